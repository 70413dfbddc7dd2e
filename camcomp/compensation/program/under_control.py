"""Execution time and contour error of a program under its controller, before and after compensation.

The controller merges lines, rounds corners and stops at ends (model/trajectory). Its contour error is reported
separately from the tip error of the written program.

A controller looks some moves ahead: a stretch is planned with the moves that follow it and with some before it.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from camcomp.compensation.program.result import CycleTime, ErrorSum
from camcomp.gcode.dialect import Dialect
from camcomp.gcode.output import Part
from camcomp.gcode.path_mode import PathMode, numbered
from camcomp.gcode.program import Program
from camcomp.ground.datatypes import RAPID, Bools, Floats, Ints
from camcomp.ground.records import Rows, dataclass, replace
from camcomp.ground.source_lines import MOST_LINES, named_lines
from camcomp.ground.vectors import chosen, largest, sizes
from camcomp.model.control import limits_of, waiting_s
from camcomp.model.job import Job
from camcomp.model.trajectory.moves import ControlLimits, ToolMoves, moves_of
from camcomp.model.trajectory.plan import plan_of

if TYPE_CHECKING:
    from camcomp.compensation.program.corrected_rows import CorrectedRows
    from camcomp.compensation.program.judged_points import Division
    from camcomp.compensation.program.programmed import Programmed

STRETCH = 1 << 14  # moves that are planned at once
IN_SIGHT = 1 << 9  # moves behind them that may still change their speed
ROUND_OFF = 1e-9  # share of the tolerance by which an error may exceed it
LOST_TIME = 1.02  # factor of the cycle time from which a faster way is looked for


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
class PointsOnMoves(Rows):
    """Points (k,) on moves of the written program, and the tip errors there before the controller."""

    move: Ints  # that leads to the point, ascending
    commanded: Floats  # (k, 3) mm
    error: Floats  # (k, 3) mm
    line: Ints  # of the source
    at_join: Bools  # next to a joining line

    def behind(self, moves: int) -> PointsOnMoves:
        """The points, their moves counted from so many before them."""
        return replace(self, move=self.move + moves)


_NO_POINTS = PointsOnMoves(
    move=np.zeros(0, np.int64), commanded=np.zeros((0, 3)), error=np.zeros((0, 3)), line=np.zeros(0, np.int64),
    at_join=np.zeros(0, np.bool_),
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
        self._points.append(points.behind(self._waiting))
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
        points = self._points[0] if len(self._points) == 1 else PointsOnMoves.joined(self._points)
        first, last = np.searchsorted(points.move, (self._planned, until)).tolist()
        chosen = points.take(slice(first, last))
        self._judge(chosen, chosen.error + plan.leaves_by(chosen.move, chosen.commanded))
        keep = int(np.searchsorted(plan.group, max(end - IN_SIGHT, 0)))
        if keep < len(moves):
            self._arrives = float(plan.passes[plan.group[keep]])
            self._moves = [moves.take(slice(keep, None))]
            self._points = [points.take(slice(last, None)).behind(-keep)]
        self._waiting, self._planned = len(moves) - keep, until - keep

    def _judge(self, points: PointsOnMoves, error: Floats) -> None:
        self.latest = error
        if 1e-3 * self.errors.add(error) <= self.tolerance:
            return
        size = sizes(error)
        far = np.flatnonzero(np.isfinite(size) & (size > self.tolerance * (1.0 + ROUND_OFF)))
        if len(far):
            size, joined = 1e3 * size[far], points.at_join[far]
            self.at_joins = self.at_joins.with_more(points.line[far[joined]], size[joined])
            self.elsewhere = self.elsewhere.with_more(points.line[far[~joined]], size[~joined])


def control_warnings(
    modes: tuple[PathMode, ...], at_joins: FarOff, elsewhere: FarOff, *, exact_stop: str, resting: int,
    apart: Iterable[PathMode],
) -> list[str]:  # fmt: skip
    """Warnings about the controller.

    Exact stops that were written because of joining lines (resting: how many), contour errors next to joining lines and
    elsewhere where all path modes were stated, and codes that keep lines from being merged in the modes `apart`.
    """
    out = []
    if resting:
        where = f"at {resting} end{'s' if resting > 1 else ''} of cuts and joining lines"
        out.append(f"{exact_stop} is written {where}: the controller stops there instead of rounding; nothing to do")
    if all(each.stated for each in modes):
        mode = mode_name(modes)
        out += at_joins.warning(mode, " next to joining lines") + elsewhere.warning(mode, "")
    if said := ", ".join(mode.apart.name for mode in apart):
        out.append(f"{said} is written around the cuts: the controller does not merge lines there; nothing to do")
    return out


class UnderControl:
    """Execution times and contour errors of a program under its controller, planned when they are asked for."""

    def __init__(
        self, asked: Programmed, found: Division, *, rest: Bools, tolerance_um: float, apart: Bools | None = None
    ) -> None:
        """A corrected program. rest, apart (N,): forced stops of joining lines, lines that are kept from being made one.

        tolerance_um: beyond which the controller is warned of.
        """
        program, job, rows, written, points = asked.program, asked.job, found.rows, found.written, found.points
        self.programmed, self.limits = programmed_moves(program, job), limits_of(job.config)
        self.rest, self.apart, self.tolerance_mm = rest, apart is not None, 1e-3 * tolerance_um
        self.modes = modes_of(program)  # of the cuts, in the order in which they come
        own, motion = self.programmed, rows.motion
        merge = own.merge.take(motion)
        self.written = ToolMoves(
            **vars(rows.curves(program.path, written.end, written.centre)), feed=job.conditions.feeds(written.feed),
            exact=own.exact.take(motion) | rest, waits=_waits(program, rows), stop=own.stop.take(motion),
            tolerance=own.tolerance.take(motion), merge=merge if apart is None else np.where(apart, 0.0, merge),
            per_turn=own.per_turn.take(motion),
        )  # fmt: skip
        judged = points.judged
        row = chosen(points.row, judged)
        joining = np.concatenate((rows.joining, [False]))
        self.points = PointsOnMoves(
            move=row, commanded=chosen(found.commanded, judged), error=chosen(found.missed, judged),
            line=program.path.line[rows.motion[row]], at_join=joining[row - 1] | joining[row + 1],
        )  # fmt: skip

    @cached_property
    def account(self) -> ControlAccount:
        """The account of the written moves."""
        return ControlAccount.of(self.written, self.limits, self.tolerance_mm, self.points)

    @cached_property
    def original(self) -> ControlAccount:
        """The account of the programmed moves."""
        return ControlAccount.of(self.programmed, self.limits)

    @property
    def after_s(self) -> float:
        """Execution time of the written program."""
        return self.account.seconds

    @property
    def stated(self) -> bool:
        """Whether the program or the machine file says the mode."""
        return all(each.stated for each in self.modes)

    def better_than(self, other: UnderControl, tolerance_um: float) -> bool:
        """Whether it is nearer to the path apart from joining lines without losing time, or faster and as near."""
        mine, theirs = (max(1e3 * each.off_joins, tolerance_um) for each in (self, other))
        if mine < 0.9 * theirs:
            return self.after_s < LOST_TIME * other.after_s
        return mine <= 1.05 * theirs and LOST_TIME * self.after_s < other.after_s

    def nearer_than(self, other: UnderControl) -> bool:
        """Whether its errors are smaller on the whole without losing time."""
        mine, theirs = (each.account.errors.figures().rms_um for each in (self, other))
        return mine < theirs and self.after_s < LOST_TIME * other.after_s

    @property
    def off_joins(self) -> float:
        """Largest error apart from joining lines, mm."""
        size = sizes(self.account.latest[~self.points.at_join])
        return float(np.nanmax(size, initial=0.0))

    def leaves_room(self, tolerance_um: float) -> bool:
        """Whether another way to write the program might be faster or nearer to the path."""
        return self.stated and (
            self.after_s > LOST_TIME * self.original.seconds or 1e3 * self.off_joins > tolerance_um * (1.0 + ROUND_OFF)
        )


def rounds(mode: PathMode, tolerance_um: float) -> bool:
    """Whether a mode that was stated rounds corners by more than the tolerance."""
    return mode.stated and not mode.exact and not 0.0 < 1e3 * mode.tolerance_mm <= tolerance_um


def rests(program: Program, rows: CorrectedRows, tolerance_um: float, part: Part | None = None) -> Bools:
    """End points (N,) at which an exact stop keeps the corner of a cut and a joining line sharp.

    Lines that set the path mode themselves are unchanged, and so is the last end point of a part: what follows it is not
    known to begin in the mode of the program.
    """
    modes, which = numbered(program.modes)
    free = np.array([rounds(mode, tolerance_um) for mode in modes], bool)[which]
    change = np.flatnonzero(np.diff(which))
    free[1 + change] &= np.array([modes[which[k]] == modes[which[k + 1]] for k in change], bool)
    cut = (rows.kind != RAPID) & ~rows.joining & rows.corrected
    between = cut[:-1] & rows.joining[1:] | rows.joining[:-1] & cut[1:]
    out: Bools = np.append(between, np.zeros(min(len(cut), 1), np.bool_)) & free[rows.motion]
    if part is not None:
        out &= (rows.motion >= part.first) & (np.append(rows.motion[1:], part.last) < part.last)
    return out


def merging(mode: PathMode, language: Dialect) -> bool:
    """Whether a stated path mode merges lines, and the dialect can switch that off."""
    return mode.stated and not mode.exact and mode.merge_mm > 0.0 and language.merges


def stays_apart(program: Program, rows: CorrectedRows, part: Part | None) -> Bools:
    """Moves (N,) that can be kept from being made one: from the first cut that is moved on, in a part all.

    Behind every line that sets the mode itself they begin anew with the motion after it.
    """
    before = program.setup.path_mode if part is None or part.first == 0 else program.modes[0]
    modes, which = numbered((before, *program.modes))
    begins = np.diff(which) != 0
    able = np.array([merging(mode, program.language) for mode in modes], bool)[which[1:]] & ~begins
    if part is not None:
        return np.asarray(able[rows.motion])
    cut = np.zeros(len(begins), np.bool_)
    cut[rows.motion[(rows.kind != RAPID) & (largest(rows.end - rows.target) > 0.0)]] = True
    section = np.cumsum(begins)
    first = np.full(int(section.max(initial=0)) + 1, len(begins))
    at = np.flatnonzero(cut & able)
    np.minimum.at(first, section[at], at)
    out: Bools = (able & (np.arange(len(begins)) >= first[section]))[rows.motion]
    return out


def modes_of(program: Program) -> tuple[PathMode, ...]:
    """The modes of the cuts of a program, in the order in which they come."""
    known, which = numbered(program.modes)
    of = which[(program.path.kind != RAPID) & ~program.path.machine]
    return tuple(dict.fromkeys(known[k] for k in of[np.diff(of, prepend=-1) != 0]))


def programmed_moves(program: Program, job: Job) -> ToolMoves:
    """The moves of a program, with the feed of the machine file where none is in force."""
    return moves_of(program.path, program.modes, job.conditions.feeds(program.path.feed), program.per_turn)


def _waits(program: Program, rows: CorrectedRows) -> Bools:
    """Moves (N,) before which the controller waits: joining lines stand in front of the line of their motion or behind it."""
    motion, sites = rows.motion, program.sites
    first, last = np.diff(motion, prepend=-1) > 0, np.diff(motion, append=len(sites.row)) > 0
    own = np.flatnonzero(~rows.joining)
    at_line = np.zeros(len(motion), np.bool_)
    at_line[own[np.diff(motion[own], prepend=-1) > 0]] = True
    at_line = np.where(sites.stops[motion], last, np.where(sites.modes_changed[motion], first, at_line))
    out: Bools = sites.waits_ahead[motion] & first | sites.waits_in_line[motion] & at_line
    return out


def of_text(
    original: Program, corrected: Program, job: Job, move: Ints, *, told: Floats, error: Floats
) -> dict[str, Any]:
    """The figures of a verification that the control adds.

    error (k, 3) mm: what the text of the corrected program leaves at points told (k, 3) mm on its moves (k,).
    """
    limits = limits_of(job.config)
    points = PointsOnMoves(
        move=move,
        commanded=told,
        error=error,
        line=np.zeros(len(move), np.int64),
        at_join=np.zeros(len(move), np.bool_),
    )
    accounts = [
        ControlAccount.of(programmed_moves(original, job), limits),
        ControlAccount.of(programmed_moves(corrected, job), limits, points=points),
    ]
    waits = [waiting_s(job.config, each.dwelt_s, each.tool_changes) for each in (original, corrected)]
    return control_figures(modes_of(original), accounts, waits)


def control_figures(
    modes: tuple[PathMode, ...], accounts: Sequence[ControlAccount], waits: Sequence[float]
) -> dict[str, Any]:
    """Figures of the accounts before and after compensation, with the time, s, that the control waits besides the moves."""
    before, after = (account.seconds + wait for account, wait in zip(accounts, waits, strict=True))
    return {
        "cycle_time_s": CycleTime.model_construct(before=before, after=after),
        "control_mode": mode_name(modes),
        "control_mode_stated": all(each.stated for each in modes),
        "under_control": accounts[1].errors.figures(),
    }


def mode_name(modes: tuple[PathMode, ...]) -> str:
    """Modes as a program says them."""
    return ", ".join(dict.fromkeys(each.name for each in modes)) or PathMode().name
