"""Seams of a recording: its start in motion, and its continuations after missing rows."""

import numpy as np

from camcomp.ground.datatypes import Bools, Floats, Ints
from camcomp.ground.records import dataclass, replace

_MISSING = 1.5  # of the median time step: longer steps mean missing rows


@dataclass(frozen=True, eq=False)
class Seams:
    """k instants at which a recording begins, or continues after missing rows, while the machine moves.

    at (k,): indices, rising; unseen (k,): s without rows before them, inf at the beginning; speed (k, m): of the actuators
    behind them, per s.
    """

    at: Ints
    unseen: Floats
    speed: Floats

    def of(self, actuators: Bools) -> "Seams":
        """Seams of some of the actuators."""
        return replace(self, speed=self.speed[:, actuators])


def missing_rows(time: Floats) -> Bools:
    """Whether rows at times (n,) s are missing between each and the next (n - 1,)."""
    step = np.diff(time)
    return np.asarray(step > _MISSING * float(np.median(step)) if len(step) else np.zeros(0, bool))
