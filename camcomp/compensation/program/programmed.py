"""A program as it is to be cut: the pieces of its track, the share of the correction that it takes, its orientations."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from camcomp.compensation.program.moves import travel_of
from camcomp.compensation.program.orienting import Orienting
from camcomp.gcode.program import Program
from camcomp.ground.datatypes import Floats, Ints
from camcomp.ground.records import dataclass
from camcomp.model.cutting.track import Track
from camcomp.model.job import Job
from camcomp.model.motion.response import aim_at, respond
from camcomp.model.motion.travel import Travel
from camcomp.model.statics.target import Correction

if TYPE_CHECKING:
    from camcomp.compensation.program.uncertainty import Shares


@dataclass(frozen=True, eq=False)
class Programmed:
    """A program on its machine; points (k,) lie at fractions w of pieces, in the order of travel."""

    program: Program
    job: Job
    track: Track
    shares: Shares | None  # None: it takes all of the correction
    orienting: Orienting | None  # None: it states no orientation

    def travel(self, piece: Ints, w: Floats) -> Travel:
        """The travel over points (k,)."""
        return travel_of(self.job, self.track, piece, w)

    def words(self, piece: Ints, w: Floats) -> Floats:
        """Words (k, 3) of the orientation, zero where there are none."""
        return np.zeros((len(w), 3)) if self.orienting is None else self.orienting.programmed(self.track, piece, w)

    def aim(
        self, piece: Ints, w: Floats, travel: Travel | None = None, *, method: str = "newton", tips_only: bool = False
    ) -> tuple[Correction, Floats]:
        """Commands for points (k,), and words (k, 3) of the orientation; travel: None, as programmed."""
        target, words = self.track.points(piece, w), self.words(piece, w)
        travel = self.travel(piece, w) if travel is None else travel
        if self.orienting is None:
            return aim_at(self.job, target, travel, method, tips_only=tips_only), words
        return self.orienting.aim(target, travel, words)

    def taken(self, piece: Ints, w: Floats, commanded: Floats, target: Floats | None = None) -> Floats:
        """Commanded tips (k, 3) that take their share of the correction of targets (k, 3), by default those of the points."""
        if self.shares is None:
            return commanded
        target = self.track.points(piece, w) if target is None else target
        return target + self.shares.at(self.track, piece, w)[:, None] * (commanded - target)

    def missed(self, error: Floats, piece: Ints, w: Floats, travel: Travel, before: Floats | None = None) -> Floats:
        """Errors (k, 3) mm beyond those that the policy accepts; NaN where the machine has no solution."""
        if self.shares is None:
            return error
        target = self.track.points(piece, w)
        aimed = aim_at(self.job, target, travel, "newton").commanded
        tip, _ = respond(self.job, self.taken(piece, w, aimed), travel, target, before=before)
        return error - (tip - target)
