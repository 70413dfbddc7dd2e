"""Friction acts against the motion, standing and at speed."""

import numpy as np
import pytest

from camcomp.diagnosis.axis.block_least_squares import series
from camcomp.diagnosis.axis.friction import brakes


@pytest.mark.parametrize(
    ("held", "drag", "said"),
    [(5.0, 0.1, True), (5.0, -0.1, True), (0.0, 0.1, True), (-5.0, 0.3, False), (0.0, -0.1, False), (2.0, -0.1, False)],
)
def test_what_pushes_an_axis_is_no_friction(held, drag, said):
    """Speeds to 30 mm/s: -0.1 N s/mm leave 2 N of 5 N, and would push with 1 N where only 2 N hold."""
    t = np.arange(0.0, 20.0, 0.01)
    speed = 30.0 * np.sin(0.7 * t)
    A = np.column_stack([np.sign(speed), speed, np.ones(len(t))])
    force = A @ [held, drag, 1.0] + np.random.default_rng(5).normal(0.0, 0.2, len(t))
    assert brakes(series([t], [force]), A) == said
