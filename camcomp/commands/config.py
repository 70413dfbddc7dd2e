"""camcomp config."""

from collections.abc import Iterator
from typing import Any

import click

from camcomp.commands._options import config_option
from camcomp.config import load_config
from camcomp.spec import Config
from camcomp.yamltree import leaves, plain


@click.group()
def command() -> None:
    """Show what several YAML files make together."""


@command.command()
@config_option
@click.option("--origin", is_flag=True, help="Say for every value in which file and line it stands.")
def show(configs: tuple[str, ...], origin: bool) -> None:
    """List every value that is in force, defaults included."""
    config = load_config(configs)
    rows = list(_rows(config))
    for name, value, place in rows:
        click.echo(f"{name} = {value}" + (f"  # {place}" if origin else ""))


def _rows(config: Config) -> Iterator[tuple[str, str, str]]:
    assert config._tree is not None  # every loaded config has one
    written = dict(leaves(config._tree))
    for name, node in written.items():
        yield name, _text(plain(node)), f"{node.at.file}:{node.at.line}"
    defaults = config.model_dump(exclude={"robot", "effects"}, by_alias=True)
    for name, value in _flat(defaults):
        if name not in written and value is not None:
            yield name, _text(value), "default"


def _flat(values: dict[str, Any], name: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in values.items():
        inner = f"{name}.{key}" if name else str(key)
        if isinstance(value, dict) and value:
            yield from _flat(value, inner)
        else:
            yield inner, value


def _text(value: Any) -> str:
    return "null" if value is None else str(value).lower() if isinstance(value, bool) else str(value)
