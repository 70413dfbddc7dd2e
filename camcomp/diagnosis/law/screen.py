"""Which single term explains most in addition to the base?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from camcomp.diagnosis.law.bench_terms import Spot, Term, TermBench, TermRows, spots
from camcomp.diagnosis.law.forms import Form, SmoothForm, at_drive, at_tip, smooth_forms
from camcomp.diagnosis.statistics.folds import Folds, gains


@dataclass(frozen=True)
class TermGrid:
    """Forms of as many functions each that are tried at spots with the same covariates."""

    spots: tuple[Spot, ...]
    forms: tuple[Form | SmoothForm, ...]


def term_grids(bench: TermBench, kind: str, *, smooth: bool = False) -> list[TermGrid]:
    """Grids of terms for the spots of a law, or of a smooth map, that shows in a kind of channel."""
    every = spots(len(bench.bench.actuators), kind)
    tip = tuple(each for each in every if each.on == "structure")
    groups = [each for each in (tip, *((each,) for each in every if each not in tip)) if each]

    def forms(spot: Spot) -> Sequence[Form | SmoothForm]:
        size = bench.sizes(spot)
        if smooth:
            return smooth_forms(size, at_tip=spot.on == "structure")
        revolute = spot.on != "structure" and bench.bench.twin.robot.actuators[spot.index].revolute
        return at_tip(size) if spot.on == "structure" else at_drive(size, revolute)

    return grids_of([(where, forms(where[0])) for where in groups])


def grids_of(tried: Sequence[tuple[tuple[Spot, ...], Sequence[Form | SmoothForm]]]) -> list[TermGrid]:
    """Grids of forms that are tried at spots with the same covariates."""
    return [
        TermGrid(where, tuple(f for f in forms if f.size == count))
        for where, forms in tried
        for count in sorted({f.size for f in forms})
    ]


def gains_of_terms(bench: TermRows, grids: Sequence[TermGrid], base: Folds) -> list[tuple[float, Term]]:
    """(gain in evidence, term) of all terms of the grids in addition to a base, best first."""
    out: list[tuple[float, Term]] = []
    for grid in grids:
        at_once = max(bench.at_once // grid.forms[0].size, 1)
        for i in range(0, len(grid.forms), at_once):
            some = grid.forms[i : i + at_once]
            values, count = bench.values(grid.spots[0], *some), some[0].size
            for spot in grid.spots:
                gain = gains(*base.alone(bench.white(spot, values), count), bench.precision(spot, values, count))
                out += [(float(g), Term(spot, form)) for g, form in zip(gain, some, strict=True)]
    return sorted(out, key=lambda each: -each[0])
