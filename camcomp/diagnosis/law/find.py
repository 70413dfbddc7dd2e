"""The search for a law or a map: best subset of terms whose shapes are refined beside the set that was found before.

A term enters where it makes withheld runs more probable by more than its prior odds: all kinds of terms at all spots are
equally likely, and a shape was looked for among many.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from camcomp.diagnosis.law.bench_terms import Term, TermRows
from camcomp.diagnosis.law.forms import Form, SmoothForm
from camcomp.diagnosis.law.screen import TermGrid, gains_of_terms
from camcomp.diagnosis.law.shapes import Shapes
from camcomp.diagnosis.model.candidates import PlacedCause
from camcomp.diagnosis.model.evidence import Members
from camcomp.diagnosis.model.noise import MINOR
from camcomp.diagnosis.model.search import ROUNDS, search_sets
from camcomp.diagnosis.statistics.folds import ALTERNATING, Folds, RunColumns, Split, gains, usual_split, withheld
from camcomp.diagnosis.statistics.probability import EQUAL_LOG_ODDS
from camcomp.ground.datatypes import Floats

BETTER = 0.9  # of what the causes or a law leave on withheld parts: a law, or another one, has to leave less
REFINED = 7  # kinds of terms whose shapes are followed at every step
CONSTANT = Form(family="constant", about=(), texts=("1",), units=("",))
_PLAIN = ("line", "power", "product", "rate", "force")  # simpler kinds of the same value come first


@dataclass(frozen=True, eq=False, kw_only=True)
class FoundLaw:
    """terms, and for each of them other terms that the data cannot tell from it; columns (c of all terms in order): white, with
    their prior precision (c,); folds: the base that they are fitted with.
    """

    terms: tuple[Term, ...]
    folds: Folds
    columns: tuple[RunColumns, ...]
    precision: Floats
    alike: tuple[tuple[Term, ...], ...] = ()

    @property
    def is_map(self) -> bool:
        """Whether it is a smooth map instead of a formula."""
        return isinstance(self.terms[0].form, SmoothForm)

    @property
    def theta(self) -> Floats:
        """Coefficients (c,)."""
        return np.asarray(self._fit[0][0])

    @property
    def theta_without(self) -> Floats:
        """Coefficients (f, c), each fitted without one of the parts."""
        return self._fit[0][1:]

    @property
    def covariance(self) -> Floats:
        """Of the coefficients, (c, c)."""
        return self._fit[1]

    @cached_property
    def _fit(self) -> tuple[Floats, Floats]:
        return self.folds.coefficients(self.columns, self.precision)

    def by_term(self, theta: Floats) -> list[Floats]:
        """Coefficients (..., c) of all terms, split by term."""
        return np.split(theta, np.cumsum([term.form.size for term in self.terms])[:-1], axis=-1)


def fitted(shapes: Shapes, terms: Sequence[Term], folds: Folds) -> FoundLaw:
    """Terms fitted jointly with a base."""
    columns, precision = zip(*map(shapes.columns, terms), strict=True)
    return FoundLaw(terms=tuple(terms), folds=folds, columns=columns, precision=np.concatenate(precision))


def find_law(
    bench: TermRows, base: Callable[[Split, bool], Folds], grids: Sequence[TermGrid], floor_mm: float
) -> FoundLaw | None:
    """The law with terms of the grids that the residual follows; None where all fail on withheld parts.

    base: makes the folds of a split of time, with or without a free constant at every spot of the tip.
    """
    return _Search(bench, base, grids, floor_mm).run()


class _Search:
    def __init__(
        self, bench: TermRows, base: Callable[[Split, bool], Folds], grids: Sequence[TermGrid], floor_mm: float
    ) -> None:
        self.base, self.split = base, usual_split(len(bench.row_counts))
        self.folds = base(self.split, True)
        self.bench, self.grids, self.floor_mm = bench, grids, floor_mm
        self.shapes = Shapes(bench)
        self.per_term = float(np.log(len({Term(s, f).kind for grid in grids for s in grid.spots for f in grid.forms})))

    def run(self) -> FoundLaw | None:
        chosen: tuple[Term, ...] = ()
        pool: list[Term] = []
        for _ in range(ROUNDS):
            pool = [*dict.fromkeys([*pool, *self._candidates(chosen)])]
            before, chosen = chosen, self._best_set(pool) if pool else ()
            if [term.kind for term in chosen] == [term.kind for term in before]:
                break
        if not chosen:
            return None
        chosen = self._without_idle(chosen)
        # cross-validation by runs cannot test terms that act in one of them alone
        self.folds = self.base(ALTERNATING if any(t.form.passing for t in chosen) else self.split, False)
        return self._answer(self._with_constants(chosen), pool)

    def _candidates(self, chosen: Sequence[Term]) -> list[Term]:
        """Terms that may join a set or replace one of its terms, each with the shape that the data want beside the others."""
        step = self._beside(chosen)
        ranked = [each for each in gains_of_terms(self.bench, self.grids, step) if each[0] > 0.0]
        leaders = self._leaders(ranked)
        # the other spots at which the same function of the same covariates can act
        where = [(t, s) for t in chosen for each in self.grids if t.spot in each.spots for s in each.spots]
        leaders += [Term(spot, t.form) for t, spot in where if spot != t.spot]
        fine = sorted((self._refined(step, term) for term in leaders), key=lambda each: -each[0])
        again = [self.shapes.followed(self._beside([o for o in chosen if o != t]), t) for t in chosen]
        return [*again, *(term for _, term in fine[: 2 * REFINED])]

    def _beside(self, chosen: Sequence[Term]) -> Folds:
        """The base with the terms chosen so far in it."""
        if not chosen:
            return self.folds
        found = fitted(self.shapes, chosen, self.folds)
        return self.folds.extended(found.columns, found.precision)

    @staticmethod
    def _leaders(ranked: Sequence[tuple[float, Term]]) -> list[Term]:
        """The best of every kind of term at every spot, as far as they are near the best of all."""
        out: dict[tuple[object, ...], Term] = {}
        for gain, term in ranked:
            if gain < 0.4 * ranked[0][0] or len(out) >= 3 * REFINED:
                break
            out.setdefault(term.kind, term)
        shaped = [term for term in out.values() if term.form.shape][:REFINED]
        return [*shaped, *(term for term in out.values() if not term.form.shape)]

    def _refined(self, step: Folds, term: Term) -> tuple[float, Term]:
        """(log density on withheld parts less what shapes cost, term with the shape that the data want)."""
        term = self.shapes.followed(step, term)
        white, size = self.shapes.columns(term)
        return withheld(gains(*step.together([white]), size)) - self._cost(term), term

    def _cost(self, term: Term) -> float:
        """Log odds against a term: all kinds are equally likely, and a shape was looked for among many."""
        return EQUAL_LOG_ODDS * len(term.form.shape) + self.per_term

    def _sets(self, terms: Sequence[Term]) -> _TermSets:
        found = fitted(self.shapes, terms, self.folds)
        return _TermSets(found, self.folds.together(found.columns), [self._cost(t) for t in terms])

    def _best_set(self, pool: Sequence[Term]) -> tuple[Term, ...]:
        """The term first that explains most alone."""
        sets = search_sets(self._sets(pool))
        return tuple(pool[i] for i in sorted(simplest(sets, pool), key=lambda i: -sets[(i,)]))

    def _with_constants(self, chosen: tuple[Term, ...]) -> tuple[Term, ...]:
        """The terms, and a constant per spot where it makes withheld parts clearly more probable."""
        for spot in dict.fromkeys(t.spot for t in chosen if isinstance(t.form, Form)):
            n, more = len(chosen), (*chosen, Term(spot, CONSTANT))
            sets = self._sets(more)
            if sets.value(range(n + 1)) > sets.value(range(n)) + EQUAL_LOG_ODDS:
                chosen = more
        return chosen

    def _without_idle(self, chosen: Sequence[Term]) -> tuple[Term, ...]:
        """The terms that move the tip by MINOR of the noise floor, or the largest one."""
        size = list(strengths(self.bench, fitted(self.shapes, chosen, self.folds)))
        least = min(max(size), (MINOR * self.floor_mm) ** 2)
        return tuple(t for t, own in zip(chosen, size, strict=True) if own >= least)

    def _answer(self, chosen: Sequence[Term], pool: Sequence[Term]) -> FoundLaw:
        own, others = len(chosen), [each for each in pool if each not in chosen]
        sets, alike = self._sets([*chosen, *others]), []
        least = sets.value(range(own)) - EQUAL_LOG_ODDS
        for i, term in enumerate(chosen):
            rest = [j for j in range(own) if j != i]
            instead = [(j, other) for j, other in enumerate(others, own) if other.kind != term.kind]
            alike.append(tuple(other for j, other in instead if sets.value([*rest, j]) > least))
        return replace(fitted(self.shapes, chosen, self.folds), alike=tuple(alike))


class _TermSets:
    """Sets of terms by their log density on withheld parts less what they cost; of a spot one map at most."""

    def __init__(self, found: FoundLaw, data: tuple[Floats, Floats], costs: Sequence[float]) -> None:
        self.data, self.costs, self.precision = data, costs, found.precision
        self.own = [own.astype(int) for own in found.by_term(np.arange(float(len(found.precision))))]
        self.usable = range(len(costs))
        self.candidates = [
            PlacedCause(f"map {t.spot}" if isinstance(t.form, SmoothForm) else f"term {i}", None, ())
            for i, t in enumerate(found.terms)
        ]

    def value(self, members: Sequence[int]) -> float:
        if not members:
            return 0.0
        on, (G, h) = np.concatenate([self.own[i] for i in members]), self.data
        gain = withheld(gains(G[:, on][:, :, on], h[:, on], self.precision[on]))
        return gain - sum(self.costs[i] for i in members)

    def with_one_more(self, members: Members, more: Sequence[int]) -> Floats:
        return np.array([self.value((*members, i)) for i in more])


def simplest(sets: Mapping[Members, float], terms: Sequence[Term]) -> Members:
    """Of the sets that explain as well as the best one, by less than EQUAL_LOG_ODDS, the one of the fewest and simplest terms."""

    def complexity(members: Members) -> tuple[float, ...]:
        own = [terms[i] for i in members]
        uncommon = sum(t.form.family not in _PLAIN for t in own)
        return (
            len(own), uncommon, sum(len(t.form.shape) for t in own), sum(map(unlikely, own)), -sets[members]
        )  # fmt: skip

    least = max(sets.values()) - EQUAL_LOG_ODDS
    return min((m for m, value in sets.items() if value > least), key=complexity)


def strengths(bench: TermRows, found: FoundLaw) -> Iterator[float]:
    """Mean square of what each term does to the tip, mm2."""
    for term, theta in zip(found.terms, found.by_term(found.theta), strict=True):
        values = [v @ theta[:, None] for v in bench.values(term.spot, term.form)]
        yield float(bench.rms(term.spot, values)[0]) ** 2


def unlikely(term: Term) -> bool:
    """Of a drive that leads one axis of the tip: what follows its own travel, or acts for a while, is its own; else the
    tip's, that too which follows a drive's load where that is the force along an axis.
    """
    own = term.form.family == "while" or term.form.about[0].startswith(("act", *"xyz"))
    return (term.spot.on == "drive") != own
