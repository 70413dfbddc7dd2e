"""Rows of a program at which it is enough to ask what changes smoothly with place and force; between them it is interpolated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from camcomp.ground.datatypes import Floats, Ints

WAY_MM = 2.0  # between stations; machines change over hundreds
TURN = 0.05  # of the largest of vectors of a kind: a turning one is missed by 0.03 % of it
BEND = 0.01  # of the same: a change of its change from row to row is no steady turning


@dataclass(frozen=True, eq=False)
class Stations:
    """Chosen rows (s,) of n, in order, and between which of them, and where, every row lies."""

    rows: Ints  # (s,) of the n
    before: Ints  # (n,) number of the station that a row is at or behind
    share: Floats  # (n,) of the way from it to the next

    @staticmethod
    def along(place: Floats, vectors: Sequence[Floats]) -> Stations:
        """Stations along places (n, 3) mm: as far apart as they and vectors, each (n, 3), change evenly; n > 0.

        Where something jumps from one row to the next both of them are stations.
        """
        step = _sizes(np.diff(place, axis=0)) / WAY_MM
        bends = np.zeros_like(step)
        for each in vectors:
            if size := float(_sizes(each).max()):
                turn = np.diff(each, axis=0)
                np.maximum(step, _sizes(turn) / (TURN * size), out=step)
                bend = _sizes(np.diff(turn, axis=0)) / (BEND * size)
                for beside in (bends[1:], bends[:-1]):
                    np.maximum(beside, bend, out=beside)
        passed = np.diff(np.floor(np.concatenate(([0.0], np.cumsum(np.maximum(step, bends)))))) > 0.0
        is_one = np.concatenate((passed, [True])) | np.concatenate(([True], passed))
        rows = np.flatnonzero(is_one)
        before = np.cumsum(is_one) - 1
        run = np.concatenate(([0.0], np.cumsum(step)))
        begin, end = run[rows], run[np.append(rows[1:], rows[-1])]
        width = np.maximum(end - begin, 1e-300)
        return Stations(rows, before, (run - begin[before]) / width[before])

    def spread(self, values: Floats) -> Floats:
        """Values (n, ...) at all rows from those (s, ...) at stations."""
        change = np.concatenate((np.diff(values, axis=0), np.zeros_like(values[:1])))
        share = self.share.reshape(-1, *[1] * (values.ndim - 1))
        out: Floats = values[self.before] + share * change[self.before]
        return out


def _sizes(vectors: Floats) -> Floats:
    return np.asarray(np.sqrt(np.einsum("ni,ni->n", vectors, vectors)))
