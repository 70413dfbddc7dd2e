"""The search for a law: forward selection over all terms, shapes refined, small sets tried exhaustively.

A term enters where it makes withheld runs more probable and where chance hardly could: its gain in evidence has to exceed what
the best of all terms gains when the signs of stretches of the residual are drawn at random (a false law in FALSE_RATE of such
data). Source: forward selection as in sparse regression of dynamics; wild bootstrap of the maximum.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from camcomp.diagnosis.law.bench_terms import Spot, Term, TermBench
from camcomp.diagnosis.law.folds import ALTERNATING, Folds, Split, gains, usual_split, withheld
from camcomp.diagnosis.law.forms import Form
from camcomp.diagnosis.law.screen import Screen, TermGrid
from camcomp.diagnosis.law.shapes import Shapes
from camcomp.diagnosis.law.white import White
from camcomp.ground.datatypes import Floats

MOST_TERMS = 6
REFINED = 7  # kinds of terms whose shapes are followed at every step
PER_SHAPE = 3.0  # log density that a number of a shape has to bring: it was looked for among many
PER_TERM = 4.0
POOL = 14  # terms among which all sets of up to three are tried
SAME = 3.0  # log density by which a term may be worse and is still as good
LEAST_GAIN = 0.01  # of the log density that a law has brought: less is not worth a term
LEAST_SHARE = 0.03  # of a law's energy at the tip, below which a term goes again
CONSTANT = Form(family="constant", about=(), texts=("1",), units=("",))
_PLAIN = ("line", "power", "product", "rate", "force")  # simpler kinds of the same value come first


@dataclass(frozen=True, eq=False, kw_only=True)
class FoundLaw:
    """terms with theta (c,), covariance (c, c) of their columns in order, theta_without (f, c): fitted without each part;
    gain: log density on withheld parts; alike: other terms for each that the data cannot tell from it; columns: white, with
    their prior precision (c,).
    """

    terms: tuple[Term, ...]
    theta: Floats
    covariance: Floats
    theta_without: Floats
    gain: float
    alike: tuple[tuple[Term, ...], ...]
    folds: Folds
    columns: tuple[White, ...]
    precision: Floats


def find_law(
    bench: TermBench, base: Callable[[Split, bool], Folds], grids: Sequence[TermGrid], *, seed: int = 0
) -> FoundLaw | None:
    """The law with terms of the grids that the residual follows; None where all fail on withheld parts.

    base: makes the folds of a split of time, with or without a free constant at every spot of the tip.
    """
    return _Search(bench, base, usual_split(len(bench.bench.runs)), grids, np.random.default_rng(seed)).run()


class _Search:
    def __init__(
        self,
        bench: TermBench,
        base: Callable[[Split, bool], Folds],
        split: Split,
        grids: Sequence[TermGrid],
        rng: np.random.Generator,
    ) -> None:
        self.base, self.split, self.folds = base, split, base(split, True)
        self.bench, self.grids = bench, grids
        self.screen = Screen(grids, self.folds, rng)
        self.shapes = Shapes(bench)

    def run(self) -> FoundLaw | None:
        chosen: list[Term] = []
        pool: list[Term] = []
        score = 0.0
        while len(chosen) < MOST_TERMS:
            step = self._beside(chosen)
            ranked, threshold = self.screen.gains(step)
            if not ranked or ranked[0][0] < threshold:
                break
            fine = [self._refined(step, term) for _, term in self._leaders(ranked)]
            fine += [self._refined(step, Term(spot, t.form)) for t in chosen for spot in self._spots_beside(t)]
            if not fine:
                break
            fine.sort(key=lambda each: -each[0])
            pool += [term for _, term in fine[: 2 * REFINED]]
            best = self._simplest(fine)
            after = self._score((*chosen, best))
            if after < score + max(PER_TERM, LEAST_GAIN * score):
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
        """The terms, and a constant per spot where it raises the score by more than PER_TERM."""
        for spot in dict.fromkeys(term.spot for term in chosen):
            more = [*chosen, Term(spot, CONSTANT)]
            if self._score(more) > self._score(chosen) + PER_TERM:
                chosen = more
        return chosen

    def _spots_beside(self, term: Term) -> list[Spot]:
        """The other spots at which the same function of the same covariates can act."""
        return [s for each in self.grids for s in each.spots if term.spot in each.spots and s != term.spot]

    # -- one step ------------------------------------------------------------------------------------------------------

    def _beside(self, chosen: Sequence[Term]) -> Folds:
        """The base with the terms chosen so far in it."""
        if not chosen:
            return self.folds
        more = [self._white(term) for term in chosen]
        return self.folds.extended(more, np.concatenate([self._precision(term) for term in chosen]))

    def _white(self, term: Term) -> White:
        return self.shapes.columns(term)[0]

    def _precision(self, term: Term) -> Floats:
        return self.shapes.columns(term)[1]

    @staticmethod
    def _leaders(ranked: Sequence[tuple[float, Term]]) -> list[tuple[float, Term]]:
        """The best of every kind of term at every spot, as far as they are near the best of all."""
        out: dict[tuple[object, ...], tuple[float, Term]] = {}
        for gain, term in ranked:
            key = (term.spot, term.form.family, term.form.about)
            if gain < 0.4 * ranked[0][0] or len(out) >= 3 * REFINED:
                break
            out.setdefault(key, (gain, term))
        shaped = [each for each in out.values() if each[1].form.shape][:REFINED]
        plain = [each for each in out.values() if not each[1].form.shape]
        return [*shaped, *plain]

    def _gain(self, step: Folds, term: Term) -> Floats:
        data = step.columns(self._white(term))
        return gains(data.G[:, None], data.h[:, None], self._precision(term)[None])[:, 0]

    def _refined(self, step: Folds, term: Term) -> tuple[float, Term]:
        """(log density on withheld parts less what shapes cost, term with the shape that the data want)."""
        term = self.shapes.followed(step, term)
        return float(withheld(self._gain(step, term)[:, None])[0]) - self._costs([term]), term

    @staticmethod
    def _costs(terms: Sequence[Term]) -> float:
        return sum(PER_SHAPE * len(t.form.shape) + PER_TERM for t in terms)

    @staticmethod
    def _simplest(fine: Sequence[tuple[float, Term]]) -> Term:
        """Of the terms that are as good as the best, one of a plain kind."""
        near = [term for score, term in fine if score > fine[0][0] - SAME]
        return min(near, key=lambda t: (t.form.family not in _PLAIN, len(t.form.shape), unlikely(t)))

    # -- sets ----------------------------------------------------------------------------------------------------------

    def _score(self, terms: Sequence[Term]) -> float:
        return self._scores(terms)(range(len(terms)))

    def _scores(self, terms: Sequence[Term]) -> Callable[[Sequence[int]], float]:
        """Function of term numbers: log density on withheld parts minus the cost of these terms."""
        data = self.folds.together([self._white(t) for t in terms])
        size = np.concatenate([self._precision(t) for t in terms])
        ends = np.cumsum([len(t.form.texts) for t in terms])
        own = [np.arange(end - len(t.form.texts), end) for end, t in zip(ends, terms, strict=True)]

        def score(some: Sequence[int]) -> float:
            at = np.concatenate([own[i] for i in some])
            G, h = data.G[:, at][:, :, at], data.h[:, at]
            gain = float(withheld(gains(G[:, None], h[:, None], size[at][None]))[0])
            return gain - self._costs([terms[i] for i in some])

        return score

    def _exhaustive(self, chosen: list[Term], pool: Sequence[Term], score: float) -> list[Term]:
        """The best of all sets of up to three terms of the pool, where it exceeds the chosen set by the margin."""
        terms = list(dict.fromkeys([*chosen, *sorted(pool, key=lambda t: -self._score([t]))]))[: max(POOL, len(chosen))]
        of = self._scores(terms)
        best, value = chosen, score
        for count in (1, 2, 3):
            for some in combinations(range(len(terms)), count):
                gain, tried = of(some), [terms[i] for i in some]
                if gain > value + margin(tried, best):
                    best, value = tried, gain
        return best

    def _without_idle(self, chosen: list[Term]) -> list[Term]:
        """The terms whose share of the law's energy exceeds LEAST_SHARE."""
        while len(chosen) > 1:
            theta = self._coefficients(chosen)[0][0]
            size, at = [], 0
            for t in chosen:
                values = self.bench.values(t.spot, t.form)
                own = [v @ theta[at : at + v.shape[1]][:, None] for v in values]
                size.append(float(self.bench.rms(t.spot, own)[0]) ** 2)
                at += len(t.form.texts)
            if min(size) > LEAST_SHARE * sum(size):
                break
            chosen.pop(int(np.argmin(size)))
        return chosen

    def _coefficients(self, terms: Sequence[Term]) -> tuple[Floats, Floats]:
        return self.folds.coefficients(
            [self._white(t) for t in terms], np.concatenate([self._precision(t) for t in terms])
        )

    def _answer(self, chosen: list[Term], pool: Sequence[Term]) -> FoundLaw:
        theta, covariance = self._coefficients(chosen)
        own, others = len(chosen), [each for each in dict.fromkeys(pool) if each not in chosen]
        of = self._scores([*chosen, *others])
        gain = of(range(own))
        alike = []
        for i, term in enumerate(chosen):
            same = (term.spot, term.form.family, term.form.about)
            found = []
            for j, other in enumerate(others):
                if (other.spot, other.form.family, other.form.about) == same:
                    continue
                if of([*range(i), own + j, *range(i + 1, own)]) > gain - SAME:
                    found.append(other)
            alike.append(tuple(found))
        columns, precision = tuple(map(self._white, chosen)), np.concatenate([self._precision(t) for t in chosen])
        return FoundLaw(
            terms=tuple(chosen), theta=theta[0], covariance=covariance, theta_without=theta[1:], gain=gain,
            alike=tuple(alike), folds=self.folds, columns=columns, precision=precision,
        )  # fmt: skip


def margin(tried: Sequence[Term], best: Sequence[Term]) -> float:
    """Log density by which a set has to be more probable than another: fewer terms and fewer shapes go before."""
    shapes = [sum(len(t.form.shape) for t in terms) for terms in (tried, best)]
    if len(tried) < len(best):
        return -SAME
    return SAME if shapes[0] > shapes[1] else 0.5


def unlikely(term: Term) -> bool:
    """Of a drive that leads one axis of the tip: what follows its own travel, or acts for a while, is its own; else the
    tip's, that too which follows a drive's load where that is the force along an axis.
    """
    own = term.form.family == "while" or term.form.about[0].startswith(("act", *"xyz"))
    return (term.spot.on == "drive") != own
