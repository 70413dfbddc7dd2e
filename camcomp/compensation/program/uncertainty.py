"""What uncertain numbers do along a program that is corrected as a whole."""

from __future__ import annotations

import numpy as np

from camcomp.compensation.bands.scatter import TipMoves
from camcomp.compensation.bands.tip_field import of_sides, tip_field_of, unsolved
from camcomp.ground.datatypes import Bools, Floats, Ints
from camcomp.ground.records import replace
from camcomp.model.cutting.track import Track, lay_track
from camcomp.model.drawn import DrawnJob
from camcomp.model.job import Job
from camcomp.model.motion.response import Travel, respond


def same_place(own: Track, other: Track, piece: Ints, w: Floats) -> tuple[Ints, Floats]:
    """Pieces (n,) of one track and fractions of them where those of another track of the same path lie."""
    middle = other.motion + 0.5 * (other.u0 + other.u1)
    at = (np.searchsorted(own.motion + own.u0, middle, side="right") - 1)[piece]
    along = (other.u(piece, w) - own.u0[at]) / np.maximum(own.u1[at] - own.u0[at], 1e-300)
    return at, np.clip(along, 0.0, 1.0)


class Uncertainty:
    """The uncertain inputs of a job along one track."""

    def __init__(self, job: Job, track: Track) -> None:
        self.job, self.track = job, track
        self._tracks: dict[DrawnJob, Track] = {}
        self._field = tip_field_of(job)
        self.inputs = self._field.inputs

    def moves(
        self,
        piece: Ints,
        w: Floats,
        *,
        commanded: Floats,
        travel: Travel,
        free: Bools,
        base: Floats,
        before: Floats | None = None,
    ) -> TipMoves:
        """Moves of the loaded tip at points (n,) of the track in the order of travel, with their commanded tips (n, 3).

        free (n,): points that carry no cutting force, whatever the track says. base (n, 3): the loaded tips themselves, before
        (3,): the commanded tip in front of them; both for machines with effects and programs with orientation only.
        """
        if not self.job.causes and travel.rotation is None:
            changes = [
                [self._force(one, piece, w, free) - travel.force for one in each.sides] if each.moves_force else []
                for each in self.inputs
            ]
            return self._field.moves(commanded, travel.force, changes)
        # Drives remember their way, and a field knows no orientation: the whole way anew for every side of every input.
        slope, bend = np.zeros((2, len(piece), 3, len(self.inputs)))
        for j, each in enumerate(self.inputs):
            tips = []
            for one in each.sides:
                force = self._force(one, piece, w, free) if each.moves_force else travel.force
                tip, state = respond(one, commanded, replace(travel, force=force), before=before)
                if state.status.any():
                    raise unsolved(self.job, each.source.name)
                tips.append(one.on_the_workpiece(tip))
            slope[:, :, j], bend[:, :, j] = of_sides(each, base, tips)
        return TipMoves(slope, bend)

    def _force(self, one: DrawnJob, piece: Ints, w: Floats, free: Bools) -> Floats:
        """Cutting force (n, 3) N, machine frame, under another job's conditions."""
        if one not in self._tracks:
            self._tracks[one] = lay_track(self.track.path, one.conditions, self.track.engaged)
        own = self._tracks[one]
        at, along = same_place(own, self.track, piece, w)
        force = one.frame.vectors(own.force(at, along))
        force[free] = 0.0
        return force
