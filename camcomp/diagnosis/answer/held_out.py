"""Shrinkage of the gap on held-out runs by the named causes, and the nuisances that were re-fitted."""

from collections.abc import Mapping, Sequence

import numpy as np

from camcomp.diagnosis.answer.unseen import JudgedRun, unseen_shrinkage
from camcomp.diagnosis.fit.bench import Bench, CandidateCause, Run
from camcomp.diagnosis.fit.columns import candidate_columns
from camcomp.diagnosis.fit.gap import floor_um, main_channels, square_lengths
from camcomp.diagnosis.fit.labels import EFFECT_OF, apart
from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.model.folds import without_nuisances
from camcomp.diagnosis.result.types import UnseenShrinkage
from camcomp.diagnosis.statistics.cause_sets import Fitted
from camcomp.ground import shelf
from camcomp.ground.datatypes import Floats
from camcomp.model.effect import Cause


def shrinkage_of(problem: Problem, best: Fitted, seen: Bench, chosen: Sequence[Mapping[int, Cause]]) -> UnseenShrinkage:
    """The `shrinkage` of the result by the members of a fit, the largest one first.

    seen: the held-out runs; chosen: per run the causes by candidate, chosen and fitted without it.
    """
    part = main_channels(problem)
    free, named = _nuisances(seen, problem.bench.runs, part)
    members = sorted(best.members, key=lambda i: -problem.moved_um(best, (i,)))

    def squares(count: int) -> list[Floats]:
        """With so many members of the answer, as far as they were chosen; with all of them, all that was."""
        these = [[c for i, c in each.items() if count == len(members) or i in members[:count]] for each in chosen]
        gaps = [seen.gap(k, each)[:, part] for k, each in enumerate(these)]
        if free:  # over all runs together
            columns = np.stack([np.concatenate(each) for each in free], axis=2)
            left = without_nuisances(np.concatenate(gaps), columns)
            gaps = np.split(left, np.cumsum([len(gap) for gap in gaps])[:-1])
        return [square_lengths(gap) for gap in gaps]

    per_step = [squares(count) for count in range(len(members) + 1)]
    candidates = [problem.columns.candidates[i] for i in members]
    return unseen_shrinkage(
        [JudgedRun(each) for each in zip(*per_step, strict=True)], [(c.name, c.target) for c in candidates],
        holdout=tuple(run.name for run in seen.runs), noise_floor_um=round(floor_um(problem), 3), refitted=tuple(named),
    )  # fmt: skip


def _nuisances(seen: Bench, fitted: Sequence[Run], part: slice) -> tuple[list[list[Floats]], list[str]]:
    """Columns, per run (n, c), and names of the nuisances that only held-out runs determine: the workpiece frame of
    another clamping and the offset of another clock.
    """
    found: list[list[Floats]] = []
    named: list[str] = []
    if part.start != 0:
        return found, named
    for label, what in (("clamping", "workpiece frame"), ("clock", "clock offset")):
        effect = EFFECT_OF[label]
        every = [getattr(run, label) for run in (*fitted, *seen.runs)]
        others = [each for each in apart(every) if each in {getattr(run, label) for run in seen.runs}]
        if not others:
            continue
        columns = candidate_columns(seen, CandidateCause(effect, None, shelf.load("effects", effect)), {})
        for other in others:
            mine = [getattr(run, label) == other for run in seen.runs]
            named += [f"{what} of {run.name} ({label} {other})" for run, on in zip(seen.runs, mine, strict=True) if on]
            found += [[on * own[:, part] for own, on in zip(each, mine, strict=True)] for each in columns]
    return found, named
