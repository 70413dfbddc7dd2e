"""Groups of columns taken one after the other, each for what it predicts where nothing was fitted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from camcomp.diagnosis.arm.discrepancy import KERNEL_WIDTHS, Evidence
from camcomp.ground import headway
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
    """Forward selection by predictive density of withheld blocks; what was taken may be exchanged for what fits it better.

    A group also has to lower the rms there: density alone rewards certainty.
    """
    density, squares = evidence.predict(np.zeros(evidence.effects))
    none = Step("", 0.0, density, squares)
    steps: list[Step] = []
    turn = 0
    while True:
        widths = widths_of(evidence, groups, steps)
        last = (none, *steps)[-1]
        left = [name for name in groups if name not in {s.group for s in steps}]
        with headway.part(1.0 - 0.5**turn, 1.0 - 0.5 ** (turn + 1)):  # nobody knows how many turns there will be
            tried = [best_width(evidence, widths, name, groups[name]) for name in headway.steps(left, len(left))]
        turn += 1
        best = max(tried, key=lambda s: s.density, default=last)
        if best.density - last.density >= LEAST_GAIN and rms(best.squares) <= (1.0 - LEAST_SHARE) * rms(last.squares):
            steps.append(best)
        elif (better := _exchanged(evidence, groups, steps)) is not None:
            steps = better
        else:
            return Taken(none, tuple(steps), tuple(sorted(tried, key=lambda s: -s.density)), widths)


def widths_of(evidence: Evidence, groups: Mapping[str, Sequence[int]], steps: Sequence[Step]) -> Floats:
    """Widths (k,) of all columns, 0 where nothing was taken."""
    widths = np.zeros(evidence.effects)
    for step in steps:
        widths[list(groups[step.group])] = step.width
    return widths


def _exchanged(evidence: Evidence, groups: Mapping[str, Sequence[int]], steps: Sequence[Step]) -> list[Step] | None:
    """Steps with the one group exchanged that gains most and does not raise the rms; None where none gains enough.

    What was taken first was taken without the others, and may have stood in for one of them.
    """
    names = [s.group for s in steps]
    best: tuple[float, list[Step]] | None = None
    for i in range(len(steps)):
        for name in (each for each in groups if each not in names):
            rest = [*steps[:i], *steps[i + 1 :]]
            step = best_width(evidence, widths_of(evidence, groups, rest), name, groups[name])
            gain = step.density - steps[-1].density
            if gain < LEAST_GAIN or rms(step.squares) > (1.0 + LEAST_SHARE) * rms(steps[-1].squares):
                continue
            if best is None or gain > best[0]:
                best = gain, [*rest, step]
    if best is None:
        return None
    return in_order(evidence, groups, [(s.group, s.width) for s in best[1]])


def in_order(evidence: Evidence, groups: Mapping[str, Sequence[int]], some: Sequence[tuple[str, float]]) -> list[Step]:
    """Groups with their widths as steps: what each leaves beside those in front of it."""
    steps: list[Step] = []
    for name, width in some:
        density, squares = evidence.predict(widths_of(evidence, groups, [*steps, Step(name, width, 0.0, np.zeros(0))]))
        steps.append(Step(name, width, density, squares))
    return steps


def best_width(evidence: Evidence, widths: Floats, name: str, columns: Sequence[int]) -> Step:
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
