"""Which smooth map does a residual follow that no short law fits: cubic splines over one or two covariates.

Every coefficient has the prior of a law's. The covariates and the spots maximise the probability of withheld parts, one
spot after the other. Without a gain on withheld parts the answer has no map.
"""

from __future__ import annotations

from camcomp.diagnosis.law.bench_terms import Spot, Term, TermBench, spots
from camcomp.diagnosis.law.find import FoundLaw, fitted
from camcomp.diagnosis.law.folds import Folds, gains, withheld
from camcomp.diagnosis.law.forms import Sizes, SmoothForm
from camcomp.diagnosis.law.shapes import Shapes
from camcomp.diagnosis.statistics.probability import EQUAL_LOG_ODDS

BOTH = 6  # splines over each of two covariates; twice as many over a single one
_SINGLE = ("heading_rad", "temp_C", "cut_min", "fx_N", "fy_N", "fz_N")


def find_map(bench: TermBench, folds: Folds, kind: str) -> FoundLaw | None:
    """The maps that the residual of a kind of channel follows; None where the gain on withheld parts stays below
    EQUAL_LOG_ODDS.
    """
    where, shapes, step = spots(len(bench.bench.actuators), kind), Shapes(bench), folds
    chosen: list[Term] = []
    while len(chosen) < len(where):
        best: tuple[float, Term] | None = None
        for spot in [s for s in where if all(s != each.spot for each in chosen)]:
            size = bench.sizes(spot)
            for names in _covariates(spot, size):
                counts = (2 * BOTH,) if len(names) == 1 else (BOTH, BOTH)
                form = SmoothForm(about=names, limits=tuple(size.limits[n] for n in names), counts=counts)
                white, precision = shapes.columns(Term(spot, form))
                gain = withheld(gains(*step.together([white]), precision))
                if best is None or gain > best[0]:
                    best = gain, Term(spot, form)
        if best is None or best[0] < EQUAL_LOG_ODDS:
            break
        chosen.append(best[1])
        found = fitted(shapes, chosen, folds)
        step = folds.extended(found.columns, found.precision)
    return found if chosen else None


def _covariates(spot: Spot, size: Sizes) -> list[tuple[str, ...]]:
    if spot.on in ("control", "drive"):
        return [
            (name,) for name in ("act_mm", "act_rad", "temp_C", "cut_min")[: 1 if size.limits else 0] if size.wide(name)
        ]
    axes = [f"{a}_mm" for a in "xyz" if size.wide(f"{a}_mm")]
    pairs = [(a, b) for i, a in enumerate(axes) for b in axes[i + 1 :]]
    return [*pairs, *((a,) for a in axes), *((name,) for name in _SINGLE if size.wide(name))]
