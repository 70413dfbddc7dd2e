"""What is left when the best causes are in: is it more than noise, and what does it depend on?

A score test on the generic patterns: with the causes free and every healthy tolerance allowed for, the patterns'
amplitudes are estimated and their joint size compared with chance. Source: Rao's score test; the threshold on the
share of the gap keeps the imperfection of a rightly named cause from passing for another one.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from camcomp.datatypes import Floats
from camcomp.gap.evidence import Prior


@dataclass(frozen=True, eq=False)
class Leftover:
    """score: log10 of the chance that noise looks like this (negative); rms: size in units of the noise, pooled over
    channels; labels: covariates with their share of the leftover, largest first; channel: where most of it shows."""

    log10_chance: float
    z: float
    rms: float
    labels: tuple[tuple[str, float], ...]
    kind: str
    signal: tuple[Floats, ...]  # per run: white rows of the leftover that patterns carry


def score_test(
    white: Sequence[Floats],
    patterns: Sequence[Floats],
    residual: Sequence[Floats],
    labels: Sequence[str],
    kinds: Sequence[str],
    prior: Prior,
    members: Sequence[int],
    factor: float = 1.0,
) -> Leftover:
    """white (w, k), patterns (w, p), residual (w,) per run; members: columns that are free."""
    precision = prior.precision(factor)
    members = list(members)
    precision[members] = 1.0 / (10.0 * prior.scale[members]) ** 2
    k = white[0].shape[1]
    joint = [np.concatenate([W, P, r[:, None]], axis=1) for W, P, r in zip(white, patterns, residual, strict=True)]
    A = sum(J.T @ J for J in joint)
    M = A[:k, :k] + np.diag(precision)
    size = 1.0 / np.sqrt(np.diag(M))
    L = np.linalg.cholesky(size[:, None] * M * size + 1e-12 * np.eye(k))
    half = np.linalg.solve(L, size[:, None] * A[:k, k:])
    S = A[k:, k:] - half.T @ half
    P, h = S[:-1, :-1], S[:-1, -1]
    scale = np.sqrt(np.maximum(np.diag(P), 1e-30))
    usable = np.diag(P) > 1e-6 * np.maximum(np.diag(A)[k:-1], 1e-30)
    value, vector = np.linalg.eigh((P / scale[:, None] / scale)[np.ix_(usable, usable)])
    keep = value > 1e-3
    z = (vector[:, keep] / np.sqrt(value[keep])).T @ (h[usable] / scale[usable])
    # Within the span of many weak patterns only the strongest directions matter for the size.
    dof, total = int(keep.sum()), float(z @ z)
    rows = int(sum(len(r) for r in residual))
    amplitude = np.zeros(len(h))
    amplitude[usable] = (vector[:, keep] @ (z / np.sqrt(value[keep]))) / scale[usable]
    shares = _shares(P, h, labels)
    strongest = shares[0][0] if shares else ""
    kind = _kind(P, h, labels, kinds, strongest)
    return Leftover(
        float(chi2.logsf(total, max(dof, 1)) / np.log(10.0)),
        (total - dof) / np.sqrt(2.0 * max(dof, 1)),
        float(np.sqrt(max(total - dof, 0.0) / rows)),
        shares,
        kind,
        tuple(P_ @ amplitude for P_ in patterns),
    )


def _explained(P: Floats, h: Floats, index: Floats) -> float:
    if not len(index):
        return 0.0
    size = np.sqrt(np.maximum(np.diag(P)[index], 1e-30))
    block = P[np.ix_(index, index)] / size[:, None] / size + 1e-3 * np.eye(len(index))
    g = h[index] / size
    return max(float(g @ np.linalg.solve(block, g)) - len(index), 0.0)


def _shares(P: Floats, h: Floats, labels: Sequence[str]) -> tuple[tuple[str, float], ...]:
    """Energy that the patterns of one covariate carry alone, per covariate, as shares of the largest sum."""
    names = list(dict.fromkeys(labels))
    every = np.array(labels)
    energy = {name: _explained(P, h, np.flatnonzero(every == name)) for name in names}
    whole = _explained(P, h, np.arange(len(labels)))
    if whole <= 0.0:
        return ()
    ranked = sorted(energy.items(), key=lambda each: -each[1])
    return tuple((name, min(value / whole, 1.0)) for name, value in ranked if value > 0.0)


def _kind(P: Floats, h: Floats, labels: Sequence[str], kinds: Sequence[str], label: str) -> str:
    best, most = "tip", -1.0
    for kind in dict.fromkeys(kinds):
        index = np.array([i for i, (a, b) in enumerate(zip(labels, kinds, strict=True)) if a == label and b == kind], int)
        value = _explained(P, h, index)
        if value > most:
            best, most = kind, value
    return best
