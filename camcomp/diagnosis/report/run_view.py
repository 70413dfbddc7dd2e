"""Data of one run for the plots of a diagnosis report."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from camcomp.ground.datatypes import Floats, Path

MOST_DRAWN = 4  # runs, or circles, with figures of their own


@dataclass(frozen=True, eq=False, kw_only=True)
class RunView:
    """Rows (n,) of one run. before, after: measured minus modelled (n, c) um, without and with the causes found.

    time (n,) s; position (n, 3) mm modelled tip in the program frame; channels:
    names of the c columns. held_out: the causes were fitted without this run. NaN for unmeasured values.
    commanded (n, 3): tip of the set-points, program frame; program: path of the program; cutting: any row was under a
    cutting force.
    """

    name: str
    held_out: bool
    time: Floats
    position: Floats
    before: Floats
    after: Floats
    channels: tuple[str, ...]
    commanded: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    program: Path | None = None
    cutting: bool = False

    @property
    def sizes(self) -> tuple[Floats, Floats]:
        """Size (n,) um of the gap before and after."""
        return np.linalg.norm(self.before, axis=1), np.linalg.norm(self.after, axis=1)

    @property
    def explained(self) -> bool:
        """Whether the causes change the gap."""
        return not np.array_equal(self.before, self.after, equal_nan=True)

    @property
    def curves(self) -> list[tuple[str, Floats]]:
        """The gap (n, c) before, and with the causes found where they change it, each with its name."""
        return [("before", self.before), ("with the causes found", self.after)][: 1 + self.explained]

    @property
    def path(self) -> Floats:
        """Path length (n,) mm."""
        step = np.linalg.norm(np.diff(self.position, axis=0), axis=1)
        return np.concatenate(([0.0], np.cumsum(np.where(np.isfinite(step), step, 0.0))))


def rms(size: Floats) -> float:
    """Root mean square of the finite values; 0 without any."""
    known = size[np.isfinite(size)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else 0.0
