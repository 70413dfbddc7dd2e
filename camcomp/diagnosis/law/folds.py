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

from camcomp.diagnosis.statistics.by_channel import ByChannel
from camcomp.ground.datatypes import Floats, Ints

PARTS = 4  # that are withheld: runs, or stretches of fewer runs


@dataclass(frozen=True, eq=False)
class White:
    """Per run: which white rows a spot reaches (r,), in their order, and columns (r, k) there."""

    rows: tuple[Ints, ...]
    columns: tuple[Floats, ...]

    def hull(self, run: int) -> tuple[int, int]:
        """The first white row that is reached, and the one behind the last."""
        rows = self.rows[run]
        return (int(rows[0]), int(rows[-1]) + 1) if len(rows) else (0, 0)

    def reach(self, run: int) -> Ints | slice:
        """The rows, as a slice where none lies between them: nothing has to be copied then."""
        low, high = self.hull(run)
        return slice(low, high) if high - low == len(self.rows[run]) else self.rows[run]

    def over(self, run: int, low: int, high: int) -> Floats:
        """Columns (high - low, k) over white rows low to high, 0 where the spot does not reach."""
        rows, columns = self.rows[run], self.columns[run]
        if (low, high) == self.hull(run) and len(rows) == high - low:
            return columns
        out = np.zeros((high - low, columns.shape[1]))
        near = (rows >= low) & (rows < high)
        out[rows[near] - low] = columns[near]
        return out


@dataclass(frozen=True)
class Split:
    """Division of a run's time into withheld parts: stretches of equal length, of which every `parts`-th belong
    together.
    """

    stretches: int
    parts: int

    def of(self, place: Floats) -> Ints:
        """Number of the part (n,) of places (n,) 0 to 1 in the time of a run."""
        number = np.minimum((place * self.stretches).astype(int), self.stretches - 1) % self.parts
        return np.asarray(number)


ALTERNATING = Split(48, 2)  # every other stretch of a run is withheld where something acts for a while only


def usual_split(runs: int) -> Split:
    """Whole runs, one after the other, or stretches of time where there are few."""
    each = -(-PARTS // runs)
    return Split(each, each)


@dataclass(frozen=True, eq=False)
class Products:
    """Columns (c) of a spot, of which each `count` belong together, with base columns (k): cross (k, c); with the residual:
    target (c,); with each other: own (c / count, count, count). more: how many columns that stand apart are in the base.
    """

    cross: Floats
    target: Floats
    own: Floats
    count: int
    more: int


class Folds:
    """The base of a law search: white columns and residual beside which laws are sought.

    Columns of all rows are those of the diagnosis and never copied; constants and laws reach some rows only, and stand apart.
    """

    def __init__(
        self, white: Sequence[ByChannel], residual: Sequence[Floats], precision: Floats, places: Sequence[Floats],
        split: Split, constants: Sequence[White],
    ) -> None:  # fmt: skip
        """White (w, k), residual (w,) per run; precision (k,) of the prior; places (w,) 0 to 1 of white rows in the time of their
        run; constants: columns that are free beside the law.
        """
        self.white, self.residual, self.split = list(white), list(residual), split
        self.more: tuple[White, ...] = ()
        self.precision = precision
        # a run and its white rows, None for all of them
        self.parts: list[tuple[int, Ints | None]] = [
            (k, None if split.parts == 1 else np.flatnonzero(split.of(own) == i))
            for k, own in enumerate(places)
            for i in range(split.parts)
        ]
        self._grams = [self._gram(k, rows) for k, rows in self.parts]
        if constants:
            loose = np.full(sum(each.columns[0].shape[1] for each in constants), 1e-6)
            self._put(constants, loose)
        self._factorise()

    def extended(self, more: Sequence[White], precision: Floats) -> Folds:
        """The same with more columns in the base, of that prior precision."""
        out = copy(self)
        out._put(more, precision)
        out._factorise()
        return out

    def _put(self, more: Sequence[White], precision: Floats) -> None:
        grams = []
        for (A, b), (cross, gram, target) in zip(self._grams, self._products(more), strict=True):
            grams.append((np.block([[A, cross], [cross.T, gram]]), np.concatenate([b, target])))
        self._grams, self.more = grams, (*self.more, *more)
        self.precision = np.concatenate([self.precision, precision])

    def _factorise(self) -> None:
        self._halves = [self._half(A) for A in _without_each([A for A, _ in self._grams])]
        self._targets = [
            np.asarray(solve_triangular(L, b, lower=True))
            for L, b in zip(self._halves, _without_each([b for _, b in self._grams]), strict=True)
        ]

    def _gram(self, k: int, rows: Ints | None) -> tuple[Floats, Floats]:
        W, r = (self.white[k], self.residual[k]) if rows is None else (self.white[k][rows], self.residual[k][rows])
        return W.T @ W, W.T @ r

    def _half(self, A: Floats) -> Floats:
        M = A + np.diag(self.precision)
        return np.asarray(np.linalg.cholesky(M + 1e-12 * np.diag(np.diag(M))))

    def means(self, more: Sequence[White], precision: Floats) -> Floats:
        """Coordinates (f, k) of the base, fitted jointly with law columns of that prior precision: with all data, and
        without each part.
        """
        both = self.extended(more, precision)
        found = [solve_triangular(L.T, t, lower=False) for L, t in zip(both._halves, both._targets, strict=True)]
        return np.array(found)[:, : len(self.precision)]

    def coefficients(self, columns: Sequence[White], precision: Floats) -> tuple[Floats, Floats]:
        """Those (f, c) of law columns of that prior precision, of all data and without each part, and their covariance (c, c)."""
        G, h = self.together(columns)
        M = G + np.diag(precision)
        each = np.asarray(np.linalg.solve(M, h[..., None])[..., 0], float)
        return each, np.asarray(np.linalg.inv(M[0]), float)

    def products(self, x: White, count: int) -> Products:
        """Products of columns of a spot with the base: they serve every larger base, too."""
        target = sum(X.T @ r[x.reach(k)] for k, (X, r) in enumerate(zip(x.columns, self.residual, strict=True)))
        return Products(self._cross(x), np.asarray(target), _grams(x.columns, count), count, len(self.more))

    def alone(self, x: White, products: Products) -> tuple[Floats, Floats]:
        """Columns (c) with the base taken out, all data: G (f, count, count) and h (f, count) of those that belong together."""
        cross = np.concatenate([products.cross, self._cross(x, first=products.more)])
        half = solve_triangular(self._halves[0], cross, lower=True)
        h = (products.target - half.T @ self._targets[0]).reshape(-1, products.count)
        return products.own - _grams([half], products.count), h

    def _cross(self, x: White, *, first: int | None = None) -> Floats:
        """Products (k, c) of the base's columns with columns of a spot: of all, or from number `first` of those that stand apart on."""
        return np.asarray(np.sum([self._against(k, x, first) for k in range(len(self.white))], axis=0))

    def _against(self, k: int, x: White, first: int | None) -> Floats:
        X, rows = x.columns[k], x.reach(k)
        parts = [self.white[k][rows].T @ X] if first is None else []
        low, high = x.hull(k)
        for each in self.more[first:]:
            near = each.over(k, low, high)
            parts.append((near if isinstance(rows, slice) else near[rows - low]).T @ X)
        return np.concatenate(parts) if parts else np.zeros((0, X.shape[1]))

    def together(self, xs: Sequence[White]) -> tuple[Floats, Floats]:
        """Columns (c) of several spots, one behind the other, with the base taken out, for all data and for all but one part
        each: G (f, c, c), h (f, c).
        """
        every = [_without_each(parts) for parts in zip(*self._products(xs), strict=True)]
        G, h = [], []
        for L, t, cross, gram, target in zip(self._halves, self._targets, *every, strict=True):
            half = solve_triangular(L, cross, lower=True)
            G.append(gram - half.T @ half)
            h.append(target - half.T @ t)
        return np.array(G), np.array(h)

    def _products(self, xs: Sequence[White]) -> list[tuple[Floats, Floats, Floats]]:
        """Per part: columns of several spots (c) against the base (k, c), each other (c, c) and the residual (c,)."""
        out = []
        for k, rows in self.parts:
            ends = [x.hull(k) for x in xs]
            low, high = min(a for a, _ in ends), max(b for _, b in ends)
            pick: slice | Ints = slice(low, high) if rows is None else rows[(rows >= low) & (rows < high)]
            near: slice | Ints = slice(None) if isinstance(pick, slice) else pick - low
            X = np.concatenate([x.over(k, low, high) for x in xs], axis=1)[near]
            own = [each.over(k, low, high)[near] for each in self.more]
            cross = np.concatenate([self.white[k][pick].T @ X, *(each.T @ X for each in own)])
            out.append((cross, X.T @ X, X.T @ self.residual[k][pick]))
        return out


def _without_each(parts: Sequence[Floats]) -> list[Floats]:
    """The sum of all, and the sums of all but one."""
    whole = np.asarray(np.sum(parts, axis=0))
    return [whole, *(whole - each for each in parts)]


def _grams(parts: Sequence[Floats], count: int) -> Floats:
    """Products (f, count, count) of columns (n, f count) of which each `count` belong together, over all parts of the rows."""
    blocks = [X.reshape(len(X), X.shape[1] // count, count) for X in parts]
    return np.asarray(np.sum([np.einsum("nfc,nfd->fcd", each, each) for each in blocks], axis=0))


def gains(G: Floats, h: Floats, size: Floats) -> Floats:
    """Log evidence (f,) that columns add: G (f, d, d), h (f, d), prior precision size (d,) or (f, d)."""
    M = G + size[..., None] * np.eye(h.shape[1])
    _, log_det = np.linalg.slogdet(M)
    fit = np.einsum("fd,fd->f", h, np.linalg.solve(M, h[..., None])[..., 0])
    return np.asarray(0.5 * fit - 0.5 * log_det + 0.5 * np.log(size).sum(axis=-1))


def withheld(gain: Floats) -> float:
    """Log density gained on withheld parts, from log evidences (f,), all data first."""
    return float((gain[0] - gain[1:]).sum())
