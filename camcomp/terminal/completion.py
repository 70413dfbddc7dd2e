"""Completion in shells with <TAB>: files, folders, and names of rules, machines, effects, dialects and actuators.

The protocols of bash, zsh and fish are click's; here every parameter gets its kind by its name and metavar.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable

import click
from click.shell_completion import CompletionItem

_FOLDER = re.compile(r"DIR$")
_FILE = re.compile(
    r"FILE|PATH|\.(csv|json|html|yaml|nc|stl|sarif|xml)$|^(PROGRAM|ORIGINAL|CORRECTED|EXPERIMENT)$", re.IGNORECASE
)


def complete_values(command: click.Command) -> click.Command:
    """The command with completion of the values of its parameters, and its subcommands; click completes choices itself."""
    for below in command.commands.values() if isinstance(command, click.Group) else ():
        complete_values(below)
    for each in command.params:
        offer = _offer_of(each)
        if offer is not None:
            setattr(each, "shell_complete", offer)  # noqa: B010 - a method of this one parameter
    return command


def _offer_of(parameter: click.Parameter) -> Callable[[click.Context, str], list[CompletionItem]] | None:
    metavar = (getattr(parameter, "metavar", None) or parameter.name or "").upper()
    names = {
        "without": _effects,
        "rule": _rules,
        "machine": _machines,
        "dialect": _dialects,
        "actuator": _actuators,
    }.get(parameter.name or "")
    if names is not None and not isinstance(parameter.type, click.Choice):
        return lambda context, begun: [
            CompletionItem(each) for each in sorted(names(context)) if each.lower().startswith(begun.lower())
        ]
    kind = "dir" if _FOLDER.search(metavar) else "file" if _FILE.search(metavar) else None
    if kind is None:
        return None
    return lambda _context, begun: [CompletionItem(begun, type=kind)]


def _effects(_context: click.Context) -> Iterable[str]:
    from camcomp.ground.shelf import members

    return members("effects")


def _dialects(_context: click.Context) -> Iterable[str]:
    from camcomp.ground.shelf import members

    return members("dialects")


def _machines(_context: click.Context) -> Iterable[str]:
    from camcomp.api.project import machines

    return (each.name for each in machines())


def _rules(_context: click.Context) -> Iterable[str]:
    from camcomp.ground.rules import RULES

    return RULES


def _actuators(context: click.Context) -> Iterable[str]:
    """Those of the machine files that stand before it in the line; none if these cannot be read."""
    from camcomp.api.machine import load_machine
    from camcomp.ground.errors import CamcompError

    try:
        return load_machine(*context.params.get("configs") or ()).config.robot.actuators
    except CamcompError:
        return ()
