"""What uncertain numbers do along a program, and which share of the correction it takes for that.

The share is found at points of the programmed path and runs smoothly between them, so that everything that writes and checks
a program can ask for it anywhere.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from camcomp.compensation.bands.scatter import TipMoves, best_share, excess
from camcomp.compensation.bands.tip_field import of_sides, tip_field_of, unsolved
from camcomp.compensation.program.line_ends import points_along
from camcomp.compensation.program.moves import travel_of
from camcomp.ground.datatypes import Bools, Floats, Ints
from camcomp.ground.records import dataclass, replace
from camcomp.model.cutting.track import Track, lay_track
from camcomp.model.drawn import DrawnJob
from camcomp.model.job import Job
from camcomp.model.motion.response import aim_at, respond
from camcomp.model.motion.travel import Travel

SAME_SHARE = 1e-3  # a smaller step of the share is none


def same_place(own: Track, other: Track, piece: Ints, w: Floats) -> tuple[Ints, Floats]:
    """Pieces (n,) of one track and fractions of them where those of another track of the same path lie."""
    middle = other.motion + 0.5 * (other.u0 + other.u1)
    at = (np.searchsorted(own.motion + own.u0, middle, side="right") - 1)[piece]
    along = (other.u(piece, w) - own.u0[at]) / np.maximum(own.u1[at] - own.u0[at], 1e-300)
    return at, np.clip(along, 0.0, 1.0)


def tip_moves(
    job: Job, track: Track, piece: Ints, w: Floats, *, commanded: Floats, travel: Travel, base: Floats,
    free: Bools | None = None, before: Floats | None = None,
) -> TipMoves:  # fmt: skip
    """Moves of the loaded tip with the uncertain inputs of a job, at points (n,) of a track in the order of travel.

    commanded (n, 3): their commanded tips. free (n,): points that carry no cutting force, whatever the track says. base
    (n, 3): the loaded tips themselves, before (3,): the commanded tip in front of them; both for machines with effects and
    programs with orientation only.
    """

    def force_of(one: DrawnJob) -> Floats:
        """Cutting force (n, 3) N, machine frame, under another job's conditions."""
        own = lay_track(track.path, one.conditions, track.engaged)
        force = one.frame.vectors(own.force(*same_place(own, track, piece, w)))
        if free is not None:
            force[free] = 0.0
        return force

    field = tip_field_of(job)
    if not job.causes and travel.rotation is None:
        changes = [
            [force_of(one) - travel.force for one in each.sides] if each.moves_force else [] for each in field.inputs
        ]
        return field.moves(commanded, travel.force, changes)
    # Drives remember their way, and a field knows no orientation: the whole way anew for every side of every input.
    slope, bend = np.zeros((2, len(piece), 3, len(field.inputs)))
    for j, each in enumerate(field.inputs):
        tips = []
        for one in each.sides:
            force = force_of(one) if each.moves_force else travel.force
            tip, state = respond(one, commanded, replace(travel, force=force), before=before)
            if state.status.any():
                raise unsolved(job, each.source.name)
            tips.append(one.on_the_workpiece(tip))
        slope[:, :, j], bend[:, :, j] = of_sides(each, base, tips)
    return TipMoves(slope, bend)


@dataclass(frozen=True, eq=False)
class Shares:
    """Share of the correction along a path: its course over twice the number of the piece of `track` plus the fraction of it."""

    track: Track
    course: Callable[[Floats], Floats]
    bent: Floats  # motion plus fraction of it, inside pieces, between which the share changes in its own way

    def at(self, track: Track, piece: Ints, w: Floats) -> Floats:
        """Shares (k,) at fractions w (k,) of pieces (k,) of this or another track of the path."""
        own, along = same_place(self.track, track, piece, w)
        return np.clip(self.course(2.0 * own + along), 0.0, 1.0)

    def of_ends(self, track: Track, piece: Ints, w: Floats, joining: Bools) -> Floats:
        """Shares (N,) of end points; a joining line behind a cut leads to where the next piece begins."""
        behind = joining & (w > 0.0)
        return self.at(track, np.minimum(piece + behind, len(track.motion) - 1), np.where(behind, 0.0, w))

    def with_jumps(self, track: Track) -> Track:
        """The track, whose correction jumps also where the share does."""
        every = np.arange(len(track.motion))
        begin, end = self.at(track, every, np.zeros(len(every))), self.at(track, every, np.ones(len(every)))
        step = np.abs(begin[1:] - end[:-1]) > SAME_SHARE
        return replace(track, jump=track.jump | np.concatenate(([False], step)))

    def divided(self, track: Track) -> tuple[Track, Ints]:
        """The track in pieces (p,) on each of which the share changes smoothly, and the pieces that they are cut from."""
        piece = np.searchsorted(track.motion + track.u0, self.bent, side="right") - 1
        span = track.u1[piece] - track.u0[piece]
        w = (self.bent - track.motion[piece] - track.u0[piece]) / np.where(span > 0.0, span, 1.0)
        inside = (w > 1e-6) & (w < 1.0 - 1e-6)
        of = np.sort(np.concatenate((np.arange(len(track.motion)), piece[inside])))
        return track.cut(piece[inside], w[inside]) if inside.any() else track, of


def shares_of(job: Job, track: Track) -> Shares | None:
    """Shares of the correction by the policy of the config; None: the correction is taken in full."""
    policy = job.config.compensation.policy
    if policy == "full" or not job.config.uncertain:
        return None
    piece, w = points_along(track)
    if not len(piece):
        return None
    target, travel = track.points(piece, w), travel_of(job, track, piece, w)
    aimed = aim_at(job, target, travel, "newton")
    tip, loaded = respond(job, target, travel)
    solved = (aimed.status == 0) & (loaded.status == 0)
    if not solved.all():  # told with its line when the program is corrected
        return None
    moves = tip_moves(job, track, piece, w, commanded=aimed.commanded, travel=travel, base=target)
    error = tip - target
    value: Floats
    if policy == "shrink":
        value = best_share(error, np.zeros_like(error), moves)
    else:
        value = np.where(left_alone(track.motion[piece], excess(error, moves)), 0.0, 1.0)
    from scipy.interpolate import (
        PchipInterpolator,  # a quarter of a second that programs without a policy need not spend
    )

    step = np.abs(np.diff(value)) > SAME_SHARE
    changes = np.concatenate(([False], step)) | np.concatenate((step, [False]))
    bent = changes & (w > 0.0) & (w < 1.0)
    return Shares(track, PchipInterpolator(2.0 * piece + w, value), (track.motion[piece] + track.u(piece, w))[bent])


def left_alone(line: Ints, over: Floats) -> Bools:
    """Points (n,) of lines on which, in the mean of their points, the band exceeds the gain; over (n,): by how much."""
    _, number = np.unique(line, return_inverse=True)
    out: Bools = (np.bincount(number, over) > 0.0)[number]
    return out
