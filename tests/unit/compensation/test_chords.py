"""Division of a curve into straight lines: the bound holds, and the lines are few."""

import numpy as np
import pytest

from camcomp.compensation.program.division import divide, second_derivative, trial_nodes


def miss(curve, nodes, shift):
    """Largest distance between the polyline through shifted nodes and the curve at equal parameter."""
    worst = 0.0
    points = curve(nodes.w) + shift
    for a in range(len(nodes.w) - 1):
        if nodes.piece[a] != nodes.piece[a + 1]:
            continue
        f = np.linspace(0.0, 1.0, 41)[:, None]
        w = nodes.w[a] + f[:, 0] * (nodes.w[a + 1] - nodes.w[a])
        line = points[a] + f * (points[a + 1] - points[a])
        worst = max(worst, float(np.linalg.norm(line - curve(w), axis=1).max()))
    return worst


def circle(radius):
    return lambda w: radius * np.stack((np.cos(2 * np.pi * w), np.sin(2 * np.pi * w), 0 * w), axis=1)


def wavy(w):
    return np.stack((80 * w, 0.3 * np.sin(2 * w), 0.1 * np.exp(w)), axis=1)


@pytest.mark.parametrize(("curve", "length", "angle"), [(circle(25.0), 157.0, 2 * np.pi), (wavy, 80.0, 0.0)])
@pytest.mark.parametrize("tolerance", [1e-3, 1e-2])
def test_lines_keep_within_the_tolerance(curve, length, angle, tolerance):
    trial = trial_nodes(np.array([length]), np.array([angle]), np.array([True]))
    nodes, shift = divide(trial, second_derivative(trial, curve(trial.w)), np.array([tolerance]))
    assert miss(curve, nodes, shift) <= 1.02 * tolerance
    assert not shift[[0, -1]].any()


def test_a_circle_takes_no_more_lines_than_its_sagitta_demands():
    # vertices and middles may both miss by the tolerance e: half angle with R (1 - cos) = 2 e
    radius, tolerance = 25.0, 1e-3
    fewest = np.pi / np.arccos(1.0 - 2.0 * tolerance / radius)
    trial = trial_nodes(np.array([157.0]), np.array([2 * np.pi]), np.array([True]))
    nodes, _ = divide(trial, second_derivative(trial, circle(radius)(trial.w)), np.array([tolerance]))
    assert len(nodes.w) - 1 <= 1.02 * fewest + 1


def test_a_straight_piece_stays_one_line_and_neighbours_do_not_mix():
    trial = trial_nodes(np.array([50.0, 157.0, 50.0]), np.array([0.0, 2 * np.pi, 0.0]), np.ones(3, bool))
    x = np.where(
        (trial.piece == 1)[:, None], circle(25.0)(trial.w), np.stack((50 * trial.w, 0 * trial.w, 0 * trial.w), axis=1)
    )
    nodes, _ = divide(trial, second_derivative(trial, x), np.full(3, 1e-3))
    counts = np.diff(nodes.first) - 1
    assert counts[0] == 1 and counts[2] == 1 and counts[1] > 100
    inside = nodes.w[nodes.piece == 1]
    assert inside[0] == 0.0 and inside[-1] == 1.0 and (np.diff(inside) > 0).all()
