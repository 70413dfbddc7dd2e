"""The state of the play is unknown for an actuator that moves when a log begins."""

import numpy as np
import pytest

from camcomp.diagnosis.fit.starts import _standing
from camcomp.diagnosis.statistics.noise_model import BLOCK


@pytest.mark.parametrize(
    ("moved_mm", "standing", "under_way"),
    [
        ((0.0, 0.06, 0.13, 0.2), (0,), (1,)),  # a plunge at which the log begins
        ((0.0, 0.13, 0.2, 0.3), (0,), ()),
        ((0.0, 0.0, 0.0, 0.05, 0.09, 0.2), (0, 1, 2), (3, 4)),  # stands, then goes
        ((0.0, 0.05, 0.0, 0.05, 0.2), (0,), (1, 2, 3)),  # what once has moved has taken up something
        ((0.0, 0.0025, 0.0, 0.0025), (0, 1, 2, 3), ()),  # a digit of an encoder
        (tuple(0.002 * k for k in range(60)), tuple(range(50)), ()),  # so slow that rows are alike
    ],
)
def test_rows_that_stand_and_rows_on_the_way(moved_mm, standing, under_way):
    for sign in (1.0, -1.0):
        found = _standing(-63.0 + sign * np.array(moved_mm))
        assert [np.flatnonzero(each).tolist() for each in found] == [list(standing), list(under_way)]


def test_what_takes_many_rows_is_told_by_its_length():
    step = 0.099 / np.arange(1, BLOCK + 3)
    for count in (BLOCK, BLOCK + 1):
        rho = np.concatenate([[0.0], step[count - 1] * np.arange(1, count + 1), [0.2]])
        assert _standing(rho)[1].any() == (count == BLOCK)
