"""The solver against mechanics that can be written down: Euler's columns, beams, statics, frames of reference."""

from dataclasses import replace

import numpy as np
import pytest

from camcomp.model.config.load import load_config
from camcomp.model.job import Job
from camcomp.model.statics.description import Actuator, Chain, Link, Parallelogram, Passive, Robot, Transform
from camcomp.model.statics.links import beam_compliance
from camcomp.model.statics.machine import build_machine
from camcomp.model.statics.solve import FREE, HOLD, STATUS, TARGET, solve
from camcomp.model.statics.stiffness import assembly_shift, loaded_stiffness, unloaded_stiffness

X, Y, Z = np.eye(3)
CODE = {text: code for code, text in STATUS.items()}
UNSTABLE, OUT_OF_REACH = CODE["not stable (buckling)"], CODE["out of reach"]
SEED = np.array([215.0, -10.0, -25.0])


def machine_of(name):
    return Job(load_config([f"config/{name}.yaml"])).machine


def gantry(*rest):
    """Three rigid axes that carry the given elements; the tip is their end."""
    axes = tuple(
        Actuator(name=n, revolute=False, axis=a, stiffness=None) for n, a in zip("xyz", (X, Y, Z), strict=True)
    )
    return Robot(name="gantry", chains=(Chain("a", (*axes, *rest)),), tool=np.zeros(3))


# --- Euler's column: two rigid bars, pinned ends, a torsion spring between them ---------------------------------------

BAR, TORSION = 100.0, 1e5


def column(kink=0.0):
    """Foot on a rigid axis, head in a guide along x; kink (rad): half the angle that the unloaded spring has."""
    c, s = np.cos(2 * kink), np.sin(2 * kink)
    bent = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    along = Transform(np.array([BAR, 0.0, 0.0]))
    spring = Link(np.diag([0, 0, 0, 0, TORSION, 0.0]), active=(4,))
    legs = (
        Chain(
            "column",
            (
                Actuator(name="x", revolute=False, axis=X, stiffness=None),
                Passive(True, Y),
                along,
                Transform(rotation=bent),
                spring,
                along,
                Passive(True, Y),
            ),
        ),
        Chain(
            "guide",
            (
                Actuator(name="y", revolute=False, axis=Y, stiffness=None),
                Actuator(name="z", revolute=False, axis=Z, stiffness=None),
                Passive(False, X),
            ),
        ),
    )
    reference = np.array([2 * BAR * np.cos(kink), 0.0, 0.0])
    robot = Robot(name="column", chains=legs, tool=np.zeros(3), start_reference=reference)
    return build_machine(robot, replace(robot, chains=column(0.0).robot.chains) if kink else robot)


@pytest.mark.parametrize(("share", "stable"), [(0.5, True), (0.999, True), (1.001, False), (1.5, False), (-3.0, True)])
def test_a_straight_column_buckles_at_eulers_load(share, stable):
    critical = 2 * TORSION / BAR
    force = np.array([[-share * critical, 0.0, 0.0]])
    state = solve(column(), FREE, np.array([[2 * BAR, 0.0, 0.0]]), force=force)
    assert state.status[0] == (0 if stable else UNSTABLE)
    if stable:
        assert state.tip[0] == pytest.approx([2 * BAR, 0.0, 0.0], abs=2e-5)  # 6000 N on 1e9 N/mm
    else:
        assert np.isnan(state.tip).all()


@pytest.mark.parametrize(
    ("load", "angle", "shortening"),
    [(2100.0, 0.538412, 28.2952), (2500.0, 1.131103, 114.8675), (3000.0, 1.495782, 185.0111)],
)
def test_a_bent_column_carries_what_the_closed_form_says(load, angle, shortening):
    kink = 1e-3
    assert 2 * TORSION * angle / (BAR * np.sin(angle)) == pytest.approx(load, rel=1e-6)  # the column without a kink
    bends = np.linspace(0.1, angle, 60)  # the column is pressed together, step by step
    tip = np.column_stack((2 * BAR * np.cos(bends), 0 * bends, 0 * bends))
    machine = column(kink)
    state = solve(machine, HOLD, tip, aim=tip, rho=np.zeros((len(tip), 3)), check=False)
    assert (state.status == 0).all()
    expected = 2 * TORSION * (bends - kink) / (BAR * np.sin(bends))
    assert -state.force[:, 0] == pytest.approx(expected, rel=1e-6)
    assert 2 * BAR - tip[-1, 0] == pytest.approx(shortening, rel=1e-5)


# --- beams and springs in series --------------------------------------------------------------------------------------


def test_a_cantilever_bends_as_beam_theory_says():
    length, a, E, G = 200.0, 12.0, 70_000.0, 26_300.0
    area, inertia, torsion = a * a, a**4 / 12, 0.1406 * a**4
    c = beam_compliance(length=length, E=E, G=G, A=area, Iy=inertia, Iz=inertia, J=torsion)
    expected = np.zeros((6, 6))
    expected[0, 0], expected[3, 3] = length / (E * area), length / (G * torsion)
    expected[1, 1] = expected[2, 2] = length**3 / (3 * E * inertia)
    expected[4, 4] = expected[5, 5] = length / (E * inertia)
    expected[1, 5] = expected[5, 1] = length**2 / (2 * E * inertia)
    expected[2, 4] = expected[4, 2] = -(length**2) / (2 * E * inertia)
    np.testing.assert_allclose(c, expected, rtol=1e-12, atol=1e-18)
    machine = build_machine(gantry(Transform(np.array([length, 0.0, 0.0])), Link(np.linalg.inv(c))))
    tip = np.array([[length, 0.0, 0.0]])
    force = np.array([[50.0, 2.0, -3.0]])
    state = solve(machine, FREE, tip, force=force)
    assert state.status[0] == 0
    assert state.tip - tip == pytest.approx(force @ c[:3, :3], abs=1e-7)  # 50 N on axes of 1e9 N/mm
    assert state.tilt == pytest.approx(force @ c[:3, 3:], rel=1e-9)


def test_where_the_legs_are_perpendicular_the_machine_is_as_soft_as_a_leg_along_its_axis():
    machine = machine_of("orthoglide")
    tip = machine.nominal.tool[None]  # Q0: the platform reference at the origin
    K = unloaded_stiffness(machine, tip).machine[0]
    leg = machine.robot.chains[0].elements
    drive = next(e for e in leg if isinstance(e, Actuator)).stiffness
    foot = next(e for e in leg if isinstance(e, Link)).stiffness
    bars = next(e for e in leg if isinstance(e, Parallelogram))
    along = bars.arm / np.linalg.norm(bars.arm)
    E_A = 1.0 / (along @ np.linalg.inv(bars.bar_stiffness)[:3, :3] @ along)
    soft = 1.0 / drive + np.linalg.inv(foot)[0, 0] + 1.0 / (2.0 * E_A)  # two bars side by side
    translation = np.linalg.inv(K)[:3, :3]
    np.testing.assert_allclose(np.diag(translation), soft, rtol=2e-3)
    assert np.ptp(np.diag(translation)) < 1e-9 * soft
    assert np.abs(translation - np.diag(np.diag(translation))).max() < 1e-6 * soft


def test_two_springs_that_do_not_fit_meet_between():
    K = np.array([[100.0 * np.eye(6), 300.0 * np.eye(6)]])
    shift = np.zeros((1, 2, 6))
    shift[0, :, 0] = 0.1, -0.1
    dt, wrench = assembly_shift(K, shift)
    assert dt[0] == pytest.approx([-0.05, 0, 0, 0, 0, 0])
    assert wrench[0, :, 0] == pytest.approx([-15.0, 15.0])


# --- statics: what the drives carry -----------------------------------------------------------------------------------


def ring(radius, count=720):
    """Tips on a circle about Q1 of REF-PUU, the seed's force turned along."""
    phi = np.linspace(0.0, 2 * np.pi, count, endpoint=False)
    c, s = np.cos(phi), np.sin(phi)
    tip = np.full(3, -73.65) + [0.0, 0.0, -100.0] + radius * np.column_stack((c, s, 0 * phi))
    return tip, np.column_stack((215 * c + 10 * s, 215 * s - 10 * c, np.full(count, -25.0)))


@pytest.mark.parametrize(("radius", "largest"), [(1e-3, 283.7), (1.0, 285.3), (25.0, 334.6), (50.0, 426.3)])
def test_drive_forces_follow_from_virtual_work(radius, largest):
    """tau = J^T F with J from differences of the inverse kinematics alone; the elastic machine carries much the same."""
    machine = machine_of("puu")
    tip, force = ring(radius)
    h = 1e-4
    rates = np.stack(
        [(solve(machine, TARGET, tip + h * a, check=False).rho_nominal
          - solve(machine, TARGET, tip - h * a, check=False).rho_nominal) / (2 * h) for a in np.eye(3)], axis=2
    )  # (n, m, 3) d rho / d tip  # fmt: skip
    tau = np.linalg.solve(rates.transpose(0, 2, 1), force[..., None])[..., 0]
    assert np.abs(tau).max() == pytest.approx(largest, rel=2e-3)
    elastic = solve(machine, TARGET, tip, force=force)
    assert np.abs(elastic.drive).max() == pytest.approx(largest, rel=0.02)


# --- frames of reference ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["orthoglide-1deg", "puu"])
def test_a_machine_that_is_turned_as_a_whole_answers_turned(name):
    machine = machine_of(name)
    robot, nominal = machine.robot, machine.nominal
    a, b = 0.7, -0.4
    R = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]]) @ np.array(
        [[1, 0, 0], [0, np.cos(b), -np.sin(b)], [0, np.sin(b), np.cos(b)]]
    )

    def turn(r):
        chains = tuple(replace(c, frame=R @ c.frame) for c in r.chains)
        return replace(r, chains=chains, tool=R @ r.tool, start_reference=R @ r.start_reference)

    tip = np.random.default_rng(1).uniform(-60, 60, (12, 3)) + robot.tool
    force = np.tile(SEED, (12, 1))
    here = solve(machine, TARGET, tip, force=force, keep=True)
    there_machine = build_machine(turn(robot), turn(nominal))
    there = solve(there_machine, TARGET, tip @ R.T, force=force @ R.T, keep=True)
    np.testing.assert_allclose(there.commanded, here.commanded @ R.T, atol=1e-8)
    np.testing.assert_allclose(there.drive, here.drive, atol=1e-5)
    np.testing.assert_allclose(there.tilt, here.tilt @ R.T, atol=1e-10)
    K0 = loaded_stiffness(machine, here).machine
    K1 = loaded_stiffness(there_machine, there).machine
    T = np.kron(np.eye(2), R)
    np.testing.assert_allclose(K1, T @ K0 @ T.T, rtol=1e-6, atol=1e-6 * np.abs(K0).max())


# --- what cannot be solved is said, and touches nothing else ----------------------------------------------------------


def test_a_point_that_cannot_be_solved_does_not_touch_its_neighbours():
    machine = machine_of("orthoglide-1deg")
    tip = np.linspace([0.0, 0, -100], [30.0, 0, -100], 9)
    force = np.tile(SEED, (9, 1))
    alone = solve(machine, TARGET, tip, force=force)
    spoilt, load = tip.copy(), force.copy()
    spoilt[3], load[6] = [9e3, 0.0, 0.0], np.nan
    state = solve(machine, TARGET, spoilt, force=load)
    good = [0, 1, 2, 4, 5, 7, 8]
    assert (state.status[good] == 0).all() and state.status[3] == OUT_OF_REACH and state.status[6] != 0
    np.testing.assert_allclose(state.commanded[good], alone.commanded[good], atol=1e-9)
    assert np.isnan(state.commanded[[3, 6]]).all() and np.isnan(state.drive[[3, 6]]).all()


@pytest.mark.parametrize(("force", "solved"), [((0, 0, 0), False), ((-10, 0, 0), False), ((10, 0, 0), True)])
def test_a_tip_that_only_its_load_holds(force, solved):
    """A pendulum: singular without load, unstable against it, stable along it."""
    loose = build_machine(gantry(Passive(True, Y), Transform(np.array([50.0, 0.0, 0.0]))))
    state = solve(loose, FREE, np.array([[50.0, 0.0, 0.0]]), force=np.array([force], float))
    assert (state.status[0] == 0) == solved
    assert np.isnan(state.tip).all() != solved
