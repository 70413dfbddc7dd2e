"""What is left when the best causes are in: is it more than noise, and what does it depend on?

A score test on the generic patterns: with the causes free and every healthy tolerance allowed for, the patterns'
amplitudes are estimated and their joint size compared with chance. Source: Rao's score test; the threshold on the
share of the gap keeps the imperfection of a rightly named cause from passing for another one.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp
from scipy.stats import chi2

from camcomp.datatypes import Floats, Ints
from camcomp.gap.evidence import Prior

_AMPLITUDES = (1.0, 3.0, 10.0, 30.0, 100.0)  # um or N


@dataclass(frozen=True, eq=False)
class Leftover:
    """score: log10 of the chance that noise looks like this (negative); rms: size in units of the noise, pooled over
    channels; labels: covariates with their share of the leftover, largest first; channel: where most of it shows.
    """

    log10_chance: float
    z: float
    rms: float
    labels: tuple[tuple[str, float], ...]
    kind: str


@dataclass(frozen=True, eq=False)
class Projected:
    """Patterns (p) with causes and tolerances taken out: P (p, p), h (p,) normal equations, white rows, labels, kinds."""

    P: Floats
    h: Floats
    rows: int
    labels: tuple[str, ...]
    kinds: tuple[str, ...]
    own: Floats  # (p,) energy of a pattern before anything was taken out


def project(
    white: Sequence[Floats],
    patterns: Sequence[Sequence[Floats]],
    residual: Sequence[Floats],
    labels: Sequence[Sequence[str]],
    kinds: Sequence[str],
    prior: Prior,
    members: Sequence[int],
    factor: float = 1.0,
) -> Projected:
    """White (w, k), residual (w,) per run; patterns per run and kind, whose rows follow each other in `white`; labels per
    kind; members: columns that are free.
    """
    precision = prior.precision(factor)
    members = list(members)
    precision[members] = 1.0 / (10.0 * prior.scale[members]) ** 2
    k, p = white[0].shape[1], sum(len(each) for each in labels)
    A, B = np.zeros((k + 1, k + 1)), np.zeros((k + 1, p))
    P = np.zeros((p, p))
    for W, r, parts in zip(white, residual, patterns, strict=True):
        joint = np.concatenate([W, r[:, None]], axis=1)
        A += joint.T @ joint
        row = at = 0
        for part, names in zip(parts, labels, strict=True):
            B[:, at : at + len(names)] += joint[row : row + len(part)].T @ part
            P[at : at + len(names), at : at + len(names)] += part.T @ part
            row, at = row + len(part), at + len(names)
    M = A[:k, :k] + np.diag(precision)
    size = 1.0 / np.sqrt(np.diag(M))
    L = np.linalg.cholesky(size[:, None] * M * size + 1e-12 * np.eye(k))
    half = np.linalg.solve(L, size[:, None] * np.concatenate([B[:k], A[:k, k:]], axis=1))
    own = np.diag(P).copy()
    every = tuple(name for each in labels for name in each)
    of_kind = tuple(kind for kind, each in zip(kinds, labels, strict=True) for _ in each)
    return Projected(
        P - half[:, :p].T @ half[:, :p], B[k] - half[:, :p].T @ half[:, p], sum(len(r) for r in residual), every, of_kind, own
    )


def score_test(left: Projected) -> Leftover:
    """Joint size of all patterns against chance."""
    P, h = left.P, left.h
    if not len(h):
        return Leftover(0.0, 0.0, 0.0, (), "tip")
    scale = np.sqrt(np.maximum(np.diag(P), 1e-30))
    usable = np.diag(P) > 1e-6 * np.maximum(left.own, 1e-30)
    value, vector = np.linalg.eigh((P / scale[:, None] / scale)[np.ix_(usable, usable)])
    keep = value > 1e-3
    z = (vector[:, keep] / np.sqrt(value[keep])).T @ (h[usable] / scale[usable])
    dof, total = int(keep.sum()), float(z @ z)
    shares = _shares(P, h, left.labels)
    kind = _kind(P, h, left.labels, left.kinds, shares[0][0] if shares else "")
    return Leftover(
        float(chi2.logsf(total, max(dof, 1)) / np.log(10.0)),
        (total - dof) / np.sqrt(2.0 * max(dof, 1)),
        float(np.sqrt(max(total - dof, 0.0) / left.rows)),
        shares,
        kind,
    )


def unknown_evidence(left: Projected) -> dict[str, float]:
    """Log Bayes factor of an unknown effect that depends on one covariate, per covariate, against none."""
    every = np.array(left.labels)
    out = {}
    for name in dict.fromkeys(left.labels):
        index = np.flatnonzero(every == name)
        P, h = left.P[np.ix_(index, index)], left.h[index]
        value, vector = np.linalg.eigh(P)
        value, z = np.maximum(value, 0.0), vector.T @ h
        logs = [0.5 * np.sum(z**2 / (value + 1 / t**2)) - 0.5 * np.sum(np.log1p(t**2 * value)) for t in _AMPLITUDES]
        out[name] = float(logsumexp(logs) - np.log(len(logs)))
    return out


def _explained(P: Floats, h: Floats, index: Ints) -> float:
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
