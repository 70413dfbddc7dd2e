"""What uncertain numbers do along a run of linear moves."""

from __future__ import annotations

from camcomp.compensation.bands.scatter import TipMoves
from camcomp.compensation.bands.stations import Stations
from camcomp.compensation.bands.tip_field import tip_field_of
from camcomp.compensation.long.loads import RunContext, loads_of
from camcomp.ground.datatypes import Bools, Floats, Ints
from camcomp.model.job import Job


class RunUncertainty:
    """The uncertain inputs along one run, with the forces on every side of each. Raises NotInPieces as loads_of."""

    def __init__(self, job: Job, context: RunContext) -> None:
        self._job, self._field = job, tip_field_of(job)
        self.inputs = self._field.inputs
        self._loads = [
            [loads_of(context, one) for one in each.sides] if each.moves_force else [] for each in self.inputs
        ]

    def moves(self, commanded: Floats, move: Ints, w: Floats, force: Floats, free: Bools) -> TipMoves:
        """Moves of the loaded tip at points (n,) of moves, with commanded tips (n, 3) mm and forces (n, 3) N, program frame.

        free (n,): points that carry no cutting force. Asked at stations.
        """
        turned, changes = self._job.frame.vectors, []
        for sides in self._loads:
            changes.append([load.at(move, w) - force for load in sides])
            for change in changes[-1]:
                change[free] = 0.0
        stations = Stations.along(commanded, [force, *(each for sides in changes for each in sides)])
        at = stations.rows
        by_input = [[turned(each[at]) for each in sides] for sides in changes]
        moves = self._field.moves(commanded[at], turned(force[at]), by_input)
        return TipMoves(stations.spread(moves.slope), stations.spread(moves.bend))
