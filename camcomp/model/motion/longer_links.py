"""Tip error of links that grow during a run: first derivatives by length at the nodes of its path."""

from __future__ import annotations

from collections.abc import Callable
from weakref import WeakKeyDictionary

import numpy as np

from camcomp.ground.datatypes import Floats
from camcomp.ground.records import dataclass, field
from camcomp.model.motion.node_pieces import Places
from camcomp.model.motion.run_path import RunPath
from camcomp.model.statics.description import Robot
from camcomp.model.statics.lengths import LENGTH_STEP_MM, lengthened


@dataclass(frozen=True, eq=False)
class LongerLinks:
    """Tip displacement by longer links of a perfect machine; derivatives are computed once per run path.

    tips: function of a changed machine and a run path that returns tips (q, 3) at the nodes for the same set-points.
    """

    robot: Robot
    tips: Callable[[Robot, RunPath], Floats]
    _known: WeakKeyDictionary[RunPath, dict[int, Floats]] = field(
        default_factory=WeakKeyDictionary, init=False, repr=False
    )

    def way(self, run_path: RunPath, place: Places, grown: Floats) -> Floats:
        """Displacement (n, 3) mm of the tips, machine frame, by links that are longer by `grown` (n, m) mm."""
        out = np.zeros((len(grown), 3))
        for j in np.flatnonzero(grown.any(axis=0)):
            out += place.of(self._by_length(run_path, int(j))) * grown[:, j, None]
        return out

    def _by_length(self, run_path: RunPath, j: int) -> Floats:
        """Displacement (q, 3) mm of the tips at the nodes per mm of growth of the link behind actuator j."""
        ways = self._known.setdefault(run_path, {})
        if j not in ways:
            longer = lengthened(self.robot, self.robot.actuators[j].name, LENGTH_STEP_MM)
            ways[j] = (self.tips(longer, run_path) - self.tips(self.robot, run_path)) / LENGTH_STEP_MM
        return ways[j]
