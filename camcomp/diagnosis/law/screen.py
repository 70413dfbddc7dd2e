"""Which single term explains most in addition to the base?"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from camcomp.diagnosis.law.bench_terms import Spot, Term, TermBench, TermRows, spots
from camcomp.diagnosis.law.folds import Folds, Products, White, gains
from camcomp.diagnosis.law.forms import Form, at_drive, at_tip
from camcomp.ground.datatypes import Floats

KEPT_BYTES = 400e6  # of white columns of all grids together; more are worked out anew at every step
Part = tuple[tuple[Form, ...], list[tuple[White, Floats]]]


@dataclass(frozen=True, eq=False, kw_only=True)
class TermGrid:
    """Forms of as many functions each that are tried at spots with the same covariates; `at_once` of them are evaluated together.

    keep: whether there is room for their white columns.
    """

    bench: TermRows
    spots: tuple[Spot, ...]
    forms: tuple[Form, ...]
    at_once: int
    keep: bool
    _kept: list[Part] = field(default_factory=list, init=False, repr=False)

    def parts(self) -> Iterator[Part]:
        """Some forms after the other, with their white columns and prior precisions at every spot."""
        if self._kept:
            yield from self._kept
            return
        kept = []
        for i in range(0, len(self.forms), self.at_once):
            some = self.forms[i : i + self.at_once]
            values = self.bench.values(self.spots[0], *some)
            part = (
                some,
                [(self.bench.white(s, values), self.bench.precision(s, values, some[0].size)) for s in self.spots],
            )
            if self.keep:
                kept.append(part)
            yield part
        self._kept.extend(kept)


def term_grids(bench: TermBench, kind: str) -> list[TermGrid]:
    """Grids of terms for the spots of a law that shows in a kind of channel."""
    every = spots(len(bench.bench.actuators), kind)
    tip = tuple(each for each in every if each.on == "structure")
    groups = [each for each in (tip, *((each,) for each in every if each not in tip)) if each]
    return grids_of(bench, [(where, _forms(bench, where[0])) for where in groups])


def grids_of(bench: TermRows, tried: Sequence[tuple[tuple[Spot, ...], Sequence[Form]]]) -> list[TermGrid]:
    """Grids of forms that are tried at spots with the same covariates."""
    pairs = [(where, some) for where, forms in tried for some in _by_count(forms)]
    size = sum(8.0 * sum(map(bench.white_rows, where)) * len(some) * some[0].size for where, some in pairs)
    return [
        TermGrid(bench=bench, spots=where, forms=some, at_once=bench.at_once, keep=size < KEPT_BYTES)
        for where, some in pairs
    ]


def _by_count(forms: Sequence[Form]) -> list[tuple[Form, ...]]:
    """Forms of one function, of two functions, and so on."""
    return [tuple(f for f in forms if f.size == count) for count in sorted({f.size for f in forms})]


def _forms(bench: TermBench, spot: Spot) -> Sequence[Form]:
    size = bench.sizes(spot)
    if spot.on in ("control", "drive"):
        return at_drive(size, bench.bench.twin.robot.actuators[spot.index].revolute)
    return at_tip(size)


class Screen:
    """Gains of all terms of the grids in addition to a base of a law search, and to that base with terms in it."""

    def __init__(self, grids: Sequence[TermGrid], base: Folds) -> None:
        self.grids, self.base = grids, base
        self._products: dict[Term, Products] = {}

    def gains(self, step: Folds) -> list[tuple[float, Term]]:
        """(gain in evidence, term) of all terms in addition to the base, best first."""
        out: list[tuple[float, Term]] = []
        for grid in self.grids:
            for forms, columns in grid.parts():
                for spot, (white, precision) in zip(grid.spots, columns, strict=True):
                    key = Term(spot, forms[0])  # of the same products at every step
                    if key not in self._products:
                        self._products[key] = self.base.products(white, grid.forms[0].size)
                    gain = gains(*step.alone(white, self._products[key]), precision)
                    out += [(float(g), Term(spot, form)) for g, form in zip(gain, forms, strict=True)]
        return sorted(out, key=lambda each: -each[0])
