"""How large is the residual of a set of causes, on which covariates does it depend, and is it an effect outside of the
library?
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.linalg import eigh

from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.model.discrepancy import LENGTHS, ROWS_OF_PROCESS, SCALES
from camcomp.diagnosis.statistics.by_channel import ByChannel
from camcomp.diagnosis.statistics.cause_sets import Fitted
from camcomp.diagnosis.statistics.evidence import Gram, Prior
from camcomp.diagnosis.statistics.score_test import JointProducts, ResidualTest, score_test
from camcomp.ground.datatypes import Floats, Ints


def residual_tests(problem: Problem, f: Fitted, prior: Prior) -> dict[str, ResidualTest]:
    """Score test on the residual of a set, per kind of channel; prior: of all other columns."""
    joint = joint_products(problem, f)
    return score_test(joint, *joint.projected(prior, problem.member_columns(f.members)))


def joint_products(problem: Problem, f: Fitted, weight: Sequence[Floats] | None = None) -> JointProducts:
    """Products of columns, residual and functions of covariates about a fit; weight: of the rows (w,), per run."""
    white, residual = about(problem, f)
    return JointProducts.of(
        white, residual, patterns=problem.white_patterns, labels=problem.dictionary.labels, kinds=problem.dictionary.kinds,
        weight=[np.ones(len(r)) for r in residual] if weight is None else weight,
    )  # fmt: skip


def process_in_time(problem: Problem, f: Fitted, weight: Sequence[Floats], power: float) -> list[tuple[Gram, float]]:
    """Normal equations about a fit with a process over the time of every run in the first kind of channel, and the log of its
    size, at every scale of model/discrepancy.

    weight: of the rows (w,), per run. power: of the distance in the logarithm of the correlation, 2 of a smooth process, 1 of one
    with jumps from row to row.
    """
    k, scales = len(problem.columns.names), len(LENGTHS["time"]) * len(SCALES)
    A, log_size = np.zeros((scales, k + 1, k + 1)), np.zeros(scales)
    for run, (W, r) in enumerate(zip(*about(problem, f), strict=True)):
        own, channels = W.appended(r[:, None]).scaled(weight[run]), np.unique(problem.row_cells(run)[0])
        first = sum(problem.kind_of(c) == problem.kind_of(channels[0]) for c in channels)
        _add_process(A, log_size, own.parts[:first], problem.row_places(run), power)
        rest = ByChannel(k + 1, own.parts[first:])
        A += rest.T @ rest
    rows = round(sum(float((w**2).sum()) for w in weight))
    return [
        (Gram(each[:k, :k], each[:k, k], float(each[k, k]), rows), float(log))
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


def about(problem: Problem, f: Fitted) -> tuple[list[ByChannel], list[Floats]]:
    """White columns and residual (absolute coordinates) linearised at the fit."""
    if not f.members:
        return problem.white, problem.white_residual
    return problem.white_at(f), list(f.residual)


def firm_prior(problem: Problem) -> Prior:
    """The prior to describe an unknown effect with: everything else is as stated, and no tolerance stretches to follow it."""
    return replace(problem.prior, tolerance=1e-3 * problem.prior.tolerance)
