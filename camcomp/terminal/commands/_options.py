"""Options that several verbs share."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import click

from camcomp.ground.places import one_place_each

if TYPE_CHECKING:
    _Text = click.ParamType[str]
else:
    _Text = click.ParamType  # no generic class in click 8.1


class OutputFile(_Text):
    """Name of an output, or "-": none twice in one command, which is said before the work begins."""

    name = "file"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """The name. Raises FileError CC502 when another option of the command names the same file."""
        if not value:
            self.fail("the name of an output is empty", param, ctx)
        if param is not None and ctx is not None:
            named = ctx.meta.setdefault("camcomp.outputs", {})
            named[param.name] = str(value)
            one_place_each(list(named.values()))
        return str(value)


OUTPUT = OutputFile()
config_option = click.option(
    "--config",
    "configs",
    metavar="FILE",
    multiple=True,
    required=True,
    help="Machine file (YAML); may be given several times, later files override earlier ones key by key.",
)


def _state_dialect(context: click.Context, _parameter: click.Parameter, name: str | None) -> None:
    if name is not None:
        from camcomp.model.config.stated import stated_dialect

        context.with_resource(stated_dialect(name))


dialect_option = click.option(
    "--dialect",
    metavar="NAME",
    callback=_state_dialect,
    expose_value=False,
    help="Language of the programs, over control: dialect: of the machine file; default: found from the text.",
)
quiet_option = click.option("-q", "--quiet", is_flag=True, help="Say nothing but errors.")
stock_option = click.option(
    "--stock",
    type=click.Choice(["none", "program", "comments"]),
    help="Where the stock comes from: none, a block about the program, or the program's comments; default: the machine "
    "file, or else the comments where they state one.",
)
_FORMATS = {
    "json": ("OUT.json", "What was found, as JSON."),
    "sarif": ("OUT.sarif", "What was found, as SARIF 2.1.0 for code hosts."),
    "junit": ("OUT.xml", "What was found, as JUnit XML for CI servers."),
}


def findings_options(*names: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Options for machine-readable findings: json, sarif, junit, each with a file or - for standard output."""

    def add(function: Callable[..., Any]) -> Callable[..., Any]:
        for name in reversed(names):
            metavar, text = _FORMATS[name]
            function = click.option(f"--{name}", f"{name}_file", metavar=metavar, type=OUTPUT, help=text)(function)
        return function

    return add
