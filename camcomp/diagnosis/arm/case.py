"""An explained set of campaigns of static poses, as the answer and the check of unseen poses take it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from camcomp.diagnosis.arm.linear import Shelf
from camcomp.diagnosis.arm.noise_floor import TipFloor
from camcomp.diagnosis.arm.poses import ArmBench, Poses, combined
from camcomp.diagnosis.model.evidence import LinearModel
from camcomp.diagnosis.model.explain import Explanation
from camcomp.ground.datatypes import Floats
from camcomp.model.effect import Cause


@dataclass(frozen=True, eq=False, kw_only=True)
class PoseCase:
    """amount (k,), covariance (k, k): of the columns; floor None: not identifiable; sd: noise, mm per coordinate.

    loose: withheld runs that are not judged, because their rows do not fix a frame of their own.
    """

    bench: ArmBench
    shelf: Shelf
    explanation: Explanation
    amount: Floats
    covariance: Floats
    floor: TipFloor | None
    sd: float
    outliers: tuple[tuple[str, int], ...]
    loose: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def model(self) -> LinearModel:
        """The linear model at the fitted causes."""
        return self.explanation.model

    @property
    def causes(self) -> list[Cause]:
        """Causes at the amplitudes that were found."""
        return combined(self.shelf.columns, {int(j): float(self.amount[j]) for j in np.flatnonzero(self.amount)})


def named_rows(poses: Poses, mask: np.ndarray) -> list[tuple[str, int]]:
    """Runs and rows of the poses of a mask."""
    return [(str(run), int(row)) for run, row in zip(poses.run[mask], poses.rows[mask], strict=True)]
