"""Centres, sweeps, and arcs that rounding must not turn into others."""

import math

import pytest

from camcomp.gcode.arcplan import Move, divide, plan, turns_of
from camcomp.gcode.arcs import ArcError, centre_of_radius, check_radii, sweep
from camcomp.ground.datatypes import ARC, LINE


@pytest.mark.parametrize(
    ("radius", "ccw", "centre"),
    [
        (1.0, True, (1.0, 0.0)),
        (2.0, True, (1.0, 3**0.5)),
        (2.0, False, (1.0, -(3**0.5))),
        (-2.0, True, (1.0, -(3**0.5))),
    ],
)
def test_centre_of_radius(radius, ccw, centre):
    found = centre_of_radius((0.0, 0.0), (2.0, 0.0), radius, ccw)
    assert found == pytest.approx(centre)
    angle = sweep((0.0, 0.0), (2.0, 0.0), found, ccw)
    assert (abs(angle) <= math.pi + 1e-9) == (radius > 0.0)
    assert (angle > 0.0) == ccw


def test_radius_is_taken_as_long_enough_within_a_micrometre():
    assert centre_of_radius((0.0, 0.0), (2.002, 0.0), 1.0, True) == pytest.approx((1.001, 0.0))
    with pytest.raises(ArcError):
        centre_of_radius((0.0, 0.0), (2.003, 0.0), 1.0, True)


def test_radii_may_differ_as_linuxcnc_lets_them():
    check_radii((-1.0, 0.0), (1.028, 0.0), (0.0, 0.0))
    check_radii((-1000.0, 0.0), (1001.0, 0.0), (0.0, 0.0))
    for start, end in (((-1.0, 0.0), (1.029, 0.0)), ((-1000.0, 0.0), (1001.1, 0.0)), ((-1e-5, 0.0), (1e-5, 0.0))):
        with pytest.raises(ArcError):
            check_radii(start, end, (0.0, 0.0))


@pytest.mark.parametrize("ccw", [True, False])
def test_equal_points_are_a_full_circle(ccw):
    sign = 1.0 if ccw else -1.0
    assert sweep((1.0, 0.0), (1.0, 0.0), (0.0, 0.0), ccw) == sign * 2.0 * math.pi
    assert sweep((1.0, 0.0), (0.0, 1.0), (0.0, 0.0), ccw, 3) == pytest.approx(
        sign * (4.0 * math.pi + (0.5 if ccw else 1.5) * math.pi)
    )


@pytest.mark.parametrize(("angle", "turns"), [(0.1, 1), (2 * math.pi, 1), (-6.4, 2), (4 * math.pi, 2), (12.6, 3)])
def test_turns(angle, turns):
    assert turns_of(angle) == turns


def blocks(angle, start, end, radius=5.0, resolution=1e-3, **options):
    centre = [0.0, 0.0, 0.0]
    move = Move(ARC, [radius * math.cos(angle), radius * math.sin(angle), 0.0], centre, angle)
    return plan(start, move, end, 17, resolution, **options)


def test_an_arc_that_says_what_it_means_stays_one_block():
    assert len(blocks(1.0, [5.0, 0.0, 0.0], [2.702, 4.207, 0.0])) == 1
    assert len(blocks(2 * math.pi, [5.0, 0.0, 0.0], [5.0, 0.0, 0.0])) == 1


def test_a_tiny_arc_whose_ends_round_together_becomes_a_line():
    (move,) = blocks(1e-5, [5.0, 0.0, 0.0], [5.0, 0.0, 0.0])
    assert move.kind == LINE


def test_a_tiny_arc_whose_end_rounds_behind_its_start_becomes_a_line():
    (move,) = blocks(1e-4, [5.0, 0.0, 0.0], [5.0, -0.001, 0.0])
    assert move.kind == LINE


def test_a_full_circle_whose_ends_round_apart_is_divided():
    moves = blocks(2 * math.pi, [5.0, 0.0, 0.0], [5.0, 0.001, 0.0])
    assert len(moves) == 2
    assert sum(move.angle for move in moves) == pytest.approx(2 * math.pi)


def test_turns_are_divided_where_the_control_has_none():
    assert len(blocks(5 * math.pi, [5.0, 0.0, 0.0], [-5.0, 0.0, 0.0])) == 1
    assert len(blocks(5 * math.pi, [5.0, 0.0, 0.0], [-5.0, 0.0, 0.0], turns_allowed=False)) == 5


def test_a_start_off_the_circle_becomes_short_lines():
    moves = blocks(1.0, [6.0, 0.0, 0.0], [2.702, 4.207, 0.0])
    assert len(moves) > 5 and all(move.kind == LINE for move in moves)
    assert moves[-1].end == pytest.approx([2.7015, 4.2074, 0.0], abs=1e-3)


def test_parts_of_a_helix():
    move = Move(ARC, [0.0, 5.0, 4.0], [0.0, 0.0, 0.0], math.pi / 2)
    first, second = divide([5.0, 0.0, 0.0], move, 17, 2)
    assert first.end == pytest.approx([5 / 2**0.5, 5 / 2**0.5, 2.0])
    assert second.end == [0.0, 5.0, 4.0]


def test_a_radius_a_little_longer_than_half_the_chord_puts_the_centre_beside_it():
    assert centre_of_radius((0.0, 0.0), (2.0, 0.0), 1.005, True) == pytest.approx((1.0, (1.005**2 - 1.0) ** 0.5))
