"""Terms with the shapes that the data want: periods, places, lengths and instants by pattern search."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from camcomp.diagnosis.law.bench_terms import Spot, Term, TermRows
from camcomp.diagnosis.law.forms import Form, SmoothForm
from camcomp.diagnosis.statistics.folds import Folds, RunColumns, gains
from camcomp.ground.datatypes import Floats

FINEST = 0.01  # of the first step of a pattern search: it ends there
LEAST_GAIN = 0.05  # log evidence by which a neighbour is better
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
        if (form.family, form.about) == ("wave", ("common_s",)):
            form = self._between_runs(step, spot, form)
        return Term(spot, self._by_pattern(step, spot, form))

    def _by_pattern(self, step: Folds, spot: Spot, form: Form) -> Form:
        """To the best neighbour, and to nearer ones where there is none that is better. Source: Hooke, Jeeves, J. ACM 8 (1961) 212."""
        start = np.abs(form.shape)
        scale = np.array([0.03 * (high - low) for low, high in form.bounds])
        if form.family == "wave":
            scale = 0.1 * start**2 / self.bench.sizes(spot).span(form.about[0])
        scale = np.minimum(scale, 0.3 * start + 1e-3 * scale)
        ways = scale * list(product((0.0, 1.0, -1.0), repeat=len(start)))
        size = 1.0
        while size > FINEST:
            tried = [form.at(form.shape + size * way) for way in ways]
            gain = self._gains(step, spot, tried)
            best = int(np.argmax(gain))
            if gain[best] > gain[0] + LEAST_GAIN:
                form = tried[best]
            else:
                size /= 3.0
        return form

    def _between_runs(self, step: Folds, spot: Spot, form: Form) -> Form:
        """An oscillation in time, by its number of turns between runs: all periods with the same turns within runs are tried."""
        size = self.bench.sizes(spot)
        low, high = size.limits["common_s"]
        longest = max(b - a for a, b in size.stretches)
        step_hz = 1.0 / (PHASES * max(high - low, 1e-9))
        most = min(int(1.0 / max(longest * step_hz, 1e-9)), MOST_APART)
        way = step_hz * np.arange(-most, most + 1)
        turns = 1.0 / form.shape[0] + way  # per second
        forms, some = [form, *(form.at((1.0 / each,)) for each in turns[turns > 0.0])], self.bench.at_once // 2
        best = [self._gains(step, spot, forms[i : i + some]) for i in range(0, len(forms), some)]
        return forms[int(np.argmax(np.concatenate(best)))]

    def _gains(self, step: Folds, spot: Spot, forms: Sequence[Form]) -> Floats:
        """Log evidence (f,) that forms of as many functions each add, each alone."""
        values, count = self.bench.values(spot, *forms), forms[0].size
        white = self.bench.white(spot, values)
        return gains(*step.alone(white, count), self.bench.precision(spot, values, count))
