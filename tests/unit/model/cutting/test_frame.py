import numpy as np
import pytest

from camcomp.model.cutting.frame import lateral, path_frame, to_components, to_vector

UP = np.array([0.0, 0.0, 1.0])


def test_e_r_is_right_of_the_feed_and_outward_on_a_counter_clockwise_circle() -> None:
    phi = np.linspace(0, 6, 7)
    outward = np.stack([np.cos(phi), np.sin(phi), 0 * phi], axis=1)
    e_r, e_t, e_z = path_frame(np.stack([-np.sin(phi), np.cos(phi), 0 * phi], axis=1), UP)
    np.testing.assert_allclose(e_r, outward, atol=1e-15)
    np.testing.assert_allclose(np.cross(e_r, e_t), e_z, atol=1e-15)


def test_seed_triple_at_the_east_of_a_counter_clockwise_circle() -> None:
    # Feed along +y: right is +x, so Fx = Fr and Fy = Ft.
    force = to_vector(np.array([[215.0, -10.0, -25.0]]), np.array([[0.0, 1.0, 0.0]]), UP)
    np.testing.assert_allclose(force, [[215.0, -10.0, -25.0]], atol=1e-13)


def test_ramp_keeps_the_frame_square_to_the_tool() -> None:
    ramp = np.array([[0.6, 0.0, -0.8]])
    e_r, e_t, _ = path_frame(ramp, UP)
    np.testing.assert_allclose(e_t, [[1, 0, 0]], atol=1e-15)
    np.testing.assert_allclose(e_r, [[0, -1, 0]], atol=1e-15)
    np.testing.assert_allclose(lateral(ramp, UP), 0.6)


@pytest.mark.parametrize("axis", [UP, np.array([1.0, 0.0, 0.0]), np.array([0.48, -0.6, 0.64])])
def test_vectors_survive_the_way_through_components_on_plunges_too(axis: np.ndarray) -> None:
    rng = np.random.default_rng(1)
    tangent = rng.normal(size=(20, 3))
    tangent[:2] = [axis, -axis]
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    force = rng.normal(size=(20, 3))
    back = to_vector(to_components(force, tangent, axis), tangent, axis)
    np.testing.assert_allclose(back, force, atol=1e-12)
