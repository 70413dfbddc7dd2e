"""Every value of a configuration that is in force, as text, with the place where it is written."""

from collections.abc import Iterator
from pathlib import PurePath
from typing import Any

from camcomp.model.config.spec import Config
from camcomp.model.config.spread import Spread
from camcomp.model.config.yaml_tree import leaves, plain


def values_in_force(config: Config, *, folders: bool = False) -> Iterator[tuple[str, str, str]]:
    """(key, value, place) of all values, written ones first, then defaults; folders: file names with their folder."""
    assert config.tree is not None  # every loaded config has one
    written = dict(leaves(config.tree))
    spread: dict[str, Spread] = {each.name: each for each in config.spreads}
    for name, node in written.items():
        file = node.at.file if folders else PurePath(node.at.file).name
        value = plain(node)
        if name.endswith(".file") and not folders:
            value = PurePath(str(value)).name
        yield name, _text(value) + _spread(spread, name), f"{file}:{node.at.line}"
    defaults = config.model_dump(exclude={"robot", "effects"}, by_alias=True)
    for name, value in _flat(defaults):
        if name not in written and value is not None:
            yield name, _text(value), "default"


def _spread(known: dict[str, Spread], name: str) -> str:
    """Text of the standard deviation of a value, or of the numbers of a list."""
    own = [each for key, each in known.items() if key == name or key.rpartition("[")[0] == name]
    if not own:
        return ""
    groups = "".join(f", group {each}" for each in dict.fromkeys(each.group for each in own if each.group))
    return f" (sd {', '.join(f'{each.sd:g}' for each in own)}{groups})"


def _flat(values: dict[str, Any], name: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in values.items():
        inner = f"{name}.{key}" if name else str(key)
        if isinstance(value, dict) and value:
            yield from _flat(value, inner)
        else:
            yield inner, value


def _text(value: Any) -> str:
    return "null" if value is None else str(value).lower() if isinstance(value, bool) else str(value)
