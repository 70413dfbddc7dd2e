"""How tips follow links that grow while a run goes on: first derivatives by length at the nodes of its path."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from weakref import WeakKeyDictionary

import numpy as np

from camcomp.ground.datatypes import Floats
from camcomp.model.motion.node_pieces import Places
from camcomp.model.motion.run_path import RunPath
from camcomp.model.statics.description import Robot
from camcomp.model.statics.lengths import LENGTH_STEP_MM, lengthened
from camcomp.model.statics.machine import Machine, build_machine
from camcomp.model.statics.solve import FREE, solve


@dataclass(frozen=True, eq=False)
class LongerLinks:
    """Links of a perfect machine, one of them longer. Derivatives are worked out once for every run path."""

    robot: Robot
    _known: WeakKeyDictionary[RunPath, dict[int, Floats]] = field(
        default_factory=WeakKeyDictionary, init=False, repr=False
    )

    @cached_property
    def _machine(self) -> Machine:
        return build_machine(self.robot, self.robot)

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
            near = run_path.node_tip
            longer = build_machine(lengthened(self.robot, self._machine.actuators[j], LENGTH_STEP_MM), self.robot)
            tips = [solve(each, FREE, near, rho=run_path.node_rho, check=False).tip for each in (longer, self._machine)]
            ways[j] = (tips[0] - tips[1]) / LENGTH_STEP_MM
        return ways[j]
