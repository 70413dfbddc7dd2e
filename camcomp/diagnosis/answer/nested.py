"""What would have been named without a run: that is what the run is judged with, for what is chosen on a run has seen it."""

from collections.abc import Sequence

import numpy as np

from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.model.classes import MOST_SETS
from camcomp.diagnosis.statistics.cause_sets import Fitted, Members, Scale, parts_of, temperature_of
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
