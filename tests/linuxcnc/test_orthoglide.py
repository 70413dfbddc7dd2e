"""An Orthoglide in LinuxCNC's simulator at F3000: every servo period recorded, what the drives get bent by a plant.

Simulated time is real time and the computer may be busy, so what is asserted of each period depends on how old the answer
in force was, which is recorded, too.
"""

import signal
import tempfile
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from camcomp.ground.files import shipped
from tests.linuxcnc import simulator
from tests.validation.plants import energy
from tests.validation.plants.legs import orthoglide
from tests.validation.plants.machine import ORIGIN

pytestmark = [simulator.needs_linuxcnc, *([] if simulator.goes_first() else [pytest.mark.alone])]
FORCE = (-60.0, 80.0, -30.0)  # N on the tool
OFFSET, TURN_DEG = np.array([12.0, -7.0, 3.0]), 20.0  # G54
LENGTHS = (100.0, 60.0)  # of the tools, mm
PROGRAM = "G21 G90 G54 G64 M53 P0\nG1 X25 Y0 Z0 F3000\nG3 X25 Y0 I-25 J0\nG1 X-10 Y5 Z2\nG1 X25 Y0\nM2\n"
FAULTS = [
    ("killed solver", "stream", signal.SIGKILL),
    ("stopped solver", "stream", signal.SIGSTOP),
    ("killed component", "camcomp_eoffset.py", signal.SIGKILL),
]
LATEST = 20  # servo periods
BEHIND = 2  # servo periods by which the cubics of LinuxCNC lead positions and offsets to the joints
RUNS = 4  # at the most
AT_REST = 0.2  # um: counts of 0.1 um on three axes, and what the plant and camcomp agree to
SLOPE = 3.5e-3  # mm per mm: correction over way; measured below 3.2e-3 on this machine and path
FOLLOWED = 16  # servo periods: two for the cubics, and 2 sqrt(3 um / 200 mm/s2) for what LATEST periods amount to
RAMP = 0.6  # um by which LinuxCNC's planner of offsets stays behind: (v + a T)^2 / 2a for v = 0.3 mm/s, a = 200 mm/s2


@pytest.mark.ecosystem  # test_simulator.py runs the loop on a Cartesian machine
def test_corrections_follow_a_program_through_pause_abort_new_offsets_and_faults():
    """The record of a simulated control has gaps between two servo periods: runs may be disturbed.

    A defect of camcomp or of the sample shows in every run, so the last one decides.
    """
    for _ in range(RUNS - 1):
        try:
            return check(simulated())
        except AssertionError as disturbed:
            print(f"run again after: {disturbed}")
    check(simulated())


def check(run):
    for order in ("homed after on", "on after homed"):
        check_order_of_enable_and_homing(run, order)
    for phase in ("pause", "override", "abort", "other tool", "other work offset"):
        check_fast_program(run, phase)
    check_another_length_of_tool_waits_for_its_solver(run)
    for fault, word, _ in FAULTS:
        check_fault_holds_the_machine(run, fault)
        if word == "stream":
            check_off_and_on_brings_a_new_solver(run, fault)
    check_every_servo_period_has_its_set_point_unless_the_computer_is_busy(run)


def simulated():
    """One run of the simulator, which takes half a minute: recording, marks and faults."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        table = "".join(f"T{n} P{n} Z{length} ;\n" for n, length in enumerate(LENGTHS, 1))
        simulator.machine(folder, shipped("config/orthoglide-1deg.yaml"), table)
        (folder / "program.nc").write_text(PROGRAM)
        seen, said = simulator.simulate(
            folder,
            "orthoglide",
            program=str(folder / "program.nc"),
            record=str(folder / "record"),
            force=FORCE,
            work_offset=f"G10 L2 P1 X{OFFSET[0]} Y{OFFSET[1]} Z{OFFSET[2]} R{TURN_DEG}",
            faults=FAULTS,
        )
        assert "error" not in seen, f"{seen}\n{said}"
        return SimpleNamespace(rows=simulator.recording(folder / "record"), **seen)


def between(rows, start, end):
    """Indices of the rows of some servo periods."""
    return np.flatnonzero((rows["period"] >= start) & (rows["period"] <= end))


def residual(rows, at, offset=OFFSET, turn_deg=TURN_DEG):
    """Distance (n,) um of the loaded tip from the programmed one at some rows, in a plant that is bent."""
    turn = np.deg2rad(-turn_deg)
    to_program = np.array([[np.cos(turn), np.sin(turn), 0], [-np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    length = rows["tool"][at]

    def tip(names, index):
        found = np.stack([rows[name][index] for name in names], 1)
        found[:, 2] -= length
        return ORIGIN + (found - offset) @ to_program

    programmed, commanded = tip("xyz", at - BEHIND), tip(("joint_x", "joint_y", "joint_z"), at)
    out = np.empty(len(at))
    for each in np.unique(length):
        these = length == each
        legs = orthoglide(tool=each or 100.0, roll_deg=1.0)
        bent = energy.settle(legs, energy.inverse(legs, commanded[these]), np.array(FORCE)).tip
        out[these] = np.linalg.norm(bent - programmed[these], axis=1)
    return 1e3 * out


def check_order_of_enable_and_homing(run, order):
    at = between(run.rows, *run.marks[order])[::20]
    assert residual(run.rows, at, offset=0.0, turn_deg=0.0).max() < AT_REST


def check_fast_program(run, phase):
    rows = run.rows
    at = between(rows, *run.marks[phase])
    moving = rows["velocity"][at] > 45.0
    assert moving.sum() > 100
    if phase == "pause":
        assert (rows["velocity"][at][np.flatnonzero(moving)[0] : np.flatnonzero(moving)[-1]] == 0).sum() > 100
    at = at[(rows["hold"][at] == 0) & (rows["tool"][at] == rows["tool"][at - LATEST])][::8]  # held is not cut
    assert len(at) > 50
    assert not rows["error"][at].any()
    # the oldest of the answers that the offsets still follow
    age = np.max([(rows["period"] - rows["answered"])[at - k] for k in range(FOLLOWED)], axis=0)
    speed = np.max([rows["velocity"][at - k] for k in range(FOLLOWED)], axis=0)
    allowed = AT_REST + RAMP + 1e3 * SLOPE * speed * 1e-3 * age
    over = residual(rows, at) - allowed
    worst = over.argmax()
    assert over[worst] < 0, (
        f"{phase}: {over[worst]:.2f} um, {at[worst]}, age {age[worst]}, speed {speed[worst]:.1f} mm/s"
    )


def check_another_length_of_tool_waits_for_its_solver(run):
    rows = run.rows
    changes = np.flatnonzero((np.diff(rows["tool"]) != 0) & (rows["on"][1:] == 1)) + 1
    assert set(rows["tool"][changes]) >= set(LENGTHS)
    for change in changes:
        # where the component got no processor for so long the watchdog holds before the component does
        begun = rows["wait"][change:].argmax()
        waited = rows["wait"][change + begun :].argmin() + begun
        assert rows["hold"][change + LATEST : change + waited].all() and waited > 2 * LATEST
        assert rows["velocity"][change : change + waited].max() < 1000.0 * 1e-3 * LATEST  # it accelerates by 1000 mm/s2


def check_fault_holds_the_machine(run, fault):
    rows = run.rows
    start, end = next((a, b) for name, a, b in run.faults if name == fault)
    at = between(rows, start, end)
    raised = at[np.flatnonzero(rows["error"][at] == 0)[-1] + 1]  # the last time: those before were recovered from
    assert rows["velocity"][raised] > 45.0, "the fault was meant to meet a fast cut"
    assert rows["period"][raised] - rows["answered"][raised - 1] <= LATEST
    assert rows["hold"][raised : at[-1]].all()
    stopped = raised + np.flatnonzero(rows["velocity"][raised : at[-1]] == 0)[0]
    assert stopped - raised < 300
    assert np.ptp(rows["joint_x"][stopped + 20 : at[-1]]) < 1e-3
    # 50 mm/s for LATEST periods and on while braking, 5 mm, on answers that do not follow
    assert residual(rows, np.arange(raised - LATEST, stopped + 20, 5)).max() < 1e3 * SLOPE * 6.0


def check_off_and_on_brings_a_new_solver(run, fault):
    at = between(run.rows, *run.marks[f"after {fault}"])[::20]
    assert not run.rows["error"][at].any()
    assert residual(run.rows, at).max() < AT_REST


def check_every_servo_period_has_its_set_point_unless_the_computer_is_busy(run):
    at = np.concatenate([between(run.rows, *run.marks[phase]) for phase in ("pause", "override")])
    at = at[run.rows["wait"][at] == 0]
    assert len(np.unique(run.rows["answered"][at])) > 0.8 * len(at)
    assert np.median((run.rows["period"] - run.rows["answered"])[at]) == 1
