"""Rows that no machine made are found by comparison with their neighbours."""

import numpy as np
import pytest

from camcomp.diagnosis.fit.outliers import _gone_along, _jumping_off, _sprung_off


def test_a_beam_break_is_found_where_the_machine_itself_moves_from_row_to_row():
    """A screw's wave along the whole way, and for a while so quick that it has few rows a turn."""
    rng = np.random.default_rng(6)
    x = rng.normal(0, 0.01, 400)
    x += 0.5 * np.sin(np.arange(400) / 40.0)
    x[40:80] += 0.2 * np.sin(1.2 * np.arange(40))
    assert not _jumping_off(x).any()
    x[[52, 300]] -= 2.0
    assert set(np.flatnonzero(_jumping_off(x))) == {52, 300}


def test_beam_breaks_are_found_however_many_rows_they_take_of_a_short_log():
    """Two bursts of seven rows in three hundred are 5 % of them, and a break that lasts is longer than any running median."""
    rng = np.random.default_rng(7)
    gap = rng.normal(0, 0.003, (300, 3)) + [0.0, 0.0, 8.0]  # with a tool whose length nobody has told
    broken = np.r_[45:52, 84:91, 230:280]
    gap[broken] += 30.0 * np.array([0.6, -0.8, 0.0])
    gap[10] = np.nan
    np.testing.assert_array_equal(np.flatnonzero(_sprung_off(gap)), broken)


def test_a_workpiece_that_lies_askew_is_no_beam_break():
    angle = np.linspace(0.0, 6.3, 300)
    gap = np.column_stack([7.0 * np.sin(angle), 7.0 * np.cos(angle), np.zeros(300)])
    assert not _sprung_off(gap).any()
    gap[:, :2] *= np.exp(-(((np.arange(300) - 150) / 15.0) ** 2))[:, None]  # far for a while
    assert not _sprung_off(gap).any()


def test_a_machine_that_has_lost_steps_and_stays_off_is_no_beam_break():
    gap = np.random.default_rng(8).normal(0, 0.003, (300, 3))
    gap[250:, 0] += 8.0
    assert not _sprung_off(gap).any()


@pytest.mark.parametrize("noise", [0.0, 0.001])
def test_a_row_off_a_smooth_curve_is_found_though_most_rows_are_the_median_of_those_beside_them(noise):
    """What rises from row to row is its own running median: of such deviations the median is nothing."""
    rng = np.random.default_rng(9)
    x = 0.06 * np.cos(np.pi * np.arange(270) / 30.0) + noise * rng.standard_normal(270)
    assert not _jumping_off(x).any()
    x[93] -= 0.28
    assert list(np.flatnonzero(_jumping_off(x))) == [93]


def test_steps_of_an_encoder_that_stands_are_no_outliers():
    x = np.round(0.4 * np.sin(np.arange(400) / 60.0) + 0.1 * np.random.default_rng(10).standard_normal(400))
    assert not _jumping_off(x).any()


def test_what_arithmetic_leaves_of_nothing_is_no_outlier():
    """A log without noise: the model is exact but for rounding, and here and there a little more of it; among steps a broken beam stands out."""
    x = np.zeros(400)
    x[::40] = 1e-16
    x[[33, 170, 290]] = 3e-14
    assert not _jumping_off(x).any()
    x[[60, 200]], x[100] = 1e-4, 30.0
    assert list(np.flatnonzero(_jumping_off(x))) == [100]


def test_an_encoder_that_is_far_behind_for_a_few_rows_is_believed_where_the_tip_was_there():
    """Rapids are few rows; a telegram that was dropped moves no tip. Encoders lead the model of the tip."""
    rng = np.random.default_rng(11)
    slopes = np.broadcast_to([[1.0, 0.0], [0.0, 0.8], [0.0, 0.0]], (300, 3, 2))
    encoder, tip = rng.normal(0, 1e-4, (300, 2)), rng.normal(0, 0.005, (300, 3)) + [0.2, 0.0, -0.1]
    encoder[40:44, 1] += 0.07  # the tip is where this says
    encoder[200:204, 1] += 0.07
    tip[200:204, 1] -= 0.8 * 0.07  # and is not here
    encoder[100, 0] += 0.003  # of which a tip measured to 5 um says nothing
    bad = np.abs(encoder) > 1e-3
    assert set(np.flatnonzero(_gone_along(tip, encoder, slopes, bad))) == {40, 41, 42, 43}
    assert not _gone_along(np.full((300, 3), np.nan), encoder, slopes, bad).any()
