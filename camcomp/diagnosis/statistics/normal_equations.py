"""Normal equations of white rows: all that columns and values have to say about amplitudes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from camcomp.ground.datatypes import Floats


@dataclass(frozen=True, eq=False)
class NormalEquations:
    """Normal equations of white rows: A = D'D (q, q), b = D'y (q,), c = y'y, number of values, log of the noise sizes."""

    A: Floats
    b: Floats
    c: float
    rows: int
    log_size: float = 0.0

    def with_noise(self, factor: float) -> NormalEquations:
        """With so many times the noise."""
        if factor == 1.0:
            return self
        more, square = self.rows * float(np.log(factor)), factor**2
        return NormalEquations(self.A / square, self.b / square, self.c / square, self.rows, self.log_size + more)


def sum_grams(grams: Sequence[NormalEquations]) -> NormalEquations:
    """Normal equations of several groups together."""
    A, b = grams[0].A.copy(), grams[0].b.copy()
    for g in grams[1:]:  # in place: a stack of many groups would be large
        A += g.A
        b += g.b
    return NormalEquations(A, b, sum(g.c for g in grams), sum(g.rows for g in grams), sum(g.log_size for g in grams))
