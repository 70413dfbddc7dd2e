"""Time and contour error of a long program under its controller, piece by piece.

A controller looks some moves ahead: a stretch is planned with the moves that follow it and with some before it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from camcomp.compensation.program.result import ErrorSum
from camcomp.compensation.program.under_control import FarOff
from camcomp.ground.datatypes import Bools, Floats, Ints
from camcomp.model.trajectory.moves import ControlLimits, ToolMoves
from camcomp.model.trajectory.plan import plan_of

STRETCH = 1 << 14  # moves that are planned at once
IN_SIGHT = 1 << 9  # moves behind them that may still change their speed


@dataclass(frozen=True, eq=False)
class SeenPoints:
    """Points (k,) on moves of the written program, and the tip errors there before the controller."""

    move: Ints
    told: Floats  # (k, 3) mm as commanded
    error: Floats  # (k, 3) mm
    line: Ints
    joined: Bools  # beside a joining line

    def take(self, rows: np.ndarray, shift: int = 0) -> SeenPoints:
        """Some of them, their moves counted from `shift`."""
        return SeenPoints(
            self.move[rows] - shift, self.told[rows], self.error[rows], self.line[rows], self.joined[rows]
        )


NO_POINTS = SeenPoints(
    np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0, np.int64), np.zeros(0, np.bool_)
)


class ControlAccount:
    """Time of moves in s, the errors in mm at points on them under the control, and where those are largest."""

    def __init__(self, limits: ControlLimits, tolerance_mm: float) -> None:
        self.limits, self.tolerance = limits, tolerance_mm
        self.seconds, self.errors = 0.0, ErrorSum()
        self.beside, self.elsewhere = FarOff(), FarOff()
        self._moves: list[ToolMoves] = []
        self._points: list[SeenPoints] = []
        self._waiting = 0
        self._planned = 0  # moves at the begin whose time is counted
        self._arrives = 0.0  # mm/s

    def add(self, moves: ToolMoves, points: SeenPoints = NO_POINTS) -> None:
        """Moves behind those before; points: on them."""
        if not len(moves):
            return
        self._points.append(points.take(np.arange(len(points.move)), -self._waiting))
        self._moves.append(moves)
        self._waiting += len(moves)
        if self._waiting >= STRETCH + 2 * IN_SIGHT:
            self._plan(self._waiting - IN_SIGHT)

    def finish(self) -> None:
        """No more moves."""
        if self._waiting:
            self._plan(self._waiting)

    def _plan(self, until: int) -> None:
        moves = self._moves[0] if len(self._moves) == 1 else ToolMoves.joined(self._moves)
        plan = plan_of(moves, self.limits, self._arrives)
        begin = int(plan.group[self._planned - 1]) + 1 if self._planned else 0
        end = int(plan.group[until - 1]) + 1 if until == len(moves) else int(plan.group[until])
        until = int(np.searchsorted(plan.group, end))
        self.seconds += float(plan.time[begin:end].sum())
        points = self._points[0] if len(self._points) == 1 else _joined(self._points)
        now = (points.move >= self._planned) & (points.move < until)
        chosen = points.take(np.flatnonzero(now))
        self._tell(chosen, chosen.error + plan.leaves_by(chosen.move, chosen.told))
        keep = int(np.searchsorted(plan.group, max(end - IN_SIGHT, 0)))
        if keep < len(moves):
            self._arrives = float(plan.passes[plan.group[keep]])
            self._moves, self._points = [moves.take(slice(keep, None))], [points.take(points.move >= until, keep)]
        self._waiting, self._planned = len(moves) - keep, until - keep

    def _tell(self, points: SeenPoints, error: Floats) -> None:
        self.errors.add(error)
        size = np.linalg.norm(error, axis=1)
        far = np.flatnonzero(np.isfinite(size) & (size > self.tolerance * (1.0 + 1e-9)))
        if len(far):
            size, joined = 1e3 * size[far], points.joined[far]
            self.beside = self.beside.with_more(points.line[far[joined]], size[joined])
            self.elsewhere = self.elsewhere.with_more(points.line[far[~joined]], size[~joined])


def _joined(parts: list[SeenPoints]) -> SeenPoints:
    return SeenPoints(
        np.concatenate([each.move for each in parts]),
        np.concatenate([each.told for each in parts]),
        np.concatenate([each.error for each in parts]),
        np.concatenate([each.line for each in parts]),
        np.concatenate([each.joined for each in parts]),
    )
