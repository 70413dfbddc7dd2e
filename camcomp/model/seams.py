"""Where the recording of a motion begins, and where it goes on."""

from dataclasses import dataclass, replace

from camcomp.ground.datatypes import Bools, Floats, Ints


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
