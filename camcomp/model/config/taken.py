"""Stock and tools that a job takes from its program instead of its machine file."""

from __future__ import annotations

from collections.abc import Mapping

from camcomp.ground.records import dataclass, field
from camcomp.model.config.cutting_tool import Cutter, Stock
from camcomp.model.config.spec import Config


@dataclass(frozen=True)
class TakenFromProgram:
    """Stock and tools from the comments of a program.

    stock: replaces the machine file's if has_stock; tools: those that the machine file does not state. said: the values read,
    line by line; remarks: contradictions with the machine file, and doubts.
    """

    has_stock: bool = False
    stock: Stock | None = None
    tools: Mapping[int, Cutter] = field(default_factory=dict)
    said: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()

    def into(self, config: Config) -> Config:
        """The config with this stock and these tools."""
        if self.has_stock:
            workpiece = config.workpiece.model_copy(update={"stock": self.stock})
            config = config.model_copy(update={"workpiece": workpiece})
        return config.model_copy(update={"tools": {**config.tools, **self.tools}}) if self.tools else config
