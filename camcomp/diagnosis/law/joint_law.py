"""A law in the problem: causes are fitted and judged with it beside them, and it with them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.law.bench_terms import Spot, TermBench
from camcomp.diagnosis.law.find import FoundLaw
from camcomp.diagnosis.law.folds import Folds
from camcomp.diagnosis.law.smooth import FoundMap
from camcomp.diagnosis.search.tempering import tempering
from camcomp.diagnosis.statistics.by_channel import channel_behind_channel
from camcomp.diagnosis.statistics.cause_sets import Fitted, Members, Scale, total
from camcomp.diagnosis.statistics.evidence import Prior
from camcomp.ground.datatypes import Floats


def with_law(
    problem: Problem, bench: TermBench, found: FoundLaw | FoundMap, terms: Sequence[tuple[Spot, list[Floats]]]
) -> Problem:
    """The problem with the terms of a law as further nuisances, with the prior of its coefficients; terms: as of
    terms_of.
    """
    more, old = len(found.precision), problem.prior
    prior = Prior(
        np.concatenate([old.tolerance, found.precision**-0.5]),
        np.concatenate([old.scale, np.ones(more)]),
        np.concatenate([old.sign, np.zeros(more)]),
        np.concatenate([old.flexible, np.zeros(more)]),
        np.concatenate([old.reach, np.full(more, np.inf)]),
    )
    own = [bench.channels(spot, values) for spot, values in terms]
    blocks = tuple(
        block.appended(channel_behind_channel(np.concatenate([each[k] for each in own], axis=2)))
        for k, block in enumerate(problem.columns.blocks)
    )
    columns = replace(
        problem.columns,
        candidate=np.concatenate([problem.columns.candidate, np.full(more, -1)]),
        names=(*problem.columns.names, *(f"law.{i}" for i in range(more))),
        prior=prior,
        blocks=blocks,
    )
    white = [
        W.appended(np.concatenate([x.over(k, 0, len(W)) for x in found.columns], axis=1))
        for k, W in enumerate(problem.white)
    ]
    return replace(problem, columns=columns, white=white)


def fit_jointly(found: FoundLaw | FoundMap, folds: Folds) -> FoundLaw | FoundMap:
    """The same law with coefficients fitted jointly with another base."""
    theta, covariance = folds.coefficients(found.columns, found.precision)
    if isinstance(found, FoundMap):
        return replace(found, theta=theta[0], theta_without=theta[1:], folds=folds)
    return replace(found, theta=theta[0], covariance=covariance, theta_without=theta[1:], folds=folds)


def fit_needed(problem: Problem, members: Members) -> Fitted:
    """The fit of the members that evidence supports and that are not small; a cause named without a law may have followed it."""
    while members:
        f = problem.refit(members)
        smaller = [tuple(each for each in members if each != i) for i in members]
        scale, prior = Scale(total(f.grams), problem.prior, problem.candidates), problem.candidates.prior
        temperature, whole = tempering(problem, f), scale(members)
        odds = [(whole - scale(less)) / temperature + prior(members) - prior(less) for less in smaller]
        small = problem.small_members(f)
        if min(odds) < 0.0:
            members = smaller[int(np.argmin(odds))]
        elif small:
            members = tuple(i for i in members if i not in small)
        else:
            return f
    return problem.refit(())
