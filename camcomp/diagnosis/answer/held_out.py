"""Runs that took no part in the fit: the causes that are named without a run, for what is chosen on a run has seen it, how far
these shrink the gap there, and the nuisances that were re-fitted.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from camcomp.diagnosis.answer.unseen import JudgedRun, unseen_shrinkage
from camcomp.diagnosis.fit.bench import Bench, CandidateCause, Run
from camcomp.diagnosis.fit.cause_sets import Fitted, Scale, parts_of, temperature_of
from camcomp.diagnosis.fit.columns import candidate_columns
from camcomp.diagnosis.fit.gap import floor_um, main_channels, square_lengths
from camcomp.diagnosis.fit.labels import EFFECT_OF, apart
from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.model.classes import MOST_SETS
from camcomp.diagnosis.model.evidence import Members
from camcomp.diagnosis.model.folds import without_nuisances
from camcomp.diagnosis.result.types import UnseenShrinkage
from camcomp.ground import shelf
from camcomp.ground.datatypes import Floats
from camcomp.model.effect import Cause


def causes_without(
    problem: Problem, best: Fitted, fits: Sequence[Fitted], probability: Floats
) -> list[dict[int, Cause]]:
    """Causes by candidate that are chosen and fitted without a run, for every run.

    best: the answer; fits, probability: the sets that rivalled it. Looked at are the answer, what is left of it without some of
    its members, and the likeliest sets that are no larger; Stone, Journal of the Royal Statistical Society B 36 (1974) 111.
    """
    runs = range(len(problem.bench.runs))
    if len(runs) == 1 or not best.members:
        return [_by_candidate(problem, best, best.members, best.theta)] * len(runs)
    ranked, own = [fits[j] for j in np.argsort(-probability)], set(best.members)
    # neither a part of the best one, which is tried anyway, nor a larger one
    rivals = [f for f in ranked if not set(f.members) <= own and len(f.members) <= len(own)][:MOST_SETS]
    tried = [(best, part) for part in parts_of(best.members)] + [(f, f.members) for f in rivals]
    temperature = temperature_of(best, problem.prior, problem.member_columns(best.members))

    def value(k: int, f: Fitted, members: Members) -> float:
        scale = Scale(f.without(k), problem.prior, problem.candidates)
        return scale((*members, *f.minor)) / temperature + problem.candidates.prior(members, f.minor)

    out = []
    for k in runs:
        f, members = max(tried, key=lambda each: value(k, *each))
        out.append(_by_candidate(problem, f, members, problem.determined_without(f, k, members)[0]))
    return out


def _by_candidate(problem: Problem, f: Fitted, members: Members, theta: Floats) -> dict[int, Cause]:
    return dict(zip(members, problem.causes(members, theta, f.extra), strict=True))


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
