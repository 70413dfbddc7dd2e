"""Withheld parts: how much more probable a part becomes when columns were fitted to all others, in closed form.

Everything that is no law (small errors, offsets, causes found) stands in the base, within its stated tolerance, and is
integrated out; the log density of a part given the others is the evidence of all less that of the others.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass

import numpy as np

from camcomp.diagnosis.statistics.by_channel import ByChannel
from camcomp.diagnosis.statistics.normal_equations import AmplitudePosterior, NormalEquations
from camcomp.ground.datatypes import Floats, Ints

PARTS = 4  # of a whole that are looked at one by one: of a log, of a run, of a disturbance
RunColumns = Sequence[ByChannel]  # white columns (w, f) of every run


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


class Folds:
    """The base of a law search: white columns and residual beside which laws are sought.

    The columns of the diagnosis are never copied; constants and laws are kept apart from them.
    """

    def __init__(
        self, white: RunColumns, residual: Sequence[Floats], precision: Floats, places: Sequence[Floats], split: Split,
        constants: Sequence[RunColumns],
    ) -> None:  # fmt: skip
        """White (w, k), residual (w,) per run; precision (k,) of the prior; places (w,) 0 to 1 of white rows in the time of their
        run; constants: columns that are free beside the law.
        """
        self.white, self.residual, self.split = list(white), list(residual), split
        self.more: tuple[RunColumns, ...] = ()
        self.precision = precision
        # a run and its white rows
        self.parts: list[tuple[int, Ints | slice]] = [
            (k, slice(None) if split.parts == 1 else np.flatnonzero(split.of(own) == i))
            for k, own in enumerate(places)
            for i in range(split.parts)
        ]
        each = [(self.white[k][rows], self.residual[k][rows]) for k, rows in self.parts]
        self._grams = [(W.T @ W, W.T @ r) for W, r in each]
        if constants:
            loose = np.full(sum(each[0].width for each in constants), 1e-6)
            self._put(constants, loose)
        self._factorise()

    def extended(self, more: Sequence[RunColumns], precision: Floats) -> Folds:
        """The same with more columns in the base, of that prior precision."""
        out = copy(self)
        out._put(more, precision)
        out._factorise()
        return out

    def _put(self, more: Sequence[RunColumns], precision: Floats) -> None:
        grams = []
        for (A, b), (cross, gram, target) in zip(self._grams, self._products(more), strict=True):
            grams.append((np.block([[A, cross], [cross.T, gram]]), np.concatenate([b, target])))
        self._grams, self.more = grams, (*self.more, *more)
        self.precision = np.concatenate([self.precision, precision])

    def _factorise(self) -> None:
        sums = (_without_each(parts) for parts in zip(*self._grams, strict=True))
        data = [NormalEquations(A, b, 0.0, 0) for A, b in zip(*sums, strict=True)]
        self._each = [AmplitudePosterior.of(own, self.precision) for own in data]

    @property
    def mean(self) -> Floats:
        """Coordinates (k,) of the base, fitted to all data."""
        return self._each[0].mean

    def means(self, more: Sequence[RunColumns], precision: Floats) -> Floats:
        """Coordinates (f, k) of the base, fitted jointly with law columns of that prior precision: with all data, and
        without each part.
        """
        return np.array([each.mean for each in self.extended(more, precision)._each])[:, : len(self.precision)]

    def coefficients(self, columns: Sequence[RunColumns], precision: Floats) -> tuple[Floats, Floats]:
        """Those (f, c) of law columns of that prior precision, of all data and without each part, and their covariance (c, c)."""
        G, h = self.together(columns)
        M = G + np.diag(precision)
        each = np.asarray(np.linalg.solve(M, h[..., None])[..., 0], float)
        return each, np.asarray(np.linalg.inv(M[0]), float)

    def alone(self, x: RunColumns, count: int) -> tuple[Floats, Floats]:
        """Columns (c) of a spot, of which each `count` belong together, with the base taken out, all data: G (f, count, count), h (f,
        count).
        """
        base = [np.sum([W.T @ X for W, X in zip(own, x, strict=True)], axis=0) for own in (self.white, *self.more)]
        half = self._each[0].half(np.concatenate(base))
        target = np.sum([X.T @ r for X, r in zip(x, self.residual, strict=True)], axis=0)
        own = _grams([values for each in x for on, values in each.parts if len(on)], count)
        return own - _grams([half], count), (target - half.T @ self._each[0].target).reshape(-1, count)

    def together(self, xs: Sequence[RunColumns]) -> tuple[Floats, Floats]:
        """Columns (c) of several spots, one behind the other, with the base taken out, for all data and for all but one part
        each: G (f, c, c), h (f, c).
        """
        every = [_without_each(parts) for parts in zip(*self._products(xs), strict=True)]
        G, h = [], []
        for own, cross, gram, target in zip(self._each, *every, strict=True):
            half = own.half(cross)
            G.append(gram - half.T @ half)
            h.append(target - half.T @ own.target)
        return np.array(G), np.array(h)

    def _products(self, xs: Sequence[RunColumns]) -> list[tuple[Floats, Floats, Floats]]:
        """Per part: columns of several spots (c) against the base (k, c), each other (c, c) and the residual (c,)."""
        out = []
        for k, rows in self.parts:
            X = ByChannel.joined([x[k] for x in xs])[rows]
            cross = np.concatenate([each[k][rows].T @ X for each in (self.white, *self.more)])
            out.append((cross, X.T @ X, X.T @ self.residual[k][rows]))
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
