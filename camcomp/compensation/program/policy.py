"""Which share of the correction a program takes, where the numbers that it rests on are uncertain.

The share is found at points of the programmed path and runs smoothly between them, so that everything that writes and checks
a program can ask for it anywhere.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from camcomp.compensation.bands.scatter import best_share, excess
from camcomp.compensation.program.line_ends import points_along
from camcomp.compensation.program.moves import travel_of
from camcomp.compensation.program.uncertainty import Uncertainty, same_place
from camcomp.ground.datatypes import Bools, Floats, Ints
from camcomp.ground.records import dataclass, replace
from camcomp.model.cutting.track import Track
from camcomp.model.job import Job
from camcomp.model.motion.response import Travel, aim_at, respond

SAME_SHARE = 1e-3  # a smaller step of the share is none


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

    def taken(self, track: Track, piece: Ints, w: Floats, target: Floats, commanded: Floats) -> Floats:
        """Commanded tips (k, 3) that take their share of the correction from `target` to `commanded`."""
        return target + self.at(track, piece, w)[:, None] * (commanded - target)

    def left(
        self, job: Job, track: Track, piece: Ints, w: Floats, travel: Travel, before: Floats | None = None
    ) -> Floats:
        """Tip errors (k, 3) mm that the policy accepts, at points in the order of travel; NaN without a solution."""
        target = track.points(piece, w)
        aimed = aim_at(job, target, travel, "newton").commanded
        tip, _ = respond(job, self.taken(track, piece, w, target, aimed), travel, target, before=before)
        out: Floats = tip - target
        return out


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
    moves = Uncertainty(job, track).moves(
        piece, w, commanded=aimed.commanded, travel=travel, free=np.zeros(len(w), np.bool_), base=target
    )
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
