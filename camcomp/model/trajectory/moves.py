"""Moves of a program as the controller reads them, and the controller's limits."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from camcomp.gcode.path_mode import PathMode, numbered
from camcomp.ground.datatypes import Bools, Curves, Floats, Path
from camcomp.ground.records import dataclass, fields


@dataclass(frozen=True)
class ControlLimits:
    """Limits of the planner of a controller."""

    acceleration: float  # mm/s², of every axis
    velocity: float  # mm/s, of every axis; infinite if not stated
    cycle_s: float  # least duration of a segment
    look_ahead: int  # segments


@dataclass(frozen=True, eq=False, kw_only=True)
class ToolMoves(Curves):
    """Moves (n,) of the tip as the controller reads them; program frame."""

    feed: Floats  # (n,) mm/min, NaN for rapids
    exact: Bools  # G61, G61.1
    waits: Bools  # stop before the move: the controller waits for an event
    stop: Bools  # stop after the move, whatever its direction: G61.1, moves in machine coordinates
    tolerance: Floats  # (n,) mm
    merge: Floats  # (n,) mm
    per_turn: Bools  # feed per revolution: its speed is unknown to the controller before the spindle turns

    def __len__(self) -> int:
        return len(self.kind)


def moves_of(
    path: Path, modes: Sequence[PathMode], feed: Floats | None = None, per_turn: Bools | None = None
) -> ToolMoves:
    """Moves of a path, each in its path mode; feed (n,) mm/min: default the path's; per_turn (n,): G95."""
    known, which = numbered(modes)
    return ToolMoves(
        **{each.name: getattr(path, each.name) for each in fields(Curves)},
        feed=path.feed if feed is None else feed,
        exact=np.array([each.exact for each in known], bool)[which],
        waits=np.asarray(path.waits),
        stop=np.array([each.code == 611 for each in known], bool)[which] | path.machine,
        tolerance=np.array([each.tolerance_mm for each in known], float)[which],
        merge=np.array([each.merge_mm for each in known], float)[which],
        per_turn=np.zeros(len(path), np.bool_) if per_turn is None else per_turn,
    )
