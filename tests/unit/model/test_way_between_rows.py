"""Between the rows of a log its way is smooth; where rows are missing it has no reversal."""

import numpy as np

from camcomp.model.motion.driven_path import _smooth

PERIOD = 0.04


def test_a_way_over_missing_rows_stays_between_them():
    """A drive comes at 20 mm/s and stands when it is seen again, four rows later."""
    moving, standing = np.arange(0.0, 1.0, PERIOD), np.arange(1.16, 2.0, PERIOD)
    time = np.concatenate([moving, standing])
    place = np.where(time < 1.0, 20.0 * time, 20.0)
    between = _smooth(time, place[:, None])(np.arange(0.0, 2.0, 0.001))[:, 0]
    assert between.max() < 20.0 + 1e-9
    assert np.diff(between).min() > -1e-9


def test_a_way_that_ends_between_two_rows_stays_before_its_end():
    """A hold stops a drive of 18 mm/s at once, soon after a row."""
    time = np.arange(0.0, 2.0, PERIOD)
    place = np.minimum(18.0 * time, 18.0 * (1.0 + 0.05 * PERIOD))
    between = _smooth(time, place[:, None])(np.arange(0.0, 2.0, 0.001))[:, 0]
    assert between.max() < place.max() + 1e-9


def test_a_circle_is_followed_beyond_its_rows():
    time = np.arange(0.0, 4.0, PERIOD)
    fine = np.arange(0.5, 3.5, 0.001)
    between = _smooth(time, 25.0 * np.sin(time)[:, None])(fine)[:, 0]
    assert np.abs(between - 25.0 * np.sin(fine)).max() < 1e-3


def test_slopes_of_round_off_are_none():
    time = np.arange(6.0)
    place = np.array([0.0, 5e-324, 1e-323, 1.0, 2.0, 3.0])
    assert _smooth(time, place[:, None])(np.array([0.5, 4.5]))[:, 0].tolist() == [0.0, 2.5]
