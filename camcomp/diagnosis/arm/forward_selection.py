"""Groups of columns taken one after the other, each for what it predicts where nothing was fitted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from camcomp.diagnosis.arm.discrepancy import KERNEL_WIDTHS, Evidence
from camcomp.ground.datatypes import Floats

LEAST_GAIN = 3.0  # log predictive density: odds of 20
LEAST_SHARE = 0.03  # of the rms on withheld blocks; less may be real and helps nobody


@dataclass(frozen=True, eq=False)
class Step:
    """A group taken: its width, and log predictive density and mean squares (blocks,) mm2 with it."""

    group: str
    width: float
    density: float
    squares: Floats


@dataclass(frozen=True, eq=False)
class Taken:
    """Groups in the order in which they were taken. widths (k,) of all columns, 0 = not taken; none: nothing taken."""

    none: Step
    steps: tuple[Step, ...]
    refused: tuple[Step, ...]  # the best that the remaining groups could do
    widths: Floats


def rms(squares: Floats) -> float:
    """Root mean square over blocks, each of which counts alike."""
    return float(np.sqrt(np.mean(squares)))


def take(evidence: Evidence, groups: Mapping[str, Sequence[int]]) -> Taken:
    """Forward selection by predictive density of withheld blocks.

    A group also has to lower the rms there: density alone rewards certainty.
    """
    widths = np.zeros(evidence.effects)
    density, squares = evidence.predict(widths)
    none = last = Step("", 0.0, density, squares)
    steps: list[Step] = []
    while True:
        tried = [
            _best(evidence, widths, name, columns)
            for name, columns in groups.items()
            if name not in {s.group for s in steps}
        ]
        if not tried:
            return Taken(none, tuple(steps), (), widths)
        best = max(tried, key=lambda s: s.density)
        if best.density - last.density < LEAST_GAIN or rms(best.squares) > (1.0 - LEAST_SHARE) * rms(last.squares):
            return Taken(none, tuple(steps), tuple(sorted(tried, key=lambda s: -s.density)), widths)
        widths = widths.copy()
        widths[list(groups[best.group])] = best.width
        steps.append(best)
        last = best


def _best(evidence: Evidence, widths: Floats, name: str, columns: Sequence[int]) -> Step:
    """The group added at its best width."""
    found = []
    for width in KERNEL_WIDTHS:
        more = widths.copy()
        more[list(columns)] = width
        density, squares = evidence.predict(more)
        found.append(Step(name, width, density, squares))
    return max(found, key=lambda s: s.density)


def odds(gain: float) -> float:
    """Probability that goes with a gain in log density, even odds before it."""
    return float(1.0 / (1.0 + np.exp(-np.clip(gain, -50.0, 50.0))))
