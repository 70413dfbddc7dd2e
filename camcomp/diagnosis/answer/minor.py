"""Effects of a fit with shrinkage that are listed apart from the causes, because they are below MINOR."""

from __future__ import annotations

from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.model.noise import HEALTHY
from camcomp.diagnosis.result.types import MinorEffect
from camcomp.diagnosis.statistics.cause_sets import Fitted
from camcomp.diagnosis.statistics.evidence import estimate

MOST_LISTED = 8  # minor effects, or drivers of a gap


def minor_effects(problem: Problem, f: Fitted) -> tuple[MinorEffect, ...]:
    """Effects of a fit with shrinkage that are no causes, largest first."""
    mean, _ = estimate(f.data, problem.prior, problem.member_columns(f.members))
    found = []
    for i, (candidate, columns) in enumerate(zip(problem.columns.candidates, problem.candidates.columns, strict=True)):
        if i in f.members or not columns:
            continue
        index = list(columns)
        size = problem.size_um(index, mean[index])
        if size > HEALTHY * problem.floor.tip_um:
            found.append(MinorEffect(effect=candidate.name, target=candidate.target, size_um=round(size, 3)))
    return tuple(sorted(found, key=lambda each: -each.size_um)[:MOST_LISTED])
