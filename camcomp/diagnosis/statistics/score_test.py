"""What do functions of a covariate explain of a residual, with causes free and every healthy tolerance allowed for?

The covariates' functions enter by their normal equations, causes and tolerances integrated out. Their joint size is compared
with what chance makes of it (Rao's score test), and their evidence at a scale is that of model/discrepancy.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cholesky, solve_triangular

from camcomp.diagnosis.statistics.by_channel import ByChannel
from camcomp.diagnosis.statistics.evidence import Gram, Prior, estimate_precision
from camcomp.ground.datatypes import Floats, Ints


@dataclass(frozen=True, eq=False)
class ResidualTest:
    """Patterns of one kind of channel: energy beyond chance in units of the kind's noise, and covariates with the share of it
    that each carries alone, largest first.
    """

    kind: str
    energy: float
    labels: tuple[tuple[str, float], ...]


@dataclass(frozen=True, eq=False, kw_only=True)
class JointProducts:
    """Products of columns (k), residual and patterns (p): data of the columns, B (k, p), h (p,), P (p, p); labels, kinds (p,).

    rows: number of white rows, each with the square of its weight.
    """

    data: Gram
    B: Floats
    h: Floats
    P: Floats
    labels: tuple[str, ...]
    kinds: tuple[str, ...]
    rows: float

    @staticmethod
    def of(
        *,
        white: Sequence[ByChannel],
        residual: Sequence[Floats],
        blocks: Sequence[Sequence[ByChannel]],
        labels: Sequence[Sequence[str]],
        kinds: Sequence[str],
        weight: Sequence[Sequence[float]] | None = None,
    ) -> JointProducts:
        """Sum over runs of white columns (w, k) and residuals (w,).

        blocks: white patterns per run and kind, whose rows follow each other in `white`. labels: covariates of the patterns
        per kind. weight: of a row, per run and kind.
        """
        k, p = white[0].width, sum(map(len, labels))
        A, B, P, rows = np.zeros((k + 1, k + 1)), np.zeros((k + 1, p)), np.zeros((p, p)), 0.0
        for run, (W, r, parts) in enumerate(zip(white, residual, blocks, strict=True)):
            joint, row, at = W.appended(r[:, None]), 0, 0
            for kind, (part, names) in enumerate(zip(parts, labels, strict=True)):
                square = 1.0 if weight is None else weight[run][kind] ** 2
                own, to = joint[row : row + len(part)], slice(at, at + len(names))
                A += square * (own.T @ own)
                B[:, to] += square * (own.T @ part)
                P[to, to] += square * (part.T @ part)
                row, at, rows = row + len(part), at + len(names), rows + square * len(part)
        of_each = tuple(kind for kind, each in zip(kinds, labels, strict=True) for _ in each)
        names = tuple(name for each in labels for name in each)
        return JointProducts(
            data=Gram(A[:k, :k], A[:k, k], float(A[k, k]), round(rows)), B=B[:k], h=B[k], P=P, labels=names,
            kinds=of_each, rows=rows,
        )  # fmt: skip

    def projected(self, prior: Prior, members: Sequence[int]) -> tuple[Floats, Floats]:
        """Normal equations (p, p), (p,) of the patterns with the columns `members` free and all others within tolerance."""
        M = self.data.A + np.diag(estimate_precision(prior, members))
        size = 1.0 / np.sqrt(np.diag(M))
        L = cholesky(size[:, None] * M * size + 1e-12 * np.eye(len(M)), lower=True)
        half = solve_triangular(L, size[:, None] * np.column_stack([self.B, self.data.b]), lower=True)
        return self.P - half[:, :-1].T @ half[:, :-1], self.h - half[:, :-1].T @ half[:, -1]


def score_test(joint: JointProducts, P: Floats, h: Floats) -> dict[str, ResidualTest]:
    """Size of the patterns of every kind against chance; P (p, p), h (p,): projected."""
    out = {}
    for kind in dict.fromkeys(joint.kinds):
        mine = np.flatnonzero(np.array(joint.kinds) == kind)
        own, b = P[np.ix_(mine, mine)], h[mine]
        energy = _explained(own, b, np.arange(len(mine)))
        out[kind] = ResidualTest(kind, energy, _shares(own, b, [joint.labels[i] for i in mine]))
    return out


def _explained(P: Floats, h: Floats, index: Ints) -> float:
    if not len(index):
        return 0.0
    size = np.sqrt(np.maximum(np.diag(P)[index], 1e-30))
    g = h[index] / size
    amount, _, freedom, _ = np.linalg.lstsq(P[np.ix_(index, index)] / size[:, None] / size, g, rcond=1e-3)
    return max(float(g @ amount) - int(freedom), 0.0)


def _shares(P: Floats, h: Floats, labels: Sequence[str]) -> tuple[tuple[str, float], ...]:
    """Energy that the patterns of one covariate carry alone, per covariate, as shares of the largest sum."""
    every = np.array(labels)
    energy = {name: _explained(P, h, np.flatnonzero(every == name)) for name in dict.fromkeys(labels)}
    whole = _explained(P, h, np.arange(len(labels)))
    if whole <= 0.0:
        return ()
    ranked = sorted(energy.items(), key=lambda each: -each[1])
    return tuple((name, min(value / whole, 1.0)) for name, value in ranked if value > 0.0)
