"""Arms under their own weight at given joints: against the energy plant, and against the general solver."""

from dataclasses import replace

import numpy as np
import pytest

from camcomp.model.config.load import load_config
from camcomp.model.job import Job
from camcomp.model.statics.description import Link
from camcomp.model.statics.hanging import hang
from camcomp.model.statics.target import settle
from tests.validation.plants import kuka, serial


@pytest.fixture(scope="module")
def robot():
    return Job(load_config(["config/kuka-kr210.yaml"])).machine.robot


def postures(n):
    return np.random.default_rng(8).uniform([-3, -2.4, -2, -3, -2, -3], [3, -0.2, 2.6, 3, 2, 3], (n, 6))


def test_poses_and_torques_of_the_energy_plant(robot):
    q = postures(40)
    mine = hang(robot, q)
    truth = serial.settle(kuka.arm(tool=0.0), q, np.zeros(3))
    rigid = serial.settle(kuka.arm(tool=0.0, weights=False), q, np.zeros(3))
    assert np.abs(truth.tip - rigid.tip).max() > 1.0  # mm of sag to be right about
    np.testing.assert_allclose(mine.point, truth.tip, atol=1e-7)
    np.testing.assert_allclose(mine.rotation, truth.orientation, atol=1e-10)
    np.testing.assert_allclose(mine.drive, truth.drive, atol=1e-2)


def test_links_that_bend(robot):
    rng = np.random.default_rng(2)
    A = rng.normal(size=(6, 6)) * [[1], [1], [1], [1e3], [1e3], [1e3]]
    K = A @ A.T * 1e3 + np.diag([1e6, 1e6, 1e6, 1e12, 1e12, 1e12])
    chain = robot.chains[0]
    k = 5  # behind the second joint's link
    soft = replace(robot, chains=(replace(chain, elements=(*chain.elements[:k], Link(K), *chain.elements[k:])),))
    q = postures(10)
    plant = kuka.arm(tool=0.0)
    base = 1  # the plant starts with the base height, as the chain does
    truth = serial.settle([*plant[: base + k - 1], serial.Link(K), *plant[base + k - 1 :]], q, np.zeros(3))
    np.testing.assert_allclose(hang(soft, q).point, truth.tip, atol=1e-6)
    assert np.abs(hang(robot, q).point - truth.tip).max() > 0.01


def test_the_general_solver_agrees_where_it_can_go(robot):
    job = Job(load_config(["config/kuka-kr210.yaml"]))
    tip = np.random.default_rng(3).uniform([1300, -300, 600], [1900, 300, 1200], (20, 3))
    loaded, state = settle(job.machine, tip, np.zeros(3))
    mine = hang(robot, state.rho)
    np.testing.assert_allclose(mine.point + mine.rotation @ robot.tool, loaded, atol=1e-6)
    wrench = np.tile([100.0, -50.0, 30.0, 1e4, 2e4, -1e4], (20, 1))
    from camcomp.model.statics.solve import FREE, solve

    pulled = solve(job.machine, FREE, tip, rho=state.rho, wrench=wrench)
    mine = hang(robot, state.rho, wrench)
    np.testing.assert_allclose(mine.point + mine.rotation @ robot.tool, pulled.tip, atol=1e-6)
    np.testing.assert_allclose(mine.drive, pulled.drive, atol=0.05)


def test_an_arm_that_cannot_stand_is_refused(robot):
    from camcomp.model.statics.description import Actuator

    limp = robot.edit(Actuator, lambda a: replace(a, stiffness=1e3))
    with pytest.raises(ArithmeticError):
        hang(limp, postures(3))
