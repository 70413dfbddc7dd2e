"""How tips follow links that grow while a run goes on: first derivatives by length at the nodes of its path."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from weakref import WeakKeyDictionary

import numpy as np

from camcomp.ground.datatypes import Floats
from camcomp.model.motion.node_pieces import Places
from camcomp.model.motion.run_path import RunPath
from camcomp.model.statics.description import Robot
from camcomp.model.statics.lengths import LENGTH_STEP_MM, lengthened


@dataclass(frozen=True, eq=False)
class LongerLinks:
    """Links of a perfect machine, one of them longer. Derivatives are worked out once for every run path.

    tips: tips (q, 3) at the nodes of a run path, of a changed machine that goes where this one is told to go.
    """

    robot: Robot
    tips: Callable[[Robot, RunPath], Floats]
    _known: WeakKeyDictionary[RunPath, dict[int, Floats]] = field(
        default_factory=WeakKeyDictionary, init=False, repr=False
    )

    def way(self, run_path: RunPath, place: Places, grown: Floats) -> Floats:
        """Way (n, 3) mm of tips at a place of the run, machine frame, by links that are longer by `grown` (n, m) mm."""
        out = np.zeros((len(grown), 3))
        for j in np.flatnonzero(grown.any(axis=0)):
            out += place.of(self._by_length(run_path, int(j))) * grown[:, j, None]
        return out

    def _by_length(self, run_path: RunPath, j: int) -> Floats:
        """Way (q, 3) of the tips at the nodes per mm by which the link behind actuator j is longer."""
        ways = self._known.setdefault(run_path, {})
        if j not in ways:
            longer = lengthened(self.robot, self.robot.actuators[j].name, LENGTH_STEP_MM)
            ways[j] = (self.tips(longer, run_path) - self.tips(self.robot, run_path)) / LENGTH_STEP_MM
        return ways[j]
