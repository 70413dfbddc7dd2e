"""Terms with the shapes that the data want: periods, places and lengths by a simplex, instants between the rows they fall."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import minimize

from camcomp.diagnosis.law.bench_terms import Spot, Term, TermRows
from camcomp.diagnosis.law.forms import Form, SmoothForm
from camcomp.diagnosis.statistics.folds import Folds, RunColumns, gains
from camcomp.ground.datatypes import Floats

INSTANTS = 60  # moments between rows that are tried for a beginning and for an end, twice in turn
PHASES = 6  # of a turn between the first row and the last, by which swings that are tried differ
MOST_APART = 500  # such steps to both sides: runs that are days apart do not count turns


class Shapes:
    """Columns of the terms of a bench, and terms whose shapes follow the data."""

    def __init__(self, bench: TermRows) -> None:
        self.bench = bench
        self._seen: dict[Term, tuple[RunColumns, Floats]] = {}

    def columns(self, term: Term) -> tuple[RunColumns, Floats]:
        """White columns of a term, and their prior precision (f,)."""
        if term not in self._seen:
            values = self.bench.values(term.spot, term.form)
            precision = self.bench.precision(term.spot, values, term.form.size)[0]
            self._seen[term] = self.bench.white(term.spot, values), precision
        return self._seen[term]

    def followed(self, step: Folds, term: Term) -> Term:
        """The term with the shape that fits the data best in addition to the base."""
        spot, form = term.spot, term.form
        if isinstance(form, SmoothForm) or not form.shape:
            return term
        if form.passing:
            return Term(spot, self._between_rows(step, spot, form))
        if (form.family, form.about) == ("wave", ("common_s",)):
            form = self._between_runs(step, spot, form)
        return Term(spot, self._by_simplex(step, spot, form))

    def _by_simplex(self, step: Folds, spot: Spot, form: Form) -> Form:
        start = np.array(form.shape)
        scale = np.array([0.03 * (high - low) for low, high in form.bounds])
        if form.family == "wave":
            size = self.bench.sizes(spot).span(form.about[0])
            scale = np.array([0.1 * start[0] ** 2 / size])
        scale = np.minimum(scale, 0.3 * np.abs(start) + 1e-3 * scale)

        def cost(u: Floats) -> float:
            return -float(self._gains(step, spot, [form.at(start + scale * u)])[0])

        simplex = np.concatenate([np.zeros((1, len(start))), np.eye(len(start))])
        found = minimize(
            cost, np.zeros(len(start)), method="Nelder-Mead",
            options={"maxfev": 30 if len(start) == 1 else 55, "xatol": 0.01, "fatol": 0.05, "initial_simplex": simplex},
        )  # fmt: skip
        return form.at(start + scale * found.x)

    def _between_rows(self, step: Folds, spot: Spot, best: Form) -> Form:
        """What begins or ends does so between two rows: the density is a staircase there, on which a simplex stops anywhere."""
        between = self._between(spot)
        for _ in range(2):
            for i in range(len(best.shape)):
                instants = np.cumsum(best.shape)
                near = between[np.argsort(np.abs(between - instants[i]))[:INSTANTS]]
                tried = [*(_moved(best, i, float(at)) for at in near), best]
                best = tried[int(np.argmax(self._gains(step, spot, tried)))]
        return best

    def _between_runs(self, step: Folds, spot: Spot, form: Form) -> Form:
        """An oscillation in time, by its number of turns between runs: all periods with the same turns within runs are tried."""
        size = self.bench.sizes(spot)
        low, high = size.limits["common_s"]
        longest = max(b - a for a, b in size.stretches)
        step_hz = 1.0 / (PHASES * max(high - low, 1e-9))
        most = min(int(1.0 / max(longest * step_hz, 1e-9)), MOST_APART)
        way = step_hz * np.arange(-most, most + 1)
        turns = 1.0 / form.shape[0] + way  # per second
        forms, some = [form, *(form.at((1.0 / each,)) for each in turns[turns > 0.0])], self.bench.at_once
        best = [self._gains(step, spot, forms[i : i + some]) for i in range(0, len(forms), some)]
        return forms[int(np.argmax(np.concatenate(best)))]

    def _between(self, spot: Spot) -> Floats:
        """Instants on the common clock in the middle between rows that show what happens at a spot."""
        return np.sort(np.concatenate([0.5 * (t[1:] + t[:-1]) for t in self.bench.shown(spot)]))

    def _gains(self, step: Folds, spot: Spot, forms: Sequence[Form]) -> Floats:
        """Log evidence (f,) that forms of as many functions each add, each alone."""
        values, count = self.bench.values(spot, *forms), forms[0].size
        white = self.bench.white(spot, values)
        return gains(*step.alone(white, count), self.bench.precision(spot, values, count))


def _moved(form: Form, i: int, at: float) -> Form:
    """A passing form whose beginning (0) or end (1) is at an instant, the other where it was, as far as its bounds let it."""
    first = form.shape[0]
    if i:
        return form.at((first, at - first))
    return form.at((at, *(last + first - at for last in form.shape[1:])))
