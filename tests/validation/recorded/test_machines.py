"""Machines under trial: closed chains, virtual work, symmetry, and the structure of camcomp's own machines of that name."""

from importlib import import_module

import numpy as np
import pytest

from camcomp.model.config.load import load_config
from camcomp.model.statics.build import build_robot
from camcomp.model.statics.machine import build_machine
from camcomp.model.statics.solve import FREE, solve
from tests.validation.recorded.faults import Fault, Faults, sized
from tests.validation.recorded.machines import MACHINES
from tests.validation.recorded.plant import Character, Motion, Run, observe
from tests.validation.recordings import recording

NOTHING = Faults()
NAMES = list(MACHINES)


def tips(machine, count=6):
    """Tips (count, 3) where the recorded programs are, machine frame."""
    return machine.origin + np.random.default_rng(4).uniform([-45, -40, -10], [45, 45, 20], (count, 3))


@pytest.mark.parametrize("name", NAMES)
def test_direct_undoes_inverse(name):
    machine, here = MACHINES[name], tips(MACHINES[name])
    assert machine.direct(machine.inverse(here)) == pytest.approx(here, abs=1e-9)


@pytest.mark.parametrize("name", NAMES)
def test_drives_and_tip_obey_virtual_work(name):
    """Of the least potential: what a drive feels of a force is how far its travel moves the tip, with the other sign."""
    machine = MACHINES[name]
    joints, force, h = machine.inverse(tips(machine, 1)), np.array([[20.0, 12.0, -9.0]]), 1e-2 / machine.reach
    steps = h * np.eye(joints.shape[1])
    moved = [
        machine.settle(NOTHING, joints + s, force)[0] - machine.settle(NOTHING, joints - s, force)[0] for s in steps
    ]
    felt = [
        machine.settle(NOTHING, joints, force + s)[1] - machine.settle(NOTHING, joints, force - s)[1] for s in np.eye(3)
    ]
    by_joint = np.concatenate(moved) / (2 * h)
    assert np.abs(by_joint).max() > 0.5
    assert np.concatenate(felt).T / 2 == pytest.approx(-by_joint, abs=2e-5 * machine.reach)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize(
    ("effect", "size"),
    [(None, 0.0), ("link_length", 0.2), ("chain_error", 0.5), ("drive_stiffness", 0.4), ("link_stiffness", 0.3), ("tool_length", 0.1)],
)  # fmt: skip
def test_the_structure_is_that_of_the_shipped_file(name, effect, size):
    machine = MACHINES[name]
    if effect in machine.without:
        pytest.skip("not of this machine")
    config = load_config([str(machine.config)])
    robot, nominal = build_robot(config.robot, config.tool.tip)
    wrong = NOTHING
    if effect is not None:
        target = machine.actuators[1] if effect in ("link_length", "chain_error", "drive_stiffness") else None
        wrong = Faults([sized(effect, target, size, 0)])
        aimed = machine.actuators if target is None else (target,)
        robot = import_module(f"camcomp.effects.{effect}").on_robot(robot, aimed, wrong[0].parameters)
    here, force = tips(machine), np.random.default_rng(5).uniform(-60, 60, (6, 3))
    joints = machine.inverse(here)
    theirs = solve(build_machine(robot, nominal), FREE, here, force=force, rho=joints)
    tip, drive = machine.settle(wrong, joints, force)
    assert tip == pytest.approx(theirs.tip, abs=1e-6)
    assert drive == pytest.approx(theirs.drive, abs=1e-5 * machine.reach)


def test_the_delta_looks_the_same_from_every_column():
    delta = MACHINES["delta"]
    turn = np.array([[-0.5, -(0.75**0.5), 0], [0.75**0.5, -0.5, 0], [0, 0, 1]])
    here, force = tips(delta), np.tile([40.0, -20.0, 10.0], (6, 1))
    plain = delta.settle(NOTHING, delta.inverse(here), force)[0]
    turned = delta.settle(NOTHING, delta.inverse(here @ turn.T), force @ turn.T)[0]
    assert turned == pytest.approx(plain @ turn.T, abs=1e-9)


def test_a_rolled_column_of_the_delta_turns_about_itself():
    """Its platform joint goes round the column at 200 mm, level."""
    rolled = Faults([Fault("chain_error", "a", {"roll_deg": 0.01})])
    delta, force = MACHINES["delta"], np.zeros((1, 3))
    joints = delta.inverse(delta.origin[None])
    moved = (delta.settle(rolled, joints, force)[0] - delta.settle(NOTHING, joints, force)[0])[0]
    assert abs(moved[1]) > 0.001
    assert moved[[0, 2]] == pytest.approx([0.0, 0.0], abs=1e-4)


def test_the_chip_follows_the_speed():
    """Override halves the feed: of the router's force the share of the chip halves, that of the edges stays."""
    router, record = MACHINES["router"], recording.load("override-blended")
    force = np.linalg.norm(Motion(router, Run(record, True, 0.0), NOTHING, Character()).force(record.t, 0.0), axis=1)
    speed = np.linalg.norm(np.gradient(record.tip, recording.STEP_S, axis=0), axis=1)
    cuts = force > 0
    slow, fast = (np.median(force[cuts & (np.abs(speed - v) < 0.1)]) for v in (15.0, 30.0))
    rub, full = (np.linalg.norm(router.triple(np.array([v]))) for v in (0.0, 30.0))
    assert fast == pytest.approx(full, rel=0.01)
    assert rub < slow < 0.8 * fast


@pytest.mark.parametrize("name", NAMES)
def test_recorded_programs_fit(name):
    """Where springs are stiff and bodies have no mass, a machine in the air is where it is commanded."""
    machine, record = MACHINES[name], recording.load("override-blended")
    stiff = Faults([Fault(e, None, {"factor": 1e9}) for e in ("drive_stiffness", "link_stiffness")])
    t = record.t[np.linspace(5, len(record.t) - 6, 8).astype(int)]
    state = observe(machine, Run(record, False, 100.0), stiff, Character(), t)
    assert state.tip == pytest.approx(state.commanded, abs=1e-6)
