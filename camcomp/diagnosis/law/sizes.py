"""How far covariates reach over all runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from camcomp.ground.datatypes import Floats


@dataclass(frozen=True)
class Sizes:
    """limits: covariate -> (low, high) over all runs; apart: how far neighbouring rows usually are; stretches: (s, s) in
    which runs were logged, on the common clock.
    """

    limits: dict[str, tuple[float, float]]
    apart: dict[str, float]
    stretches: tuple[tuple[float, float], ...]

    def span(self, name: str) -> float:
        """High minus low."""
        low, high = self.limits[name]
        return high - low

    def wide(self, name: str) -> bool:
        """Whether it varies at all."""
        low, high = self.limits[name]
        return high - low > max(1e-6, 1e-3 * max(abs(low), abs(high)))


def sizes(rows: Sequence[Mapping[str, Floats]]) -> Sizes:
    """Reach of every covariate."""
    limits, apart = {}, {}
    for name in rows[0]:
        every = [each[name] for each in rows]
        limits[name] = (min(float(v.min()) for v in every), max(float(v.max()) for v in every))
        steps: Floats = np.concatenate([np.abs(np.diff(v)) for v in every])
        apart[name] = float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
    stretches = tuple((float(each["common_s"][0]), float(each["common_s"][-1])) for each in rows)
    return Sizes(limits, apart, tuple(sorted(stretches)))
