"""An explained set of campaigns of static poses, as the answer and the check of unseen poses take it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.special import expit

from camcomp.diagnosis.arm.linear import Shelf
from camcomp.diagnosis.arm.noise_floor import TipFloor
from camcomp.diagnosis.arm.poses import ArmBench, Poses, combined
from camcomp.diagnosis.model.calibration import calibration_of
from camcomp.diagnosis.model.candidates import Place
from camcomp.diagnosis.model.classes import alternatives_of
from camcomp.diagnosis.model.evidence import LinearModel
from camcomp.diagnosis.model.explain import Explanation
from camcomp.diagnosis.model.folds import Excess
from camcomp.diagnosis.statistics.probability import EVEN
from camcomp.ground.datatypes import Floats
from camcomp.model.effect import Cause

POSES_MAP, UNKNOWN_MAP = "poses", "poses beside unknown"  # kinds of log of the calibration


@dataclass(frozen=True, eq=False)
class PlacedEffect:
    """An effect at a target: its columns and the probability of the posterior."""

    effect: str
    target: str | None
    columns: list[int]
    probability: float


@dataclass(frozen=True, eq=False, kw_only=True)
class PoseCase:
    """amount (k,), covariance (k, k): of the columns; floor None: not identifiable; sd: noise, mm per coordinate.

    loose: withheld runs that are not judged, because their rows do not fix a frame of their own. every_gap (n, 3) mm: of
    all campaigns to the arm of the config. check: of held-out poses.
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
    every_gap: Sequence[Floats] = ()
    check: Excess | None = None

    @property
    def gaps(self) -> Sequence[Floats]:
        """Gaps (n, 3) mm of the fitted campaigns to the arm of the config."""
        return self.every_gap[: len(self.bench.own)]

    @property
    def runs(self) -> list[str]:
        """Names of the fitted runs."""
        return list(dict.fromkeys(str(name) for k in self.bench.own for name in self.bench.campaigns[k].run))

    @property
    def model(self) -> LinearModel:
        """The linear model at the fitted causes."""
        return self.explanation.model

    @property
    def causes(self) -> list[Cause]:
        """Causes at the amplitudes that were found."""
        return combined(self.shelf.columns, {int(j): float(self.amount[j]) for j in np.flatnonzero(self.amount)})

    @property
    def unmodelled(self) -> float:
        """Calibrated probability that something unmodelled acts; unseen poses above their floor decide."""
        if self.check is not None and self.check.above:
            return calibration_of(POSES_MAP).calibrate(1.0)
        return calibration_of(POSES_MAP).calibrate(self.explanation.unknown)

    @property
    def kind(self) -> str:
        """The calibration map of causes."""
        return UNKNOWN_MAP if self.unmodelled > EVEN else POSES_MAP

    @property
    def wide(self) -> float:
        """Half width of a 95 % interval in standard deviations."""
        return 1.96 * calibration_of(self.kind).interval

    @cached_property
    def rest(self) -> list[Floats]:
        """Residuals (n, 3) mm of the fitted campaigns with the causes, frames fitted."""
        return [self.bench.gap(k, self.causes) for k in self.bench.own]

    @cached_property
    def parts(self) -> list[PlacedEffect]:
        """Members of the most probable set, and the targets of its families."""
        found, columns = self.explanation, self.shelf.columns
        own = [PlacedEffect(c.effect, c.target, list(c.columns), found.places[c.place])
               for c in (found.model.candidates[i] for i in found.members)]  # fmt: skip
        for name, _ in found.background.families:
            on = [j for j in found.model.family(name)[0].tolist() if self.amount[j] != 0.0]
            for target in dict.fromkeys(columns[j].target for j in on):
                here = [j for j in on if columns[j].target == target]
                alone = next((p for p in own if (p.effect, p.target) == (name, target)), None)
                if alone is None:
                    chance = float(expit(found.odds_of(here)))
                    own.append(PlacedEffect(name, target, here, found.families[name] * chance))
                else:
                    alone.columns.extend(j for j in here if j not in alone.columns)
        return own

    def alternatives(self) -> list[tuple[int, ...]]:
        """Sets that are indistinguishable by these poses, the best first."""
        return alternatives_of(self.explanation)

    def places(self, members: Sequence[int]) -> list[Place]:
        """Effects and targets of candidates."""
        return [self.shelf.candidates[i].place for i in members]


def named_rows(poses: Poses, mask: np.ndarray) -> list[tuple[str, int]]:
    """Runs and rows of the poses of a mask."""
    return [(str(run), int(row)) for run, row in zip(poses.run[mask], poses.rows[mask], strict=True)]
