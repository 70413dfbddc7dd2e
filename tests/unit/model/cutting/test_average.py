import numpy as np
import pytest
from numpy.polynomial.legendre import leggauss

from camcomp.model.cutting.average import linear_edge, power_law, sine_power, slanted, to_path


def gauss(f, start: float, stop: float) -> float:  # type: ignore[no-untyped-def]
    """Gauss-Legendre after phi = start + (stop - start) (3 u^2 - 2 u^3), which flattens the steep ends."""
    nodes, weights = leggauss(200)
    u = (nodes + 1) / 2
    phi = start + (stop - start) * u**2 * (3 - 2 * u)
    return float((weights / 2 * f(phi) * (stop - start) * 6 * u * (1 - u)).sum())


@pytest.mark.parametrize("power", [0.7, 0.8, 1.0, 1.76, 2.0])
@pytest.mark.parametrize("span", [(0, np.pi), (0, 0.4), (2.0, np.pi), (0.3, 2.9), (1.2, 1.3)])
def test_sine_power_agrees_with_quadrature(power: float, span: tuple[float, float]) -> None:
    expected = gauss(lambda phi: np.sin(phi) ** power, *span)
    np.testing.assert_allclose(sine_power(power, *span), expected, rtol=1e-8)


def test_sine_power_of_whole_powers_is_elementary() -> None:
    np.testing.assert_allclose(sine_power(1, 0.2, 2.5), np.cos(0.2) - np.cos(2.5), rtol=1e-14)
    np.testing.assert_allclose(sine_power(2, 0, np.pi), np.pi / 2, rtol=1e-14)


def test_a_power_law_without_exponent_is_the_linear_model_without_edges() -> None:
    start, stop = np.array([0.0, 0.0, 1.9]), np.array([np.pi, 1.1, np.pi])
    chip, depth = np.array([0.05, 0.1, 0.2]), np.array([1.0, 2.0, 3.0])
    linear = linear_edge(
        chip=chip, depth=depth, teeth=3, start=start, stop=stop, cutting=(700, 0.3 * 700, 0.2 * 700), edge=(0, 0, 0)
    )
    power = power_law(chip=chip, depth=depth, teeth=3, start=start, stop=stop, kc11=700, mc=0.0, ratios=(0.3, 0.2))
    np.testing.assert_allclose(power, linear, rtol=1e-12, atol=1e-12)


def test_engagements_side_by_side_add_up() -> None:
    parts = [(0.0, 0.9), (0.9, 2.2), (2.2, np.pi)]
    for model in (
        lambda a, b: linear_edge(
            chip=0.1, depth=2.0, teeth=2, start=a, stop=b, cutting=(900, 250, 150), edge=(15, 19, 18)
        ),
        lambda a, b: power_law(chip=0.1, depth=2.0, teeth=2, start=a, stop=b, kc11=641, mc=0.27, ratios=(0.3, 0.2)),
    ):
        np.testing.assert_allclose(sum(model(*part) for part in parts), model(0.0, np.pi), rtol=1e-12, atol=1e-12)


def test_a_counter_clockwise_spindle_mirrors_the_side_force_only() -> None:
    force = np.array([[-3.0, 5.0, -2.0]])
    np.testing.assert_array_equal(to_path(force, True), [[-5.0, -3.0, -2.0]])
    np.testing.assert_array_equal(to_path(force, False), [[5.0, -3.0, -2.0]])


def test_a_force_normal_to_a_slanting_edge_is_radial_at_a_side_and_pushes_the_tool_away_under_a_tip() -> None:
    """A unit normal force and one along the edge, at the side of a cylinder, at 30 degrees and under the tool's tip."""
    rise, run = np.array([1.0, 0.5, 0.0]), np.array([0.0, np.sqrt(0.75), 1.0])
    radial, axial = slanted(np.full(3, -1.0), np.zeros(3), rise, run)  # the workpiece presses towards the tool's axis
    np.testing.assert_allclose(radial, [-1.0, -0.5, 0.0], atol=1e-15)
    np.testing.assert_allclose(axial, [0.0, np.sqrt(0.75), 1.0], atol=1e-15)  # and up, out of the workpiece
    radial, axial = slanted(np.zeros(3), np.ones(3), rise, run)
    np.testing.assert_allclose(axial, [1.0, 0.5, 0.0], atol=1e-15)
    np.testing.assert_allclose(radial, [0.0, np.sqrt(0.75), 1.0], atol=1e-15)
