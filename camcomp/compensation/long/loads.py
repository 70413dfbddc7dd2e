"""The cutting force along a run of straight moves, with the moves next to the run in sight."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from camcomp.compensation.long.engaged_loads import lay_engaged
from camcomp.compensation.long.engagement import RunEngagement
from camcomp.compensation.long.linear_run import LinearRun, NotInPieces
from camcomp.ground import path_geometry
from camcomp.ground.datatypes import LINE, RAPID, Bools, Floats, Ints, Path
from camcomp.model.cutting.engaged import Engaged, EngagedAt
from camcomp.model.cutting.piece_load import needed
from camcomp.model.cutting.track import JOIN_ANGLE, PLUNGE_SINE, Conditions, Track, base_of, lay_track
from camcomp.model.drawn import DrawnJob
from camcomp.model.job import Job

Places = tuple[Ints, Floats, Floats, Floats]  # motion, fraction, engaged arcs (rad), Fr Ft Fz (k, 3) N at k places


@dataclass(frozen=True, eq=False)
class RunContext:
    """A run with the motions next to it, which have their direction at the run's side, and where a stock is known its engagement."""

    run: LinearRun
    before: Path | None
    after: Path | None
    engaged: RunEngagement | None = None

    def path(self) -> tuple[Path, slice]:
        """The motions with those next to them, and which of them are the run's."""
        parts = [self.run.path, *([self.after] if self.after else [])]
        first = int(self.before is not None)
        path = Path.joined([self.before, *parts] if self.before else parts)
        return path, slice(first, first + self.run.motions)


@dataclass(frozen=True, eq=False, kw_only=True)
class Loads:
    """Forces of n moves, program frame; with a known stock the moves are parts of motions between places of the engagement."""

    first: Floats  # (n, 3) N at the start of each move
    last: Floats  # (n, 3) N at its end
    jump: Bools  # (n + 1,) the force jumps at the start of each move, and behind the last one
    length: Floats  # (n,) mm
    run: LinearRun  # the moves
    of: Ints  # (n,) motion that a move is a part of, counted with the motion in front of the run
    u0: Floats  # (n,) which part
    u1: Floats
    own: slice  # motions of the run
    engaged: EngagedAt | None = None  # where a stock is known
    track: Track | None = None  # of a force that is not linear along the moves
    piece: int = 0  # of the track, of the first move

    @property
    def motion(self) -> Ints:
        """(n,) motion of the run that a move is a part of."""
        return np.asarray(self.of - self.own.start)

    def at(self, move: Ints, w: Floats) -> Floats:
        """Forces (k, 3) at fractions w (k,) of moves (k,)."""
        if self.track is not None:
            return self.track.force(move + self.piece, w)
        return np.asarray(self.first[move] + w[:, None] * (self.last[move] - self.first[move]))

    def sizes(self, move: Ints, w: Floats) -> Floats | None:
        """Depth mm and engaged arcs rad (k, 2) at fractions of moves; None without a stock."""
        if self.engaged is None:
            return None
        u = np.where(w == 1.0, self.u1[move], self.u0[move] + w * (self.u1[move] - self.u0[move]))
        return np.column_stack(self.engaged.sizes(self.of[move], u, w == 0.0))


def constant_of(job: Job | DrawnJob) -> Floats | None:
    """Fr, Ft, Fz (3,) N of a force model that always gives the same; None: any other model."""
    force = job.config.process.force
    if job.config.workpiece.stock is not None:  # not where the tool meets nothing
        return None
    if force.model == "none":
        return np.zeros(3)
    if force.model == "constant" and job.conditions.stock_top_mm is None:
        return np.array([force.params.Fr_N, force.params.Ft_N, force.params.Fz_N], float)
    return None


def loads_of(context: RunContext, job: Job | DrawnJob) -> Loads:
    """Forces along a run under the conditions of a job. Raises NotInPieces where the stock's top is too near."""
    (path, own), c, engaged, constant = context.path(), job.conditions, context.engaged, constant_of(job)
    n = len(path)
    if constant is not None:
        cuts = np.repeat(path.known & ~path.machine, 2).astype(float)
        places = np.repeat(np.arange(n), 2), np.tile([0.0, 1.0], n), cuts, np.tile(constant, (2 * n, 1))
        return _linear(context.run, path, own, c, places)
    if engaged is not None and not c.plunges:
        parts, lengths = engaged.around(own), path_geometry.lengths(path)
        base = np.concatenate([base_of(path, c, each, lengths, extent=False) for each in parts])
        motion, u, depth, turn, bends = (
            np.concatenate([getattr(each, name) for each in parts])
            for name in ("motion", "u", "depth", "turn", "bends")
        )
        rows, at = needed(motion, u, turn, bends, base), EngagedAt(motion, u, depth, turn)
        return _linear(context.run, path, own, c, (motion[rows], u[rows], turn[rows], base[rows]), engaged=at)
    track = lay_track(path, c, None if engaged is None else Engaged.joined(engaged.around(own)))
    if engaged is None and len(track.motion) != n:  # a neighbour crosses the stock's top within NEAR
        raise NotInPieces
    first, last = np.searchsorted(track.motion, (own.start, own.stop)).tolist()
    moves, zero, one = np.arange(first, last), np.zeros(last - first), np.ones(last - first)
    of, parts_of = track.motion[first:last], context.run
    if engaged is not None:
        parts_of = context.run.parts(of - own.start, track.points(moves, zero), track.points(moves, one))
    return Loads(
        first=track.force(moves, zero), last=track.force(moves, one),
        jump=np.append(track.jump, False)[first : last + 1], length=track.length[first:last], run=parts_of, of=of,
        u0=track.u0[first:last], u1=track.u1[first:last], own=own, engaged=track.engaged, track=track, piece=first,
    )  # fmt: skip


def _linear(
    run: LinearRun, path: Path, own: slice, c: Conditions, places: Places, engaged: EngagedAt | None = None
) -> Loads:
    """Loads in parts between places; the force is linear between them."""
    motion, u, turn, base = places
    n = len(path)
    of, u0, u1, start, end = np.arange(n), np.zeros(n), np.ones(n), path.start, path.end
    inner = np.flatnonzero((u > 0.0) & (u < 1.0))
    if len(inner):
        inner = inner[np.append(True, (np.diff(motion[inner]) > 0) | (np.diff(u[inner]) > 0.0))]
        of, u0 = np.concatenate((of, motion[inner])), np.concatenate((u0, u[inner]))
        order = np.lexsort((u0, of))
        of, u0 = of[order], u0[order]
        u1 = np.append(np.where(of[1:] == of[:-1], u0[1:], 1.0), 1.0)
        start, end = path_geometry.points(path, of, u0), path_geometry.points(path, of, u1)
    first, last = np.empty(start.shape), np.empty(start.shape)
    jump, length = np.zeros(len(of) + 1, np.bool_), np.empty(len(of))
    lay_engaged(
        path.kind[of], of, u0, u1, start, end, np.asarray(c.tool_axis, float), motion, u, turn, base,
        float(np.cos(JOIN_ANGLE)), PLUNGE_SINE, first, last, jump, length,
    )  # fmt: skip
    a, b = np.searchsorted(of, (own.start, own.stop)).tolist()
    parts = run.parts(of[a:b] - own.start, start[a:b], end[a:b]) if len(inner) else run
    return Loads(
        first=first[a:b], last=last[a:b], jump=jump[a : b + 1], length=length[a:b], run=parts, of=of[a:b],
        u0=u0[a:b], u1=u1[a:b], own=own, engaged=engaged,
    )  # fmt: skip


def joints_at(loads: Loads, before: Path | None, after: Path | None) -> tuple[Bools, Bools]:
    """Moves (n,) that get a joining line in front, and behind: as row_layout has it, but for the length of the jump."""
    feed = loads.run.linear.kind == LINE
    lead = loads.jump[:-1] & feed
    corrected = [each is not None and bool(each.known[0] & ~each.machine[0]) for each in (before, after)]
    machine = before is not None and bool(before.machine[0])
    lead[0] = feed[0] and before is not None and (loads.jump[0] and corrected[0] or machine)
    goes_on = after is not None and corrected[1] and int(after.kind[0]) != RAPID
    trail = loads.jump[1:] & ~np.append(feed[1:], goes_on) & feed
    if after is None:
        trail[-1] = False
    return lead, trail
