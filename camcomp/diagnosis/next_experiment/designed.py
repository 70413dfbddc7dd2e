"""Search for the next experiment: the best of a grid over position, plane, radius, feed, direction, load and dwell.

The objective is the information minus the price of machine time (`proposal.PRICE`), so that a short experiment with little
information does not win. The search is deterministic.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import partial

import numpy as np

from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.next_experiment.candidates import (
    Candidate,
    by_other_means,
    coarse,
    single_changes,
)  # fmt: skip
from camcomp.diagnosis.next_experiment.information_gain import predicted_gain
from camcomp.diagnosis.next_experiment.predicted_logs import Question, predict_logs
from camcomp.diagnosis.next_experiment.proposal import LEAST_BITS, Proposal, after_unknown, outcomes_of
from camcomp.diagnosis.next_experiment.ready_program import can_be_run
from camcomp.diagnosis.next_experiment.site import Site, site_of
from camcomp.diagnosis.statistics.cause_sets import Fitted
from camcomp.ground.datatypes import Floats
from camcomp.model.job import Job


def propose(problem: Problem, rivals: Sequence[Fitted], probability: Floats, job: Job) -> Proposal | None:
    """The best next experiment to separate fitted sets of causes; None if all tell less than it costs to set one up."""
    if not any(f.members for f in rivals):
        return None
    question = Question(problem, rivals, probability, job)
    separates, site = question.separates, question.site
    useful = [
        each for each in (*coarse(site), *by_other_means(site)) if all(effect in separates for effect, *_ in each.knows)
    ]
    return _best(problem, site, job, useful, partial(judged, question))


def judged(question: Question, each: Candidate) -> Proposal | None:
    """A candidate with its expected information about a question; None if it is infeasible or has no gain."""
    there = predict_logs(question, each)
    if there is None:
        return None
    found = predicted_gain(question, each, there)
    outcomes = outcomes_of(found, each, question.names)
    return Proposal(candidate=each, gain=found.gain, separates=question.separates, outcomes=outcomes)


def _best(
    problem: Problem, site: Site, job: Job, tried: Iterable[Candidate], judge: Callable[[Candidate], Proposal | None]
) -> Proposal | None:
    """The proposal of most value that tells more than it costs to set one up, of those that the machine can run."""
    bench = problem.bench
    every = [judge(each) for each in tried if site.holds(each.design.points())]
    worth = sorted((p for p in every if p is not None and p.gain > LEAST_BITS), key=lambda p: -p.value)
    return next((p for p in worth if can_be_run(p.candidate, bench.runs, job, bench.twin)), None)


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

    def judge(each: Candidate) -> Proposal:
        p = sum(weight.get(family, 0.0) for family in each.varies) / whole if whole > 0 else 0.0
        gain = -float(sum(q * np.log2(q) for q in (p, 1.0 - p) if q > 0.0))
        others = [family for family in sorted(weight, key=lambda of: -weight[of]) if family not in each.varies]
        outcomes = after_unknown([v for v in each.varies if v in weight] or each.varies, others)
        return Proposal(candidate=each, gain=gain, separates=("unknown",), outcomes=outcomes)

    site = site_of(problem.bench, job)
    return _best(problem, site, job, single_changes(site), judge)
