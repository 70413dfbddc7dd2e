"""Which smooth map does a residual follow that no short law fits: cubic splines over one or two covariates.

Every coefficient has a prior about zero. Its width, the covariates and the spots maximise the probability of withheld
parts, one spot after the other. Without a gain on withheld parts the answer has no map.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from camcomp.diagnosis.law.bench_terms import Spot, TermBench, spots
from camcomp.diagnosis.law.folds import Folds, gains, withheld
from camcomp.diagnosis.law.sizes import Sizes
from camcomp.diagnosis.law.white import White
from camcomp.ground.datatypes import Floats
from camcomp.model.law.spline_map import splines, tensor

ALONG, BOTH = 12, 6  # splines over one covariate, and over each of two
WIDTHS_MM = (0.01, 0.03, 0.1)  # of the coefficients at the tip, standard deviation before any data
LEAST_GAIN = 10.0  # log density on withheld parts
MOST_MAPS = 3
_SINGLE = ("heading_rad", "temp_C", "cut_min", "fx_N", "fy_N", "fz_N")


@dataclass(frozen=True, eq=False, kw_only=True)
class FoundMap:
    """Maps (spot, covariates, limits, counts) with theta of all their coefficients, and theta_without (f, c) each part; columns:
    white, with their prior precision (c,).
    """

    maps: tuple[MapTerm, ...]
    theta: Floats
    theta_without: Floats
    gain: float
    folds: Folds
    columns: tuple[White, ...]
    precision: Floats


@dataclass(frozen=True)
class MapTerm:
    """One map before its coefficients are known."""

    spot: Spot
    names: tuple[str, ...]
    limits: tuple[tuple[float, float], ...]
    width: float = 0.0

    @property
    def shape(self) -> tuple[int, ...]:
        """How many splines along each covariate."""
        return (ALONG,) if len(self.names) == 1 else (BOTH, BOTH)


def map_values(bench: TermBench, term: MapTerm) -> list[Floats]:
    """Splines (n, c) per run."""
    out = []
    for rows in bench.rows(term.spot):
        basis = [
            splines(rows[name], low, high, count)
            for name, (low, high), count in zip(term.names, term.limits, term.shape, strict=True)
        ]
        out.append(tensor(basis))
    return out


def find_map(bench: TermBench, folds: Folds, kind: str) -> FoundMap | None:
    """The maps that the residual of a kind of channel follows; None where the gain on withheld parts stays below
    LEAST_GAIN.
    """
    where, step = spots(len(bench.bench.actuators), kind), folds
    chosen: list[MapTerm] = []
    while len(chosen) < MOST_MAPS:
        best: tuple[float, MapTerm] | None = None
        for spot in [s for s in where if all(s != each.spot for each in chosen)]:
            size = bench.sizes(spot)
            for names in _covariates(spot, size):
                term = MapTerm(spot, names, tuple(size.limits[name] for name in names))
                white = bench.white(spot, map_values(bench, term))
                data = step.together([white])
                for width in WIDTHS_MM:
                    prior = np.full(data.h.shape[1], 1.0 / width**2)
                    gain = float(withheld(gains(data.G[:, None], data.h[:, None], prior[None]))[0])
                    if best is None or gain > best[0]:
                        best = (gain, MapTerm(spot, names, term.limits, width))
        if best is None or best[0] < LEAST_GAIN:
            break
        chosen.append(best[1])
        step = folds.extended([bench.white(each.spot, map_values(bench, each)) for each in chosen], _precision(chosen))
    if not chosen:
        return None
    columns = tuple(bench.white(each.spot, map_values(bench, each)) for each in chosen)
    data = folds.together(columns)
    size_of = _precision(chosen)
    theta = folds.coefficients(columns, size_of)[0]
    gain = float(withheld(gains(data.G[:, None], data.h[:, None], size_of[None]))[0])
    return FoundMap(
        maps=tuple(chosen), theta=theta[0], theta_without=theta[1:], gain=gain, folds=folds, columns=columns,
        precision=size_of,
    )  # fmt: skip


def _precision(chosen: Sequence[MapTerm]) -> Floats:
    return np.concatenate([np.full(int(np.prod(each.shape)), 1.0 / each.width**2) for each in chosen])


def _covariates(spot: Spot, size: Sizes) -> list[tuple[str, ...]]:
    if spot.on in ("control", "drive"):
        return [
            (name,) for name in ("act_mm", "act_rad", "temp_C", "cut_min")[: 1 if size.limits else 0] if size.wide(name)
        ]
    axes = [f"{a}_mm" for a in "xyz" if size.wide(f"{a}_mm")]
    pairs = [(a, b) for i, a in enumerate(axes) for b in axes[i + 1 :]]
    return [*pairs, *((a,) for a in axes), *((name,) for name in _SINGLE if size.wide(name))]
