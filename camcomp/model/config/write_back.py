"""Write causes into a machine file: add entries under `effects:`, keep comments and layout of the YAML text."""

import io
import os
from collections.abc import Mapping, Sequence
from math import inf
from typing import Any, Protocol

from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq

from camcomp.ground import shelf
from camcomp.model.config.effect_entries import certain, key_of_effect, key_of_entry, merged_entries
from camcomp.model.config.spread import HALF_95


class EstimatedValue(Protocol):
    """Estimate of a parameter."""

    @property
    def value(self) -> float:
        """Estimated value."""

    @property
    def ci95(self) -> tuple[float, float]:
        """95 % interval."""


class NamedEffect(Protocol):
    """A cause that a diagnosis has found."""

    @property
    def effect(self) -> str:
        """Name of the effect on the shelf."""

    @property
    def target(self) -> str | None:
        """Target of the effect."""

    @property
    def parameters(self) -> Mapping[str, EstimatedValue]:
        """Estimates by name of the parameter."""

    @property
    def settings(self) -> Mapping[str, Any]:
        """Further YAML keys of the effect: numbers, and lists of them."""


def machine_file(texts: Sequence[str]) -> int:
    """Index of the config file, in order of precedence, to which causes are added.

    It is the last file with a list of effects, because its entries replace those of earlier files; else the last that
    describes a robot.
    """
    trees = [YAML(typ="safe").load(text) or {} for text in texts]
    for key in ("effects", "robot"):
        having = [k for k, tree in enumerate(trees) if tree.get(key)]
        if having:
            return having[-1]
    return len(texts) - 1


def carried(text: str, earlier: Sequence[str], causes: Sequence[NamedEffect]) -> str:
    """Text of a machine file with those entries of earlier files that `causes` change: an entry here replaces them."""
    found = {cause.effect for cause in causes}
    yaml = _round_trip()
    tree, below = yaml.load(text), list[Any]()
    for each in earlier:
        below = merged_entries(below, (YAML(typ="safe").load(each) or {}).get("effects") or [])
    own = list((tree or {}).get("effects") or [])
    mine = {key_of_entry(each) for each in own}
    more = [each for each in below if each["effect"] in found and key_of_entry(each) not in mine]
    if not more:
        return text
    tree["effects"] = tree.get("effects") or CommentedSeq()
    for each in more:
        tree["effects"].append(_entry(each))
    out = io.StringIO()
    yaml.dump(tree, out)
    return out.getvalue()


def _round_trip() -> YAML:
    yaml = YAML()
    yaml.preserve_quotes = True
    yaml.width = 4096
    yaml.indent(mapping=2, sequence=4, offset=2)
    return yaml


def with_causes(
    text: str,
    causes: Sequence[NamedEffect],
    *,
    folder: str = "",
    moved_to: str = "",
    note: str = "",
    laws: Sequence[Mapping[str, Any]] = (),
    actuators: Sequence[str] = (),
) -> str:
    """Text of a machine file with the `causes` of a diagnosis in its effects; existing entries are changed.

    Estimates are written as {value, sd}, with their 95 % intervals in a comment behind them.

    Args:
        text: of the machine file.
        causes: of the diagnosis.
        folder: of the file.
        moved_to: folder of the new file; relative paths in it are changed to match.
        note: comment above the causes.
        laws: more entries, key by key.
        actuators: names; an entry for all actuators is divided into one per actuator if a cause needs it.
    """
    yaml = _round_trip()
    tree = yaml.load(text)
    _move(tree, folder, moved_to)
    effects = tree.get("effects")
    if effects is None and (causes or laws):
        effects = tree["effects"] = CommentedSeq()
    new = [each for cause in causes for each in _new_ones(effects, cause, actuators)]
    first = len(effects or ())
    for cause, target in new:
        entry = CommentedMap()
        entry["effect"] = cause.effect
        if target is not None:
            entry["target"] = target
        records = _records(cause.effect)
        for name, found in cause.parameters.items():
            low, high = found.ci95
            entry[name] = _number(records.get(name), found.value, found.ci95)
            entry.yaml_add_eol_comment(f"95 %: {low:g} to {high:g}", name)
        for name, value in cause.settings.items():
            entry[name] = _in_a_row(value)
        effects.append(entry)
    for law in laws:
        effects.append(_entry(law))
    if note and (new or laws):
        effects.yaml_set_comment_before_after_key(first, before=note, indent=2)
    out = io.StringIO()
    yaml.dump(tree, out)
    return out.getvalue()


def _new_ones(
    effects: CommentedSeq, cause: NamedEffect, actuators: Sequence[str]
) -> list[tuple[NamedEffect, str | None]]:
    """The cause with its targets that have no entry yet; existing entries are changed in place."""
    values = {**{name: each.value for name, each in cause.parameters.items()}, **cause.settings}
    wanted = key_of_effect(cause.effect, cause.target, values)
    plain = [{key: certain(value) for key, value in each.items()} for each in effects]
    keys = [key_of_effect(str(each.get("effect")), each.get("target"), each) for each in plain]
    if cause.target is not None and (wanted[0], None, *wanted[2:]) in keys and actuators:
        _part(effects, keys.index((wanted[0], None, *wanted[2:])), actuators)
        return _new_ones(effects, cause, actuators)
    targets = [cause.target]
    if cause.target is None and any(key[0] == wanted[0] and key[2:] == wanted[2:] and key[1] for key in keys):
        targets = [*actuators] or targets
    out: list[tuple[NamedEffect, str | None]] = []
    for target in targets:
        key = (wanted[0], target, *wanted[2:])
        if key in keys:
            _change(effects[keys.index(key)], cause)
        else:
            out.append((cause, target))
    return out


def _part(effects: CommentedSeq, at: int, actuators: Sequence[str]) -> None:
    """Replace an entry for all actuators by one per actuator."""
    whole = effects.pop(at)
    for name in reversed(actuators):
        entry = CommentedMap([("effect", whole["effect"]), ("target", name)])
        entry.update({key: value for key, value in whole.items() if key not in ("effect", "target")})
        effects.insert(at, entry)


def _change(entry: CommentedMap, cause: NamedEffect) -> None:
    """Add an estimate to an entry."""
    records = _records(cause.effect)
    for name, found in cause.parameters.items():
        low, high = found.ci95
        record = records.get(name)
        before = certain(entry.get(name))
        value = found.value
        if record is not None and not record.shape and isinstance(before, int | float):
            value = float(f"{record.on_top(float(before), found.value):.6g}")
        entry[name] = _number(record, value, found.ci95)
        entry.yaml_add_eol_comment(f"found on top: {found.value:g}, 95 %: {low:g} to {high:g}", name)


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


def _records(effect: str) -> dict[str, Any]:
    """Parameters of an effect by name."""
    return {each.name: each for each in getattr(shelf.load("effects", effect), "PARAMETERS", ())}


def _number(record: Any, value: float, ci95: tuple[float, float]) -> float | CommentedMap:
    """A value within the bounds of its parameter, with the deviation where one deviation off is allowed on either side."""
    low, high = (-inf, inf) if record is None else (record.low, record.high)
    value = min(max(value, low), high)
    sd = (ci95[1] - ci95[0]) / (2.0 * HALF_95)
    if not 0.0 < sd < inf or (value - sd < low and value + sd > high):
        return value
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
