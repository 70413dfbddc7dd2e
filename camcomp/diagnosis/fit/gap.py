"""The gap that is to be explained: in which channels it is stated, how large it is, and the floor of its noise."""

from collections.abc import Sequence

import numpy as np

from camcomp.diagnosis.fit.columns import RUN_OFFSET_MM
from camcomp.diagnosis.fit.problem import Problem
from camcomp.ground.datatypes import Floats
from camcomp.model.effect import Cause


def main_channels(problem: Problem) -> slice:
    """The channels in which the gap is stated: the tip, or else the encoders, or else the drive forces."""
    m = len(problem.bench.actuators)
    for part in (slice(0, 3), slice(3, 3 + m), slice(3 + m, 3 + 2 * m)):
        if any(np.isfinite(r[:, part]).any() for r in problem.residuals):
            return part
    return slice(3 + 2 * m, 6 + 2 * m)


def gap_sizes(problem: Problem, causes: Sequence[Cause] = ()) -> Floats:
    """Length (n,), um, of what causes leave of the gap, at all rows of all runs where it is known."""
    part = main_channels(problem)
    gaps = [problem.bench.gap(k, causes)[:, part] for k in range(len(problem.residuals))]
    # an axis that nobody measured is no reason to do without the others
    size = np.concatenate(
        [np.where(np.isfinite(g).any(axis=1), np.sqrt(np.nansum(g**2, axis=1)), np.nan) for g in _together(gaps)]
    )
    return np.asarray(size[np.isfinite(size)] * 1e3)


def gap_of(problem: Problem) -> dict[str, float]:
    """Size of the gap over all runs, and of its noise, um."""
    part, size = main_channels(problem), gap_sizes(problem)
    repeats = RUN_OFFSET_MM if part.start == 0 else 0.0  # what one run differs from the next belongs to the floor
    seen = np.isfinite(problem.noise.sigma[:, part])
    sigma = np.where(seen, problem.noise.sigma[:, part] ** 2, 0.0).sum(axis=0) / np.maximum(seen.sum(axis=0), 1)
    if part.start == 0:
        sigma = sigma - problem.background.colour().excess ** 2
    noise = np.sqrt(np.sum(np.maximum(sigma, 0.0) + repeats**2, where=seen.any(axis=0))) * 1e3
    return {
        "rms_um": round(float(np.sqrt(np.mean(size**2))), 3),
        "p95_um": round(float(np.quantile(size, 0.95)), 3),
        "max_um": round(float(size.max()), 3),
        "noise_floor_um": round(float(noise), 3),
    }


def _together(gaps: list[Floats]) -> list[Floats]:
    """Gaps with rows blanked where a channel that the run has is missing."""
    out = []
    for g in gaps:
        known = np.isfinite(g)
        whole = np.all(known | ~np.any(known, axis=0), axis=1)
        out.append(np.where(np.reshape(whole, (-1, 1)), g, np.nan))
    return out
