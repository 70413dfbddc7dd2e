"""The gap that is to be explained: in which channels it is stated, how large it is, and the floor of its noise."""

import numpy as np

from camcomp.diagnosis.fit.bench import thinned
from camcomp.diagnosis.fit.cause_sets import Fitted
from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.statistics.evidence import estimate
from camcomp.ground.datatypes import Floats


def main_channels(problem: Problem) -> slice:
    """The channels in which the gap is stated: the tip, or else the encoders, or else the drive forces."""
    *others, last = problem.bench.parts.values()
    return next((part for part in others if any(np.isfinite(r[:, part]).any() for r in problem.residuals)), last)


def gap_sizes(problem: Problem, f: Fitted) -> Floats:
    """Length (n,), um, of the gap at all known rows of all runs, with the offsets of labels from the fit f removed."""
    part, labels = main_channels(problem), problem.columns.of_labels
    offset = estimate(f.data, problem.prior, problem.member_columns(f.members))[0][labels]
    gaps = []
    for k, run in enumerate(problem.bench.runs):
        gap = problem.bench.gap(k)[:, part]
        if len(labels) and part.start == 0:
            moved = (problem.columns.blocks[k][:, labels] @ offset).reshape(-1, len(gap))[:3].T
            if run.turn is not None:  # along the path nothing is known of it
                moved = np.einsum("nji,nj->ni", thinned(run.turn[:, 1:], run.thin), moved[:, 1:])
            gap = gap - moved
        gaps.append(gap)
    size = np.sqrt(np.concatenate([square_lengths(g) for g in gaps]))
    return np.asarray(size[np.isfinite(size)] * 1e3)


def square_lengths(gap: Floats) -> Floats:
    """Squared length (n,) of a gap (n, c) over the channels that the run has; NaN where one of them is missing."""
    here = np.isfinite(gap).any(axis=0)
    return np.asarray(np.sum(gap[:, here] ** 2, axis=1)) if here.any() else np.full(len(gap), np.nan)


def floor_um(problem: Problem) -> float:
    """The floor in the channels in which the gap is stated, um."""
    part = main_channels(problem)
    if part.start == 0:
        return problem.floor.tip_um
    fast = problem.floor.fast[part]
    return 1e3 * float(np.sqrt(np.nansum(fast**2)))
