"""Which single term explains most in addition to the base, and how much would the best one gain by chance?"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from camcomp.diagnosis.law.bench_terms import Spot, Term, TermBench, spots
from camcomp.diagnosis.law.folds import Folds, Products, White
from camcomp.diagnosis.law.forms import Form, at_drive, at_tip
from camcomp.diagnosis.statistics.noise_model import BLOCK
from camcomp.ground.datatypes import Floats

FALSE_RATE = 0.02  # of a law where there is none
DRAWS = 40  # of signs, one for each block of rows
KEPT_BYTES = 400e6  # of white columns of all grids together; more are worked out anew at every step
LEAST_LEFT = 1e-4  # of a function's energy, or of a determinant, that base and neighbour have to leave


@dataclass(frozen=True, eq=False, kw_only=True)
class TermGrid:
    """Forms of as many functions each that are tried at spots with the same covariates; `at_once` of them are evaluated together.

    keep: whether there is room for their white columns.
    """

    bench: TermBench
    spots: tuple[Spot, ...]
    forms: tuple[Form, ...]
    at_once: int
    keep: bool
    _kept: list[tuple[tuple[Form, ...], list[White]]] = field(default_factory=list, init=False, repr=False)

    def parts(self) -> Iterator[tuple[tuple[Form, ...], list[White]]]:
        """Some forms after the other, with their white columns at every spot."""
        if self._kept:
            yield from self._kept
            return
        kept = []
        for i in range(0, len(self.forms), self.at_once):
            some = self.forms[i : i + self.at_once]
            values = self.bench.values(self.spots[0], *some)
            part = some, [self.bench.white(spot, values) for spot in self.spots]
            if self.keep:
                kept.append(part)
            yield part
        self._kept.extend(kept)


def term_grids(bench: TermBench, kind: str) -> list[TermGrid]:
    """Grids of terms for the spots of a law that shows in a kind of channel."""
    every = spots(len(bench.bench.actuators), kind)
    tip = tuple(each for each in every if each.on == "structure")
    groups = [each for each in (tip, *((each,) for each in every if each not in tip)) if each]
    pairs = [(where, some) for where in groups for some in _by_count(_forms(bench, where[0]))]
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

    def __init__(self, grids: Sequence[TermGrid], base: Folds, rng: np.random.Generator) -> None:
        self.grids, self.base, self.rng = grids, base, rng
        self._products: dict[Term, Products] = {}

    def gains(self, step: Folds) -> tuple[list[tuple[float, Term]], float]:
        """(gain in evidence, term) of all terms in addition to the base, best first, and the chance gain.

        Chance gain: the gain that the best function exceeds in FALSE_RATE of data without a law.
        """
        draws = self._draws(step.rest())
        chance, most = step.projected(draws), np.zeros(DRAWS)
        out: list[tuple[float, Term]] = []
        for forms, spot, white in (
            (forms, *each) for grid in self.grids for forms, whites in grid.parts() for each in zip(grid.spots, whites, strict=True)
        ):  # fmt: skip
            key, count = Term(spot, forms[0]), forms[0].size  # of the same products at every step
            if key not in self._products:
                self._products[key] = self.base.products(white, count)
            G, h, half = step.alone(white, self._products[key])
            size, own = (np.diagonal(each, axis1=1, axis2=2) for each in (G, self._products[key].own))
            good = size > LEAST_LEFT * own + 1e-9
            usable = good.all(axis=1) & (np.linalg.det(G) > LEAST_LEFT * np.prod(size, axis=1))
            G = np.where(usable[:, None, None], G, np.eye(count))
            gain = 0.5 * usable * np.einsum("fc,fc->f", h, np.linalg.solve(G, h[..., None])[..., 0])
            out += [(float(g), Term(spot, form)) for g, form in zip(gain, forms, strict=True)]
            e = sum(X.T @ d[white.reach(k)] for k, (X, d) in enumerate(zip(white.columns, draws, strict=True)))
            by_draw = 0.5 * good.reshape(-1, 1) * (e - half.T @ chance) ** 2 / np.maximum(size.reshape(-1, 1), 1e-12)
            most = np.maximum(most, by_draw.max(axis=0))
        beta = float(most.std()) * np.sqrt(6.0) / np.pi  # of Gumbel's distribution of a maximum
        threshold = float(most.mean() - np.euler_gamma * beta - beta * np.log(-np.log(1.0 - FALSE_RATE)))
        return sorted(out, key=lambda each: -each[0]), threshold

    def _draws(self, rest: Sequence[Floats]) -> list[Floats]:
        """Residuals (w, d) per run with random signs, one per block of rows."""
        out = []
        for r in rest:
            signs = self.rng.choice([-1.0, 1.0], size=(-(-len(r) // BLOCK), DRAWS))
            out.append(r[:, None] * np.repeat(signs, BLOCK, axis=0)[: len(r)])
        return out
