"""Terms with the shapes that the data want: periods, places and lengths by a simplex, instants between the rows they fall."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import minimize

from camcomp.diagnosis.law.bench_terms import AT_ONCE, Spot, Term, TermBench
from camcomp.diagnosis.law.folds import WIDE_MM, Folds, gains
from camcomp.diagnosis.law.forms import Form
from camcomp.diagnosis.law.white import White
from camcomp.ground.datatypes import Floats

INSTANTS, TURNS = 60, 2  # moments between rows that are tried for a beginning and for an end, and how often in turn
PHASES = 6  # of a turn between the first row and the last, by which swings that are tried differ
MOST_APART = 500  # such steps to both sides: runs that are days apart do not count turns
TINY = 1e-12


class Shapes:
    """Columns of the terms of a bench, and terms whose shapes follow the data."""

    def __init__(self, bench: TermBench) -> None:
        self.bench = bench
        self._seen: dict[Term, tuple[White, Floats]] = {}

    def columns(self, term: Term) -> tuple[White, Floats]:
        """White columns of a term, and their prior precision (f,): WIDE_MM at the tip."""
        if term not in self._seen:
            self._seen[term] = self._worked_out(term)
        return self._seen[term]

    def _worked_out(self, term: Term) -> tuple[White, Floats]:
        values = self.bench.values(term.spot, term.form)
        size = float(np.sqrt(np.mean(self.bench.rms(term.spot, values) ** 2)))
        return self.bench.white(term.spot, values), np.full(len(term.form.texts), (size / WIDE_MM) ** 2 + TINY)

    def followed(self, step: Folds, term: Term) -> Term:
        """The term with the shape that fits the data best in addition to the base."""
        if not term.form.shape:
            return term
        if term.form.passing:
            return self._between_rows(step, term)
        if (term.form.family, term.form.about) == ("wave", ("common_s",)):
            term = self._between_runs(step, term)
        return self._by_simplex(step, term)

    def _by_simplex(self, step: Folds, term: Term) -> Term:
        start = np.array(term.form.shape)
        scale = np.array([0.03 * (high - low) for low, high in term.form.bounds])
        if term.form.family == "wave":
            size = self.bench.sizes(term.spot).span(term.form.about[0])
            scale = np.array([0.1 * start[0] ** 2 / size])
        scale = np.minimum(scale, 0.3 * np.abs(start) + 1e-3 * scale)

        def cost(u: Floats) -> float:
            white, size = self._worked_out(Term(term.spot, term.form.at(start + scale * u)))
            data = step.of_all(white)
            return -float(gains(data.G[:, None], data.h[:, None], size[None])[0, 0])

        simplex = np.concatenate([np.zeros((1, len(start))), np.eye(len(start))])
        found = minimize(
            cost, np.zeros(len(start)), method="Nelder-Mead",
            options={"maxfev": 30 if len(start) == 1 else 55, "xatol": 0.01, "fatol": 0.05, "initial_simplex": simplex},
        )  # fmt: skip
        return Term(term.spot, term.form.at(start + scale * found.x))

    def _between_rows(self, step: Folds, term: Term) -> Term:
        """What begins or ends does so between two rows: the density is a staircase there, on which a simplex stops anywhere."""
        between, best = self._between(term.spot), term.form
        for _ in range(TURNS):
            for i in range(len(best.shape)):
                instants = np.cumsum(best.shape)
                near = between[np.argsort(np.abs(between - instants[i]))[:INSTANTS]]
                tried = [*(_moved(best, i, float(at)) for at in near), best]
                best = tried[int(np.argmax(self._gains(step, term.spot, tried)))]
        return Term(term.spot, best)

    def _between_runs(self, step: Folds, term: Term) -> Term:
        """An oscillation in time, by its number of turns between runs: all periods with the same turns within runs are tried."""
        size = self.bench.sizes(term.spot)
        low, high = size.limits["common_s"]
        longest = max(b - a for a, b in size.stretches)
        step_hz = 1.0 / (PHASES * max(high - low, 1e-9))
        most = min(int(1.0 / max(longest * step_hz, 1e-9)), MOST_APART)
        way = step_hz * np.arange(-most, most + 1)
        turns = 1.0 / term.form.shape[0] + way  # per second
        forms = [term.form, *(term.form.at((1.0 / each,)) for each in turns[turns > 0.0])]
        best = [self._pair_gains(step, term.spot, forms[i : i + AT_ONCE]) for i in range(0, len(forms), AT_ONCE)]
        return Term(term.spot, forms[int(np.argmax(np.concatenate(best)))])

    def _pair_gains(self, step: Folds, spot: Spot, forms: Sequence[Form]) -> Floats:
        """Log evidence (f,) that forms of two columns add, each alone."""
        values = self.bench.values(spot, *forms)
        white = self.bench.white(spot, values)
        half = step.halved(step.cross(white))
        pairs = [X.reshape(len(X), -1, 2) for X in (*white.columns, half)]
        grams = [np.einsum("nfc,nfd->fcd", each, each) for each in pairs]
        G = np.sum(grams[:-1], axis=0) - grams[-1]
        h = (step.target(white) - step.of_target(half)).reshape(-1, 2)
        rms = self.bench.rms(spot, values).reshape(-1, 2)
        size = np.repeat(np.mean(rms**2, axis=1)[:, None] / WIDE_MM**2 + TINY, 2, axis=1)
        return np.asarray(gains(G[None], h[None], size)[0])

    def _between(self, spot: Spot) -> Floats:
        """Instants on the common clock in the middle between rows that show what happens at a spot."""
        every = zip(self.bench.bench.runs, self.bench.times, self.bench.seen(spot), strict=True)
        shown = [run.run_path.started + t[seen] for run, t, seen in every]
        return np.sort(np.concatenate([0.5 * (t[1:] + t[:-1]) for t in shown]))

    def _gains(self, step: Folds, spot: Spot, forms: Sequence[Form]) -> Floats:
        """Log evidence (f,) that forms of one column add, each alone."""
        each = [self.bench.values(spot, form) for form in forms]
        values = [np.concatenate(of_run, axis=1) for of_run in zip(*each, strict=True)]
        white = self.bench.white(spot, values)
        half = step.halved(step.cross(white))
        G = np.sum([np.einsum("rc,rc->c", X, X) for X in white.columns], axis=0) - np.einsum("kc,kc->c", half, half)
        h = step.target(white) - step.of_target(half)
        size = (self.bench.rms(spot, values) / WIDE_MM) ** 2 + TINY
        return np.asarray(0.5 * h**2 / (G + size) + 0.5 * np.log(size / (G + size)))


def _moved(form: Form, i: int, at: float) -> Form:
    """A passing form whose beginning (0) or end (1) is at an instant, the other where it was, as far as its bounds let it."""
    first = form.shape[0]
    if i:
        return form.at((first, at - first))
    return form.at((at, *(last + first - at for last in form.shape[1:])))
