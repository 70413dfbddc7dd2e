"""A corrected program on the truth machine that has the very errors named in the machine file: the cut must be true."""

import json
from itertools import pairwise

import numpy as np
import pytest

from tests.campaign import runner
from tests.plants import designs
from tests.plants.machine import Run, Truth, observe
from tests.plants.motion import Timeline, read

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
}


def distance(points, program):
    """Distances (n,) mm of points (n, 3) from the programmed path, by a dense polygon of it."""
    line = Timeline(read(program))
    dense = line.sample(np.linspace(0, line.log_end, 4000))["tip"]
    out = np.full(len(points), np.inf)
    for a, b in pairwise(dense):
        d = b - a
        share = np.clip((points - a) @ d / max(float(d @ d), 1e-30), 0, 1)
        out = np.minimum(out, np.linalg.norm(points - a - share[:, None] * d, axis=1))
    return out


def cut(text, truth):
    """Tips (n, 3) that cut, clear of the joining lines at the ends of the groove."""
    line = Timeline(read(text))
    t = np.linspace(0.05, line.log_end - 0.05, 300)
    state = observe(Run(line, True, 0.0, surface=Timeline(read(PROGRAM))), truth, t, [(0.0, line.log_end)])
    ends = np.linalg.norm(state.programmed - [25.0, 0, 0], axis=1) < 2.5
    return state.tip[state.cuts & ~ends]


@pytest.mark.parametrize("name", sorted(SETS))
def test_the_broken_machine_cuts_true(tmp_path, name):
    effects, truth = SETS[name]
    (tmp_path / "effects.yaml").write_text(json.dumps({"effects": effects}))
    (tmp_path / "in.nc").write_text(PROGRAM)
    out = tmp_path / "out.nc"
    line = ["compensate", str(tmp_path / "in.nc"), "--config", str(runner.CONFIG)]
    code, said = runner.invoke([*line, "--config", str(tmp_path / "effects.yaml"), "-o", str(out)])
    assert code == 0, said
    assert distance(cut(PROGRAM, truth), PROGRAM).max() > 0.3
    left = distance(cut(out.read_text(), truth), PROGRAM)
    assert (
        left.max() < 1.2e-3
    )  # the bound of the splitting is 1 um; the nearest sampled direction adds a little


def test_a_machine_with_other_errors_does_not(tmp_path):
    (tmp_path / "in.nc").write_text(PROGRAM)
    out = tmp_path / "out.nc"
    code, said = runner.invoke(
        ["compensate", str(tmp_path / "in.nc"), "--config", str(runner.CONFIG), "-o", str(out)]
    )
    assert code == 0, said
    assert distance(cut(out.read_text(), Truth()), PROGRAM).max() < 1.2e-3
    assert distance(cut(out.read_text(), SETS["elastic"][1]), PROGRAM).max() > 0.05
