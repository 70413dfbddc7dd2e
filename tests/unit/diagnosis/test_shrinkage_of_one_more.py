"""The interval of the shrinkage of one more run."""

from types import SimpleNamespace

import numpy as np
import pytest

from camcomp.diagnosis.answer.unseen import JudgedRun, of_one_more, scatter, unseen_shrinkage


def shrinkage(before, after):
    """Ratio and ends of its interval of runs with these squares."""
    found = unseen_shrinkage(
        [JudgedRun(each) for each in zip(before, after, strict=True)], [("backlash", "x")], holdout=()
    )
    return SimpleNamespace(ratio=found.ratio, low=found.ci95[0], high=found.ci95[1], before=found.before_rms_um)


def runs(*ratios, rows=100):
    """Squared gaps of runs of which these shares of the rms remain."""
    return [np.ones(rows) for _ in ratios], [np.full(rows, each**2) for each in ratios]


@pytest.mark.parametrize("n", [2, 3, 6])
def test_of_normal_logarithms_it_holds_as_many_as_it_says(n):
    rng = np.random.default_rng(n)
    held = []
    for _ in range(3000):
        drawn = rng.normal(-1.0, 0.4, n + 1)
        low, high = of_one_more(float(drawn[:n].mean()), *scatter(drawn[:n]), 1.0 + 1.0 / n)
        held.append(low <= 1.0 - np.exp(drawn[n]) <= high)
    assert np.mean(held) == pytest.approx(0.95, abs=0.013)


def test_runs_that_differ_make_it_wide_and_more_runs_make_it_narrow():
    alike, apart, many = (shrinkage(*runs(*each)) for each in ((0.2,) * 3, (0.1, 0.2, 0.4), (0.1, 0.2, 0.4) * 4))
    assert apart.high - apart.low > 1.5 * (alike.high - alike.low)
    assert many.high - many.low < apart.high - apart.low
    assert all(each.low < each.ratio < each.high for each in (alike, apart, many))


def test_few_runs_that_agree_by_chance_are_no_certainty():
    """Two that leave 0.20 and 0.21 say little of a third, which may be cut in the air."""
    two = shrinkage(*runs(0.20, 0.21))
    assert two.low < 0.5
    assert shrinkage(*runs(0.2)).low < two.low


def test_it_ends_at_nothing_unless_a_run_got_worse():
    assert shrinkage(*runs(0.1, 1.0, 0.1)).low == 0.0
    assert shrinkage(*runs(0.1, 1.1, 0.1)).low == pytest.approx(-0.1, abs=1e-4)


def test_rows_and_runs_without_a_value_do_not_count():
    before, after = runs(0.5, 0.5, 0.5)
    after[1][:50] = np.nan
    after[2][:] = np.nan
    found, plain = shrinkage(before, after), shrinkage(*runs(0.5, 0.5))
    assert (found.ratio, found.low, found.high) == pytest.approx((plain.ratio, plain.low, plain.high), abs=1e-4)
    nothing = shrinkage([np.full(3, np.nan)], [np.full(3, np.nan)])
    assert (nothing.ratio, nothing.before) == (0.0, 0.0)
