"""Withheld parts: how much more probable a part becomes when columns were fitted to all others, in closed form.

Everything that is no law (small errors, offsets, causes found) stands in the base, within its stated tolerance, and is
integrated out; the log density of a part given the others is the evidence of all less that of the others.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular

from camcomp.diagnosis.law.white import White
from camcomp.ground.datatypes import Floats, Ints

FEW_RUNS = 4  # from which on runs are withheld, else stretches of them
PARTS = 6
SHORT = 48  # stretches of a run, every other one of which is withheld where something acts for a while only
WIDE_MM = 0.2  # what a law may move the tip by, standard deviation before any data


Part = tuple[int, Ints]  # a run, and its white rows


@dataclass(frozen=True)
class Split:
    """How the time of a run is divided into what is withheld: stretches of equal length, of which every `parts`-th belong together."""

    stretches: int
    parts: int

    def of(self, place: Floats) -> Ints:
        """Number of the part (n,) of places (n,) 0 to 1 in the time of a run."""
        number = np.minimum((place * self.stretches).astype(int), self.stretches - 1) % self.parts
        return np.asarray(number)


ALTERNATING = Split(SHORT, 2)


def usual_split(runs: int) -> Split:
    """Whole runs, one after the other, or stretches of time where there are few."""
    each = 1 if runs >= FEW_RUNS else -(-PARTS // runs)
    return Split(each, each)


@dataclass(frozen=True, eq=False)
class FoldedColumns:
    """Columns (c) with the base taken out, for all data and for all but one part each: G (f, c, c), h (f, c)."""

    G: Floats
    h: Floats


class Folds:
    """The base of a law search: white columns and residual beside which laws are sought."""

    def __init__(
        self, white: Sequence[Floats], residual: Sequence[Floats], precision: Floats, places: Sequence[Floats],
        split: Split, constants: Sequence[White],
    ) -> None:  # fmt: skip
        """White (w, k), residual (w,) per run; precision (k,) of the prior; places (w,) 0 to 1 of white rows in the time of their
        run; constants: columns that are free beside the law.
        """
        loose = np.full(sum(each.columns[0].shape[1] for each in constants), 1e-6)
        self.precision = np.concatenate([precision, loose])
        self.white = [
            np.concatenate([W, *(spread(c, k, len(W)) for c in constants)], axis=1) for k, W in enumerate(white)
        ]
        self.residual = list(residual)
        self.split = split
        self.parts: list[Part] = [
            (k, np.flatnonzero(split.of(own) == i)) for k, own in enumerate(places) for i in range(split.parts)
        ]
        self._prepare()

    def beside(self, more: Sequence[White], precision: Floats) -> Folds:
        """The same with more columns in the base, of that prior precision."""
        out = copy(self)
        out.precision = np.concatenate([self.precision, precision])
        out.white = [
            np.concatenate([W, *(spread(x, k, len(W)) for x in more)], axis=1) for k, W in enumerate(self.white)
        ]
        out._prepare()
        return out

    def _prepare(self) -> None:
        self._grams = [self._gram(k, rows) for k, rows in self.parts]
        self._halves = [self._half(A) for A in _without_each([A for A, _ in self._grams])]
        self._targets = [
            np.asarray(solve_triangular(L, b, lower=True))
            for L, b in zip(self._halves, _without_each([b for _, b in self._grams]), strict=True)
        ]

    def _gram(self, k: int, rows: Ints) -> tuple[Floats, Floats]:
        W = self.white[k][rows]
        return W.T @ W, W.T @ self.residual[k][rows]

    def _half(self, A: Floats) -> Floats:
        M = A + np.diag(self.precision)
        return np.asarray(np.linalg.cholesky(M + 1e-12 * np.diag(np.diag(M))))

    def rest(self) -> list[Floats]:
        """White residual (w,) per run that the base leaves, all data together."""
        mean = solve_triangular(self._halves[0].T, self._targets[0], lower=False)
        return [r - W @ mean for r, W in zip(self.residual, self.white, strict=True)]

    def means(self, more: Sequence[White], precision: Floats) -> Floats:
        """Coordinates (f, k) of what stands beside a law, law columns of that prior precision fitted with it: of all data, and
        without each part.
        """
        both = self.beside(more, precision)
        found = [solve_triangular(L.T, t, lower=False) for L, t in zip(both._halves, both._targets, strict=True)]
        return np.array(found)[:, : len(self.precision)]

    def coefficients(self, columns: Sequence[White], precision: Floats) -> tuple[Floats, Floats]:
        """Those (f, c) of law columns of that prior precision, of all data and without each part, and their covariance (c, c)."""
        data = self.together(columns)
        M = data.G + np.diag(precision)
        each = np.asarray(np.linalg.solve(M, data.h[..., None])[..., 0], float)
        return each, np.asarray(np.linalg.inv(M[0]), float)

    def half_cross(self, x: White) -> Floats:
        """Columns of a spot against the base (k, c), for `projected`."""
        cross = np.sum([W[rows].T @ X for W, rows, X in zip(self.white, x.rows, x.columns, strict=True)], axis=0)
        return np.asarray(solve_triangular(self._halves[0], cross, lower=True))

    def projected(self, draws: Sequence[Floats]) -> Floats:
        """White residuals (w, b) per run against the base (k, b)."""
        cross = np.sum([W.T @ e for W, e in zip(self.white, draws, strict=True)], axis=0)
        return np.asarray(solve_triangular(self._halves[0], cross, lower=True))

    def of_all(self, x: White) -> FoldedColumns:
        """As `columns`, for all data alone: (1, c, c), (1, c)."""
        half = self.half_cross(x)
        gram = sum(X.T @ X for X in x.columns)
        target = sum(X.T @ r[rows] for X, rows, r in zip(x.columns, x.rows, self.residual, strict=True))
        return FoldedColumns((gram - half.T @ half)[None], (target - half.T @ self._targets[0])[None])

    def columns(self, x: White) -> FoldedColumns:
        """Columns of one spot with the base taken out, in full."""
        return self.together([x])

    def together(self, xs: Sequence[White]) -> FoldedColumns:
        """The same for columns of several spots, one behind the other."""
        dense = [np.concatenate([spread(x, k, len(r)) for x in xs], axis=1) for k, r in enumerate(self.residual)]
        crosses, grams, targets = [], [], []
        for k, rows in self.parts:
            X = dense[k][rows]
            crosses.append(self.white[k][rows].T @ X)
            grams.append(X.T @ X)
            targets.append(X.T @ self.residual[k][rows])
        return self._folded(crosses, grams, targets)

    def diagonals(self, x: White) -> tuple[Floats, Floats]:
        """As `of_all`, but of G only the diagonal: (c,), (c,)."""
        half = self.half_cross(x)
        gram = np.sum([np.einsum("rc,rc->c", X, X) for X in x.columns], axis=0)
        target = np.sum([X.T @ r[rows] for X, rows, r in zip(x.columns, x.rows, self.residual, strict=True)], axis=0)
        return gram - np.einsum("kc,kc->c", half, half), target - half.T @ self._targets[0]

    def pairs(self, x: White, first: Ints) -> Floats:
        """Products (p,) of columns first and first + 1, with the base taken out, all data."""
        half = self.half_cross(x)
        gram = np.sum([np.einsum("rc,rc->c", X[:, first], X[:, first + 1]) for X in x.columns], axis=0)
        return np.asarray(gram - np.einsum("kc,kc->c", half[:, first], half[:, first + 1]))

    def _folded(self, crosses: Sequence[Floats], grams: Sequence[Floats], targets: Sequence[Floats]) -> FoldedColumns:
        G, h = [], []
        every = zip(
            self._halves,
            self._targets,
            _without_each(crosses),
            _without_each(grams),
            _without_each(targets),
            strict=True,
        )
        for L, t, c, g, b in every:
            half = solve_triangular(L, c, lower=True)
            G.append(g - half.T @ half)
            h.append(b - half.T @ t)
        return FoldedColumns(np.array(G), np.array(h))


def _without_each(parts: Sequence[Floats]) -> list[Floats]:
    """The sum of all, and the sums of all but one."""
    whole = np.asarray(np.sum(parts, axis=0))
    return [whole, *(whole - each for each in parts)]


def spread(x: White, k: int, rows: int) -> Floats:
    """Columns (rows, c) over all white rows of run k."""
    out = np.zeros((rows, x.columns[k].shape[1]))
    out[x.rows[k]] = x.columns[k]
    return out


def gains(G: Floats, h: Floats, size: Floats) -> Floats:
    """Log evidence (f, s) that sets of columns add: G (f, s, d, d), h (f, s, d), prior precision size (s, d)."""
    M = G + size[None, :, :, None] * np.eye(h.shape[2])
    _, log_det = np.linalg.slogdet(M)
    fit = np.einsum("fsd,fsd->fs", h, np.linalg.solve(M, h[..., None])[..., 0])
    return np.asarray(0.5 * fit - 0.5 * log_det + 0.5 * np.log(size).sum(axis=1))


def withheld(gain: Floats) -> Floats:
    """Log density (s,) gained on withheld parts, from log evidences (f, s), all data first."""
    return np.asarray((gain[0] - gain[1:]).sum(axis=0))
