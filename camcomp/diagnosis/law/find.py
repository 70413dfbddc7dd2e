"""The search for a law: forward selection over all terms, shapes refined, small sets tried exhaustively.

A term enters where it makes withheld runs more probable by more than its prior odds: all kinds of terms at all spots are
equally likely, and a shape was looked for among many. Source: forward selection as in sparse regression of dynamics.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations

import numpy as np

from camcomp.diagnosis.law.bench_terms import Spot, Term, TermBench, TermRows, spots
from camcomp.diagnosis.law.forms import Form, Sizes, SmoothForm
from camcomp.diagnosis.law.screen import TermGrid, gains_of_terms
from camcomp.diagnosis.law.shapes import Shapes
from camcomp.diagnosis.model.discrepancy import ORDERS
from camcomp.diagnosis.model.noise import MINOR
from camcomp.diagnosis.model.search import MOST
from camcomp.diagnosis.statistics.folds import ALTERNATING, Folds, RunColumns, Split, gains, usual_split, withheld
from camcomp.diagnosis.statistics.probability import EQUAL_LOG_ODDS
from camcomp.ground.datatypes import Floats

BETTER = 0.9  # of what the causes or a law leave on withheld parts: a law, or another one, has to leave less
_SINGLE = ("heading_rad", "temp_C", "cut_min", "fx_N", "fy_N", "fz_N")  # covariates of a map by themselves
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
        chosen: list[Term] = []
        pool: list[Term] = []
        score = 0.0
        while len(chosen) < MOST:
            step = self._beside(chosen)
            ranked = [each for each in gains_of_terms(self.bench, self.grids, step) if each[0] > 0.0]
            fine = [self._refined(step, term) for _, term in self._leaders(ranked)]
            # the other spots at which the same function of the same covariates can act
            where = [(t, s) for t in chosen for each in self.grids if t.spot in each.spots for s in each.spots]
            fine += [self._refined(step, Term(spot, t.form)) for t, spot in where if spot != t.spot]
            if not fine:
                break
            fine.sort(key=lambda each: -each[0])
            pool += [term for _, term in fine[: 2 * REFINED]]
            near = [term for score, term in fine if score > fine[0][0] - EQUAL_LOG_ODDS]
            best = min(near, key=lambda t: (t.form.family not in _PLAIN, len(t.form.shape), unlikely(t)))
            after = self._score((*chosen, best))
            if after < score + EQUAL_LOG_ODDS:
                break
            chosen, score = [*chosen, best], after
        if not chosen:
            return None
        chosen = self._exhaustive(chosen, pool, score)
        chosen = self._without_idle(chosen)
        # cross-validation by runs cannot test terms that act in one of them alone
        self.folds = self.base(ALTERNATING if any(t.form.passing for t in chosen) else self.split, False)
        return self._answer(self._with_constants(chosen), pool)

    def _with_constants(self, chosen: list[Term]) -> list[Term]:
        """The terms, and a constant per spot where it makes withheld parts clearly more probable."""
        for spot in dict.fromkeys(term.spot for term in chosen):
            more = [*chosen, Term(spot, CONSTANT)]
            if self._score(more) > self._score(chosen) + EQUAL_LOG_ODDS:
                chosen = more
        return chosen

    # -- one step ------------------------------------------------------------------------------------------------------

    def _beside(self, chosen: Sequence[Term]) -> Folds:
        """The base with the terms chosen so far in it."""
        if not chosen:
            return self.folds
        found = fitted(self.shapes, chosen, self.folds)
        return self.folds.extended(found.columns, found.precision)

    @staticmethod
    def _leaders(ranked: Sequence[tuple[float, Term]]) -> list[tuple[float, Term]]:
        """The best of every kind of term at every spot, as far as they are near the best of all."""
        out: dict[tuple[object, ...], tuple[float, Term]] = {}
        for gain, term in ranked:
            if gain < 0.4 * ranked[0][0] or len(out) >= 3 * REFINED:
                break
            out.setdefault(term.kind, (gain, term))
        shaped = [each for each in out.values() if each[1].form.shape][:REFINED]
        plain = [each for each in out.values() if not each[1].form.shape]
        return [*shaped, *plain]

    def _refined(self, step: Folds, term: Term) -> tuple[float, Term]:
        """(log density on withheld parts less what shapes cost, term with the shape that the data want)."""
        term = self.shapes.followed(step, term)
        white, size = self.shapes.columns(term)
        return withheld(gains(*step.together([white]), size)) - self._costs([term]), term

    def _costs(self, terms: Sequence[Term]) -> float:
        """Log odds against terms: their kinds are equally likely, and shapes were looked for among many."""
        return sum(EQUAL_LOG_ODDS * len(t.form.shape) + self.per_term for t in terms)

    # -- sets ----------------------------------------------------------------------------------------------------------

    def _score(self, terms: Sequence[Term]) -> float:
        return self._scores(terms)(range(len(terms)))

    def _scores(self, terms: Sequence[Term]) -> Callable[[Sequence[int]], float]:
        """Function of term numbers: log density on withheld parts minus the cost of these terms."""
        found = fitted(self.shapes, terms, self.folds)
        G, h = self.folds.together(found.columns)
        own = found.by_term(np.arange(float(len(found.precision))))

        def score(some: Sequence[int]) -> float:
            at = np.concatenate([own[i] for i in some]).astype(int)
            gain = withheld(gains(G[:, at][:, :, at], h[:, at], found.precision[at]))
            return gain - self._costs([terms[i] for i in some])

        return score

    def _exhaustive(self, chosen: list[Term], pool: Sequence[Term], score: float) -> list[Term]:
        """The best of all sets of up to three terms of the pool, where it exceeds the chosen set by the margin."""
        terms = list(dict.fromkeys([*chosen, *sorted(pool, key=lambda t: -self._score([t]))]))[
            : max(2 * REFINED, len(chosen))
        ]
        of = self._scores(terms)
        best, value = chosen, score
        for count in (1, 2, 3):
            for some in combinations(range(len(terms)), count):
                gain, tried = of(some), [terms[i] for i in some]
                if gain > value + margin(tried, best):
                    best, value = tried, gain
        return best

    def _without_idle(self, chosen: list[Term]) -> list[Term]:
        """The terms that move the tip by MINOR of the noise floor, or the largest one."""
        while len(chosen) > 1:
            size = list(strengths(self.bench, fitted(self.shapes, chosen, self.folds)))
            if min(size) > (MINOR * self.floor_mm) ** 2:
                break
            chosen.pop(int(np.argmin(size)))
        return chosen

    def _answer(self, chosen: list[Term], pool: Sequence[Term]) -> FoundLaw:
        own, others = len(chosen), [each for each in dict.fromkeys(pool) if each not in chosen]
        of = self._scores([*chosen, *others])
        gain = of(range(own))
        alike = []
        for i, term in enumerate(chosen):
            instead = [(j, other) for j, other in enumerate(others, own) if other.kind != term.kind]
            same = [other for j, other in instead if of([*range(i), j, *range(i + 1, own)]) > gain - EQUAL_LOG_ODDS]
            alike.append(tuple(same))
        return replace(fitted(self.shapes, chosen, self.folds), alike=tuple(alike))


def strengths(bench: TermRows, found: FoundLaw) -> Iterator[float]:
    """Mean square of what each term does to the tip, mm2."""
    for term, theta in zip(found.terms, found.by_term(found.theta), strict=True):
        values = [v @ theta[:, None] for v in bench.values(term.spot, term.form)]
        yield float(bench.rms(term.spot, values)[0]) ** 2


def margin(tried: Sequence[Term], best: Sequence[Term]) -> float:
    """Log density by which a set has to be more probable than another: fewer terms and fewer shapes go before."""
    shapes = [sum(len(t.form.shape) for t in terms) for terms in (tried, best)]
    if len(tried) < len(best):
        return -EQUAL_LOG_ODDS
    return EQUAL_LOG_ODDS if shapes[0] > shapes[1] else 0.5


def unlikely(term: Term) -> bool:
    """Of a drive that leads one axis of the tip: what follows its own travel, or acts for a while, is its own; else the
    tip's, that too which follows a drive's load where that is the force along an axis.
    """
    own = term.form.family == "while" or term.form.about[0].startswith(("act", *"xyz"))
    return (term.spot.on == "drive") != own


def find_map(bench: TermBench, folds: Folds, kind: str) -> FoundLaw | None:
    """The smooth maps that the residual of a kind of channel follows: cubic splines over one or two covariates.

    Covariates and spots make withheld parts most probable, one spot after the other; None where none gains EQUAL_LOG_ODDS.
    """
    where, shapes, step = spots(len(bench.bench.actuators), kind), Shapes(bench), folds
    chosen: list[Term] = []
    while len(chosen) < len(where):
        best: tuple[float, Term] | None = None
        for spot in [s for s in where if all(s != each.spot for each in chosen)]:
            size = bench.sizes(spot)
            for names in _covariates(spot, size):
                counts = (2 * ORDERS,) if len(names) == 1 else (ORDERS, ORDERS)
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
        return [("act_mm",)] if size.wide("act_mm") else []
    axes = [f"{a}_mm" for a in "xyz" if size.wide(f"{a}_mm")]
    pairs = [(a, b) for i, a in enumerate(axes) for b in axes[i + 1 :]]
    return [*pairs, *((a,) for a in axes), *((name,) for name in _SINGLE if size.wide(name))]
