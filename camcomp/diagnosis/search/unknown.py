"""How large is the residual of a set of causes, on which covariates does it depend, and is it an effect outside of the
library?
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.linalg import eigh

from camcomp.diagnosis.fit.cause_sets import Fitted
from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.model.classes import INDISTINGUISHABLE
from camcomp.diagnosis.model.discrepancy import LENGTHS, ROWS_OF_PROCESS, SCALES, gains_at_scales
from camcomp.diagnosis.model.evidence import Members
from camcomp.diagnosis.statistics.by_channel import ByChannel
from camcomp.diagnosis.statistics.evidence import Prior, estimate, gram, posterior
from camcomp.diagnosis.statistics.normal_equations import NormalEquations, sum_grams
from camcomp.ground.datatypes import Bools, Floats, Ints

Shares = tuple[tuple[str, float], ...]  # covariates with the share that each takes alone, largest first
SEEN_SHARE = 0.1  # of the energy of the run that shows a cause best, from which on a run says something about it
CONFIRMED = 0.8  # share of its own signal that a cause beside an unknown one has to take away from unseen runs


def residual_tests(problem: Problem, f: Fitted) -> dict[str, Shares]:
    """Covariates on which the residual of a set depends, per kind of channel.

    That kind is first of which functions take most. Of every covariate: what its functions take alone, as a share of that.
    """
    prior, joint = firm_prior(problem), joint_products(problem, f, [np.ones(len(r)) for r in f.residual])
    at = posterior(joint, prior, problem.member_columns(f.members))
    labels, kinds = np.array(problem.dictionary.labels), np.array(problem.dictionary.kinds)
    found = []
    for kind in dict.fromkeys(problem.dictionary.kinds):
        mine = kinds == kind
        names = dict.fromkeys(labels[mine].tolist())
        blocks = [np.flatnonzero(mine & (labels == name)) for name in names]
        every = at.blocks_without([len(prior.tolerance) + own for own in (np.flatnonzero(mine), *blocks)])
        whole, *each = [energy_taken(*block) for block in every]
        shares = [
            (name, min(energy / whole, 1.0))
            for name, energy in zip(names, each, strict=True)
            if 0.0 < energy and whole > 0.0
        ]
        found.append((whole, kind, tuple(sorted(shares, key=lambda share: -share[1]))))
    return {kind: shares for _, kind, shares in sorted(found, key=lambda each: -each[0])}


def energy_taken(gram: Floats, moment: Floats) -> float:
    """Energy, in units of the noise, that functions take at their most probable scale; none where nothing is more probable.

    gram (q, q), moment (q,): their normal equations.
    """
    gains, amount = gains_at_scales(gram, moment)
    return max(float(2.0 * moment @ amount - amount @ gram @ amount), 0.0) if gains.max() > 0.0 else 0.0


def joint_products(problem: Problem, f: Fitted, weight: Sequence[Floats]) -> NormalEquations:
    """Normal equations of columns and, behind them, functions of covariates about a fit; weight: of the rows (w,), per run."""
    every = zip(problem.white_at(f), problem.white_patterns, f.residual, weight, strict=True)
    return sum_grams([gram(ByChannel.joined([W, D]).scaled(w), w * r) for W, D, r, w in every])


def process_in_time(problem: Problem, f: Fitted, weight: Sequence[Floats], power: float) -> list[NormalEquations]:
    """Normal equations about a fit with a process over the time of every run in the first kind of channel, at every scale of
    model/discrepancy.

    weight: of the rows (w,), per run. power: of the distance in the logarithm of the correlation, 2 of a smooth process, 1 of one
    with jumps from row to row.
    """
    k, scales = len(problem.columns.names), len(LENGTHS["time"]) * len(SCALES)
    A, log_size = np.zeros((scales, k + 1, k + 1)), np.zeros(scales)
    for run, (W, r) in enumerate(zip(problem.white_at(f), f.residual, strict=True)):
        own, channels = W.appended(r[:, None]).scaled(weight[run]), np.unique(problem.row_cells(run)[0])
        first = sum(problem.kind_of(c) == problem.kind_of(channels[0]) for c in channels)
        _add_process(A, log_size, own.parts[:first], problem.row_places(run), power)
        rest = ByChannel(k + 1, own.parts[first:])
        A += rest.T @ rest
    rows = round(sum(float((w**2).sum()) for w in weight))
    return [
        NormalEquations(each[:k, :k], each[:k, k], float(each[k, k]), rows, float(log))
        for each, log in zip(A, log_size, strict=True)
    ]


def _add_process(
    A: Floats, log_size: Floats, channels: Sequence[tuple[Ints, Floats]], places: Floats, power: float
) -> None:
    """Add products (scales, k, k) of white rows, channel behind channel at places (w,), with the process at every scale."""
    known: dict[bytes, list[tuple[Floats, Floats]]] = {}  # channels are mostly read at the same places
    first = 0
    for on, X in channels:
        place = places[first : (first := first + len(X))]
        for region in np.array_split(np.arange(len(X)), -(-len(X) // ROWS_OF_PROCESS)):
            key = place[region].tobytes()
            known[key] = known.get(key) or [
                eigh(np.exp(-((np.abs(np.subtract.outer(place[region], place[region])) / length) ** power) / power))
                for length in LENGTHS["time"]
            ]
            for i, (spread, way) in enumerate(known[key]):
                turned = way.T @ X[region]
                for j, size in enumerate(SCALES, i * len(SCALES)):
                    grown = 1.0 + size**2 * np.maximum(spread, 0.0)
                    A[j][np.ix_(on, on)] += turned.T @ (turned / grown[:, None])
                    log_size[j] += 0.5 * float(np.log(grown).sum())


def firm_prior(problem: Problem) -> Prior:
    """The prior to describe an unknown effect with: everything else is as stated, and no tolerance stretches to follow it."""
    return replace(problem.prior, tolerance=1e-3 * problem.prior.tolerance)


def foretelling(problem: Problem, f: Fitted) -> Members:
    """The members that predict a withheld run when they are fitted to the other runs; the weakest is dropped until all
    do.

    Few effects can follow an unknown one in the runs of their fit. A true cause reduces the residual of withheld runs
    as well.
    """
    members = f.members
    while members and len(problem.bench.runs) > 1:
        now = _left_unseen(problem, f, members)
        gains = [
            (CONFIRMED if followed(problem, f, i) else 0.0)
            if problem.passing(i)
            else _gain(
                _left_unseen(problem, f, tuple(each for each in members if each != i)) - now,
                _own(problem, f, members, i),
            )
            for i in members
        ]
        if min(gains) >= CONFIRMED:
            break
        least = members[int(np.argmin(gains))]
        members = tuple(each for each in members if each != least)
    return members


def followed(problem: Problem, f: Fitted, i: int) -> bool:
    """Whether the rows for which a member acts are nearer to it than to nothing, those too that count less because they are far off or unsteady.

    Other runs tell nothing of what acts for a while. A piece of what goes on all the time is found where a few rows go one
    way by chance; those between them do not.
    """
    bench, index = problem.bench, problem.member_columns((i,))
    at = problem.member_columns(f.members)
    theta = f.theta[[at.index(c) for c in index]]
    causes = problem.causes(f.members, f.theta, f.extra)
    near: list[Bools] = []
    for k in range(len(bench.runs)):
        gap = bench.difference(k, bench.read(k, causes))
        signal = (problem.columns.blocks[k][:, index] @ theta).reshape(-1, len(gap))[:3].T
        size = np.linalg.norm(signal, axis=1)
        rest = np.sum(gap[:, :3] * signal, axis=1) / np.maximum(size, 1e-12)
        there = (size > 0.0) & np.isfinite(rest)
        near.append(
            np.abs(rest[there]) < np.maximum(0.5 * size[there], np.sqrt(INDISTINGUISHABLE) * problem.floor.axis_mm)
        )
    rows = np.concatenate(near)
    return not len(rows) or float(rows.mean()) >= CONFIRMED


def _gain(change: Floats, own: Floats) -> float:
    """Share of its own signal (runs,) that a member takes away from unseen runs; no run may speak against it."""
    seen = own > SEEN_SHARE * own.max(initial=0.0)
    if not seen.any():
        return 0.0
    return min(float(change[seen].sum() / own[seen].sum()), 1.0 + float(np.min(change[seen] / own[seen])))


def _own(problem: Problem, f: Fitted, members: Members, i: int) -> Floats:
    """Squares per row (runs,) that a member explains and the other members cannot.

    Where they would take over more of it than that, the others may be what is there, and all that it does counts.
    """
    index, at = problem.member_columns((i,)), problem.member_columns(f.members)
    others = problem.member_columns(tuple(each for each in members if each != i))
    A, signal = f.data.A, np.zeros(len(problem.columns.names))
    signal[index] = f.theta[[at.index(c) for c in index]]
    alone = signal.copy()
    alone[others] -= np.linalg.solve(A[np.ix_(others, others)] + np.eye(len(others)), A[others] @ signal)
    whole, own = ([float(each @ g.A @ each) / g.rows for g in f.grams] for each in (signal, alone))
    return np.array(own if sum(own) > 0.5 * sum(whole) else whole)


def _left_unseen(problem: Problem, f: Fitted, members: Members) -> Floats:
    """Squares per row (runs,) that members of a set leave of runs that they were not fitted to.

    Beyond what the doubt about the members' amplitudes makes; frames and clocks that are a run's own are fitted to it.
    """
    index, free, out = problem.member_columns(members), problem.columns.of_labels, []
    for k, g in enumerate(f.grams):
        mean, covariance = estimate(f.without(k), problem.prior, index)
        own = mean[index]
        A, b = g.A[np.ix_(index, index)], g.b[index]
        square = own @ A @ own - 2.0 * b @ own - float(np.sum(A * covariance))
        toward = g.b[free] - g.A[free][:, index] @ own
        square -= toward @ np.linalg.lstsq(g.A[np.ix_(free, free)], toward, rcond=1e-12)[0]
        out.append((g.c + square) / g.rows)
    return np.array(out)
