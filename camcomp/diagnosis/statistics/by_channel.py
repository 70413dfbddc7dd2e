"""Columns over the rows of many channels, most of which are zero in most channels: what is zero is neither kept nor multiplied."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from camcomp.ground.datatypes import Floats, Ints

AT_ONCE = 1_000_000  # values that are worked out together, and held in memory


@dataclass(frozen=True, eq=False)
class ByChannel:
    """A matrix (w, k) whose rows lie channel behind channel. width k; parts: per channel the columns (a,) that are not zero
    there, and their values (rows, a).

    It is multiplied and picked from as an array is; what comes out is an array, where only rows are picked a ByChannel.
    """

    width: int
    parts: tuple[tuple[Ints, Floats], ...]

    @classmethod
    def of(cls, channels: Iterable[Floats]) -> ByChannel:
        """From the values (rows, k) of every channel."""
        every = list(channels)
        return cls(every[0].shape[1], tuple(_not_zero(np.arange(each.shape[1]), each) for each in every))

    @classmethod
    def joined(cls, matrices: Sequence[ByChannel]) -> ByChannel:
        """Matrices of the same rows, one behind the other."""
        first, parts = np.cumsum([0, *(each.width for each in matrices)]), []
        for channel in zip(*(each.parts for each in matrices), strict=True):
            on = np.concatenate([own + at for at, (own, _) in zip(first, channel, strict=False)])
            parts.append((on, np.concatenate([X for _, X in channel], axis=1)))
        return cls(int(first[-1]), tuple(parts))

    @cached_property
    def _starts(self) -> list[int]:
        return [int(n) for n in np.cumsum([0, *(len(X) for _, X in self.parts)])]

    def __len__(self) -> int:
        return self._starts[-1]

    def __matmul__(self, a: Floats) -> Floats:
        return np.concatenate([X @ a[on] for on, X in self.parts])

    @property
    def T(self) -> _Turned:
        """Rows for columns."""
        return _Turned(self)

    def __getitem__(self, key: Any) -> Any:
        """[:, columns]: an array; [rows], a slice or indices in order: a ByChannel."""
        if isinstance(key, tuple):
            return self._columns(np.asarray(key[1], int))[key[0]]
        return self._rows(key)

    def _columns(self, index: Ints) -> Floats:
        out, place = np.zeros((len(self), len(index))), np.full(self.width, -1)
        place[index] = np.arange(len(index))
        for (on, X), at in zip(self.parts, self._starts, strict=False):
            asked = place[on] >= 0
            out[at : at + len(X), place[on[asked]]] = X[:, asked]
        return out

    def _rows(self, rows: slice | Ints) -> ByChannel:
        if isinstance(rows, slice):
            low, high, _ = rows.indices(len(self))
            ends = [(max(low - at, 0), max(high - at, 0)) for at in self._starts]
            parts = [(on, X[a:b]) for (on, X), (a, b) in zip(self.parts, ends, strict=False)]
        else:
            cut = np.searchsorted(rows, self._starts)
            parts = [
                (on, X[rows[a:b] - at])
                for (on, X), at, a, b in zip(self.parts, self._starts, cut, cut[1:], strict=False)
            ]
        return ByChannel(self.width, tuple(parts))

    def exchanged(self, index: Sequence[int] | Ints, columns: Floats) -> ByChannel:
        """With other columns (w, d) in the places `index` (d,)."""
        at, parts = np.asarray(index, int), []
        for (on, X), start in zip(self.parts, self._starts, strict=False):
            others = ~np.isin(on, at)
            new, values = _not_zero(at, columns[start : start + len(X)])
            if others.all() and not len(new):
                parts.append((on, X))
            else:
                parts.append((np.concatenate([on[others], new]), np.concatenate([X[:, others], values], axis=1)))
        return ByChannel(self.width, tuple(parts))

    def appended(self, columns: Floats) -> ByChannel:
        """With more columns (w, d) behind its own."""
        new = np.arange(self.width, self.width + columns.shape[1])
        return ByChannel(self.width + len(new), self.parts).exchanged(new, columns)

    def scaled(self, factor: Floats) -> ByChannel:
        """With every row times a factor (w,)."""
        each = zip(self.parts, self._starts, strict=False)
        return ByChannel(self.width, tuple((on, factor[at : at + len(X), None] * X) for (on, X), at in each))

    def dense(self, rows: slice = slice(None)) -> Floats:
        """Every value (n, c, k) of channels that have n rows each, or of some of these rows."""
        parts = [(on, X[rows]) for on, X in self.parts]
        out = np.zeros((len(parts[0][1]), len(parts), self.width))
        for c, (on, X) in enumerate(parts):
            out[:, c, on] = X
        return out


@dataclass(frozen=True, eq=False)
class _Turned:
    whole: ByChannel

    def __matmul__(self, other: Floats | ByChannel) -> Floats:
        mine = self.whole
        if other is mine:
            gram = np.zeros((mine.width, mine.width))
            for on, X in mine.parts:
                gram[np.ix_(on, on)] += X.T @ X
            return gram
        if isinstance(other, ByChannel):
            out = np.zeros((mine.width, other.width))
            for (on, X), (to, Y) in zip(mine.parts, other.parts, strict=True):
                if len(on) and len(to):
                    out[np.ix_(on, to)] += X.T @ Y
            return out
        out = np.zeros((mine.width, *other.shape[1:]))
        for (on, X), at in zip(mine.parts, mine._starts, strict=False):
            if (own := other[at : at + len(X)]).any():  # most columns are of a few channels
                out[on] += X.T @ own
        return out


def channel_behind_channel(values: Floats) -> Floats:
    """Values (n, c, k) as rows (c n, k)."""
    return np.swapaxes(values, 0, 1).reshape(-1, values.shape[2])


def _not_zero(index: Ints, columns: Floats) -> tuple[Ints, Floats]:
    """The columns (n, d) that are not zero, and their numbers of `index` (d,)."""
    some = np.flatnonzero(columns.any(axis=0))
    return index[some], np.ascontiguousarray(columns[:, some])
