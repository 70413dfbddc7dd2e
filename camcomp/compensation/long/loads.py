"""The cutting force along a run of straight moves, with the moves next to the run in sight."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from camcomp.compensation.long.engaged_loads import lay_engaged
from camcomp.compensation.long.engagement import RunEngagement
from camcomp.compensation.long.kernel import lay_loads
from camcomp.compensation.long.plain_run import NotInPieces, PlainRun
from camcomp.ground import path_geometry
from camcomp.ground.datatypes import LINE, RAPID, Bools, Floats, Ints, Path
from camcomp.model.cutting.engaged import EngagedAt
from camcomp.model.cutting.piece_load import needed
from camcomp.model.cutting.track import JOIN_ANGLE, PLUNGE_SINE, Conditions, base_of, lay_track
from camcomp.model.job import Job


@dataclass(frozen=True, eq=False, kw_only=True)
class Edge:
    """The motion next to a run, as a straight move with the direction that it has at the run's side. Program frame."""

    kind: int
    start: Floats  # (3,) mm
    end: Floats
    feed: float  # mm/min
    speed: float  # of the spindle, rev/min
    turn: float  # of the spindle, as in Path
    tool: int
    corrected: bool = True
    machine: bool = False  # in machine coordinates


@dataclass(frozen=True, eq=False, kw_only=True)
class Loads:
    """Forces of n moves, program frame."""

    first: Floats  # (n, 3) N at the start of each move
    last: Floats  # (n, 3) N at its end
    jump: Bools  # (n + 1,) the force jumps at the start of each move, and behind the last one
    length: Floats  # (n,) mm
    at: Callable[[Ints, Floats], Floats]  # (move (k,), fraction (k,)) -> force (k, 3)
    run: PlainRun  # the moves, where the stock is known in parts between the places of the engagement
    of: Ints  # (n,) motion of the program that a move is a part of
    sizes: Callable[[Ints, Floats], Floats] | None = None  # (move, fraction) -> depth mm, engaged arcs rad (k, 2)


def constant_of(job: Job) -> Floats | None:
    """Fr, Ft, Fz (3,) N of a force model that always gives the same; None: any other model."""
    force = job.config.process.force
    if job.config.workpiece.stock is not None:  # not where the tool meets nothing
        return None
    if force.model == "none":
        return np.zeros(3)
    if force.model == "constant" and job.conditions.stock_top_mm is None:
        return np.array([force.params.Fr_N, force.params.Ft_N, force.params.Fz_N], float)
    return None


def loads_of(
    run: PlainRun,
    before: Edge | None,
    after: Edge | None,
    c: Conditions,
    constant: Floats | None,
    met: RunEngagement | None = None,
) -> Loads:
    """Forces along a run. constant (3,): Fr, Ft, Fz of a model that always gives the same; None: any other model.

    met: what the tool meets, where the stock is known. Raises NotInPieces where the stock's top is too near.
    """
    n, plain = run.motions, run.plain
    left, right = ([before] if before else []), ([after] if after else [])
    kind = np.array([e.kind for e in left] + [0] * n + [e.kind for e in right], np.int8)
    start, end = np.empty((len(kind), 3)), np.empty((len(kind), 3))
    own = slice(len(left), len(left) + n)
    kind[own], start[own], end[own] = plain.kind, plain.start, plain.end
    beside = [(e, 0) for e in left] + [(e, -1) for e in right]
    for each, row in beside:
        start[row], end[row] = each.start, each.end
    if constant is None:
        return _of_model(run, kind, start=start, end=end, own=own, beside=beside, c=c, met=met)
    first, last, length = np.empty(start.shape), np.empty(start.shape), np.empty(len(kind))
    jump = np.zeros(len(kind) + 1, np.bool_)
    axis = np.asarray(c.tool_axis, float)
    lay_loads(kind, start, end, axis, constant, float(np.cos(JOIN_ANGLE)), PLUNGE_SINE, first, last, jump, length)
    f0, f1 = first[own], last[own]

    def at(move: Ints, w: Floats) -> Floats:
        return f0[move] + w[:, None] * (f1[move] - f0[move])

    return Loads(
        first=f0, last=f1, jump=jump[own.start : own.stop + 1], length=length[own], at=at, run=run, of=np.arange(n)
    )


def _of_model(
    run: PlainRun,
    kind: np.ndarray,
    *,
    start: Floats,
    end: Floats,
    own: slice,
    beside: list[tuple[Edge, int]],
    c: Conditions,
    met: RunEngagement | None,
) -> Loads:
    n, plain, state = len(kind), run.plain, run.state
    line, feed, speed, turn, tool = np.zeros(n, np.int64), *np.empty((3, n)), np.empty(n, np.int64)
    line[own], feed[own], speed[own], turn[own], tool[own] = (
        plain.row + run.row0 + 1, plain.feed, state.speed, state.sense, state.tool,
    )  # fmt: skip
    for each, row in beside:
        feed[row], speed[row], turn[row], tool[row] = each.feed, each.speed, each.turn, each.tool
    path = Path(
        line=line, kind=kind, start=start, end=end, centre=np.full((n, 3), np.nan), axis=np.zeros((n, 3)), angle=np.zeros(n),
        feed=np.where(kind == RAPID, np.nan, feed), speed=speed, turn=turn, tool=tool,
        known=np.ones(n, np.bool_), machine=np.zeros(n, np.bool_),
    )  # fmt: skip
    if met is not None and not c.plunges:
        return _where_met(run, path, own, c, met)
    track = lay_track(path, c, None if met is None else met.around(own))
    if met is None and len(track.motion) != n:  # a neighbour crosses the stock's top within NEAR
        raise NotInPieces
    first, last = np.searchsorted(track.motion, (own.start, own.stop)).tolist()

    def at(move: Ints, w: Floats) -> Floats:
        return track.force(move + first, w)

    def sizes(move: Ints, w: Floats) -> Floats:
        return np.column_stack(track.sizes(move + first, w))

    moves = np.arange(last - first)
    jump = np.append(track.jump, False)[first : last + 1]
    zero, one = np.zeros(len(moves)), np.ones(len(moves))
    of = track.motion[first:last] - own.start
    parts = run if met is None else run.parts(of, track.points(moves + first, zero), track.points(moves + first, one))
    length = track.length[first:last]
    return Loads(
        first=at(moves, zero), last=at(moves, one), jump=jump, length=length, at=at, run=parts, of=of,
        sizes=None if met is None else sizes,
    )  # fmt: skip


def _where_met(run: PlainRun, path: Path, own: slice, c: Conditions, met: RunEngagement) -> Loads:
    """The same where the stock is known: in parts between places of the engagement."""
    met_parts, lengths = met.parts(own), path_geometry.lengths(path)
    base = np.concatenate([base_of(path, c, each, lengths, extent=False) for each in met_parts])
    motion, u, depth, turn, bends = (
        np.concatenate([getattr(each, name) for each in met_parts])
        for name in ("motion", "u", "depth", "turn", "bends")
    )
    rows = needed(motion, u, turn, bends, base)
    n, parts = len(path), run
    of, u0, u1 = np.arange(n), np.zeros(n), np.ones(n)
    start, end = path.start, path.end
    inner = rows[(u[rows] > 0.0) & (u[rows] < 1.0)]
    if len(inner):
        inner = inner[np.append(True, (np.diff(motion[inner]) > 0) | (np.diff(u[inner]) > 0.0))]
        of, u0 = np.concatenate((of, motion[inner])), np.concatenate((u0, u[inner]))
        order = np.lexsort((u0, of))
        of, u0 = of[order], u0[order]
        u1 = np.append(np.where(of[1:] == of[:-1], u0[1:], 1.0), 1.0)
        start, end = path_geometry.points(path, of, u0), path_geometry.points(path, of, u1)
    first, last = np.empty(start.shape), np.empty(start.shape)
    jump, length = np.zeros(len(of) + 1, np.bool_), np.empty(len(of))
    axis = np.asarray(c.tool_axis, float)
    lay_engaged(
        path.kind[of], of, u0, u1, start, end, axis, motion[rows], u[rows], turn[rows], base[rows],
        float(np.cos(JOIN_ANGLE)), PLUNGE_SINE, first, last, jump, length,
    )  # fmt: skip
    a, b = np.searchsorted(of, (own.start, own.stop)).tolist()
    f0, f1, of, u0, u1 = first[a:b], last[a:b], of[a:b], u0[a:b], u1[a:b]
    if len(inner):
        parts = run.parts(of - own.start, start[a:b], end[a:b])

    def at(move: Ints, w: Floats) -> Floats:
        return f0[move] + w[:, None] * (f1[move] - f0[move])

    def sizes(move: Ints, w: Floats) -> Floats:
        at = np.where(w == 1.0, u1[move], u0[move] + w * (u1[move] - u0[move]))
        return np.column_stack(places.sizes(of[move], at, w == 0.0))

    places = EngagedAt(motion, u, depth, turn)
    return Loads(
        first=f0, last=f1, jump=jump[a : b + 1], length=length[a:b], at=at, run=parts, of=of - own.start, sizes=sizes
    )


def joints_at(loads: Loads, kind: np.ndarray, before: Edge | None, after: Edge | None) -> tuple[Bools, Bools]:
    """Moves (n,) that get a joining line in front, and behind: as row_layout has it, but for the length of the jump."""
    feed = kind == LINE
    lead = loads.jump[:-1] & feed
    lead[0] = feed[0] and before is not None and (loads.jump[0] and before.corrected or before.machine)
    following = np.append(feed[1:], after is not None and after.kind != RAPID and after.corrected)
    trail = loads.jump[1:] & ~following & feed
    if after is None:
        trail[-1] = False
    return lead, trail
