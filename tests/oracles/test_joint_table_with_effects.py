"""The joint table of machines with effects, played into independent plants, leaves the claimed error."""

import json

import numpy as np
import pytest

from tests.commandline import table
from tests.oracles.machines import MACHINES, tilt
from tests.validation.plants import drives
from tests.validation.recorded.faults import Fault, Faults
from tests.validation.runner import invoke

PROGRAM = "G21 G90 G17\nS8000 M3\nG0 X0 Y0 Z5\nG1 Z-1 F300\nG1 X12 F600\nG3 X12 Y10 I0 J5\nG1 X3 Y4\nG0 Z5\nM30\n"
FEEDS = (5, 6, 7)  # lines behind the plunge: how long the rapid before that takes the table does not say
SMOOTHLY = 6  # the line that begins without a stop
REMEMBERED = (
    "backlash",
    "joint_hysteresis",
    "servo_lag",
)  # the ends of rapids and joining lines are not led through them


def effects_of(machine):
    """One effect of every kind that the plant knows, on the second actuator where it has a target."""
    second = machine.actuators[1]
    angle = machine.rotary
    offset = {"offset_rad": 0.001} if angle else {"offset_mm": 0.1}
    found = [
        Fault("joint_offset", second, offset),
        Fault("servo_lag", second, {"time_constant_ms": 3.0}),
        Fault("backlash", second, {"width_rad": 3e-4} if angle else {"width_mm": 0.03}),
        Fault("drive_stiffness", second, {"factor": 0.5}),
        Fault("link_stiffness", None, {"factor": 0.8}),
        Fault("chain_error", second, {"roll_deg": 0.8}),
        Fault("link_length", second, {"length_mm": 0.2}),
        Fault("gravity", None, {"weight_N": 60.0}),
        Fault("tool_length", None, {"length_mm": 0.5}),
        Fault("cutting_force", None, {"factor": 1.7}),
        Fault("workpiece_frame", None, {"shift_x_mm": 0.1, "shift_y_mm": -0.2, "shift_z_mm": 0.1, "rotation_deg": 0.0}),
    ]
    if angle:
        found.append(Fault("joint_hysteresis", second, {"width_rad": 1e-4}))
    else:
        found.append(Fault("screw_pitch", second, {"error_ppm": 500.0}))
    return [each for each in found if each.effect not in machine.without]


GRID = [(name, fault) for name, machine in sorted(MACHINES.items()) for fault in effects_of(machine)]
OFTEN = {("kuka-kr210", each) for each in ("joint_offset", "drive_stiffness", "cutting_force", "backlash")}
OFTEN |= {
    ("orthoglide", "cutting_force"),
    ("hexapod", "joint_offset"),
    ("cartesian", "backlash"),
    ("cartesian", "servo_lag"),
}
OFTEN |= {("ur10", "joint_offset")}


def params():
    """The grid; what CI runs in any case has no mark."""
    for name, fault in GRID:
        marks = [] if (name, fault.effect) in OFTEN else [pytest.mark.campaign]
        yield pytest.param(name, fault, marks=marks, id=f"{name}-{fault.effect}")


def carriages(machine, fault, joints, time, line, begin):
    """Where drives with this fault stand at set-points (n, m) of rows at times (n,) s; they rest between lines (n,).

    begin (m,): where they stand in the middle of their play.
    """
    out, k = joints.copy(), machine.actuators.index(fault.target) if fault.target else 0
    start = begin[k : k + 1]
    own = np.ascontiguousarray(joints[:, k])
    if fault.effect == "joint_offset":
        out[:, k] += sum(fault.parameters.values())
    if fault.effect == "screw_pitch":
        out[:, k] += 1e-6 * fault.parameters["error_ppm"] * (own - machine.home)
    if fault.effect == "joint_hysteresis" or (fault.effect == "backlash" and not machine.rotary):
        out[:, k] = drives.play(np.concatenate((start, own)), sum(fault.parameters.values()), 0.0)[1:]
    if fault.effect == "servo_lag":
        out[:, k] = late(own, time, line, 1e-3 * fault.parameters["time_constant_ms"])
    return out


def late(x, time, line, constant):
    """Solution of constant y' = x - y for set-points x (n,) that are straight between rows, from rest."""
    out = x.copy()
    for i in range(1, len(x)):
        dt = time[i] - time[i - 1]
        after = min(i + 1, len(x) - 1)
        stops = line[after] not in (line[i], SMOOTHLY) or (
            after > i and time[after] == time[i]
        )  # so does a joining line
        if dt > 0 and not stops:
            behind = constant * (x[i] - x[i - 1]) / dt
            out[i] = x[i] - behind + (out[i - 1] - x[i - 1] + behind) * np.exp(-dt / constant)
    return out


def played(folder, name, fault, program):
    """A corrected program's joint table in the plant: summary, columns, errors of the tip (n, 3) mm, and what has to be equal."""
    machine = MACHINES[name]
    source, overlay, joints_file, summary_file = (folder / each for each in ("in.nc", "e.yaml", "j.csv", "s.json"))
    source.write_text(program)
    entry = {"effect": fault.effect, **({"target": fault.target} if fault.target else {}), **fault.parameters}
    overlay.write_text(json.dumps({"effects": [entry]}))
    words = ["--config", str(machine.config), "--config", str(overlay), "-o", str(folder / "out.nc")]
    words += ["--joints", str(joints_file), "--summary", str(summary_file)]
    code, said = invoke(["compensate", str(source), *words])
    summary = json.loads(summary_file.read_text())
    assert code == int(summary["after"]["max_um"] > 1.0), said
    columns = table(joints_file)
    length, load = ("rad", "Nmm") if machine.rotary else ("mm", "N")
    joints, nominal, drive, tip, force = (
        np.column_stack([columns[each.format(a)] for a in names])
        for each, names in (
            (f"act_{{}}_{length}", machine.actuators),
            (f"act_{{}}_nominal_{length}", machine.actuators),
            (f"act_{{}}_{load}", machine.actuators),
            ("{}_mm", "xyz"),
            ("f{}_N", "xyz"),
        )
    )
    faults = Faults([fault])
    at = carriages(machine, fault, joints, columns["t_s"], columns["line"], nominal[0])
    found, held = machine.settle(faults, at, force)
    off = found - machine.origin - tip
    if fault.effect == "workpiece_frame":
        off = off - np.array([fault.parameters.get(f"shift_{a}_mm", 0.0) for a in "xyz"])
    np.testing.assert_allclose(drive, held, atol=2e-4 * np.abs(held).max())
    if len(machine.actuators) == 6:
        assert np.abs(tilt(machine, faults, at, force, nominal)).max() < 2e-6
    return summary, columns, off


@pytest.mark.parametrize(("name", "fault"), list(params()))
def test_the_joint_table_leads_the_plant_to_the_programmed_tips(tmp_path, name, fault):
    summary, columns, off = played(tmp_path, name, fault, PROGRAM)
    claims = np.ones(len(off), bool)
    if fault.effect in REMEMBERED:
        claims = np.isin(columns["line"], FEEDS) & (np.diff(columns["s_mm"], prepend=0.0) > 0.0)
    assert 1e3 * np.linalg.norm(off, axis=1)[claims].max() < max(summary["after"]["max_um"], 1.0)


@pytest.mark.parametrize("effect", ["drive_stiffness", "cutting_force", "chain_error"])
def test_long_programs_with_effects_are_interpolated_and_lead_the_plant_there_too(tmp_path, effect):
    angle = np.linspace(0.0, 6.0 * np.pi, 2600)
    radius = 10.0 + 0.8 * np.sin(5.0 * angle)
    lines = [f"G1 X{x:.4f} Y{y:.4f}\n" for x, y in zip(radius * np.cos(angle), radius * np.sin(angle), strict=True)]
    program = f"G21 G90 G17\nS8000 M3\nG0 X10. Y0 Z5.\nG1 Z-1. F600\n{''.join(lines)}G0 Z5.\nM30\n"
    (fault,) = (each for each in effects_of(MACHINES["orthoglide"]) if each.effect == effect)
    summary, columns, off = played(tmp_path, "orthoglide", fault, program)
    assert summary["interpolation"]["checked"] > 500
    cut = (columns["line"] > 5) & (columns["line"] < 2600)
    worst = 1e3 * np.linalg.norm(off, axis=1)[cut].max()
    assert cut.sum() > 2500 and worst < summary["after"]["max_um"] + 0.01 < 0.2
