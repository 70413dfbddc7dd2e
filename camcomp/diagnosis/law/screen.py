"""Which single term explains most in addition to the base, and how much would the best one gain by chance?"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from camcomp.diagnosis.law.bench_terms import AT_ONCE, Spot, Term, TermBench, spots
from camcomp.diagnosis.law.folds import Folds
from camcomp.diagnosis.law.forms import Form, at_drive, at_tip
from camcomp.diagnosis.law.white import White
from camcomp.diagnosis.statistics.noise_model import BLOCK
from camcomp.ground.datatypes import Bools, Floats, Ints

FALSE_RATE = 0.02  # of a law where there is none
DRAWS = 40  # of signs, one for each block of rows
KEPT_BYTES = 400e6  # of white columns of all grids together; more are worked out anew at every step
AT_ONCE_BYTES = 12e6  # of functions before rows are thinned


@dataclass(frozen=True, eq=False, kw_only=True)
class TermGrid:
    """All terms that are tried at spots where the same covariates stand, whose functions are evaluated once.

    first (forms,): column at which each form begins, of `width`; at_once: forms that are evaluated together; keep: whether there
    is room for their white columns.
    """

    bench: TermBench
    spots: tuple[Spot, ...]
    forms: tuple[Form, ...]
    first: Ints
    width: int
    at_once: int
    keep: bool
    _kept: list[tuple[slice, list[White]]] = field(default_factory=list, init=False, repr=False)

    def parts(self) -> Iterator[tuple[slice, list[White]]]:
        """Some columns after the other, forms never torn apart: which they are, and white at every spot."""
        if self._kept:
            yield from self._kept
            return
        ends = [*self.first, self.width]
        kept = []
        for i in range(0, len(self.forms), self.at_once):
            some = self.forms[i : i + self.at_once]
            values = self.bench.values(self.spots[0], *some)
            part = slice(ends[i], ends[i + len(some)]), [self.bench.white(spot, values) for spot in self.spots]
            if self.keep:
                kept.append(part)
            yield part
        self._kept.extend(kept)


def term_grids(bench: TermBench, kind: str) -> list[TermGrid]:
    """Grids of terms for the spots of a law that shows in a kind of channel."""
    every = spots(len(bench.bench.actuators), kind)
    tip = [each for each in every if each.on == "structure"]
    groups = [each for each in (tip, *([each] for each in every if each not in tip)) if each]
    forms = [_forms(bench, where[0]) for where in groups]
    widths = [sum(len(each.texts) for each in some) for some in forms]
    rows = [sum(bench.white_rows(spot) for spot in where) for where in groups]
    keep = 8.0 * float(np.dot(widths, rows)) < KEPT_BYTES
    long = sum(len(way) for way in bench.tip_ways(every[0]))
    at_once = int(np.clip(AT_ONCE_BYTES / (16.0 * long), 4, AT_ONCE))
    return [_grid(bench, where, some, at_once, keep) for where, some in zip(groups, forms, strict=True)]


def _forms(bench: TermBench, spot: Spot) -> Sequence[Form]:
    size = bench.sizes(spot)
    if spot.on in ("control", "drive"):
        return at_drive(size, bench.bench.twin.robot.actuators[spot.index].revolute)
    return at_tip(size)


def _grid(bench: TermBench, where: Sequence[Spot], forms: Sequence[Form], at_once: int, keep: bool) -> TermGrid:
    ends = np.cumsum([0, *(len(each.texts) for each in forms)])
    return TermGrid(
        bench=bench, spots=tuple(where), forms=tuple(forms), first=ends[:-1], width=int(ends[-1]), at_once=at_once,
        keep=keep,
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class _Part:
    """Some columns of a grid at a spot against the base, the same at all steps: cross (k, c), target (c,), energy own (c,), and
    products (c,) of a column with the next.
    """

    cross: Floats
    target: Floats
    own: Floats
    products: Floats


@dataclass(frozen=True, eq=False, kw_only=True)
class _View:
    """The terms at a spot with the base taken out, all data: G, h (c,), products (c,) with the next column, usable (c,); chance (d,):
    the largest gain in evidence of any for every draw of signs.
    """

    grid: TermGrid
    spot: Spot
    G: Floats
    h: Floats
    products: Floats
    good: Bools
    chance: Floats


class Screen:
    """Gains of all terms of the grids in addition to a base of a law search, and to that base with terms in it."""

    def __init__(self, grids: Sequence[TermGrid], base: Folds, rng: np.random.Generator) -> None:
        self.grids, self.base, self.rng = grids, base, rng
        self._parts: dict[tuple[Spot, int], _Part] = {}

    def gains(self, step: Folds) -> tuple[list[tuple[float, Term]], float]:
        """(gain in evidence, term) of all terms in addition to the base, best first, and the chance gain.

        Chance gain: the gain that the best term exceeds in FALSE_RATE of data without a law.
        """
        draws = self._draws(step.rest())
        chance = step.projected(draws)
        views = [view for grid in self.grids for view in self._seen(step, grid, draws, chance)]
        return _singles(views), _by_chance(views)

    def _draws(self, rest: Sequence[Floats]) -> list[Floats]:
        """Residuals (w, d) per run with random signs, one per block of rows."""
        out = []
        for r in rest:
            signs = self.rng.choice([-1.0, 1.0], size=(-(-len(r) // BLOCK), DRAWS))
            out.append(r[:, None] * np.repeat(signs, BLOCK, axis=0)[: len(r)])
        return out

    def _seen(self, step: Folds, grid: TermGrid, draws: Sequence[Floats], chance: Floats) -> list[_View]:
        shape = len(grid.spots), grid.width
        G, h, products, good = np.zeros(shape), np.zeros(shape), np.zeros(shape), np.zeros(shape, bool)
        most = np.zeros((len(grid.spots), DRAWS))
        for at, whites in grid.parts():
            for n, (spot, white) in enumerate(zip(grid.spots, whites, strict=True)):
                part = self._part(spot, at.start, white)
                half = step.halved(np.concatenate([part.cross, step.cross(white, first=len(self.base.more))]))
                G[n, at] = part.own - np.einsum("kc,kc->c", half, half)
                h[n, at] = part.target - step.of_target(half)
                products[n, at] = part.products - _following([half])
                good[n, at] = G[n, at] > 1e-4 * part.own + 1e-9
                e = sum(X.T @ d[white.reach(k)] for k, (X, d) in enumerate(zip(white.columns, draws, strict=True)))
                e = e - half.T @ chance
                gain = np.where(good[n, at, None], 0.5 * e**2 / np.maximum(G[n, at], 1e-12)[:, None], 0.0)
                most[n] = np.maximum(most[n], gain.max(axis=0, initial=0.0))
        return [
            _View(grid=grid, spot=spot, G=G[n], h=h[n], products=products[n], good=good[n], chance=most[n])
            for n, spot in enumerate(grid.spots)
        ]

    def _part(self, spot: Spot, first: int, white: White) -> _Part:
        """Columns of a spot from number `first` of its grid on, against the base."""
        if (spot, first) not in self._parts:
            own = np.asarray(np.sum([np.einsum("rc,rc->c", X, X) for X in white.columns], axis=0))
            cross, target = self.base.cross(white), self.base.target(white)
            self._parts[spot, first] = _Part(cross, target, own, _following(white.columns))
        return self._parts[spot, first]


def _singles(views: Sequence[_View]) -> list[tuple[float, Term]]:
    """(gain in evidence, term) of all grid terms, best first."""
    out: list[tuple[float, Term]] = []
    for view in views:
        grid, G, h, good = view.grid, view.G, view.h, view.good
        count = np.array([len(each.texts) for each in grid.forms])
        one = np.flatnonzero(count == 1)
        i = grid.first[one]
        gain = np.where(good[i], 0.5 * h[i] ** 2 / np.maximum(G[i], 1e-12), 0.0)
        out += [(float(g), Term(view.spot, grid.forms[k])) for g, k in zip(gain, one, strict=True)]
        two = np.flatnonzero(count == 2)
        if len(two):
            i = grid.first[two]
            cross = view.products[i]
            det = G[i] * G[i + 1] - cross**2
            fit = (h[i] ** 2 * G[i + 1] - 2 * h[i] * h[i + 1] * cross + h[i + 1] ** 2 * G[i]) / np.maximum(det, 1e-12)
            usable = good[i] & good[i + 1] & (det > 1e-4 * G[i] * G[i + 1])
            gain = np.where(usable, 0.5 * fit, 0.0)
            out += [(float(g), Term(view.spot, grid.forms[k])) for g, k in zip(gain, two, strict=True)]
    return sorted(out, key=lambda each: -each[0])


def _by_chance(views: Sequence[_View]) -> float:
    """Gain that the best of all terms has with signs drawn at random, exceeded in FALSE_RATE of draws."""
    most = np.max([each.chance for each in views], axis=0)
    beta = float(most.std()) * np.sqrt(6.0) / np.pi
    return float(most.mean() - 0.5772 * beta - beta * np.log(-np.log(1.0 - FALSE_RATE)))


def _following(columns: Sequence[Floats]) -> Floats:
    """Products (c,) of columns (n, c) with the next ones, over all parts of the rows; 0 of the last."""
    each = np.sum([np.einsum("rc,rc->c", X[:, :-1], X[:, 1:]) for X in columns], axis=0)
    return np.append(each, 0.0)
