"""Search for the next experiment: the best of a grid over position, plane, radius, feed, direction, load and dwell.

The objective is the information minus the price of machine time (`proposal.PRICE`), so that a short experiment with little
information does not win. The search is deterministic.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import islice

import numpy as np

from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.next_experiment.candidates import (
    Candidate,
    by_other_means,
    coarse,
    single_changes,
)  # fmt: skip
from camcomp.diagnosis.next_experiment.information_gain import most_narrowed, predicted_gain
from camcomp.diagnosis.next_experiment.predicted_logs import Question, predict_logs
from camcomp.diagnosis.next_experiment.proposal import LEAST_BITS, Proposal, after_unknown
from camcomp.diagnosis.next_experiment.ready_program import can_be_run
from camcomp.diagnosis.next_experiment.site import site_of
from camcomp.diagnosis.statistics.cause_sets import Fitted
from camcomp.ground.datatypes import Floats
from camcomp.model.job import Job

MOST_JUDGED_WHOLE = 3  # best designs evaluated with every effect of the library within its tolerance


def judged(question: Question, each: Candidate, *, whole: bool = False) -> Proposal | None:
    """A candidate with its expected information about a question; None if it is infeasible or has no gain."""
    there = predict_logs(question, each, whole=whole)
    if there is None:
        return None
    found = predicted_gain(question, each, there, question.weight)
    separates = separated(question.problem, question.rivals)
    return Proposal(candidate=each, gain=found.gain, separates=separates, told=found)


def separated(problem: Problem, rivals: Sequence[Fitted]) -> tuple[str, ...]:
    """Effects in some rivals but not in all; for a single set all of its effects."""
    sets = [set(f.members) for f in rivals]
    common = set.intersection(*sets) if len(sets) > 1 else set()
    return tuple(dict.fromkeys(problem.columns.candidates[i].name for s in sets for i in sorted(s - common)))


def propose(problem: Problem, rivals: Sequence[Fitted], probability: Floats, job: Job) -> Proposal | None:
    """The best next experiment to separate fitted sets of causes; None if all tell less than it costs to set one up."""
    if not any(f.members for f in rivals):
        return None
    question = Question(problem, rivals, probability, job)
    if len(rivals) == 1 and most_narrowed(question, question.weight) <= LEAST_BITS:
        return None
    found = ranked(question, (*coarse(question.site), *by_other_means(question.site)))
    bench = problem.bench
    can = (each for each in found if can_be_run(each.candidate, bench.runs, job, bench.twin))
    whole = [judged(question, each.candidate, whole=True) for each in islice(can, MOST_JUDGED_WHOLE)]
    worth = [each for each in whole if each is not None and each.tells]
    return max(worth, key=lambda each: each.value, default=None)


def ranked(question: Question, tried: Iterable[Candidate]) -> list[Proposal]:
    """Candidates that tell more than it costs to set one up, best first."""
    names = separated(question.problem, question.rivals)
    useful = (each for each in tried if all(effect in names for effect, *_ in each.knows))
    every = (judged(question, each) for each in useful if question.site.holds(each.design.points()))
    found = [each for each in every if each is not None and each.tells]
    return sorted(found, key=lambda each: -each.value)


def explore(problem: Problem, labels: Sequence[tuple[str, float]], job: Job) -> Proposal | None:
    """The experiment with the largest gain about the covariate of an unknown effect, or None.

    A run in which some covariates of the residual change shows whether the true one is among them: its gain is the entropy
    of that outcome, bits. labels: covariates (`time:x`) with the share of the residual that each explains alone.
    """
    weight: dict[str, float] = {}
    for name, share in labels:
        family = name.partition(":")[0]
        weight[family] = max(weight.get(family, 0.0), share)
    whole = sum(weight.values())
    found = []
    bench, site = problem.bench, site_of(problem.bench, job)
    for each in single_changes(site):
        p = sum(weight.get(family, 0.0) for family in each.varies) / whole if whole > 0 else 0.0
        gain = -float(sum(q * np.log2(q) for q in (p, 1.0 - p) if q > 0.0))
        others = [family for family in sorted(weight, key=lambda of: -weight[of]) if family not in each.varies]
        outcomes = after_unknown([v for v in each.varies if v in weight] or each.varies, others)
        found.append(Proposal(candidate=each, gain=gain, separates=("unknown",), outcomes=outcomes))
    found = sorted((each for each in found if each.tells), key=lambda each: -each.value)
    can = (each for each in found if can_be_run(each.candidate, bench.runs, job, bench.twin))
    return next((each for each in can if site.holds(each.candidate.design.points())), None)
