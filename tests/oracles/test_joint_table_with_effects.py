"""The joint table of machines with effects, played into plants that share nothing with the model, leaves what is claimed."""

import json

import numpy as np
import pytest

from tests.commandline import table
from tests.validation.plants import serial
from tests.validation.plants.rotations import vector
from tests.validation.recorded.faults import Fault, Faults
from tests.validation.recorded.machines import MACHINES
from tests.validation.runner import invoke

PROGRAM = "G21 G90 G17\nS8000 M3\nG0 X0 Y0 Z5\nG1 Z-1 F300\nG1 X12 F600\nG3 X12 Y10 I0 J5\nG1 X3 Y4\nG0 Z5\nM30\n"


def effects_of(machine):
    """One effect of every kind that the plant knows, on the second actuator where it has a target."""
    second = machine.actuators[1]
    angle = machine.rotary
    offset = {"offset_rad": 0.001} if angle else {"offset_mm": 0.1}
    found = [
        Fault("joint_offset", second, offset),
        Fault("drive_stiffness", second, {"factor": 0.5}),
        Fault("link_stiffness", None, {"factor": 0.8}),
        Fault("chain_error", second, {"roll_deg": 0.8}),
        Fault("link_length", second, {"length_mm": 0.2}),
        Fault("gravity", None, {"weight_N": 60.0}),
        Fault("tool_length", None, {"length_mm": 0.5}),
        Fault("cutting_force", None, {"factor": 1.7}),
        Fault("workpiece_frame", None, {"shift_x_mm": 0.1, "shift_y_mm": -0.2, "shift_z_mm": 0.1, "rotation_deg": 0.0}),
    ]
    if not angle:
        found.append(Fault("screw_pitch", second, {"error_ppm": 500.0}))
    return [each for each in found if each.effect not in machine.without]


GRID = [(name, fault) for name, machine in sorted(MACHINES.items()) for fault in effects_of(machine)]
OFTEN = {("kuka-kr210", "joint_offset"), ("kuka-kr210", "tool_length"), ("kuka-kr210", "drive_stiffness")}
OFTEN |= {("kuka-kr210", "cutting_force"), ("kuka-kr210", "workpiece_frame"), ("orthoglide", "cutting_force")}


def params():
    """The grid; what CI runs in any case has no mark."""
    for name, fault in GRID:
        marks = [] if (name, fault.effect) in OFTEN else [pytest.mark.campaign]
        yield pytest.param(name, fault, marks=marks, id=f"{name}-{fault.effect}")


def carriages(machine, fault, joints):
    """Where drives with this fault stand at set-points (n, m)."""
    out, k = joints.copy(), machine.actuators.index(fault.target) if fault.target else 0
    if fault.effect == "joint_offset":
        out[:, k] += sum(fault.parameters.values())
    if fault.effect == "screw_pitch":
        out[:, k] += 1e-6 * fault.parameters["error_ppm"] * (joints[:, k] - machine.home)
    return out


@pytest.mark.parametrize(("name", "fault"), list(params()))
def test_the_joint_table_leads_the_plant_to_the_programmed_tips(tmp_path, name, fault):
    machine = MACHINES[name]
    (tmp_path / "in.nc").write_text(PROGRAM)
    entry = {"effect": fault.effect, **({"target": fault.target} if fault.target else {}), **fault.parameters}
    (tmp_path / "effects.yaml").write_text(json.dumps({"effects": [entry]}))
    words = ["--config", str(machine.config), "--config", str(tmp_path / "effects.yaml")]
    words += ["--joints", str(tmp_path / "j.csv"), "-o", str(tmp_path / "out.nc")]
    code, said = invoke(["compensate", str(tmp_path / "in.nc"), *words])
    assert code == 0, said
    columns = table(tmp_path / "j.csv")
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
    at = carriages(machine, fault, joints)
    found, held = machine.settle(faults, at, force)
    shift = [fault.parameters.get(f"shift_{a}_mm", 0.0) for a in "xyz"]
    off = found - machine.origin - tip
    if fault.effect == "workpiece_frame":
        off = off - np.array(shift)
    assert 1e3 * np.linalg.norm(off, axis=1).max() < 1.0
    np.testing.assert_allclose(drive, held, atol=2e-4 * np.abs(held).max())
    if len(machine.actuators) == 6:
        arm = machine.structure(faults)
        straight = serial._walk(arm, nominal, np.zeros((len(nominal), serial._columns(arm))))[0].r
        turned = serial.settle(arm, at, force).orientation
        assert np.abs(vector(turned @ np.swapaxes(straight, 1, 2))).max() < 2e-6
