"""Moves of a program as the controller reads them, and the controller's limits."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from camcomp.gcode.path_mode import PathMode, numbered
from camcomp.ground.datatypes import Bools, Floats, Ints, Path
from camcomp.ground.records import dataclass, fields


@dataclass(frozen=True)
class ControlLimits:
    """Limits of the planner of a controller."""

    acceleration: float  # mm/s², of every axis
    velocity: float  # mm/s, of every axis; infinite if not stated
    cycle_s: float  # least duration of a segment
    look_ahead: int  # segments


@dataclass(frozen=True, eq=False, kw_only=True)
class ToolMoves:
    """Moves (n,) of the tip as the controller reads them; program frame."""

    kind: Ints
    start: Floats  # (n, 3) mm
    end: Floats  # (n, 3) mm
    centre: Floats  # (n, 3) mm, of arcs
    axis: Floats  # (n, 3)
    angle: Floats  # (n,) rad
    feed: Floats  # (n,) mm/min, NaN for rapids
    exact: Bools  # G61, G61.1
    waits: Bools  # stop before the move: the controller waits for an event
    stop: Bools  # stop after the move, whatever its direction: G61.1, moves in machine coordinates
    tolerance: Floats  # (n,) mm
    merge: Floats  # (n,) mm
    per_turn: Bools  # feed per revolution: its speed is unknown to the controller before the spindle turns

    def __len__(self) -> int:
        return len(self.kind)

    def take(self, rows: np.ndarray | slice) -> ToolMoves:
        """Some of the moves, in the given order."""
        return ToolMoves(**{each.name: getattr(self, each.name)[rows] for each in fields(self)})

    @classmethod
    def joined(cls, parts: Sequence[ToolMoves]) -> ToolMoves:
        """Concatenation of several lists of moves."""
        return cls(**{each.name: np.concatenate([getattr(part, each.name) for part in parts]) for each in fields(cls)})

    def path(self) -> Path:
        """The moves as a path, for its geometry."""
        n = len(self)
        return Path(
            line=np.ones(n, np.int64), kind=self.kind.astype(np.int8), start=self.start, end=self.end, centre=self.centre,
            axis=self.axis, angle=self.angle, feed=self.feed, speed=np.zeros(n), turn=np.zeros(n),
            tool=np.zeros(n, np.int64), known=np.ones(n, np.bool_), machine=self.stop, waits=self.waits,
        )  # fmt: skip


def moves_of(
    path: Path, modes: Sequence[PathMode], feed: Floats | None = None, per_turn: Bools | None = None
) -> ToolMoves:
    """Moves of a path, each in its path mode; feed (n,) mm/min: default the path's; per_turn (n,): G95."""
    exact, stop, tolerance, merged = mode_columns(modes)
    return ToolMoves(
        kind=path.kind.astype(np.int64),
        start=path.start,
        end=path.end,
        centre=path.centre,
        axis=path.axis,
        angle=path.angle,
        feed=path.feed if feed is None else feed,
        exact=exact,
        waits=np.asarray(path.waits),
        stop=stop | path.machine,
        tolerance=tolerance,
        merge=merged,
        per_turn=np.zeros(len(path), np.bool_) if per_turn is None else per_turn,
    )


def mode_columns(modes: Sequence[PathMode]) -> tuple[Bools, Bools, Floats, Floats]:
    """Columns exact, stop, tolerance (mm) and merge (mm) (n,) of ToolMoves for path modes (n,)."""
    known, which = numbered(modes)
    exact = np.array([each.exact for each in known], bool)
    stop = np.array([each.code == 611 for each in known], bool)
    tolerance = np.array([each.tolerance_mm for each in known], float)
    merge = np.array([each.merge_mm for each in known], float)
    return exact[which], stop[which], tolerance[which], merge[which]
