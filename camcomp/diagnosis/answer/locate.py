"""The gap of every run in the channels that its place is judged by."""

from collections.abc import Sequence

import numpy as np

from camcomp.diagnosis.fit.bench import thinned
from camcomp.diagnosis.fit.gap import main_channels
from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.model.noise import REPEATABILITY_MM
from camcomp.diagnosis.statistics import places
from camcomp.diagnosis.statistics.noise_model import effective_rows
from camcomp.model.effect import Cause


def run_gaps(problem: Problem, causes: Sequence[Cause] = ()) -> list[places.RunGap]:
    """Every run's gap, or what causes leave of it, in the main channels."""
    part = main_channels(problem)
    m = len(problem.bench.actuators)
    out = []
    for k, run in enumerate(problem.bench.runs):
        gap = problem.bench.gap(k, causes)[:, part]
        noise = problem.noise.sigma[k, part]
        thin = float(np.mean([1.0 / effective_rows(problem.noise, c, 1) for c in range(part.start, part.stop)]))
        line = thinned(run.measured.line, run.thin)
        if part.start == 0:
            slope = problem.bench.thin_slopes[k]
            clean = np.where(np.isfinite(gap), gap, 0.0)
            drives = np.einsum("nij,nj->ni", np.linalg.pinv(slope), clean)
        else:
            drives = gap if gap.shape[1] == m else np.zeros((len(gap), m))
        noise = np.where(np.isfinite(noise), np.hypot(noise, REPEATABILITY_MM if part.start == 0 else 0.0), 1.0)
        out.append(
            places.RunGap(
                name=run.name,
                gap=gap,
                noise=noise,
                thin=thin,
                time=problem.times[k],
                line=line,
                drives=drives,
            )
        )
    return out


def channel_axes(problem: Problem) -> list[str]:
    """Names of the main channels: x, y, z of the tip, or the actuators."""
    return ["x", "y", "z"] if main_channels(problem).start == 0 else list(problem.bench.actuators)
