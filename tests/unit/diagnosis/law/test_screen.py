"""All terms at once: in parts as all together, and rows of several runs as each run alone."""

from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

from camcomp.diagnosis.law.bench_terms import Spot, Term, TermBench
from camcomp.diagnosis.law.forms import Form
from camcomp.diagnosis.law.screen import TermGrid, gains_of_terms
from camcomp.diagnosis.law.shapes import Shapes
from camcomp.diagnosis.statistics.by_channel import ByChannel
from camcomp.diagnosis.statistics.folds import Folds, Split

TIPS = (Spot("structure", 0), Spot("structure", 1))
PERIODS = (30.0, 24.0, 17.0, 12.0, 9.0)
WAVES = tuple(
    Form(
        family="wave",
        about=("x_mm",),
        texts=("sin(2*pi*x_mm/{0})", "cos(2*pi*x_mm/{0})"),
        units=("", ""),
        shape=(each,),
        bounds=((1.0, 90.0),),
    )
    for each in PERIODS
)
FORMS = (
    Form(family="line", about=("x_mm",), texts=("x_mm",), units=("mm",)),
    *WAVES,
    Form(family="drag", about=("x_mm",), texts=("drag(x_mm, 4)",), units=("mm",)),
)
NOWHERE = Form(family="power", about=("x_mm",), texts=("1/x_mm",), units=("",))  # at 0


class Rows(dict):
    rows = 200


class Runs(TermBench):
    """Two runs over x; rows of the first spot come before those of the second."""

    wide = 0.2

    def __init__(self):
        t = np.linspace(0.0, 9.0, Rows.rows)
        self.runs = [Rows(x_mm=20.0 * np.sin(t)), Rows(x_mm=25.0 - 30.0 * np.cos(1.3 * t))]
        self.runs[0]["x_mm"][0] = 0.0

    row_counts = property(lambda self: [Rows.rows] * len(self.runs))

    def rows(self, spot):
        return self.runs

    def precision(self, spot, values, count):
        return np.ones((values[0].shape[1] // count, count))

    def white(self, spot, values):
        return [ByChannel.of([v, 0.0 * v][:: 1 - 2 * spot.index]) for v in values]


def screen(bench, at_once):
    rng = np.random.default_rng(3)
    counts = [tuple(form for form in FORMS if form.size == count) for count in (1, 2)]
    grids = [TermGrid(TIPS, forms) for forms in counts]
    bench.at_once = at_once
    swing = [np.sin(2 * np.pi * (run["x_mm"] + 2.0) / PERIODS[2]) for run in bench.runs]
    residual = [rng.normal(size=400) + np.concatenate([np.zeros(200), each]) for each in swing]
    white = [ByChannel.of(rng.normal(size=(2, 200, 3))) for _ in residual]
    folds = Folds(white, residual, np.ones(3), [np.linspace(0, 1, 400)] * 2, Split(1, 1), ())
    return partial(gains_of_terms, bench, grids), folds


def test_in_parts_they_gain_what_they_gain_all_together():
    bench = Runs()
    whole, base = screen(bench, 100)
    parts, _ = screen(Runs(), 2)
    more = base.extended([bench.white(TIPS[1], bench.values(TIPS[1], WAVES[2]))], np.ones(2))
    for step in (base, more):
        expected, got = whole(step), parts(step)
        assert [term for _, term in got] == [term for _, term in expected]
        assert [gain for gain, _ in got] == pytest.approx([gain for gain, _ in expected])


def test_what_is_there_leads_by_far():
    all_terms, base = screen(Runs(), 3)
    first, second, *_ = all_terms(base)
    assert (first[1].spot, first[1].form) == (TIPS[1], WAVES[2])
    assert first[0] > 5.0 * second[0]


def test_rows_of_several_runs_have_the_values_of_each_run():
    bench = Runs()
    together = bench.values(TIPS[0], *FORMS, NOWHERE)
    for k, run in enumerate(bench.runs):
        bench.runs = [run]
        assert np.array_equal(bench.values(TIPS[0], *FORMS, NOWHERE)[0], together[k])
        bench.runs = Runs().runs
    assert together[0][0, -1] == np.finfo(float).max  # finite, where the formula has no value


class Level(Shapes):
    """Evidence that is the same for all shapes but for rounding, or that some shapes do not have."""

    calls = 0

    def _gains(self, step, spot, forms):
        self.calls += 1
        assert self.calls < 100
        return np.append(1e-9 * np.arange(len(forms) - 1), self.last)


@pytest.mark.parametrize("last", [1e-8, np.nan])
def test_a_shape_that_changes_nothing_stays_and_the_search_ends(last):
    bench = Runs()
    bench.sizes = lambda spot: SimpleNamespace(span=lambda name: 50.0)
    level = Level(bench)
    level.last = last
    assert level.followed(None, Term(TIPS[0], WAVES[2])).form == WAVES[2]
