"""Tables for controls, evaluated by the controls' own formulas against errors in closed form."""

import math
import re

import numpy as np
import pytest

from camcomp.api.machine import load_machine
from camcomp.api.settings import screw_file, skew
from camcomp.ground.errors import ConfigError
from camcomp.terminal.cli import run
from tests.commandline import ROOT

CARTESIAN = ROOT / "config/cartesian.yaml"
ANGLES = {"xy": 0.8, "xz": -0.5, "yz": 1.3}  # mrad
POINTS = np.array([[0.0, 0.0, 0.0], [120.0, 80.0, 40.0], [-30.0, 150.0, 200.0]])


def machine(folder, effects):
    (folder / "effects.yaml").write_text(f"effects: [{effects}]\n")
    return load_machine(CARTESIAN, folder / "effects.yaml")


def square(angles):
    return ", ".join(f"{{effect: squareness, target: {plane}, angle_mrad: {a}}}" for plane, a in angles.items())


def marlin_factors(text):
    """M852: I is XY_SKEW_FACTOR, J XZ, K YZ (Marlin, M852.cpp)."""
    found = dict(re.findall(r"([IJK])(-?[\d.]+)", text))
    return [float(found[letter]) for letter in "IJK"]


def klipper_factors(text):
    """Klipper, skew_correction.py: cmd_SET_SKEW and calc_skew_factor."""
    out = []
    for plane in ("XY", "XZ", "YZ"):
        found = re.search(rf"{plane}=([\d.]+),([\d.]+),([\d.]+)", text)
        if found is None:
            out.append(0.0)
            continue
        ac, bd, ad = map(float, found.groups())
        side = math.sqrt(2 * ac * ac + 2 * bd * bd - 4 * ad * ad) / 2.0
        out.append(math.tan(math.pi / 2 - math.acos((ac * ac - side * side - ad * ad) / (2 * side * ad))))
    return out


def sent(factors, points):
    """Marlin, planner.h, skew(), and Klipper, calc_skew: what goes to the drives."""
    xy, xz, yz = factors
    x, y, z = points.T
    return np.column_stack([x - y * xy - z * (xz - xy * yz), y - z * yz, z])


def reached(angles, drives):
    """Where a machine with these angles stands: the tip errs along the first axis by angle times position of the second."""
    x, y, z = drives.T
    xy, xz, yz = (1e-3 * angles.get(plane, 0.0) for plane in ("xy", "xz", "yz"))
    return np.column_stack([x + xy * y + xz * z, y + yz * z, z])


@pytest.mark.parametrize(("control", "factors"), [("marlin", marlin_factors), ("klipper", klipper_factors)])
@pytest.mark.parametrize("angles", [ANGLES, {"xy": -2.0}])
def test_the_firmware_takes_the_skew_out(tmp_path, control, factors, angles):
    text = skew(machine(tmp_path, square(angles)), control).decode()
    tip = reached(angles, sent(factors(text), POINTS))
    assert np.abs(reached(angles, POINTS) - POINTS).max() > 0.1  # without it
    assert np.abs(tip - POINTS).max() < 2e-5  # seven decimals of a factor over 200 mm


def test_a_machine_that_is_square_has_no_command(tmp_path):
    with pytest.raises(ConfigError, match="no squareness"):
        skew(machine(tmp_path, ""), "marlin")


PITCH = "{effect: screw_pitch, target: x, error_ppm: 200}, {effect: backlash, target: x, width_mm: 0.02}"


def test_siemens_moves_the_axis_against_the_error(tmp_path):
    """SINUMERIK, Function Manual: a positive compensation value moves the machine axis in the negative direction."""
    job = machine(tmp_path, PITCH)
    text = screw_file(job, "x", (-50.0, 100.0, 50.0), "siemens").decode()
    step, low, high = (float(re.search(rf"_{key}\[0,X1\],(\S+)", text)[1]) for key in ("STEP", "MIN", "MAX"))
    values = [float(each) for each in re.findall(r"ENC_COMP\[0,\d+,X1\],(\S+)", text)]
    place = np.arange(low, high + 1e-9, step)
    assert (step, low, high, len(values)) == (50.0, -50.0, 100.0, 4)
    carriage = (place - values) + 200e-6 * (place - values)  # the screw errs by 200 ppm from its home at 0
    assert np.abs(carriage - place).max() < 1e-5


def test_heidenhain_holds_the_errors_of_both_directions(tmp_path):
    text = screw_file(machine(tmp_path, PITCH), "x", (0.0, 100.0, 50.0), "heidenhain").decode()
    head, *rows = text.splitlines()
    assert head == "AXISPOS,X,BACKLASH"
    place, there, back = np.array([[float(cell) for cell in row.split(",")] for row in rows]).T
    assert there == pytest.approx(200e-6 * place - 0.01, abs=1e-6) and back == pytest.approx(
        200e-6 * place + 0.01, abs=1e-6
    )


def test_unequal_steps_are_no_table_of_siemens(tmp_path):
    with pytest.raises(ConfigError, match="last step"):
        screw_file(machine(tmp_path, PITCH), "x", (0.0, 100.0, 30.0), "siemens")


def test_both_verbs_write_to_standard_output(tmp_path, capfd):
    machine(tmp_path, f"{square(ANGLES)}, {PITCH}")
    files = ["--config", str(CARTESIAN), "--config", str(tmp_path / "effects.yaml")]
    assert run(["config", "skew", *files, "--control", "marlin"]) == 0
    assert capfd.readouterr().out == "G21\nM852 I0.0008000 J-0.0005000 K0.0013000\n"
    travel = ["--actuator", "x", "--from-mm", "0", "--to-mm", "10"]
    assert run(["config", "screw-file", *files, *travel, "--control", "heidenhain"]) == 0
    assert capfd.readouterr().out.startswith("AXISPOS,X,BACKLASH\n")
