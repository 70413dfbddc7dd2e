"""The interpolated machine against the exact one."""

import numpy as np
import pytest

from camcomp.compensation.long import field as field_module
from camcomp.compensation.long.field import ALLOWED, LEVELS, Field
from camcomp.compensation.long.kernel import find_tiles, look_up
from camcomp.ground.files import shipped
from camcomp.model.config.load import load_config
from camcomp.model.job import Job
from camcomp.model.statics.target import correct, settle

FORCE = np.array([[215.0, -10.0, -25.0], [-215.0, 200.0, 0.0]])


def ask(known, target, force):
    """(correction, shift, tilt, drives, change of joints), nominal joints, tiles."""
    answer, nominal, tile = known.look(target, force)
    m = len(known.machine.actuators)
    return np.split(answer, [3, 6, 9, 9 + m], axis=1), nominal, tile


def machine(name):
    return Job(load_config([shipped(f"config/{name}.yaml")])).machine


@pytest.fixture(scope="module")
def orthoglide():
    return machine("orthoglide-1deg")


def points(rng, n, low, high):
    return rng.uniform(low, high, (n, 3)), rng.uniform(FORCE.min(axis=0), FORCE.max(axis=0), (n, 3))


def test_every_answer_is_the_exact_one_within_the_promise(orthoglide):
    low = np.array([-60.0, -70.0, -170.0])
    target, force = points(np.random.default_rng(3), 150, low, low + 30.0)
    known = Field(orthoglide, FORCE)
    (correction, shift, tilt, drives, change), nominal, tile = ask(known, target, force)
    assert (tile >= 0).all() and len(known.tiles.half) >= 4
    exact = correct(orthoglide, target, force)
    tip, _ = settle(orthoglide, target, force)
    assert np.abs(target + correction - exact.commanded).max() < 2 * ALLOWED
    assert np.abs(target + shift - tip).max() < 2 * ALLOWED
    assert np.abs(nominal - exact.rho_nominal).max() < 2 * ALLOWED
    assert np.abs(nominal + change - exact.rho).max() < 2 * ALLOWED
    assert np.abs(drives - exact.drive).max() < 2e-4 * np.abs(exact.drive).max()
    assert np.abs(tilt - exact.tilt).max() < 1e-6


def test_neighbours_asked_together_get_what_each_gets_alone(orthoglide):
    """Points of a tile share one pass through its coefficients, as many as there are lanes; the last ones are fewer."""
    rng, way = np.random.default_rng(4), np.linspace(0.0, 1.0, 97)[:, None]
    target = np.array([-60.0, -70.0, -170.0]) + way * np.array([40.0, 30.0, 5.0])
    force = rng.uniform(FORCE.min(axis=0), FORCE.max(axis=0), (97, 3))
    known = Field(orthoglide, FORCE)
    together = ask(known, target, force)
    assert len(np.unique(together[2])) >= 3
    for k in range(97):
        alone = ask(known, target[k : k + 1], force[k : k + 1])
        assert all((a[0] == b[k]).all() for a, b in zip(alone[0], together[0], strict=True))
        assert (alone[1][0] == together[1][k]).all() and alone[2][0] == together[2][k]


def test_slopes_and_rates_are_derivatives(orthoglide):
    centre = np.array([[-60.0, -60.0, -160.0]])
    known = Field(orthoglide, FORCE)
    _, _, tile = ask(known, centre, FORCE[:1])
    at = known.corner + known.tiles.centre[tile[0]]
    for axis in range(3):
        step = 0.01 * np.eye(3)[axis]
        pair = np.stack((at - step, at + step))
        tip, state = settle(orthoglide, pair, np.tile(known.force_mid, (2, 1)))
        assert known.tiles.slope[tile[0], :, axis] == pytest.approx((tip[1] - tip[0]) / 0.02, abs=1e-4)
        rates = (state.rho_nominal[1] - state.rho_nominal[0]) / 0.02
        assert known.tiles.rates[tile[0], :, axis] == pytest.approx(rates, abs=1e-4)


def test_a_wider_range_of_forces_makes_a_new_field():
    target = np.zeros((4, 3))
    known = Field(machine("cartesian"), np.zeros((1, 3)))
    (correction, *_), _, _ = ask(known, target, np.zeros((4, 3)))
    assert np.abs(correction).max() < 1e-9
    force = np.array([[100.0, 0, 0], [0, -300.0, 0], [0, 0, 50.0], [0, 0, 0]])
    (correction, *_), _, tile = ask(known, target, force)
    assert (tile >= 0).all()
    assert correction == pytest.approx(-force / [2e4, 2e4, 4e4], abs=1e-6)


def test_where_no_fit_is_good_enough_points_are_left_to_the_solver(monkeypatch):
    monkeypatch.setattr(field_module, "ALLOWED", -1.0)
    known = Field(machine("cartesian"), np.zeros((1, 3)))
    monkeypatch.setattr(np, "empty", lambda shape, dtype=float: np.full(shape, 7, dtype))  # of a process before
    answer, nominal, tile = known.look(np.zeros((2, 3)), np.zeros((2, 3)))
    assert (tile < 0).all() and len(known.tiles.half) == 0
    assert not answer.any() and not nominal.any(), "or the next points would lie anywhere"


def test_a_cube_with_points_out_of_reach_is_divided(orthoglide):
    job = Job(load_config([shipped("config/orthoglide.yaml")]))
    reach = 0.0
    for distance in np.arange(0.0, 400.0, 1.0):  # outwards along a diagonal until the rigid machine gives up
        point = np.array([[-1.0, -1.0, -1.0]]) * (60.0 + distance) - [0, 0, 100.0]
        if correct(job.machine, point, np.zeros((1, 3))).status[0]:
            break
        reach = distance
    near = np.array([[-1.0, -1.0, -1.0]]) * (60.0 + 0.8 * reach) - [0, 0, 100.0]
    known = Field(job.machine, np.zeros((1, 3)))
    (correction, *_), _, tile = ask(known, near, np.zeros((1, 3)))
    exact = correct(job.machine, near, np.zeros((1, 3)))
    assert tile[0] < 0 or np.abs(near + correction - exact.commanded).max() < 5e-5
    assert (known.tiles.values == -1).any()


def test_points_are_searched_once_and_looked_up_once_where_their_cubes_are_known(orthoglide, monkeypatch):
    target, force = points(np.random.default_rng(5), 50, np.array([-4.0, -4.0, -104.0]), np.array([4.0, 4.0, -96.0]))
    known = Field(orthoglide, FORCE)
    ask(known, target, force)
    asked = []
    for each in (find_tiles, look_up):
        monkeypatch.setattr(field_module, each.__name__, lambda *args, own=each: asked.append(own) or own(*args))
    ask(known, target, force)
    assert asked == [find_tiles, look_up]


def test_far_out_of_reach_one_point_of_a_cube_is_tried_and_no_more(orthoglide):
    """The solver tries long before it gives up: a line with a digit too many took half a minute."""
    known = Field(orthoglide, np.array([[0.0, 0.0, -100.0]]))
    ask(known, np.array([[900.0, 0.0, 0.0]]), np.zeros((1, 3)))
    assert known.solved == LEVELS, "the cube and every half of it that holds the point"
