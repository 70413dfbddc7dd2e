"""A tree of the values of YAML files with file, line and column: merging, finding, plain values."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from camcomp.ground.errors import Location
from camcomp.ground.records import dataclass, replace

# A mapping that names another member than the earlier file has other keys too: it replaces the earlier one as a whole.
_SELECTORS = ("type", "model")


@dataclass(frozen=True)
class Node:
    """A value (scalar, list of Nodes, dict of Nodes), its location and, in a mapping, the location of its key."""

    value: Any
    at: Location
    key_at: Location | None = None


def merge(base: Node, over: Node) -> Node:
    """Merge `over` into `base` key by key: mappings merge, all other values (lists too) are replaced as a whole.

    An `sd` alone is added to the number that it belongs to.
    """
    if isinstance(over.value, dict) and "sd" in over.value and "value" not in over.value and _is_scalar(base):
        return replace(over, value={"value": base, **over.value})  # the spread of a number of another file
    if not (isinstance(base.value, dict) and isinstance(over.value, dict)):
        return over
    for key in _SELECTORS:
        if key in base.value and key in over.value and base.value[key].value != over.value[key].value:
            return over
    both = {key: merge(base.value[key], node) for key, node in over.value.items() if key in base.value}
    return replace(over, value={**base.value, **over.value, **both})


def _is_scalar(node: Node) -> bool:
    return not isinstance(node.value, list | dict)


def plain(node: Node) -> Any:
    """Plain values of a tree. A string under the key `file` or `..._file` is a path relative to its own YAML file."""
    if isinstance(node.value, list):
        return [plain(each) for each in node.value]
    if isinstance(node.value, dict):
        return {key: _resolved(key, each) for key, each in node.value.items()}
    return node.value


def _resolved(key: Any, node: Node) -> Any:
    if isinstance(node.value, str) and isinstance(key, str) and (key == "file" or key.endswith("_file")):
        return str(Path(node.at.file).parent / node.value)
    return plain(node)


def find(node: Node, keys: Sequence[str | int]) -> Node:
    """The node under `keys`; missing keys are skipped, so that the result is the nearest node above."""
    for key in keys:
        node = child(node, key) or node
    return node


def child(node: Node, key: str | int) -> Node | None:
    """The node under one key of a mapping or one index of a list."""
    if isinstance(node.value, dict):
        return node.value.get(key)
    if isinstance(node.value, list) and isinstance(key, int) and key < len(node.value):
        out: Node | None = node.value[key]
        return out
    return None


def tree_of(value: Any, at: Location) -> Node:
    """Plain values as a tree in which every node has one location."""
    if isinstance(value, dict):
        return Node({key: tree_of(each, at) for key, each in value.items()}, at)
    if isinstance(value, list):
        return Node([tree_of(each, at) for each in value], at)
    return Node(value, at)


def leaves(node: Node, name: str = "") -> Iterator[tuple[str, Node]]:
    """Every scalar, and every list of scalars, under its dotted name."""
    if isinstance(node.value, dict):
        for key, each in node.value.items():
            yield from leaves(each, f"{name}.{key}" if name else str(key))
    elif isinstance(node.value, list) and any(isinstance(each.value, dict) for each in node.value):
        for i, each in enumerate(node.value):
            yield from leaves(each, f"{name}[{i + 1}]")
    else:
        yield name, node
