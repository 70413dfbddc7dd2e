"""What uncertain numbers do along a run of plain lines."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from camcomp.compensation.bands.scatter import TipMoves
from camcomp.compensation.bands.stations import Stations
from camcomp.compensation.bands.tip_field import TipField, of_sides, tip_field_of
from camcomp.compensation.long.engagement import RunEngagement
from camcomp.compensation.long.loads import Edge, Loads, constant_of, loads_of
from camcomp.compensation.long.plain_run import PlainRun
from camcomp.ground.datatypes import Bools, Floats, Ints
from camcomp.model.drawn import DrawnJob, UncertainJob
from camcomp.model.job import Job


@dataclass(frozen=True, eq=False)
class RunUncertainty:
    """The uncertain inputs along one run, with the forces on every side of each."""

    job: Job
    field: TipField
    loads: list[list[Loads]]

    @staticmethod
    def of(
        job: Job, run: PlainRun, before: Edge | None, after: Edge | None, met: RunEngagement | None = None
    ) -> RunUncertainty:
        """met: what the tool meets, where the stock is known. Raises NotInPieces as loads_of."""

        def loads(one: DrawnJob) -> Loads:
            return loads_of(run=run, before=before, after=after, c=one.conditions, constant=constant_of(one), met=met)

        field = tip_field_of(job)
        return RunUncertainty(
            job, field, [[loads(one) for one in each.sides] if each.moves_force else [] for each in field.inputs]
        )

    @property
    def inputs(self) -> list[UncertainJob]:
        """The inputs in order."""
        return self.field.inputs

    def moves(self, commanded: Floats, move: Ints, w: Floats, force: Floats, free: Bools) -> TipMoves:
        """Moves of the loaded tip at points (n,) of moves, with commanded tips (n, 3) mm and forces (n, 3) N, program frame.

        free (n,): points that carry no cutting force. Asked at stations.
        """
        changes = [[load.at(move, w) - force for load in loads] for loads in self.loads]
        for change in (each for sides in changes for each in sides):
            change[free] = 0.0
        stations = Stations.along(commanded, [force, *(each for sides in changes for each in sides)])
        at = stations.rows
        moves, compliance = self.field.at(commanded[at], self.job.frame.vectors(force[at]))
        for j, (each, sides) in enumerate(zip(self.inputs, changes, strict=True)):
            if not sides:
                continue
            slope, bend = of_sides(each, np.zeros_like(force[at]), [change[at] for change in sides])
            moves.slope[:, :, j] += np.einsum("nij,nj->ni", compliance, self.job.frame.vectors(slope))
            moves.bend[:, :, j] += np.einsum("nij,nj->ni", compliance, self.job.frame.vectors(bend))
        return TipMoves(stations.spread(moves.slope), stations.spread(moves.bend))
