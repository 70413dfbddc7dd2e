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
from camcomp.diagnosis.statistics.evidence import Prior, estimate_precision
from camcomp.diagnosis.statistics.normal_equations import NormalEquations
from camcomp.ground.datatypes import Floats, Ints

Shares = tuple[tuple[str, float], ...]  # covariates with the share that each carries alone, largest first


@dataclass(frozen=True, eq=False, kw_only=True)
class JointProducts:
    """Products of columns (k), residual and patterns (p): data of the columns, B (k, p), h (p,), P (p, p); labels, kinds (p,).

    rows: number of white rows, each with the square of its weight.
    """

    data: NormalEquations
    B: Floats
    h: Floats
    P: Floats
    labels: tuple[str, ...]
    kinds: tuple[str, ...]
    rows: float

    @staticmethod
    def of(
        white: Sequence[ByChannel], residual: Sequence[Floats], patterns: Sequence[ByChannel], labels: Sequence[str],
        kinds: Sequence[str], weight: Sequence[Floats],
    ) -> JointProducts:  # fmt: skip
        """Sum over runs of white columns (w, k), residuals (w,) and patterns (w, p); weight (w,): of the rows."""
        k, whole = white[0].width, np.zeros((white[0].width + len(labels) + 1,) * 2)
        for W, r, D, w in zip(white, residual, patterns, weight, strict=True):
            own = ByChannel.joined([W, D]).appended(r[:, None]).scaled(w)
            whole += own.T @ own
        rows = float(sum((w**2).sum() for w in weight))
        return JointProducts(
            data=NormalEquations(whole[:k, :k], whole[:k, -1], float(whole[-1, -1]), round(rows)), B=whole[:k, k:-1], h=whole[k:-1, -1],
            P=whole[k:-1, k:-1], labels=tuple(labels), kinds=tuple(kinds), rows=rows,
        )  # fmt: skip

    def projected(self, prior: Prior, members: Sequence[int]) -> tuple[Floats, Floats]:
        """Normal equations (p, p), (p,) of the patterns with the columns `members` free and all others within tolerance."""
        M = self.data.A + np.diag(estimate_precision(prior, members))
        size = 1.0 / np.sqrt(np.diag(M))
        L = cholesky(size[:, None] * M * size + 1e-12 * np.eye(len(M)), lower=True)
        half = solve_triangular(L, size[:, None] * np.column_stack([self.B, self.data.b]), lower=True)
        return self.P - half[:, :-1].T @ half[:, :-1], self.h - half[:, :-1].T @ half[:, -1]


def score_test(joint: JointProducts, P: Floats, h: Floats) -> dict[str, Shares]:
    """Shares of the energy beyond chance of the patterns of every kind of channel, the kind with most of it first.

    P (p, p), h (p,): projected.
    """
    found = []
    for kind in dict.fromkeys(joint.kinds):
        mine = np.flatnonzero(np.array(joint.kinds) == kind)
        own, b = P[np.ix_(mine, mine)], h[mine]
        found.append((explained(own, b, np.arange(len(mine))), kind, _shares(own, b, [joint.labels[i] for i in mine])))
    return {kind: shares for _, kind, shares in sorted(found, key=lambda each: -each[0])}


def explained(P: Floats, h: Floats, index: Ints) -> float:
    """Energy beyond chance, in units of the noise, of some patterns."""
    if not len(index):
        return 0.0
    size = np.sqrt(np.maximum(np.diag(P)[index], 1e-30))
    g = h[index] / size
    amount, _, freedom, _ = np.linalg.lstsq(P[np.ix_(index, index)] / size[:, None] / size, g, rcond=1e-3)
    return max(float(g @ amount) - int(freedom), 0.0)


def _shares(P: Floats, h: Floats, labels: Sequence[str]) -> Shares:
    """Energy that the patterns of one covariate carry alone, per covariate, as shares of the largest sum."""
    every = np.array(labels)
    energy = {name: explained(P, h, np.flatnonzero(every == name)) for name in dict.fromkeys(labels)}
    whole = explained(P, h, np.arange(len(labels)))
    if whole <= 0.0:
        return ()
    ranked = sorted(energy.items(), key=lambda each: -each[1])
    return tuple((name, min(value / whole, 1.0)) for name, value in ranked if value > 0.0)
