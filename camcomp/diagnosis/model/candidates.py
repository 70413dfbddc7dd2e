"""Candidates: an effect at a target with its columns, once for each shape; and prior facts of columns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from camcomp.ground.datatypes import Floats
from camcomp.model.effect import Parameter

Place = tuple[str, str | None]


@dataclass(frozen=True)
class PlacedCause:
    """A group of columns that enters a set together. ways: number of shapes that share this place."""

    effect: str
    target: str | None
    columns: tuple[int, ...]
    ways: float = 1.0

    @property
    def place(self) -> Place:
        """Effect and target."""
        return self.effect, self.target


@dataclass(frozen=True, eq=False)
class AmplitudeBounds:
    """Amplitudes of columns: lowest and highest (k,), and sign (k,), +1 where an amplitude is never below 0, else 0.

    shaped (k,): whether a column has a shape that is scanned: it takes no part in the small errors of a healthy machine.
    """

    low: Floats
    high: Floats
    sign: Floats
    shaped: np.ndarray

    @staticmethod
    def of(parameters: Sequence[Parameter], shaped: Sequence[bool]) -> AmplitudeBounds:
        """AmplitudeBounds of parameters in units of their scales."""
        ends = [
            [p.coordinate(b) / p.scale if b > 0.0 or not p.log else -np.inf for b in (p.low, p.high)]
            for p in parameters
        ]
        low, high = np.array(ends, float).reshape(-1, 2).T
        return AmplitudeBounds(low, high, np.array([p.sign for p in parameters], float), np.array(shaped, bool))
