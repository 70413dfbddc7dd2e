"""Closed-form inverse kinematics of an arm: against the plant's forward kinematics, in all branches, and where it does not apply."""

from dataclasses import replace

import numpy as np
import pytest

from camcomp.model.config.load import load_config
from camcomp.model.job import Job
from camcomp.model.statics.arm import arm_of, end_pose
from camcomp.model.statics.closedform import closed_form
from camcomp.model.statics.description import Transform
from camcomp.model.statics.rigid import OUT_OF_REACH
from camcomp.model.statics.solve import FREE, INVERSE, solve
from tests.validation.plants import kuka, serial


@pytest.fixture(scope="module")
def machine():
    return Job(load_config(["config/kuka-kr210.yaml"])).machine


def postures(n, seed=1):
    """Joint angles of an arm with its elbow up and its wrist well bent."""
    low, high = np.radians([[-170, -130, 20, -170, 20, -170], [170, -20, 140, 170, 110, 170]])
    return np.random.default_rng(seed).uniform(low, high, (n, 6))


def test_all_branches_lead_to_the_pose_and_one_is_where_it_came_from(machine):
    arm = arm_of(machine.nominal)
    form = machine.closed_form
    for q in postures(50):
        R, p = end_pose(arm, q)
        branches = [b for b in form.all(R, p) if b is not None]
        assert len(branches) >= 4
        for b in branches:
            R_b, p_b = end_pose(arm, b)
            assert np.abs(p_b - p).max() < 1e-8 and np.abs(R_b - R).max() < 1e-11
        assert min(np.abs(np.exp(1j * b) - np.exp(1j * q)).max() for b in branches) < 1e-9


def test_the_branch_is_that_of_the_start_pose_and_the_plant_is_there(machine):
    tip = np.random.default_rng(3).uniform([1200, -400, 500], [2000, 400, 1300], (30, 3))
    reference = tip - machine.nominal.held_rotation @ machine.nominal.tool
    q = np.array([machine.closed_form.near(machine.nominal.held_rotation, at) for at in reference])
    assert np.abs(serial.settle(kuka.arm(weights=False), q, np.zeros(3)).tip - tip).max() < 1e-6
    numeric = replace(machine)
    vars(numeric)["closed_form"] = None  # it walks from the start pose
    walked = solve(numeric, FREE, tip, check=False).rho_nominal
    np.testing.assert_allclose(q, walked, atol=1e-9)


@pytest.mark.parametrize("config", ["orthoglide-1deg", "delta", "ur10"])
def test_the_inverse_alone_is_that_of_the_loaded_machine(config):
    machine = Job(load_config([f"config/{config}.yaml"])).real_machine
    at = machine.nominal.held_rotation @ machine.nominal.tool + machine.start_pose[9:]
    tip = at + np.random.default_rng(5).uniform(-30.0, 30.0, (300, 3))
    tip[7] += 1e5
    loaded, alone = (solve(machine, mode, tip, check=False) for mode in (FREE, INVERSE))
    assert np.array_equal(alone.rho_nominal, loaded.rho_nominal, equal_nan=True)
    assert (
        np.array_equal(alone.status == OUT_OF_REACH, loaded.status == OUT_OF_REACH) and alone.status[7] == OUT_OF_REACH
    )
    assert np.isfinite(np.delete(alone.rho_nominal, 7, axis=0)).all() and np.isnan(alone.tip).all()


def test_what_is_out_of_reach_has_no_joint_angles(machine):
    assert machine.closed_form.near(np.eye(3), np.array([9000.0, 0.0, 0.0])) is None


def test_an_arm_without_a_spherical_wrist_has_no_closed_form(machine):
    robot = machine.nominal
    chain = robot.chains[0]
    elements = list(chain.elements)
    at = max(i for i, e in enumerate(elements) if type(e).__name__ == "Actuator")
    elements.insert(at, Transform(np.array([3.0, 0.0, 0.0])))
    assert closed_form(arm_of(robot)) is not None
    assert closed_form(arm_of(replace(robot, chains=(replace(chain, elements=tuple(elements)),)))) is None
    assert Job(load_config(["config/ur10.yaml"])).machine.closed_form is None
