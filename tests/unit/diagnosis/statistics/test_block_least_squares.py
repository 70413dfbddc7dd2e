"""The information about a left-out block that remains in the others."""

import numpy as np
import pytest

from camcomp.diagnosis.axis.block_least_squares import gain, series, withheld


def test_what_lasts_across_the_border_of_two_blocks_does_not_foretell_itself():
    time = np.arange(0.0, 10.0, 0.01)
    border = 10.0 / 25 * 12
    for half_width, foretold in ((0.15, False), (1.0, True)):
        bump = (np.abs(time - border) < half_width).astype(float)
        data = series([time], [bump + 0.01 * np.random.default_rng(1).standard_normal(len(time))])
        found = gain(withheld(data, np.zeros((len(time), 0))), withheld(data, bump[:, None]))
        assert (found.log_ratio > 0.1) == foretold


def test_what_two_columns_do_that_differ_in_one_block_only_is_left_open_there():
    """Speed and its size where an axis goes one way in all blocks but the first: the others tell their sum, and no more."""
    rng = np.random.default_rng(1)
    time = np.linspace(0.0, 25.0, 2500)
    speed = 1.0 + rng.uniform(size=2500)
    speed[:100] *= -1.0
    size = np.abs(speed) + 1e-4 * rng.standard_normal(2500)
    y = 3.0 * speed + rng.standard_normal(2500)
    left = withheld(series([time], [y]), np.stack([speed, size], axis=1))
    assert left[0] < 2.0 * np.mean(y[:100] ** 2)
    assert np.mean(left[1:]) == pytest.approx(1.0, rel=0.1)


@pytest.mark.parametrize(("moving", "foretold"), [(None, False), (1, True)])
def test_runs_in_which_an_axis_stands_foretell_nothing_of_the_one_in_which_it_moves(moving, foretold):
    """Whole runs of four are the folds; a single informative run is split into stretches."""
    rng = np.random.default_rng(2)
    times = [np.linspace(0.0, 10.0, 1000)] * 4
    columns = [np.zeros(1000)] * 3 + [np.sin(np.linspace(0.0, 60.0, 1000))]
    values = [5.0 * c + 0.1 * rng.standard_normal(1000) for c in columns]
    data = series(times, values, moving)
    assert (withheld(data, np.concatenate(columns)[:, None]).max() < 0.1) == foretold
