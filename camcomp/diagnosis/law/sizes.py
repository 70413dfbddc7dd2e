"""How far covariates reach over all runs."""

from __future__ import annotations

from dataclasses import dataclass

_NARROW = 1e-6


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
        return high - low > max(_NARROW, 1e-3 * max(abs(low), abs(high)))
