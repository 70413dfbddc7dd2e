"""How sure is a cause where something unmodelled may act, instead of it or jointly with it?

Hypotheses h: nothing unmodelled, functions of one covariate at one scale, or a process over the time of every run, smooth or
with jumps.
With S the parts of a set of causes,

    P(cause i) = sum_(S has i, h) p(S, h) / sum_(S, h) p(S, h),      log p(S, h) = log evidence(S, h) / T + log prior(S, h)

A cause has to be sure beside every kind of discrepancy: its probability is the lowest one. A covariate whose functions
do the same as the cause, within MODELLED of its size, is the cause under another name.

Sources: Hoeting et al., Statistical Science 14 (1999) 382; Kennedy, O'Hagan, J. R. Statist. Soc. B 63 (2001) 425.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import log

import numpy as np
from scipy.linalg import block_diag
from scipy.special import logsumexp

from camcomp.diagnosis.fit.cause_sets import Fitted, Scale, parts_of
from camcomp.diagnosis.fit.patterns import KINDS
from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.model.discrepancy import UNKNOWN, gains_at_scales
from camcomp.diagnosis.model.imitation import probability_with_unmodelled
from camcomp.diagnosis.model.noise import MINOR
from camcomp.diagnosis.search.unknown import joint_products, process_in_time
from camcomp.diagnosis.statistics.evidence import posterior
from camcomp.diagnosis.statistics.normal_equations import NormalEquations
from camcomp.diagnosis.statistics.probability import TEMPERATURE
from camcomp.ground.datatypes import Floats, Ints

MODELLED = 0.1  # of what causes explain: none is modelled better than that


def credibility(problem: Problem, f: Fitted, *, surely: bool) -> tuple[dict[int, float], dict[int, float]]:
    """Of every member of f: its probability, and that of something unmodelled in its place.

    surely: whether something unmodelled acts for certain.
    """
    members = f.members
    if not members:
        return {}, {}
    weight = _weights(problem)
    joint, k = joint_products(problem, f, weight), len(problem.columns.names)
    data = NormalEquations(joint.A[:k, :k], joint.b[:k], joint.c, joint.rows)
    alone = _alone(problem, f, data, log(1.0 - UNKNOWN))
    kinds = [_with_covariates(problem, f, joint, alone, weight)]
    for power in (2.0, 1.0):
        scales = process_in_time(problem, f, weight, power)
        prior = log(UNKNOWN) - log(len(scales))
        beside = [each for data in scales for each in _alone(problem, f, data, prior)]
        kinds.append([replace(each, unmodelled=True) for each in beside])
    each_kind = [_present_and_replaced([*kind, *(() if surely else alone)]) for kind in kinds if kind]
    present, replaced = np.min([p for p, _ in each_kind], axis=0), np.max([r for _, r in each_kind], axis=0)
    return dict(zip(members, present.tolist(), strict=True)), dict(zip(members, replaced.tolist(), strict=True))


def _present_and_replaced(found: Sequence[_Hypothesis]) -> tuple[Floats, Floats]:
    """Of every member (d,): the probability that it acts, and that something unmodelled acts in its place."""
    value = np.array([each.evidence / TEMPERATURE + each.prior for each in found])
    p = np.exp(value - logsumexp(value))
    there = np.array([each.there for each in found])
    return p @ there, (p * [each.unmodelled for each in found]) @ (1.0 - there)


@dataclass(frozen=True)
class _Hypothesis:
    """A part of a set, with something unmodelled or without: log evidence, log prior, which members of the whole set act."""

    evidence: float
    prior: float
    there: tuple[float, ...]
    unmodelled: bool = False


def _alone(problem: Problem, f: Fitted, data: NormalEquations, prior: float) -> list[_Hypothesis]:
    """Every part of a set by normal equations; prior: log prior of what these hold beside the set."""
    scale, out = Scale(data, problem.prior, problem.candidates), []
    for some in parts_of(f.members):
        there = tuple(float(i in some) for i in f.members)
        out.append(_Hypothesis(scale(some), problem.candidates.prior(some) + prior, there))
    return out


def _with_covariates(
    problem: Problem, f: Fitted, joint: NormalEquations, alone: Sequence[_Hypothesis], weight: Sequence[Floats]
) -> list[_Hypothesis]:
    """Every part of a set jointly with functions of every covariate."""
    columns, theta, k = problem.candidates.columns, _thetas(problem, f), len(problem.columns.names)
    groups = _covariates_with_units(problem, joint, weight)
    prior = log(UNKNOWN / (1.0 - UNKNOWN)) - log(max(len(groups), 1))
    out = []
    for some, own in zip(parts_of(f.members), alone, strict=True):
        blocks = posterior(joint, problem.prior, problem.member_columns(some)).blocks_without(
            [k + g for g, _ in groups]
        )
        for (g, unit), block in zip(groups, blocks, strict=True):
            gains, amount = gains_at_scales(*block, unit)
            there = tuple(
                has or float(_is_alike(joint.A, [*columns[i], *(k + g)], theta[i], amount))
                for has, i in zip(own.there, f.members, strict=True)
            )
            gain = float(logsumexp(gains)) - float(np.log(len(gains)))
            out.append(_Hypothesis(own.evidence + gain, own.prior + prior, there, unmodelled=True))
    return out


def _thetas(problem: Problem, f: Fitted) -> dict[int, Floats]:
    """Coordinates of every member."""
    ends = np.cumsum([len(problem.candidates.columns[i]) for i in f.members])[:-1]
    return dict(zip(f.members, np.split(f.theta, ends), strict=True))


def _covariates_with_units(
    problem: Problem, joint: NormalEquations, weight: Sequence[Floats]
) -> list[tuple[Ints, float]]:
    """Patterns (q,) of every covariate that has any, and the scale at which their rms over all rows is that of the noise."""
    energy = np.diag(joint.A)[len(problem.columns.names) :]
    rows = sum(float((w**2).sum()) for w in weight)  # white ones, each with its squared weight
    groups = [g for g in covariates(problem.dictionary.labels) if energy[g].any()]
    return [(g, float(np.sqrt(rows / energy[g].sum()))) for g in groups]


def with_unmodelled(problem: Problem, f: Fitted, excess_um: float) -> dict[int, float]:
    """Of every member of f: its probability where an excess residual (um at the tip) is unmodelled for certain."""
    if not f.members:
        return {}
    weight = _weights(problem)
    joint = joint_products(problem, f, weight)
    functions = dict[str, tuple[float, Ints]]()
    groups, k = _covariates_with_units(problem, joint, weight), len(problem.columns.names)
    at = posterior(joint, problem.prior, problem.member_columns(f.members))
    blocks = at.blocks_without([k + g for g, _ in groups])
    for n, ((g, unit), block) in enumerate(zip(groups, blocks, strict=True)):
        gains = gains_at_scales(*block, unit)[0]
        functions[str(n)] = float(logsumexp(gains)) - log(len(gains)), np.concatenate([[0], 1 + g])
    out, columns = {}, problem.candidates.columns
    for i, theta in _thetas(problem, f).items():
        others, own, size = tuple(j for j in f.members if j != i), columns[i], problem.moved_um(f, (i,))
        beside = posterior(joint, problem.prior, problem.member_columns(others), own)
        gram, _ = beside.blocks_without([np.array([*own, *range(k, len(joint.b))])])[0]
        effect = block_diag(theta[:, None], np.eye(len(joint.b) - k))
        products = effect.T @ gram @ effect  # of what the cause does, and of functions, with all else within tolerance
        products *= size**2 / float(theta @ joint.A[np.ix_(own, own)] @ theta)  # as mean squares at the tip
        odds = problem.candidates.prior(f.members) - problem.candidates.prior(others)
        out[i] = probability_with_unmodelled(
            size, {name: (gain, products[np.ix_(on, on)]) for name, (gain, on) in functions.items()},
            rows=1.0, excess=excess_um, floor=problem.floor.tip_um, odds=odds,
        )  # fmt: skip
    return out


def covariates(labels: Sequence[str]) -> list[Ints]:
    """Patterns (q,) of every covariate: of one actuator or axis, of all of them, and all that one of them does."""
    words = [name.split(":") for name in labels]
    sorts = [list(labels), [word for word, _ in words], [target for _, target in words]]
    return [np.flatnonzero(np.array(names) == each) for names in sorts for each in dict.fromkeys(names)]


def _is_alike(gram: Floats, on: Sequence[int], theta: Floats, amount: Floats) -> bool:
    """Whether the last of the columns `on`, with amplitudes (q,), do the same as the first at coordinates theta (d,)."""
    own, apart = (np.concatenate([theta, sign * amount]) for sign in (0.0, -1.0))
    A = gram[np.ix_(on, on)]
    return float(apart @ A @ apart) < MODELLED**2 * float(own @ A @ own)


def _weights(problem: Problem) -> list[Floats]:
    """Weights (w,) of the white rows per run: none counts for more than MINOR floors at the tip.

    An encoder resolves a hundredth of it, and every model is wrong by more.
    """
    noise_um, most = 1e3 * problem.noise.sigma * problem.bench.tip_sizes, MINOR * problem.floor.tip_um
    for kind in KINDS:
        part = problem.channels_of(kind)
        for own in noise_um:
            own[part] = np.median(own[part][own[part] > 0.0]) if (own[part] > 0.0).any() else np.inf
    return [np.minimum(own / most, 1.0)[problem.row_cells(k)[0]] for k, own in enumerate(noise_um)]
