"""Inertia, growing links, a soft base and a limit of speed, against plants independent of the model."""

import csv
import json
from functools import partial

import numpy as np
import pytest

from camcomp.ground import shelf
from camcomp.model import signal_path
from camcomp.model.config.load import load_config
from camcomp.model.effect import Cause, Load, Motion, applies
from camcomp.model.job import Job
from camcomp.model.law.covariates import loads_along
from camcomp.model.motion.response import aim_at, respond
from camcomp.model.motion.travel import Travel
from camcomp.model.motion.twin import twin_of
from camcomp.model.statics.masses import acceleration, has_moved_mass, mass_loads
from tests.validation import runner
from tests.validation.plants import bodies
from tests.validation.plants.kuka import ROWS, G

KUKA = runner.ROOT / "config" / "kuka-kr210.yaml"
POSE = np.radians([10.0, -70.0, 95.0, 15.0, 60.0, -20.0])
AXIS = """
robot:
  name: one axis
  type: serial
  convention: dh
  joints:
    - {name: z, joint: prismatic, alpha_deg: 90, stiffness_N_per_mm: 20000, mass_kg: 50}
    - {name: y, joint: prismatic, theta_deg: 90, alpha_deg: 90, stiffness_N_per_mm: 20000, mass_kg: 20}
    - {name: x, joint: prismatic, theta_deg: 90, alpha_deg: 90, stiffness_N_per_mm: 20000}
tool: {length_mm: 0}
"""
LINE = "G21 G90 G17 G94\nS9000 M3\nG0 X0 Y0 Z0\nG1 Z60 F1800\nG1 Z0 F1800\nM5\nM30\n"


@pytest.fixture(scope="module")
def robot():
    return Job(load_config([KUKA])).real_machine.robot


def swing(t):
    return POSE + np.radians(8.0) * np.sin(2.0 * np.pi * 0.5 * t * np.array([1.0, 1.3, 0.7, 2.0, 1.6, 1.1]))


def test_drives_accelerate_the_masses_as_lagrange_says(robot):
    time = np.arange(0.0, 1.2, 0.002)
    got = mass_loads(robot, np.array([swing(t) for t in time]), time).drive
    for k in (200, 555):
        want = bodies.inertia_torques(swing, float(time[k]))
        assert got[k] == pytest.approx(want, rel=3e-3, abs=2e-3 * np.abs(want).max())


def test_at_rest_the_base_carries_the_weights(robot):
    loads = mass_loads(robot, POSE[None], None)
    centres, pulls = bodies.walk(POSE)[1], np.array([[0.0, 0.0, -G * row[5]] for row in ROWS])
    assert not loads.drive.any()
    assert loads.base[0] == pytest.approx(
        np.concatenate([pulls.sum(axis=0), np.cross(centres, pulls).sum(axis=0)]), rel=1e-9
    )


@pytest.mark.parametrize("even", [True, False])
def test_acceleration_of_a_constant_one_is_exact_at_any_instants(even):
    time = np.linspace(0.0, 1.0, 401) if even else np.sort(np.random.default_rng(1).uniform(0.0, 1.0, 40))
    got = acceleration(time, 3.0 * time[:, None] ** 2)
    assert got == pytest.approx(np.full((len(time), 1), 6.0), rel=1e-6)


@pytest.mark.parametrize("difference, cross", [(0.0, 0.0), (3e-11, -2e-11)])
def test_a_base_that_turns_about_its_foot_moves_the_tip_as_moments_balance(robot, difference, cross):
    force, depth, soft = np.array([150.0, -80.0, -40.0]), 400.0 * (difference == 0.0), 1e-10
    tip = bodies.walk(POSE)[0]
    base = shelf.load("effects", "base_compliance")
    n = np.zeros((1, 6))
    motion = Motion(
        time=np.zeros(1),
        common=np.zeros(1),
        cut_min=np.zeros(1),
        temperature=None,
        encoder=POSE[None],
        speed=n,
        direction=n,
        home=n[0],
        stiffness=n[0],
        ordered=False,
        masses=lambda: mass_loads(robot, POSE[None], None),
    )
    p = {
        "rad_per_Nmm": soft,
        "rad_per_N": depth * soft,
        "mm_per_N": 0.0,
        "difference_rad_per_Nmm": difference,
        "cross_rad_per_Nmm": cross,
    }
    got = base.on_pose(tip[None], Load(force[None], np.zeros((1, 6))), motion, p)[0]
    level = np.array([[difference, cross, 0.0], [cross, -difference, 0.0], [0.0, 0.0, 0.0]])
    want = bodies.on_pedestal(POSE, force, soft * np.eye(3) + level, depth)
    assert np.linalg.norm(want - tip) > 0.5
    assert got - tip == pytest.approx(want - tip, abs=4e-3 * np.linalg.norm(want - tip))


def test_a_drive_with_a_largest_speed_falls_behind_and_catches_up():
    def asked(t):
        return 40.0 * np.sin(3.0 * t)

    time = np.linspace(0.0, 3.0, 3001)
    x = asked(time)[:, None]
    motion = Motion(
        time=time,
        common=time,
        cut_min=time,
        temperature=None,
        encoder=x,
        speed=x,
        direction=x,
        home=np.zeros(1),
        stiffness=np.ones(1),
    )
    limit = shelf.load("effects", "speed_limit")
    got = limit.on_servo(x, motion, np.ones(1), {"speed_mm_per_s": 70.0})[:, 0]
    fine, want = bodies.slow_follower(asked, 70.0, 3.0, 5e-4)
    assert got == pytest.approx(np.interp(time, fine, want), abs=0.05)
    assert np.abs(got - x[:, 0]).max() > 5.0


def test_a_search_for_the_limit_begins_at_the_speed_that_encoders_keep_to():
    def asked(t):
        return 40.0 * np.sin(3.0 * t)

    time, reached = bodies.slow_follower(asked, 70.0, 3.0, 5e-4)
    rows = slice(None, None, 60)
    guess = shelf.load("effects", "speed_limit").first_guess
    assert guess([(time[rows], asked(time[rows]), reached[rows])]) == pytest.approx(70.0, rel=0.01)
    assert guess([(time[rows], asked(time[rows]), asked(time[rows]))]) > 1e5


def test_compensation_leaves_what_no_set_point_corrects():
    job = Job(load_config([KUKA]))
    other = [Cause(name, shelf.load("effects", name), "A2") for name in ("speed_limit", "inertia")]
    vars(job)["causes"] = tuple(other)
    assert [each.name for each in job.correctable.causes] == ["inertia"]
    job = Job(load_config([KUKA]))
    vars(job)["causes"] = tuple(other[1:])
    assert job.correctable is job


def simulated(folder, config, program, **more):
    """Columns of a log of `simulate`."""
    (folder / "machine.yaml").write_text(config)
    (folder / "more.yaml").write_text(json.dumps({"effects": [], **more}))
    (folder / "line.nc").write_text(program)
    out = folder / "log.csv"
    code, said = runner.invoke([
        "simulate", str(folder / "line.nc"), "--config", str(folder / "machine.yaml"), "--config", str(folder / "more.yaml"),
        "-o", str(out), "--step-s", "0.01",
    ])  # fmt: skip
    assert code == 0, said
    rows = list(csv.DictReader(out.read_text().splitlines()))
    return {key: np.array([float(row[key] or "nan") for row in rows]) for key in rows[0]}


def test_an_axis_that_speeds_up_is_wound_up_by_mass_times_acceleration(tmp_path):
    plain = simulated(tmp_path, AXIS, LINE)
    heavy = simulated(tmp_path, AXIS, LINE, effects=[{"effect": "inertia", "target": "z", "factor": 1.5}])
    push, late = heavy["act_z_N"] - plain["act_z_N"], heavy["z_mm"] - plain["z_mm"]
    most = 1.5 * 70.0 * 1500.0 * 1e-3  # N: 50 + 20 kg ride on z, 1500 mm/s2
    along = np.abs(push) > 0.5 * most
    assert np.abs(push).max() == pytest.approx(most, rel=1e-6)
    assert late[along] == pytest.approx(-push[along] / 20000.0, abs=2e-6)


def test_a_warm_link_moves_the_tip_as_a_longer_one_in_the_table(tmp_path):
    config = KUKA.read_text()
    program = "G21 G90 G17 G94\nS9000 M3\nG0 X0 Y0 Z0\nG1 X200 Y100 Z80 F6000\nM5\nM30\n"
    cut = {"process": {"force": {"model": "none"}}}
    plain = simulated(tmp_path, config, program, **cut)
    cut["process"]["temperature_C"] = 35.0
    warm = simulated(
        tmp_path, config, program, effects=[{"effect": "link_growth", "target": "A2", "growth_mm_per_K": 0.012}], **cut
    )
    q = np.column_stack([warm[f"act_A{k}_rad"] for k in range(1, 7)])
    for k in (0, len(q) // 2, -1):
        want = bodies.walk(q[k], {1: 0.18})[0] - bodies.walk(q[k])[0]
        got = np.array([warm[c][k] - plain[c][k] for c in ("x_mm", "y_mm", "z_mm")])
        assert got == pytest.approx(want, abs=2e-4)


@pytest.mark.parametrize(("machine", "there"), [("kuka-kr210", True), ("orthoglide", False)])
def test_what_masses_do_is_a_cause_only_where_masses_are_stated(machine, there):
    robot = twin_of(Job(load_config([runner.ROOT / "config" / f"{machine}.yaml"]))).robot
    assert has_moved_mass(robot) is there
    assert applies(shelf.load("effects", "inertia"), robot, robot.actuators[0].name) is there
    assert applies(shelf.load("effects", "base_compliance"), robot, None) is there


GIVES = 5e-9  # rad per N mm, of a loop without an integrator


def weight_torques(q, h=1e-5):
    """Torque (6,) N mm that holds the links against their weight: the rise of their centres by the joints."""
    heights = [bodies.walk(q + e)[1][:, 2] - bodies.walk(q - e)[1][:, 2] for e in h * np.eye(6)]
    return np.array(heights) @ [G * row[5] for row in ROWS] / (2.0 * h)


def giving_way(tmp_path, terms):
    """The arm with loops of A2 and A3 that give way to loads."""
    entries = [
        {"effect": "formula", "stage": "control", "target": a, "formula": f"-{GIVES}*({terms})"} for a in ("A2", "A3")
    ]
    (tmp_path / "loops.yaml").write_text(json.dumps({"effects": entries}))
    return Job(load_config([KUKA, tmp_path / "loops.yaml"]))


def test_loops_give_way_to_the_weight_and_the_inertia_of_all_bodies(robot, tmp_path):
    time = np.arange(0.0, 1.2, 0.002)
    asked = np.array([swing(t) for t in time])
    motion = Motion(
        time=time, common=time, cut_min=time, temperature=None, encoder=asked, speed=asked, direction=asked, home=np.zeros(6),
        stiffness=np.ones(6), stated_loads=partial(loads_along, robot),
    )  # fmt: skip
    for terms, torques in (
        ("followed_weight_Nmm", lambda t: weight_torques(swing(t))),
        ("followed_inertia_Nmm", lambda t: bodies.inertia_torques(swing, t)),
    ):
        causes = giving_way(tmp_path, terms).causes
        gap = signal_path.controlled(causes[:1], tuple(f"A{k}" for k in range(1, 7)), motion) - asked
        assert not np.delete(gap, 1, axis=1).any()
        want = np.array([-GIVES * torques(float(time[k]))[1] for k in (200, 555)])
        assert gap[[200, 555], 1] == pytest.approx(want, rel=5e-3)


def test_the_twin_has_what_a_law_of_the_weight_says_and_compensation_takes_it_out(tmp_path):
    entries = [{"effect": "formula", "stage": "control", "target": "A2", "formula": f"-{GIVES}*followed_weight_Nmm"}]
    program = "G21 G90 G17 G94\nS9000 M3\nG0 X0 Y0 Z0\nG1 X200 Y100 Z80 F6000\nM5\nM30\n"
    log = simulated(tmp_path, KUKA.read_text(), program, process={"force": {"model": "none"}}, effects=entries)
    asked = np.column_stack([log[f"cmd_A{k}_rad"] for k in range(1, 7)])
    want = [-GIVES * weight_torques(q)[1] for q in asked]
    assert log["act_A2_rad"] - asked[:, 1] == pytest.approx(np.array(want), rel=1e-3, abs=2e-6)
    job, target = (
        giving_way(tmp_path, "followed_weight_Nmm"),
        np.array([[0.0, 0.0, 0.0], [60.0, 40.0, 20.0], [200.0, 100.0, 80.0]]),
    )
    travel = Travel(force=np.zeros((3, 3)), time=np.arange(3.0), cut_min=np.zeros(3), stop=np.ones(3, bool))
    rigid = Job(load_config([KUKA]))
    off = respond(job, target, travel)[0] - respond(rigid, target, travel)[0]
    assert np.linalg.norm(off, axis=1).min() > 5.0
    assert respond(job, aim_at(job, target, travel, "newton").commanded, travel)[0] == pytest.approx(target, abs=2e-5)
