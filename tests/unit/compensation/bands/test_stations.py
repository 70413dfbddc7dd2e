"""Stations: what changes smoothly along a program is asked at few rows of it and interpolated."""

import numpy as np
import pytest

from camcomp.compensation.bands.stations import Stations


def circle(rows, turns=1.0):
    angle = np.linspace(0.0, turns * 2.0 * np.pi, rows)
    return np.column_stack((np.cos(angle), np.sin(angle), np.zeros(rows)))


def test_a_turning_force_is_met_within_a_thousandth_of_it_from_a_tenth_of_the_rows():
    force = 200.0 * circle(5000)
    found = Stations.along(25.0 * circle(5000), [force])
    assert 100 < len(found.rows) < 500
    assert np.linalg.norm(found.spread(force[found.rows]) - force, axis=1).max() < 0.001 * 200.0


def test_jumps_stay_jumps():
    force = np.repeat([[200.0, 0.0, 0.0], [0.0, 0.0, 0.0], [-200.0, 0.0, 0.0]], 40, axis=0)
    place = np.column_stack((np.linspace(0.0, 1.0, 120), np.zeros((120, 2))))
    found = Stations.along(place, [force])
    assert {39, 40, 79, 80} <= set(found.rows.tolist()) and len(found.rows) <= 10
    assert found.spread(force[found.rows]) == pytest.approx(force)


@pytest.mark.parametrize("rows", [1, 2, 3])
def test_the_first_and_the_last_row_are_stations(rows):
    place = np.zeros((rows, 3))
    found = Stations.along(place, [np.zeros((rows, 3))])
    assert found.rows[0] == 0 and found.rows[-1] == rows - 1
    assert found.spread(np.arange(len(found.rows), dtype=float)).shape == (rows,)


def test_what_turns_small_beside_a_large_force_is_seen_too():
    """A force that is zero does not determine the band of machines with another force."""
    change = 30.0 * circle(400)
    found = Stations.along(0.1 * circle(400), [np.zeros((400, 3)), change])
    assert np.linalg.norm(found.spread(change[found.rows]) - change, axis=1).max() < 0.001 * 30.0
