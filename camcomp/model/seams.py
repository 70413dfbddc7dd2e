"""Where the recording of a motion begins, and where it goes on."""

from dataclasses import dataclass, replace

import numpy as np

from camcomp.ground.datatypes import Bools, Floats, Ints

_MISSING = 1.5  # usual steps between rows from which on rows are missing between them


@dataclass(frozen=True, eq=False)
class Seams:
    """Where a recording begins, or goes on after rows that nobody logged, in motion: k instants.

    at (k,): their indices, rising; unseen (k,) s before them, inf at the beginning; speed (k, m) with which it goes on, per s.
    """

    at: Ints
    unseen: Floats
    speed: Floats

    def of(self, actuators: Bools) -> "Seams":
        """Of some of the actuators."""
        return replace(self, speed=self.speed[:, actuators])


def missing_rows(time: Floats) -> Bools:
    """Whether rows at times (n,) s are missing between each and the next (n - 1,)."""
    step = np.diff(time)
    return np.asarray(step > _MISSING * float(np.median(step)) if len(step) else np.zeros(0, bool))
