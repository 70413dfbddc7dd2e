"""A corrected program on the truth machine that has the very errors named in the machine file: the cut must be true."""

import json

import numpy as np
import pytest

from tests.validation import runner
from tests.validation.plants import designs
from tests.validation.plants.machine import Run, Truth, observe
from tests.validation.plants.measure import misses
from tests.validation.plants.motion import Timeline, read

Y = np.array([0.0, 1.0, 0.0])
PROGRAM = designs.circle(25.0, 1200.0, False)  # its corrected plunge slants and yet does not cut
SETS = {
    "elastic": (
        [
            {"effect": "drive_stiffness", "target": "y", "factor": 0.6},
            {"effect": "link_stiffness", "factor": 0.9},
            {"effect": "chain_error", "target": "y", "roll_deg": 0.8},
            {"effect": "gravity", "weight_N": 30},
            {"effect": "cutting_force", "factor": 1.2},
        ],
        Truth(
            drive_factor=np.array([1, 0.6, 1]),
            link_factor=0.9,
            roll_deg=0.8 * Y,
            weight_N=30.0,
            force_factor=1.2,
        ),
    ),
    "geometric": (
        [
            {"effect": "joint_offset", "target": "y", "offset_mm": 0.1},
            {"effect": "screw_pitch", "target": "y", "error_ppm": 500},
            {"effect": "link_length", "target": "y", "length_mm": 0.2},
            {"effect": "tool_length", "length_mm": 0.3},
            {"effect": "tool_deflection", "compliance_mm_per_N": 2e-4},
            {
                "effect": "workpiece_frame",
                "shift_x_mm": 0.1,
                "shift_y_mm": -0.2,
                "shift_z_mm": 0.1,
                "rotation_deg": 0.2,
            },
        ],
        Truth(
            offset_mm=0.1 * Y,
            pitch_ppm=500 * Y,
            longer_mm=0.2 * Y,
            tool_mm=0.3,
            deflection_mm_per_N=2e-4,
            shift_mm=np.array([0.1, -0.2, 0.1]),
            rotation_deg=0.2,
        ),
    ),
    "control": (
        [
            {"effect": "servo_lag", "target": "x", "time_constant_ms": 1.0},
            {
                "effect": "screw_cyclic",
                "target": "z",
                "amplitude_mm": 0.03,
                "pitch_mm": 8.0,
                "phase_rad": 1.0,
            },
        ],
        Truth(
            lag_ms=np.array([1.0, 0, 0]),
            cyclic_mm=np.array([0, 0, 0.03]),
            cyclic_pitch_mm=np.array([5.0, 5.0, 8.0]),
            cyclic_phase=np.array([0, 0, 1.0]),
        ),
    ),
}


def executed(text, truth, began=0.0):
    """State of the machine, in motion since time 0, that executes `text` from `began` (s) on."""
    line = Timeline(read(text), looks_ahead=True)
    t = np.linspace(0.05, line.log_end - 0.05, 600)
    run = Run(line, True, began, surface=Timeline(read(PROGRAM)))
    return observe(run, truth, t, [(0.0, began + line.log_end)])


def missed(text, truth, began=0.0):
    """Distances (n,) mm of the tips from the groove while the machine executes `text`."""
    return misses(executed(text, truth, began), PROGRAM)


@pytest.mark.parametrize("name", sorted(SETS))
def test_the_broken_machine_cuts_true(tmp_path, name):
    effects, truth = SETS[name]
    (tmp_path / "effects.yaml").write_text(json.dumps({"effects": effects}))
    (tmp_path / "in.nc").write_text(PROGRAM)
    out = tmp_path / "out.nc"
    line = ["compensate", str(tmp_path / "in.nc"), "--config", str(runner.CONFIG)]
    code, said = runner.invoke([*line, "--config", str(tmp_path / "effects.yaml"), "-o", str(out)])
    behind_stops = name == "control" and "CC601" in said  # within 0.1 mm of a stop no line can follow the lag
    assert code == 0 or behind_stops, said
    assert missed(PROGRAM, truth).max() > 0.3
    left = missed(out.read_text(), truth)
    assert left.max() < 1.2e-3  # the bound of the splitting is 1 um; the nearest sampled direction adds a little


def test_a_machine_with_other_errors_does_not(tmp_path):
    (tmp_path / "in.nc").write_text(PROGRAM)
    out = tmp_path / "out.nc"
    code, said = runner.invoke(["compensate", str(tmp_path / "in.nc"), "--config", str(runner.CONFIG), "-o", str(out)])
    assert code == 0, said
    assert missed(out.read_text(), Truth()).max() < 1.2e-3
    assert missed(out.read_text(), SETS["elastic"][1]).max() > 0.05


def test_a_drive_with_play_and_friction_is_led_through_both(tmp_path):
    """Friction holds back the carriage behind the play. Its turn-round here is Maxwell's, there Dahl's: some um stay.

    The plant's play follows the motion alone, so the friction exceeds the largest load of the structure, 403 N.
    """
    truth = Truth(play_mm=0.04 * Y, friction_N=450.0 * Y)
    effects = [
        {"effect": "friction", "target": "y", "force_N": 450, "presliding_mm": 0.0028},
        {"effect": "backlash", "target": "y", "width_mm": 0.04},
    ]
    (tmp_path / "effects.yaml").write_text(json.dumps({"effects": effects}))
    (tmp_path / "in.nc").write_text(PROGRAM)
    left = []
    for config in ([], ["--config", str(tmp_path / "effects.yaml")]):
        line = ["compensate", str(tmp_path / "in.nc"), "--config", str(runner.CONFIG), *config]
        code, said = runner.invoke([*line, "-o", str(tmp_path / "out.nc")])
        assert code == 0, said
        left.append(missed((tmp_path / "out.nc").read_text(), truth))
    assert np.sqrt(np.mean(left[0] ** 2)) > 0.03 and np.sqrt(np.mean(left[1] ** 2)) < 1e-3
    assert left[1].max() < 4e-3


@pytest.mark.parametrize("stated", [True, False])
def test_a_warm_machine_cuts_true_at_its_temperature(tmp_path, stated):
    truth, began = Truth(growth_mm_per_K=np.array([0, 0, 0.006])), 7200.0
    effects = [{"effect": "thermal_growth", "target": "z", "growth_mm_per_K": 0.006}]
    temperature = float(executed(PROGRAM, truth, began).temperature.mean())
    process = {"process": {"temperature_C": temperature}} if stated else {}
    (tmp_path / "warm.yaml").write_text(json.dumps({"effects": effects, **process}))
    (tmp_path / "in.nc").write_text(PROGRAM)
    out = tmp_path / "out.nc"
    line = ["compensate", str(tmp_path / "in.nc"), "--config", str(runner.CONFIG)]
    code, said = runner.invoke([*line, "--config", str(tmp_path / "warm.yaml"), "-o", str(out)])
    assert code == 0, said
    assert ("temperature_C" in said) is not stated
    assert (missed(out.read_text(), truth, began).max() < 1.2e-3) == stated
