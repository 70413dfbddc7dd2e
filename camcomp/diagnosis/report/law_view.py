"""Data for the plot of a law in the report."""

from __future__ import annotations

import numpy as np

from camcomp.diagnosis.fit.bench import thinned
from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.law.bench_terms import Spot
from camcomp.diagnosis.law.law_answer import LawAnswer, term_bench
from camcomp.diagnosis.report.law_section import LawView
from camcomp.ground.datatypes import Floats

MICRO = 1e3  # mm -> um


def law_view(problem: Problem, answer: LawAnswer) -> LawView:
    """Residuals over the first covariate of the law, along the axis of the tip with its largest effect."""
    bench = problem.bench
    part = answer.law.parts[0]
    drive = part.target is not None
    index = bench.actuators.index(part.target) if part.target is not None else 0
    rows = term_bench(problem).rows(Spot(part.stage if drive else "structure", index))
    covariate = next(iter(part.envelope))
    axis = int(np.argmax(np.sum([np.sum(s**2, axis=0) for s in answer.signal], axis=0)))
    runs, sizes = [], []
    every = zip(bench.runs, rows, answer.before, answer.gaps, answer.signal, strict=True)
    for run, own, before, gap, signal in every:
        x = thinned(own[covariate][:, None], run.thin)[:, 0]
        runs.append((run.name, x, MICRO * gap[:, axis], MICRO * signal[:, axis]))
        sizes.append((_rms(before), _rms(gap - signal)))
    return LawView(covariate, "xyz"[axis], tuple(runs), np.array(sizes))


def _rms(gap: Floats) -> float:
    known = np.isfinite(gap).any(axis=1)
    return MICRO * float(np.sqrt(np.mean(np.nansum(gap[known] ** 2, axis=1)))) if known.any() else 0.0
