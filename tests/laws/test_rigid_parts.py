"""Laws of parts that hardly give: what they carry follows from equilibrium, however little they move under it."""

from dataclasses import replace

import numpy as np
import pytest

from camcomp.ground.files import shipped
from camcomp.model.config.load import load_config
from camcomp.model.job import Job
from camcomp.model.statics.description import Actuator, Link
from camcomp.model.statics.machine import build_machine
from camcomp.model.statics.solve import FREE, TARGET, solve
from camcomp.model.statics.stiffness import tip_sensitivity

STIFF = [1e3, 1e5, 1e7, 1e9, 1e11, 1e12, 1e13, 1e14, 1e15, None]
FORCE = np.array([[100.0, -50.0, 30.0], [-215.0, 10.0, 25.0]])
MACHINES = {"orthoglide-1deg": 1.0, "router": 1.0, "puu": 1.0, "kuka-kr210": 1e4}  # and N mm/rad for a N/mm


def changed(robot, kind, change):
    """The robot with every element of a kind changed."""
    chains = tuple(
        replace(c, elements=tuple(change(e) if isinstance(e, kind) else e for e in c.elements)) for c in robot.chains
    )
    return replace(robot, chains=chains)


def solved(name, kind, change, mode, **more):
    job = Job(load_config([shipped(f"config/{name}.yaml")]))
    robot = changed(job.machine.robot, kind, change)
    machine = build_machine(robot, job.machine.nominal)
    tip = job.frame.to_machine(np.array([[3.0, 4.0, -5.0], [30.0, 20.0, -15.0]]))
    state = solve(machine, mode, tip, force=FORCE, **more)
    assert (state.status == 0).all()
    return machine, state


@pytest.mark.parametrize("name", MACHINES)
def test_a_drive_exerts_the_same_however_stiff_it_is(name):
    # The tip is where it has to be, and the stiffness says only what has to be commanded; but an arm's tool also tilts.
    first = STIFF.index(1e13) if name == "kuka-kr210" else 0
    drives = [
        solved(name, Actuator, lambda e, k=k: replace(e, stiffness=k), TARGET, check=False)[1].drive
        for k in STIFF[first:]
    ]
    size = np.abs(drives[0]).max()
    for drive in drives[1:-1]:
        np.testing.assert_allclose(drive, drives[0], rtol=0, atol=1e-6 * size)
    np.testing.assert_allclose(drives[-1], drives[0], rtol=0, atol=1e-5 * size)


@pytest.mark.parametrize("name", MACHINES)
def test_links_that_hardly_give_are_rigid(name):
    def stiff(link, k):
        return replace(link, stiffness=np.diag([k, k, k, 1e4 * k, 1e4 * k, 1e4 * k])[: len(link.stiffness), :])

    states = [solved(name, Link, lambda e, k=k: stiff(e, k), FREE)[1] for k in (1e11, 1e13, 1e15)]
    for each in states[1:]:
        np.testing.assert_allclose(each.tip, states[0].tip, rtol=0, atol=1e-6)
        np.testing.assert_allclose(each.drive, states[0].drive, rtol=0, atol=1e-6 * np.abs(each.drive).max())


def test_derivatives_of_nearly_rigid_drives_are_those_of_stiff_ones():
    found = []
    for k in (1e9, 1e12, 1e15):
        machine, state = solved("orthoglide-1deg", Actuator, lambda e, k=k: replace(e, stiffness=k), FREE, keep=True)
        found.append(tip_sensitivity(machine, state))
    for each in found[1:]:
        for name in ("by_rho", "drive_by_rho", "drive_by_force", "drive_by_wrench"):
            expected = getattr(found[0], name)
            np.testing.assert_allclose(getattr(each, name), expected, rtol=0, atol=2e-4 * np.abs(expected).max())
