"""Where the cutting force acts along a path, and where it jumps."""

from dataclasses import replace

import numpy as np
import pytest

from camcomp.model.cutting.track import Conditions, lay_track
from tests.paths import path_of

TRIPLE = np.array([215.0, -10.0, -25.0])


def conditions(**more):
    return Conditions(model=lambda cut: np.tile(TRIPLE, (len(cut), 1)), **more)


def force_at(track, piece, w):
    return track.force(np.array([piece]), np.array([float(w)]))[0]


def test_force_is_to_the_right_of_the_feed_along_it_and_up_the_tool():
    track = lay_track(path_of(("line", (10, 0, 0))), conditions())
    # feed +x: e_t = x, e_z = z, e_r = e_t x e_z = -y
    np.testing.assert_allclose(force_at(track, 0, 0.3), [-10.0, -215.0, -25.0])


def test_force_points_outward_on_a_counter_clockwise_circle():
    track = lay_track(path_of(("arc", (25, 0, 0), (0, 0, 0), 2 * np.pi), start=(25, 0, 0)), conditions())
    np.testing.assert_allclose(force_at(track, 0, 0.0), [215.0, -10.0, -25.0], atol=1e-9)
    np.testing.assert_allclose(force_at(track, 0, 0.25), [10.0, 215.0, -25.0], atol=1e-9)


def test_rapids_and_plunges_carry_no_force_and_the_cut_starts_and_ends_with_a_jump():
    path = path_of(("rapid", (5, 0, 5)), ("line", (5, 0, 0)), ("line", (9, 0, 0)), ("line", (9, 0, 5)))
    track = lay_track(path, conditions())
    assert track.cutting.tolist() == [False, False, True, False]
    assert track.jump.tolist() == [False, False, True, True]
    assert not force_at(track, 1, 0.5).any()


def test_a_corrected_plunge_slants_and_is_one_and_a_ramp_is_none():
    path = path_of(("line", (0.003, -0.002, -5)), ("line", (0.053, -0.002, -10)))
    assert lay_track(path, conditions()).cutting.tolist() == [False, True]


def test_a_model_may_load_plunges():
    track = lay_track(path_of(("line", (0, 0, -5))), conditions(plunges=True))
    assert track.cutting.all()


@pytest.mark.parametrize(("turn_deg", "jumps"), [(4.9, False), (5.1, True), (90.0, True)])
def test_force_jumps_where_the_feed_turns_by_more_than_five_degrees(turn_deg, jumps):
    a = np.radians(turn_deg)
    track = lay_track(path_of(("line", (10, 0, 0)), ("line", (10 + 10 * np.cos(a), 10 * np.sin(a), 0))), conditions())
    assert track.jump.tolist() == [False, jumps]
    gap = np.linalg.norm(force_at(track, 0, 1.0) - force_at(track, 1, 0.0))
    assert (gap > 1.0) == jumps


def test_a_shallow_corner_takes_the_force_of_the_bisecting_direction_and_fades_linearly():
    a = np.radians(4.0)
    track = lay_track(path_of(("line", (10, 0, 0)), ("line", (10 + 10 * np.cos(a), 10 * np.sin(a), 0))), conditions())
    t = np.array([np.cos(a / 2), np.sin(a / 2), 0.0])
    r = np.array([np.sin(a / 2), -np.cos(a / 2), 0.0])
    corner = 215.0 * r - 10.0 * t + [0, 0, -25.0]
    np.testing.assert_allclose(force_at(track, 0, 1.0), corner, atol=1e-9)
    start = force_at(track, 0, 0.0)
    np.testing.assert_allclose(start, [-10.0, -215.0, -25.0], atol=1e-9)
    np.testing.assert_allclose(force_at(track, 0, 0.25), 0.75 * start + 0.25 * corner, atol=1e-9)


def test_above_the_stock_nothing_is_cut_and_a_ramp_is_divided_at_its_top():
    path = path_of(("line", (10, 0, 3)), ("line", (30, 0, -1)), ("line", (40, 0, -1)), start=(0, 0, 3))
    track = lay_track(path, conditions(stock_top_mm=0.0))
    assert track.motion.tolist() == [0, 1, 1, 2]
    np.testing.assert_allclose(track.u1[1], 0.75, atol=1e-12)
    assert track.cutting.tolist() == [False, False, True, True]


def test_a_motion_without_length_does_not_end_the_cut():
    track = lay_track(path_of(("line", (10, 0, 0)), ("line", (10, 0, 0)), ("line", (20, 0, 0))), conditions())
    assert not track.jump.any()
    np.testing.assert_allclose(force_at(track, 1, 0.5), force_at(track, 0, 1.0))


def test_depth_is_the_programmed_height_under_the_top_of_the_stock():
    seen = []

    def model(cut):
        seen.append(cut.depth.copy())
        return np.zeros((len(cut), 3))

    track = lay_track(path_of(("line", (10, 0, -2)), start=(0, 0, -2)), Conditions(model=model, stock_top_mm=1.0))
    force_at(track, 0, 0.5)
    np.testing.assert_allclose(seen[-1], [3.0])


def test_an_upright_arc_is_cut_where_its_feed_turns_over():
    # half a turn in the XZ plane, from the lowest point over the vertical to the highest
    path = path_of(("arc", (0, 0, 20), (0, 0, 10), -np.pi), start=(0, 0, 0))
    track = lay_track(replace(path, axis=np.array([[0.0, 1.0, 0.0]])), conditions())
    assert track.motion.tolist() == [0, 0] and track.u1[0] == pytest.approx(0.5)
    assert track.jump.tolist() == [False, True]
    before, after = force_at(track, 0, 1.0), force_at(track, 1, 0.0)
    np.testing.assert_allclose(before[:2], -after[:2])
    assert before[2] == after[2] == -25.0
    np.testing.assert_allclose(before, force_at(track, 0, 0.5))


def test_a_first_cut_behind_a_move_without_length_begins_with_a_jump():
    track = lay_track(path_of(("line", (0, 0, 0)), ("line", (10, 0, 0))), conditions())
    assert track.jump.tolist() == [False, True]
    assert not lay_track(path_of(("line", (0, 0, 0)), ("rapid", (10, 0, 0))), conditions()).jump.any()


def test_an_arc_that_dips_into_the_stock_for_a_twentieth_of_its_length_is_cut_there():
    """A full turn in the XZ plane from its side; its lowest 0.1 mm lie below the stock's top: crossings in closed form."""
    radius, depth = 10.0, 0.1
    turn = path_of(("arc", (10, 0, 10), (0, 0, 10), 2 * np.pi), start=(10, 0, 10))
    track = lay_track(replace(turn, axis=np.array([[0.0, 1.0, 0.0]])), conditions(stock_top_mm=depth))
    half = np.arccos(1.0 - depth / radius) / (2 * np.pi)
    below = np.flatnonzero(track.cutting)
    assert track.u0[below].min() == pytest.approx(0.25 - half, abs=1e-9)
    assert track.u1[below].max() == pytest.approx(0.25 + half, abs=1e-9)


def test_the_force_ends_at_once_where_a_rapid_goes_straight_on():
    """The rapid has the direction of the cut: nothing fades, and the tip may stop between them."""
    track = lay_track(path_of(("line", (10, 0, 0)), ("rapid", (20, 0, 0)), ("line", (30, 0, 0))), conditions())
    assert track.jump.tolist() == [False, True, True] and track.corner.tolist() == [True, True, True]
    np.testing.assert_allclose(force_at(track, 0, 1.0), force_at(track, 0, 0.3))
    assert not force_at(track, 1, 0.0).any() and not force_at(track, 1, 1.0).any()
