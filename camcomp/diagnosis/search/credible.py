"""How sure is a cause where something unmodelled may act, instead of it or jointly with it?

Hypotheses h: nothing unmodelled, functions of one covariate at one scale, or a smooth process over the time of every run.
With S the parts of a set of causes,

    P(cause i) = sum_(S has i, h) p(S, h) / sum_(S, h) p(S, h),      log p(S, h) = log evidence(S, h) / T + log prior(S, h)

A covariate whose functions do the same as the cause, within MODELLED of its size, is the cause under another name.

Sources: Hoeting et al., Statistical Science 14 (1999) 382; Kennedy, O'Hagan, J. R. Statist. Soc. B 63 (2001) 425.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import logsumexp

from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.model.discrepancy import UNKNOWN, gains_at_scales
from camcomp.diagnosis.model.noise import MINOR
from camcomp.diagnosis.search.unknown import joint_products, smooth_in_time
from camcomp.diagnosis.statistics.cause_sets import Fitted, Members, parts_of
from camcomp.diagnosis.statistics.evidence import Gram, base, holding_back, log_bayes
from camcomp.diagnosis.statistics.score_test import JointProducts
from camcomp.ground.datatypes import Floats, Ints

MODELLED = 0.1  # of what causes explain: none is modelled better than that


@dataclass(frozen=True, eq=False)
class Credibility:
    """Of every member of a set: its probability, and that of something unmodelled in its place."""

    present: Mapping[int, float]
    replaced: Mapping[int, float]


def credibility(problem: Problem, f: Fitted, *, surely: bool, temperature: float) -> Credibility:
    """How sure the members of f are; surely: whether something unmodelled acts for certain."""
    members = f.members
    if not members:
        return Credibility({}, {})
    weight = _weights(problem)
    joint = joint_products(problem, f, weight)
    alone, groups = _alone(problem, f, joint.data), covariates(joint)
    found = _with_covariates(problem, f, joint, alone, groups)
    scales = smooth_in_time(problem, f, weight)
    for data, log_size in scales:
        found += [
            replace(each, evidence=each.evidence - log_size, unmodelled=1.0 / len(scales))
            for each in _alone(problem, f, data)
        ]
    if not surely:
        found += alone
    of_each = UNKNOWN / (len(groups) + 1)
    prior = np.array([each.unmodelled * of_each if each.unmodelled else 1.0 - UNKNOWN for each in found])
    value = np.array([each.evidence / temperature + each.prior for each in found]) + np.log(prior)
    p = np.exp(value - logsumexp(value))
    there = np.array([each.there for each in found])
    without = (p * (prior != 1.0 - UNKNOWN)) @ (1.0 - there)
    return Credibility(
        dict(zip(members, (p @ there).tolist(), strict=True)), dict(zip(members, without.tolist(), strict=True))
    )


@dataclass(frozen=True)
class _Hypothesis:
    """A part of a set: log evidence, log prior of the part, and which members of the whole set act.

    unmodelled: share of a covariate's prior probability, 0 where nothing unmodelled acts.
    """

    evidence: float
    prior: float
    there: tuple[float, ...]
    unmodelled: float = 0.0


def _alone(problem: Problem, f: Fitted, data: Gram) -> list[_Hypothesis]:
    """Every part of a set by normal equations, with nothing unmodelled in them."""
    at, columns = base(data, problem.prior), problem.candidates.columns
    out = []
    for some in parts_of(f.members):
        value = at.log_evidence - holding_back(at, problem.prior, problem.member_columns(some))
        value += float(log_bayes(at, problem.prior, [[columns[i] for i in some]])[0])
        there = tuple(float(i in some) for i in f.members)
        out.append(_Hypothesis(value, problem.candidates.prior(some), there))
    return out


def _with_covariates(
    problem: Problem, f: Fitted, joint: JointProducts, alone: Sequence[_Hypothesis], groups: Sequence[Ints]
) -> list[_Hypothesis]:
    """Every part of a set jointly with functions of every covariate."""
    columns, theta, first = problem.candidates.columns, list[Floats](), 0
    for i in f.members:
        theta.append(f.theta[first : (first := first + len(columns[i]))])
    out = []
    for some, own in zip(parts_of(f.members), alone, strict=True):
        P, h = joint.projected(problem.prior, problem.member_columns(some))
        for g in groups:
            # a scale is the rms of all rows, in units of the noise
            unit = float(np.sqrt(joint.rows / np.diag(joint.P)[g].sum()))
            gains, amount = gains_at_scales(P[np.ix_(g, g)], h[g], unit)
            there = tuple(
                has or float(_is_alike(joint, g, amount, columns[i], each))
                for has, i, each in zip(own.there, f.members, theta, strict=True)
            )
            gain = float(logsumexp(gains)) - float(np.log(len(gains)))
            out.append(_Hypothesis(own.evidence + gain, own.prior, there, 1.0))
    return out


def covariates(joint: JointProducts) -> list[Ints]:
    """Patterns (q,) of every covariate: of one actuator or axis, of all of them, and all that one of them does."""
    words = [name.split(":") for name in joint.labels]
    sorts = [list(joint.labels), [word for word, _ in words], [target for _, target in words]]
    found = [np.flatnonzero(np.array(names) == each) for names in sorts for each in dict.fromkeys(names)]
    return [g for g in found if np.diag(joint.P)[g].any()]


def _is_alike(joint: JointProducts, g: Ints, amount: Floats, columns: Members, theta: Floats) -> bool:
    """Whether functions g with amplitudes (q,) do the same as columns (d,) at coordinates theta (d,)."""
    on = np.array(columns)
    own = float(theta @ joint.data.A[np.ix_(on, on)] @ theta)
    apart = own - 2.0 * float(theta @ joint.B[np.ix_(on, g)] @ amount) + float(amount @ joint.P[np.ix_(g, g)] @ amount)
    return apart < MODELLED**2 * own


def _weights(problem: Problem) -> list[list[float]]:
    """Weight of a white row per run and kind of channel: none counts for more than MINOR floors at the tip.

    An encoder resolves a hundredth of it, and every model is wrong by more.
    """
    bench, m, out = problem.bench, len(problem.bench.actuators), []
    springs = np.array([np.inf if a.stiffness is None else a.stiffness for a in bench.twin.robot.actuators])
    for k, sigma in enumerate(problem.noise.sigma):
        way = np.sqrt(np.mean(np.sum(bench.row_slopes(k) ** 2, axis=1), axis=0))  # (m,) of the tip per way of a drive
        at_tip = {"encoder": sigma[3 : 3 + m] * way, "drive": sigma[3 + m : 3 + 2 * m] / springs * way}
        own = []
        for words in problem.dictionaries:
            seen = at_tip.get(words.kind, np.full(1, np.inf))
            size = 1e3 * float(np.median(seen[np.isfinite(seen)])) if np.isfinite(seen).any() else np.inf
            own.append(min(1.0, size / (MINOR * problem.floor.tip_um)))
        out.append(own)
    return out
