"""What a job takes from its program instead of its machine file: stock and tools."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from camcomp.model.config.cutting_tool import Cutter, Stock
from camcomp.model.config.spec import Config


@dataclass(frozen=True)
class TakenFromProgram:
    """stock: in place of the machine file's where has_stock; tools: those that the machine file does not state.

    said: what was read from comments, line by line; remarks: where that contradicts the machine file or is doubtful.
    """

    has_stock: bool = False
    stock: Stock | None = None
    tools: Mapping[int, Cutter] = field(default_factory=dict)
    said: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()

    def into(self, config: Config) -> Config:
        """A config with it."""
        if self.has_stock:
            workpiece = config.workpiece.model_copy(update={"stock": self.stock})
            config = config.model_copy(update={"workpiece": workpiece})
        return config.model_copy(update={"tools": {**config.tools, **self.tools}}) if self.tools else config
