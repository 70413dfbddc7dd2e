"""Time and contour error of moves under their controller, of a whole program or piece by piece.

A controller looks some moves ahead: a stretch is planned with the moves that follow it and with some before it.
"""

from __future__ import annotations

import numpy as np

from camcomp.compensation.program.result import ErrorSum
from camcomp.ground.datatypes import Bools, Floats, Ints
from camcomp.ground.records import dataclass, fields
from camcomp.ground.source_lines import MOST_LINES, named_lines
from camcomp.ground.vectors import sizes
from camcomp.model.trajectory.moves import ControlLimits, ToolMoves
from camcomp.model.trajectory.plan import plan_of

STRETCH = 1 << 14  # moves that are planned at once
IN_SIGHT = 1 << 9  # moves behind them that may still change their speed
ROUND_OFF = 1e-9  # share of the tolerance by which an error may exceed it


@dataclass(frozen=True)
class FarOff:
    """Source lines on which the control goes further off than the tolerance, and how far: the worst ones."""

    um: tuple[tuple[float, int], ...] = ()  # error and line, falling

    def with_more(self, lines: Ints, um: Floats) -> FarOff:
        """With errors (k,) of lines (k,)."""
        worst = np.argsort(-um, kind="stable")
        found: dict[int, float] = {line: size for size, line in self.um}
        for line, size in zip(lines[worst].tolist(), um[worst].tolist(), strict=True):
            if len(found) > MOST_LINES + len(self.um) and line not in found:
                break
            found[line] = max(size, found.get(line, 0.0))
        return FarOff(tuple(sorted(((size, line) for line, size in found.items()), reverse=True)[: MOST_LINES + 1]))

    def warning(self, mode: str, what: str) -> list[str]:
        """Warning of the contour error in this path mode; empty if it is small."""
        if not self.um:
            return []
        lines = named_lines(sorted(line for _, line in self.um))
        off = f"in {mode} the controller drives up to {self.um[0][0]:.1f} um off the written path{what}"
        return [f"{off}, at {lines}; a smaller tolerance of the path mode reduces it"]


@dataclass(frozen=True, eq=False, kw_only=True)
class PointsOnMoves:
    """Points (k,) on moves of the written program, and the tip errors there before the controller."""

    move: Ints  # that leads to the point, ascending
    commanded: Floats  # (k, 3) mm
    error: Floats  # (k, 3) mm
    line: Ints  # of the source
    joined: Bools  # next to a joining line

    def take(self, rows: slice, shift: int = 0) -> PointsOnMoves:
        """Some of them, their moves counted from `shift`."""
        parts = {each.name: getattr(self, each.name)[rows] for each in fields(self)}
        return PointsOnMoves(**{**parts, "move": parts["move"] - shift})

    @classmethod
    def joint(cls, parts: list[PointsOnMoves]) -> PointsOnMoves:
        """Concatenation of several lists of points."""
        return cls(**{each.name: np.concatenate([getattr(part, each.name) for part in parts]) for each in fields(cls)})


_NO_POINTS = PointsOnMoves(
    move=np.zeros(0, np.int64), commanded=np.zeros((0, 3)), error=np.zeros((0, 3)), line=np.zeros(0, np.int64),
    joined=np.zeros(0, np.bool_),
)  # fmt: skip


class ControlAccount:
    """Time of moves in s, the errors in mm at points on them under the control, and where those are largest."""

    def __init__(self, limits: ControlLimits, tolerance_mm: float) -> None:
        self.limits, self.tolerance = limits, tolerance_mm
        self.seconds, self.errors = 0.0, ErrorSum()
        self.latest = np.zeros((0, 3))  # errors (k, 3) mm of the points that were planned last
        self.at_joins, self.elsewhere = FarOff(), FarOff()
        self._moves: list[ToolMoves] = []
        self._points: list[PointsOnMoves] = []
        self._waiting = 0
        self._planned = 0  # moves at the begin whose time is counted
        self._arrives = 0.0  # mm/s

    @classmethod
    def of(
        cls, moves: ToolMoves, limits: ControlLimits, tolerance_mm: float = np.inf, points: PointsOnMoves = _NO_POINTS
    ) -> ControlAccount:
        """The account of a whole program, planned at once; `latest` has the errors of all points."""
        out = cls(limits, tolerance_mm)
        out._moves, out._points, out._waiting = [moves], [points], len(moves)
        out.finish()
        return out

    def add(self, moves: ToolMoves, points: PointsOnMoves = _NO_POINTS) -> None:
        """Moves behind those before; points: on them."""
        if not len(moves):
            return
        self._points.append(points.take(slice(None), -self._waiting))
        self._moves.append(moves)
        self._waiting += len(moves)
        if self._waiting >= STRETCH + 2 * IN_SIGHT:
            self._plan(self._waiting - IN_SIGHT)

    def finish(self) -> None:
        """No more moves."""
        if self._waiting > self._planned:
            self._plan(self._waiting)

    def _plan(self, until: int) -> None:
        moves = self._moves[0] if len(self._moves) == 1 else ToolMoves.joined(self._moves)
        plan = plan_of(moves, self.limits, self._arrives)
        begin = int(plan.group[self._planned - 1]) + 1 if self._planned else 0
        end = int(plan.group[until - 1]) + 1 if until == len(moves) else int(plan.group[until])
        until = int(np.searchsorted(plan.group, end))
        self.seconds += float(plan.time[begin:end].sum())
        points = self._points[0] if len(self._points) == 1 else PointsOnMoves.joint(self._points)
        first, last = np.searchsorted(points.move, (self._planned, until)).tolist()
        chosen = points.take(slice(first, last))
        self._judge(chosen, chosen.error + plan.leaves_by(chosen.move, chosen.commanded))
        keep = int(np.searchsorted(plan.group, max(end - IN_SIGHT, 0)))
        if keep < len(moves):
            self._arrives = float(plan.passes[plan.group[keep]])
            self._moves = [moves.take(slice(keep, None))]
            self._points = [points.take(slice(last, None), keep)]
        self._waiting, self._planned = len(moves) - keep, until - keep

    def _judge(self, points: PointsOnMoves, error: Floats) -> None:
        self.latest = error
        self.errors.add(error)
        size = sizes(error)
        far = np.flatnonzero(np.isfinite(size) & (size > self.tolerance * (1.0 + ROUND_OFF)))
        if len(far):
            size, joined = 1e3 * size[far], points.joined[far]
            self.at_joins = self.at_joins.with_more(points.line[far[joined]], size[joined])
            self.elsewhere = self.elsewhere.with_more(points.line[far[~joined]], size[~joined])
