"""Readers of tool tables: what a user's own has to be, checked when it is loaded."""

from collections.abc import Iterator
from types import ModuleType
from typing import Any, Protocol

from camcomp.model.config.tool_table import TabledTool, ToolFile
from camcomp.plugins.contract import check_functions, check_module, check_names, refusal


class ToolTablePlugin(Protocol):
    """One kind of tool table. SUFFIXES: small letters with the dot; STATES_UNIT: the file says in which unit it is."""

    TITLE: str
    SUFFIXES: tuple[str, ...]
    STATES_UNIT: bool

    def read(self, file: ToolFile) -> Iterator[TabledTool]:
        """The tools of a file; raises `camcomp.model.config.tool_table.refused(...)` where it cannot be used."""


def checked(name: str, found: Any, who: str) -> ModuleType:
    """The reader behind an entry point. Raises ConfigError CC280."""
    del name
    module = check_module(who, found)
    check_names(who, module, {"TITLE": str, "SUFFIXES": tuple, "STATES_UNIT": bool})
    check_functions(who, module, ToolTablePlugin)
    if not module.SUFFIXES or not all(isinstance(each, str) and each[:1] == "." for each in module.SUFFIXES):
        raise refusal(who, "SUFFIXES is no tuple of suffixes with their dots")
    return module
