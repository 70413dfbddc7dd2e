"""A drive that is late, where its recording begins in motion and goes on after rows that are missing."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from camcomp.model.hysteresis import first_order
from camcomp.model.motion.driven_path import _seams, _smooth

LATE_S, SPEED = 0.006, 8.0


def told(t):
    """Set-point, mm: down, back at five times the speed, down again; each turn within 20 ms."""
    turn = np.interp(t, [0.0, 0.02, 1.0, 1.02, 1.2, 1.22, 3.0], [0.0, -1.0, -1.0, 5.0, 5.0, -1.0, -1.0])
    steps = np.diff(t, prepend=t[0])
    return np.cumsum(SPEED * 0.5 * (turn + np.roll(turn, 1)) * steps)


@pytest.fixture(scope="module")
def course():
    """Instants, set-points and where the drive is: the loop's differential equation, integrated."""
    t = np.arange(0.0, 2.5, 0.0005)
    x = told(t)
    late = solve_ivp(
        lambda s, y: (np.interp(s, t, x) - y) / LATE_S, (0.0, 2.5), [x[0]], t_eval=t, rtol=1e-8, max_step=0.001
    )
    return t, x, late.y[0]


def modelled(rows, x, seams):
    lead = _smooth(rows, x[:, None])
    grid = np.linspace(rows[0], rows[-1], round((rows[-1] - rows[0]) / 0.001) + 1)
    x_grid = lead(grid)
    there = first_order(x_grid, grid, LATE_S, _seams(rows, grid, lead) if seams else None)
    return x + np.interp(rows, grid, (there - x_grid)[:, 0])


def test_it_is_as_late_from_the_first_row_on_and_from_the_first_one_after_a_gap(course):
    t, x, there = course
    rows = np.concatenate([np.arange(0.5, 0.95, 0.04), np.arange(1.4, 2.4, 0.04)])
    told_there, is_there = np.interp(rows, t, x), np.interp(rows, t, there)
    off = 1e3 * np.abs(modelled(rows, told_there, seams=True) - is_there)
    assert off.max() < 0.5
    assert 1e3 * np.abs(modelled(rows, told_there, seams=False) - is_there).max() > 0.9e3 * SPEED * LATE_S


def test_one_that_is_recorded_from_rest_on_is_not_late_at_first(course):
    t, x, there = course
    rows = np.concatenate([[-0.02, -0.01], np.arange(0.0, 0.9, 0.01)])
    told_there, is_there = np.interp(rows, t, x), np.interp(rows, t, there)
    off = 1e3 * np.abs(modelled(rows, told_there, seams=True) - is_there)
    assert off.max() < 1.5 and off[:2].max() < 0.1


def test_rows_lost_closer_together_than_the_grid_is_fine_are_seams_that_rise():
    """A long log of many rows has a grid that is coarser than they are."""
    rows = np.delete(np.arange(0.0, 1.0, 0.001), [501, 503, 505, 507, 700])
    grid = np.linspace(rows[0], rows[-1], 68)
    at = _seams(rows, grid, _smooth(rows, told(rows)[:, None])).at
    assert len(at) > 4 and np.all(np.diff(at) > 0)
