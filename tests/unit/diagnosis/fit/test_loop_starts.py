"""A loop may swing where its start is not in the log: what its encoder says in the first rows is that, and nothing of the loop.

Truth: the loop's differential equation, integrated from rest; the log has it from its first step on, as if it had been moving.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from camcomp.diagnosis.fit.starts import _swing
from camcomp.model.hysteresis import second_order

SPEED, PERIOD_S, DAMPING = 5.0, 0.083, 0.2


@pytest.fixture(scope="module")
def swung():
    """Rows, set-points and the lag of the loop; it speeds up within 3 ms of the first row."""
    w = 2 * np.pi / PERIOD_S
    push = lambda t: SPEED / 0.003 * (t < 0.003)
    found = solve_ivp(
        lambda t, y: [y[1], -push(t) - 2 * DAMPING * w * y[1] - w * w * y[0]], (0.0, 1.0), [0.0, 0.0],
        max_step=0.0005, dense_output=True,
    )  # fmt: skip
    rows = np.arange(0.0, 0.9, 0.015)
    told = np.where(rows < 0.003, 0.5 * SPEED / 0.003 * rows**2, SPEED * (rows - 0.0015))
    return rows, told[:, None], found.sol(rows)[0]


def test_first_rows_may_be_off_by_what_a_loop_from_rest_swings(swung):
    rows, told, stands = swung
    off = np.abs(stands - second_order(told, rows, PERIOD_S, DAMPING)[:, 0])
    assert off.max() > 0.01
    assert np.all(off < 2.0 * _swing(rows, told)[:, 0] + 1e-4)


def test_half_a_second_later_all_is_known(swung):
    rows, told, _ = swung
    assert _swing(rows, told)[rows > 0.5].max() < 1e-4


def test_what_begins_at_rest_is_known_at_once(swung):
    told = swung[1]
    waits = np.concatenate([np.full((20, 1), told[0, 0]), told])
    assert not _swing(np.arange(len(waits)) * 0.015, waits).any()


def test_rows_behind_many_missing_ones_begin_anew_and_behind_one_do_not(swung):
    rows, told, _ = swung
    for lost, anew in ((1, False), (4, True)):
        kept = np.delete(np.arange(len(rows)), np.arange(40, 40 + lost))
        assert (_swing(rows[kept], told[kept])[40, 0] > 0.1) == anew


def test_where_rows_show_how_it_speeds_up_from_rest_nothing_is_unknown():
    rows = np.arange(0.0, 0.2, 0.01)
    assert _swing(rows, 500.0 * rows[:, None] ** 2).max() < 1e-9
