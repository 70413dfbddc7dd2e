"""`camcomp simulate` with each effect switched on, against the truth machine with the same thing wrong.

Two derivations that share nothing must agree on sign, size and channel.  Where the truth machine is deliberately another
formula (second-order servo, presliding friction, play with memory) the bound says by how much they may differ.
"""

import json

import numpy as np
import pytest

from tests.validation import runner
from tests.validation.plants import designs
from tests.validation.plants.machine import Run, Truth, observe
from tests.validation.plants.motion import Timeline, read

PROGRAM = designs.circle(25.0, 1200.0, False, plunge=False)
CORNERS = designs.rectangle(30.0, 20.0, 900.0, plunge=False)
Y = np.array([0.0, 1.0, 0.0])

STATIC = {
    "nominal": ([], {}),
    "joint_offset": ([{"target": "y", "offset_mm": 0.08}], {"offset_mm": 0.08 * Y}),
    "screw_pitch": ([{"target": "y", "error_ppm": 400}], {"pitch_ppm": 400 * Y}),
    "screw_cyclic": (
        [{"target": "y", "amplitude_mm": 0.02, "pitch_mm": 5.0, "phase_rad": 0.7}],
        {"cyclic_mm": 0.02 * Y, "cyclic_phase": 0.7 * Y},
    ),
    "drive_stiffness": ([{"target": "y", "factor": 0.6}], {"drive_factor": np.array([1, 0.6, 1])}),
    "link_stiffness": ([{"factor": 0.8}], {"link_factor": 0.8}),
    "chain_error": ([{"target": "y", "roll_deg": 0.5}], {"roll_deg": 0.5 * Y}),
    "link_length": ([{"target": "y", "length_mm": 0.1}], {"longer_mm": 0.1 * Y}),
    "gravity": ([{"weight_N": 40}], {"weight_N": 40.0}),
    "cutting_force": ([{"factor": 1.3}], {"force_factor": 1.3}),
    "tool_length": ([{"length_mm": 0.2}], {"tool_mm": 0.2}),
    "tool_deflection": ([{"compliance_mm_per_N": 2e-4}], {"deflection_mm_per_N": 2e-4}),
    "tool_wear": ([{"growth_per_min": 0.5}], {"wear_per_min": 0.5}),
    "workpiece_frame": (
        [{"shift_x_mm": 0.1, "shift_y_mm": -0.05, "shift_z_mm": 0.2, "rotation_deg": 0.1}],
        {"shift_mm": np.array([0.1, -0.05, 0.2]), "rotation_deg": 0.1},
    ),
    "time_sync": ([{"offset_s": 0.01}], {"sync_s": 0.01}),
}


def twin(tmp_path, program, effect, choices):
    """Columns of camcomp's log of the program with the effect in the machine file."""
    extra = tmp_path / "effects.yaml"
    listed = [{"effect": effect} | c for c in choices]
    extra.write_text(json.dumps({"effects": listed}))
    (tmp_path / "in.nc").write_text(program)
    log = tmp_path / "log.csv"
    code, said = runner.invoke(
        [
            "simulate",
            str(tmp_path / "in.nc"),
            "--config",
            str(runner.CONFIG),
            "--config",
            str(extra),
            "-o",
            str(log),
        ]
    )
    assert code == 0, said
    names = log.read_text().splitlines()[0].split(",")
    values = np.genfromtxt(log, delimiter=",", skip_header=1)
    return names, values


def columns(names, values, pattern):
    return values[:, [names.index(pattern.format(a)) for a in "xyz"]]


def both(tmp_path, program, effect, choices, wrong):
    """(camcomp's table reader, truth state) at the instants that lie clear of every start and stop."""
    names, values = twin(tmp_path, program, effect, choices)
    line = Timeline(read(program))
    t = values[:, 0]
    clear = np.abs(t[:, None] - line.begin[None, :]).min(1) > 0.012
    clear &= (t > 0.02) & (t < line.log_end - 1e-3)
    assert clear.sum() > 60
    values, t = values[clear], t[clear]
    run = Run(line, True, 0.0)
    return (lambda p: columns(names, values, p)), observe(run, Truth(**wrong), t, [(0.0, line.log_end)])


@pytest.mark.parametrize("program", [PROGRAM, CORNERS], ids=["circle", "rectangle"])
@pytest.mark.parametrize("effect", sorted(STATIC))
def test_effects_without_memory(tmp_path, effect, program):
    choices, wrong = STATIC[effect]
    log, truth = both(tmp_path, program, effect, choices, wrong)
    assert np.abs(log("cmd_{}_mm") - truth.setpoint).max() < 2e-4
    assert np.abs(log("act_{}_mm") - truth.encoder).max() < 2e-4
    assert np.abs(log("{}_mm") - truth.tip).max() < 3e-4
    assert np.abs(log("act_{}_N") - truth.drive).max() < 0.1
    assert np.abs(log("f{}_N") - truth.force).max() < 0.01


def rms(values):
    return float(np.sqrt(np.mean(values**2)))


@pytest.mark.parametrize(
    ("effect", "choices", "wrong", "share"),
    [
        ("servo_lag", [{"target": "y", "time_constant_ms": 4.0}], {"lag_ms": 4.0 * Y}, 0.15),
        ("servo_lag", [{"time_constant_ms": 4.0}], {"lag_ms": np.full(3, 4.0)}, 0.15),
        ("backlash", [{"target": "y", "width_mm": 0.04}], {"play_mm": 0.04 * Y}, 0.25),
        ("friction", [{"target": "y", "force_N": 200.0}], {"friction_N": 200.0 * Y}, 0.35),
    ],
)
def test_effects_with_memory(tmp_path, effect, choices, wrong, share):
    """Same sign, same size: what is left between the two is the stated share of what the effect does."""
    log, truth = both(tmp_path, PROGRAM, effect, choices, wrong)
    clean = observe(Run(Timeline(read(PROGRAM)), True, 0.0), Truth(), truth.t, [(0.0, 10.0)])
    does = rms(truth.tip - clean.tip)
    assert does > 5e-3
    assert rms(log("{}_mm") - truth.tip) < share * does
    assert rms(log("act_{}_mm") - truth.encoder) < 2e-4 + share * rms(truth.encoder - clean.encoder)
    assert rms(log("act_{}_N") - truth.drive) < 0.1 + share * rms(truth.drive - clean.drive)
