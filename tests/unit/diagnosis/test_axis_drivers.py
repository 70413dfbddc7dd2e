"""Covariates of the residual of an axis, in motion and at rest."""

import numpy as np
import pytest

from camcomp.diagnosis.axis.block_least_squares import series
from camcomp.diagnosis.axis.drivers import dependences
from camcomp.diagnosis.axis.terms import AxisTravel

TIME = np.arange(0.0, 20.0, 0.01)


def swing(way, hertz):
    turn = 2.0 * np.pi * hertz
    return AxisTravel(
        TIME, way * np.sin(turn * TIME), way * turn * np.cos(turn * TIME), -way * turn**2 * np.sin(turn * TIME)
    )


@pytest.mark.parametrize(("own", "left", "named"), [
    (swing(0.0, 1.0), TIME**2 / 100.0, "time"),
    (swing(20.0, 0.7), 1e-3 * swing(5.0, 1.9).acceleration, "acceleration:y"),
    (swing(20.0, 0.7), 1e-4 * np.abs(swing(20.0, 0.7).speed) ** 2, "velocity"),
])  # fmt: skip
def test_it_is_named(own, left, named):
    """The first axis stands: it has no place or speed of its own, and that was an internal error."""
    noise = 0.1 * np.random.default_rng(4).standard_normal(len(TIME))
    data = series([TIME], [left + noise])
    found = dependences(data, np.ones((len(TIME), 1)), [own], {"y": [swing(5.0, 1.9)]}, 0.1)
    assert found and found[0][0] == named, found


def test_noise_depends_on_nothing():
    data = series([TIME], [0.1 * np.random.default_rng(5).standard_normal(len(TIME))])
    assert dependences(data, np.ones((len(TIME), 1)), [swing(20.0, 0.7)], {"y": [swing(5.0, 1.9)]}, 0.05) == []
