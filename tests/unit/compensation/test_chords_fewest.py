"""The sample grooves are cut with hardly more lines than their tolerance demands."""

import numpy as np
import pytest

from tests.fewest import by_curvature, by_reach, groove

MOST = 1.2  # times the fewest


@pytest.mark.parametrize(("radius", "tolerance_um"), [(50, 1.0), (2, 1.0), (50, 5.0), (2, 0.5)])
def test_the_sample_grooves_take_few_lines(radius, tolerance_um):
    lines, by_search, by_bound = groove(radius, tolerance_um=tolerance_um)
    assert by_bound <= by_search <= 1.1 * by_bound + 2  # two ways to count the fewest agree
    assert lines <= MOST * by_bound


def test_the_search_finds_the_lines_of_a_circle():
    angle = np.linspace(0.0, 2 * np.pi, 2001)
    circle = np.stack((np.cos(angle), np.sin(angle), 0 * angle), axis=1)
    tolerance = 1e-3
    fewest = np.pi / np.arccos((1 - tolerance) / (1 + tolerance))  # chords of the outer circle that touch the inner one
    assert by_curvature(circle, tolerance) == pytest.approx(fewest, abs=1.0)
    assert fewest <= by_reach(circle, tolerance) <= 1.06 * fewest + 1
