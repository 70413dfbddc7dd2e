"""Causes into a machine file: the YAML text gains entries under `effects:`; its comments and layout stay."""

import io
import os
from collections.abc import Mapping, Sequence
from math import inf
from typing import Any, Protocol

from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq

from camcomp.model.config.spread import HALF_95


class EstimatedValue(Protocol):
    """What is known of a parameter."""

    @property
    def value(self) -> float:
        """As estimated."""

    @property
    def ci95(self) -> tuple[float, float]:
        """Its 95 % interval."""


class NamedEffect(Protocol):
    """A cause that a diagnosis has found."""

    @property
    def effect(self) -> str:
        """Its name on the shelf."""

    @property
    def target(self) -> str | None:
        """Where it is at work."""

    @property
    def parameters(self) -> Mapping[str, EstimatedValue]:
        """By name."""

    @property
    def settings(self) -> Mapping[str, Any]:
        """What it has in YAML beside its parameters: numbers, and lists of them."""


def machine_file(texts: Sequence[str]) -> int:
    """Which of the config files, in the order in which they count, has to gain the causes: a later list of effects replaces
    an earlier one, so it is the last that has one; where none has, the last that describes a robot.
    """
    trees = [YAML(typ="safe").load(text) or {} for text in texts]
    for key in ("effects", "robot"):
        having = [k for k, tree in enumerate(trees) if tree.get(key)]
        if having:
            return having[-1]
    return len(texts) - 1


def with_causes(
    text: str,
    causes: Sequence[NamedEffect],
    *,
    folder: str = "",
    moved_to: str = "",
    note: str = "",
    laws: Sequence[Mapping[str, Any]] = (),
) -> str:
    """The text of a machine file with the `causes` of a diagnosis appended to its effects.

    Values are those found, intervals are written as their standard deviations, and go into a comment behind them. folder, moved_to: where
    the file stands and where the new one will; relative paths in it are changed to match. note: comment above the causes.
    laws: more entries, key by key.
    """
    yaml = YAML()
    yaml.preserve_quotes = True
    yaml.width = 4096
    yaml.indent(mapping=2, sequence=4, offset=2)
    tree = yaml.load(text)
    _move(tree, folder, moved_to)
    effects = tree.get("effects")
    if effects is None and (causes or laws):
        effects = tree["effects"] = CommentedSeq()
    first = len(effects or ())
    for cause in causes:
        entry = CommentedMap()
        entry["effect"] = cause.effect
        if cause.target is not None:
            entry["target"] = cause.target
        for name, found in cause.parameters.items():
            low, high = found.ci95
            sd = (high - low) / (2.0 * HALF_95)
            entry[name] = _spread(found.value, sd) if 0.0 < sd < inf else found.value
            entry.yaml_add_eol_comment(f"95 %: {low:g} to {high:g}", name)
        for name, value in cause.settings.items():
            entry[name] = _in_a_row(value)
        effects.append(entry)
    for law in laws:
        effects.append(_entry(law))
    if note and (causes or laws):
        effects.yaml_set_comment_before_after_key(first, before=note, indent=2)
    out = io.StringIO()
    yaml.dump(tree, out)
    return out.getvalue()


def _entry(law: Mapping[str, Any]) -> CommentedMap:
    """A law as an entry of `effects:`; lists of numbers stand on one line."""
    entry = CommentedMap()
    for key, value in law.items():
        whole = isinstance(value, Mapping)
        entry[key] = CommentedMap({n: _in_a_row(pair) for n, pair in value.items()}) if whole else _in_a_row(value)
    return entry


def _in_a_row(value: Any) -> Any:
    """Lists on one line."""
    if not isinstance(value, (list, tuple)):
        return value
    out = CommentedSeq(_in_a_row(each) for each in value)
    out.fa.set_flow_style()
    return out


def _spread(value: float, sd: float) -> CommentedMap:
    out = CommentedMap([("value", value), ("sd", float(f"{sd:.3g}"))])
    out.fa.set_flow_style()
    return out


def _move(node: Any, folder: str, moved_to: str) -> None:
    """Relative file names below a node, as seen from another folder."""
    if isinstance(node, dict):
        for key, value in node.items():
            if key == "file" and isinstance(value, str) and not os.path.isabs(value):
                node[key] = (
                    os.path.relpath(os.path.join(folder, value), moved_to or ".") if folder != moved_to else value
                )
            else:
                _move(value, folder, moved_to)
    elif isinstance(node, list):
        for each in node:
            _move(each, folder, moved_to)
