"""Columns of a law in white rows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from camcomp.ground.datatypes import Floats, Ints


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
