"""What withheld runs are asked for themselves: a cause of which the other runs say nothing, as a whole or not at all."""

import numpy as np
import pytest

from camcomp.diagnosis.search.unexplained import moved, undetermined

CASES = {
    "known": ([3.0], [0.1], [1], [False]),
    "not known": ([3.0], [10.0], [1], [True]),
    "a wave with hardly a cosine": ([2.0, 0.01], [0.1, 0.1], [2], [False, False]),
    "a wave of which nothing is known": ([2.0, 0.01], [5.0, 5.0], [2], [True, True]),
    "one beside a known one": ([3.0, 2.0, 0.01], [9.0, 0.1, 0.1], [1, 2], [True, False, False]),
    "none": ([], [], [], []),
}


@pytest.mark.parametrize("name", CASES)
def test_a_cause_is_told_as_a_whole(name):
    theta, doubt, widths, expected = CASES[name]
    assert undetermined(np.array(theta), np.array(doubt), widths).tolist() == expected


def test_channels_that_a_run_lacks_move_no_tip_and_hide_no_other():
    """A grid plate sees two of three axes; one encoder of three may be logged."""
    way = np.broadcast_to(np.array([[1.0, 0.0, 0.5], [0.0, 2.0, 0.0], [0.0, 0.0, 1.0]]), (4, 3, 3))
    left = np.array([[1.0, 2.0, np.nan], [3.0, np.nan, np.nan], [0.0, 1.0, np.nan], [0.0, 0.0, np.nan]])
    found = moved(way, left)
    assert found[[0, 2, 3]].tolist() == [[1.0, 4.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 0.0]]
    assert np.isnan(found[1]).all()  # a row without one of its channels
    assert np.isnan(moved(way, np.full((4, 3), np.nan))).all()
