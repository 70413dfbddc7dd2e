"""The program frame in the machine frame: axes that are the same give what a product with them gives."""

import numpy as np
import pytest

from camcomp.model.job import Frame
from camcomp.model.statics.build import rotation_of


@pytest.mark.parametrize("turned_deg", [0.0, 25.0])
def test_points_and_vectors_are_those_of_the_product(turned_deg):
    frame = Frame(np.array([12.5, -3.0, 0.0]), rotation_of([0.0, 0.0, turned_deg]))
    points = np.random.default_rng(5).normal(0.0, 80.0, (50, 3))
    points[:3] = -0.0
    given, product = points.copy(), points @ frame.rotation.T
    for found, expected in (
        (frame.vectors(points), product),
        (frame.to_machine(points), product + frame.origin),
        (frame.to_program(points), (points - frame.origin) @ frame.rotation),
    ):
        assert np.array_equal(found, expected) and not np.shares_memory(found, points)
    assert given.tobytes() == points.tobytes()
    assert turned_deg or not np.signbit(frame.vectors(points)[:3]).any()
