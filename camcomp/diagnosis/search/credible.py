"""How sure is a cause where something unmodelled may act, instead of it or jointly with it?

Hypotheses h: nothing unmodelled, or functions of one covariate at one scale. With S the parts of a set of causes,

    P(cause i) = sum_(S has i, h) p(S, h) / sum_(S, h) p(S, h),      log p(S, h) = log evidence(S, h) / T + log prior(S, h)

A covariate whose functions do the same as the cause, within MODELLED of its size, is the cause under another name.

Sources: Hoeting et al., Statistical Science 14 (1999) 382; Kennedy, O'Hagan, J. R. Statist. Soc. B 63 (2001) 425.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp

from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.model.discrepancy import gains_at_scales
from camcomp.diagnosis.model.noise import MINOR
from camcomp.diagnosis.search.unknown import joint_products
from camcomp.diagnosis.statistics.cause_sets import Fitted, Members, parts_of
from camcomp.diagnosis.statistics.evidence import base, holding_back, log_bayes
from camcomp.diagnosis.statistics.score_test import JointProducts
from camcomp.ground.datatypes import Floats, Ints

UNMODELLED = 0.1  # prior probability of something that the library does not have
MODELLED = 0.1  # of what causes explain: none is modelled better than that


@dataclass(frozen=True, eq=False)
class Credibility:
    """Of every member of a set: its probability, and that of something unmodelled in its place."""

    present: Mapping[int, float]
    replaced: Mapping[int, float]


def credibility(problem: Problem, f: Fitted, *, surely: bool, temperature: float) -> Credibility:
    """How sure the members of f are; surely: whether something unmodelled acts for certain."""
    members, columns = f.members, problem.candidates.columns
    if not members:
        return Credibility({}, {})
    joint = joint_products(problem, f, _weights(problem))
    at, groups = base(joint.data, problem.prior), covariates(joint)
    theta, first = dict[int, Floats](), 0
    for i in members:
        theta[i] = f.theta[first : (first := first + len(columns[i]))]
    value, there, unmodelled = list[float](), list[list[float]](), list[bool]()
    for some in parts_of(members):
        index = problem.member_columns(some)
        alone = at.log_evidence - holding_back(at, problem.prior, index)
        alone += float(log_bayes(at, problem.prior, [[columns[i] for i in some]])[0])
        odds, has = problem.candidates.prior(some), [float(i in some) for i in members]
        if not surely:
            value.append(alone / temperature + odds + float(np.log(1.0 - UNMODELLED)))
            there.append(has)
            unmodelled.append(False)
        P, h = joint.projected(problem.prior, index)
        for g in groups:
            # a scale is the rms of all rows, in units of the noise
            unit = float(np.sqrt(joint.rows / np.diag(joint.P)[g].sum()))
            gains, amount = gains_at_scales(P[np.ix_(g, g)], h[g], unit)
            gain = float(logsumexp(gains)) - float(np.log(len(gains)))
            value.append((alone + gain) / temperature + odds + float(np.log(UNMODELLED / len(groups))))
            there.append(
                [
                    1.0 if own else float(_is_alike(joint, g, amount, columns[i], theta[i]))
                    for own, i in zip(has, members, strict=True)
                ]
            )
            unmodelled.append(True)
    v, m = np.array(value), np.array(there)
    p = np.exp(v - logsumexp(v))
    without = p * np.array(unmodelled)
    present = {i: float(p @ m[:, n]) for n, i in enumerate(members)}
    return Credibility(present, {i: float(without @ (1.0 - m[:, n])) for n, i in enumerate(members)})


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
