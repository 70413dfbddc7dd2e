"""Uncertain numbers: `{value: 215, sd: 20}`, or `{low: 180, high: 250}`, in place of any number.

The tree is read with the plain value; its spread is stored separately. A number that anchors repeat is one number.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from camcomp.ground.bounds import LARGEST_NUMBER
from camcomp.ground.errors import CamcompError, ConfigError, Location
from camcomp.ground.records import dataclass, replace
from camcomp.model.config.yaml_tree import Node

SECTIONS = ("robot", "workpiece", "tool", "process", "effects")
KEYS = ("value", "sd", "low", "high", "group", "source")
HALF_95 = 1.9599639845400536  # standard deviations from the middle of a 95 % interval to its ends
EXAMPLE = "write {value: 215, sd: 20} or, as a 95 % interval, {low: 180, high: 250}"

Keys = tuple[str | int, ...]


@dataclass(frozen=True, kw_only=True)
class Spread:
    """One number of a config and its standard deviation, both in the unit of its key. Drawn from a normal distribution.

    Numbers of one `group` are drawn together: all of them lie the same number of deviations from their values.
    """

    name: str  # dotted, as `config show` has it
    keys: Keys
    value: float
    sd: float
    group: str | None
    at: Location


@dataclass(frozen=True)
class UncertainInput:
    """One independent random input: a number with all its repetitions, or a group of numbers."""

    name: str
    members: tuple[Spread, ...]


def uncertain_inputs(spreads: Sequence[Spread]) -> list[UncertainInput]:
    """Independent random inputs in the order of the file; only numbers with a positive deviation."""
    found: dict[Any, list[Spread]] = {}
    for each in spreads:
        if each.sd > 0.0:
            found.setdefault(each.group if each.group is not None else each.at, []).append(each)
    return [
        UncertainInput(key if isinstance(key, str) else members[0].name, tuple(members))
        for key, members in found.items()
    ]


def without_spreads(tree: Node) -> tuple[Node, list[Spread], list[CamcompError]]:
    """The tree with plain values, its spreads, and the errors found in them."""
    found: list[Spread] = []
    errors: list[CamcompError] = []
    bare = _stripped(tree, (), found, errors)
    unique = {(each.rule, each.at): each for each in errors}  # an anchor used in three chains is one mistake
    return bare, found, list(unique.values())


def is_meant(node: Node) -> bool:
    """Whether a mapping is meant as a number with its spread."""
    keys = node.value.keys() if isinstance(node.value, dict) else set()
    return "sd" in keys or (set(KEYS) >= keys and ("value" in keys or {"low", "high"} <= keys))


def replaced(tree: Node, values: Mapping[Keys, float]) -> Node:
    """The tree with new numbers under some keys."""
    for keys, value in values.items():
        tree = _put(tree, keys, value)
    return tree


def _put(node: Node, keys: Keys, value: float) -> Node:
    if not keys:
        return replace(node, value=value)
    key, *rest = keys
    children: Any = node.value.copy()
    children[key] = _put(children[key], tuple(rest), value)
    return replace(node, value=children)


def _stripped(node: Node, keys: Keys, found: list[Spread], errors: list[CamcompError]) -> Node:
    if keys and is_meant(node):
        return _number(node, keys, found, errors)
    if isinstance(node.value, dict):
        return replace(node, value={k: _stripped(each, (*keys, k), found, errors) for k, each in node.value.items()})
    if isinstance(node.value, list):
        return replace(node, value=[_stripped(each, (*keys, k), found, errors) for k, each in enumerate(node.value)])
    return node


def _number(node: Node, keys: Keys, found: list[Spread], errors: list[CamcompError]) -> Node:
    """The plain value of an uncertain number, which is appended to `found`; an arbitrary number if it is wrong."""
    name = dotted(keys)
    wrong = list(_mistakes(node, keys, name))
    errors += wrong
    given = {key: each.value for key, each in node.value.items()}
    if wrong:
        return replace(node, value=next((given[k] for k in ("value", "low", "high") if _is_number(given.get(k))), 1.0))
    if "sd" in given:
        value, sd = given["value"], given["sd"]
    else:
        low, high = given["low"], given["high"]
        value, sd = given.get("value", 0.5 * (low + high)), (high - low) / (2.0 * HALF_95)
    at = node.value["value"].at if "value" in given else node.at
    group = given.get("group")
    found.append(
        Spread(
            name=name, keys=keys, value=float(value), sd=float(sd), group=None if group is None else str(group), at=at
        )
    )
    return Node(value, at, node.key_at)


def _mistakes(node: Node, keys: Keys, name: str) -> Iterator[CamcompError]:
    given = node.value
    if keys[0] not in SECTIONS:
        message = f"{name}: a number of this section is taken as exact"
        hint = f"numbers of {', '.join(SECTIONS)} may be uncertain; write the value alone"
        yield ConfigError("CC284", message, at=node.at, hint=hint)
        return
    for key, each in given.items():
        if key not in KEYS:
            yield ConfigError(
                "CC201", f"{name}: unknown key '{key}'", at=each.key_at, hint=f"known here: {', '.join(KEYS)}"
            )
        elif key == "group" and (not isinstance(each.value, str) or not each.value):
            yield ConfigError("CC204", f"{name}.group: has to be a name", at=each.at)
        elif key in ("value", "sd", "low", "high") and not _is_number(each.value):
            yield ConfigError("CC204", f"{name}.{key}: has to be a number", at=each.at, hint=EXAMPLE)
        elif key == "sd" and each.value < 0:
            yield ConfigError("CC205", f"{name}.sd: a standard deviation is not negative", at=each.at)
    low, high, value = (given.get(key) for key in ("low", "high", "value"))
    if "sd" in given:
        if value is None:
            yield ConfigError("CC203", f"{name}: the key 'value' is missing", at=node.at, hint=EXAMPLE)
        for each in (low, high):
            if each is not None:
                message = f"{name}: either sd or an interval from low to high"
                yield ConfigError("CC215", message, at=each.key_at, hint=EXAMPLE)
                return
    elif low is None or high is None:
        yield ConfigError("CC203", f"{name}: the key 'sd' is missing", at=node.at, hint=EXAMPLE)
    elif _is_number(low.value) and _is_number(high.value):
        middle = value.value if value is not None and _is_number(value.value) else 0.5 * (low.value + high.value)
        if not low.value < high.value or not low.value <= middle <= high.value:
            message = f"{name}: low, value and high have to stand in this order"
            yield ConfigError("CC209", message, at=node.at, hint=EXAMPLE)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= LARGEST_NUMBER


def dotted(keys: Keys) -> str:
    """Keys as a dotted name, entries of lists counted from 1."""
    return "".join(f"[{key + 1}]" if isinstance(key, int) else f".{key}" for key in keys).removeprefix(".")
