"""Which single term explains most in addition to the base?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from camcomp.diagnosis.law.bench_terms import Spot, Term, TermBench, TermRows, spots
from camcomp.diagnosis.law.forms import Form, at_drive, at_tip
from camcomp.diagnosis.statistics.folds import Folds, Products, RunColumns, gains
from camcomp.ground.datatypes import Floats

KEPT_BYTES = 400e6  # of white columns that are kept; more are worked out anew at every step
Columns = list[tuple[RunColumns, Floats]]  # of some forms, with their prior precisions, at every spot


@dataclass(frozen=True)
class TermGrid:
    """Forms of as many functions each that are tried at spots with the same covariates."""

    spots: tuple[Spot, ...]
    forms: tuple[Form, ...]


def term_grids(bench: TermBench, kind: str) -> list[TermGrid]:
    """Grids of terms for the spots of a law that shows in a kind of channel."""
    every = spots(len(bench.bench.actuators), kind)
    tip = tuple(each for each in every if each.on == "structure")
    groups = [each for each in (tip, *((each,) for each in every if each not in tip)) if each]

    def forms(spot: Spot) -> Sequence[Form]:
        size = bench.sizes(spot)
        revolute = spot.on != "structure" and bench.bench.twin.robot.actuators[spot.index].revolute
        return at_tip(size) if spot.on == "structure" else at_drive(size, revolute)

    return grids_of([(where, forms(where[0])) for where in groups])


def grids_of(tried: Sequence[tuple[tuple[Spot, ...], Sequence[Form]]]) -> list[TermGrid]:
    """Grids of forms that are tried at spots with the same covariates."""
    return [
        TermGrid(where, tuple(f for f in forms if f.size == count))
        for where, forms in tried
        for count in sorted({f.size for f in forms})
    ]


class Screen:
    """Gains of all terms of the grids in addition to a base of a law search, and to that base with terms in it."""

    def __init__(self, bench: TermRows, grids: Sequence[TermGrid], base: Folds) -> None:
        self.bench, self.grids, self.base = bench, grids, base
        self._room = KEPT_BYTES
        self._kept: dict[Term, Columns] = {}
        self._products: dict[Term, Products] = {}

    def gains(self, step: Folds) -> list[tuple[float, Term]]:
        """(gain in evidence, term) of all terms in addition to the base, best first."""
        out: list[tuple[float, Term]] = []
        for grid in self.grids:
            for i in range(0, len(grid.forms), self.bench.at_once):
                some = grid.forms[i : i + self.bench.at_once]
                for spot, (white, precision) in zip(grid.spots, self._columns(grid.spots, some), strict=True):
                    key = Term(spot, some[0])  # of the same products at every step
                    if key not in self._products:
                        self._products[key] = self.base.products(white, some[0].size)
                    gain = gains(*step.alone(white, self._products[key]), precision)
                    out += [(float(g), Term(spot, form)) for g, form in zip(gain, some, strict=True)]
        return sorted(out, key=lambda each: -each[0])

    def _columns(self, where: Sequence[Spot], forms: Sequence[Form]) -> Columns:
        """White columns and prior precisions of forms at every spot; kept as long as there is room."""
        key = Term(where[0], forms[0])
        if key in self._kept:
            return self._kept[key]
        values = self.bench.values(where[0], *forms)
        out: Columns = [(self.bench.white(s, values), self.bench.precision(s, values, forms[0].size)) for s in where]
        size = sum(X.nbytes for white, _ in out for each in white for _, X in each.parts)
        if size <= self._room:
            self._room -= size
            self._kept[key] = out
        return out
