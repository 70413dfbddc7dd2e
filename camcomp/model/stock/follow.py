"""Engagement of a whole program with its stock, and the errors of programs that crash into it or miss it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from camcomp.gcode.program import Program
from camcomp.ground.datatypes import Floats, Ints, Path
from camcomp.ground.errors import ConfigError, Location, ProgramError, raise_all
from camcomp.model.config.spec import Config
from camcomp.model.cutting.engaged import Engaged
from camcomp.model.stock.from_config import Bounds, memory_of
from camcomp.model.stock.memory import StockMemory
from camcomp.model.stock.tool_frame import tool_frame_of

MOST_ERRORS = 20


def followed(
    config: Config, tool_axis: Floats, path: Path, program: Program | None = None
) -> tuple[Engaged, StockMemory]:
    """Engagement along a path, and the stock after it.

    Raises:
        ProgramError: CC142, a rapid moves through material; at its line of the program.
        ConfigError: CC295 to CC298, the stock or a tool cannot be simulated.
    """
    frame = tool_frame_of(config, tool_axis, path)
    memory = memory_of(config, frame, Bounds().add(path))
    engaged, crashes = memory.follow(frame.turned(path))
    refuse_crashes(path, crashes, None if program is None else lambda line: program.text.place(line - 1, 0))
    refuse_untouched(config, memory)
    return engaged, memory


def refuse_crashes(path: Path, crashes: Ints, place: Callable[[int], Location] | None) -> None:
    """Raise ProgramError CC142 for rapids that move through material. place: of source lines, from 1."""
    errors = []
    for line in np.unique(path.line[crashes])[:MOST_ERRORS].tolist():
        text = f"line {line}: the rapid goes through material of the stock"
        errors.append(ProgramError("CC142", text, at=None if place is None else place(line)))
    raise_all(errors)


def refuse_untouched(config: Config, memory: StockMemory) -> None:
    """Raise ConfigError CC298 for a program that never cuts the stock."""
    if not memory.touched:
        low, high = memory.bounds
        lies = ", ".join(f"{axis} {a:.6g} to {b:.6g}" for axis, a, b in zip("XYZ", low, high, strict=True))
        message = f"the program never touches the stock ({lies} mm)"
        raise ConfigError("CC298", message, at=config.at("workpiece", "stock"))
