"""What is left when the best causes are in: is it more than noise, and what does it depend on?

A score test on the generic patterns: with the causes free and every healthy tolerance allowed for, the patterns'
amplitudes are estimated and their joint size compared with what chance makes of it. Source: Rao's score test.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from camcomp.diagnosis.statistics.by_channel import ByChannel
from camcomp.diagnosis.statistics.evidence import Prior
from camcomp.ground.datatypes import Floats, Ints

_TOLD = 0.01  # share of its information that a direction keeps beside the others, below which it tells of the noise's colour


@dataclass(frozen=True, eq=False)
class ResidualTest:
    """What the patterns of one kind of channel carry. rms: size beyond chance in units of the kind's noise, rows: how many
    the kind has; labels: covariates with the share of it that each carries alone, largest first.
    """

    kind: str
    rms: float
    rows: int
    labels: tuple[tuple[str, float], ...]

    @property
    def energy(self) -> float:
        """Of all rows, in units of the noise."""
        return self.rms**2 * self.rows


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
    white: Sequence[ByChannel],
    patterns: Sequence[Sequence[ByChannel]],
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
        joint = W.beside(r[:, None])
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
        P - half[:, :p].T @ half[:, :p],
        B[k] - half[:, :p].T @ half[:, p],
        sum(len(r) for r in residual),
        every,
        of_kind,
        own,
    )


def score_test(left: Projected, rows: Mapping[str, int]) -> dict[str, ResidualTest]:
    """Size of the patterns of every kind against chance; rows: white rows per kind."""
    out = {}
    for kind in dict.fromkeys(left.kinds):
        mine = np.flatnonzero(np.array(left.kinds) == kind)
        P, h = left.P[np.ix_(mine, mine)], left.h[mine]
        usable = np.diag(P) > 1e-6 * np.maximum(left.own[mine], 1e-30)
        scale = np.sqrt(np.maximum(np.diag(P)[usable], 1e-30))
        value, vector = np.linalg.eigh(P[np.ix_(usable, usable)] / scale[:, None] / scale)
        keep = value > _TOLD
        z = (vector[:, keep] / np.sqrt(value[keep])).T @ (h[usable] / scale)
        dof, total = max(int(keep.sum()), 1), float(z @ z)
        out[kind] = ResidualTest(
            kind,
            float(np.sqrt(max(total - dof, 0.0) / rows[kind])),
            rows[kind],
            _shares(P, h, [left.labels[i] for i in mine]),
        )
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
