"""Entries of `effects:` in a config are part of the compensated machine."""

import numpy as np
import pytest

from camcomp.compensation.program.compensate import compensate
from camcomp.compensation.program.verify import verify
from camcomp.gcode.interpret import read_program
from camcomp.model.config.load import load_config
from camcomp.model.control import open_program
from camcomp.model.job import Job
from tests.validation.plants import energy
from tests.validation.plants.legs import orthoglide

FORCE = np.array([215.0, -10.0, -25.0])


def done(tmp_path, effect, sample="samples/groove-circle-50.nc", machine="orthoglide"):
    (tmp_path / "effects.yaml").write_text(f"effects: [{effect}]\n")
    config = load_config([f"config/{machine}.yaml", tmp_path / "effects.yaml"])
    job = Job(config)
    program = open_program(str(sample), config)
    return compensate(program, job, method="newton", tolerance_um=1.0, version="0"), job


def plant_tips(result, job, legs, *, tool=None, rho_error=None, weight=0.0, factor=1.0):
    """Tips (N, 3), program frame, of the energy plant at the commands written, on rows that cut."""
    rows = result.rows.corrected & ~result.rows.joining
    told = job.frame.to_machine(result.written.end[rows])
    rho = energy.inverse(orthoglide(), told)
    rho = rho if rho_error is None else rho + rho_error(rho)
    force = factor * job.frame.vectors(result.rows.force[rows])
    return job.frame.to_program(energy.settle(legs, rho, force, weight=weight).tip), result.rows.target[rows]


CASES = {
    "{effect: joint_offset, target: y, offset_mm: 0.1}": {"rho_error": lambda rho: np.array([0.0, 0.1, 0.0])},
    "{effect: screw_pitch, target: z, error_ppm: 100}": {
        "rho_error": lambda rho: 1e-4 * (rho + 300.0) * np.array([0.0, 0.0, 1.0])
    },
    "{effect: gravity, weight_N: 30}": {"weight": 30.0},
    "{effect: cutting_force, factor: 1.3}": {"factor": 1.3},
    "{effect: tool_length, length_mm: 0.3}": {"legs": lambda: orthoglide(tool=100.3)},
    "{effect: drive_stiffness, target: x, factor: 0.7}": {"legs": lambda: orthoglide(drive_factor=(0.7, 1.0, 1.0))},
    "{effect: link_stiffness, factor: 0.8}": {"legs": lambda: orthoglide(link_factor=0.8)},
    "{effect: chain_error, target: x, roll_deg: 0.3}": {"legs": lambda: orthoglide(roll_deg=(0.3, 0.0, 0.0))},
    "{effect: link_length, target: x, length_mm: 0.1}": {"legs": lambda: orthoglide(longer=(0.1, 0.0, 0.0))},
}


@pytest.mark.parametrize("effect", CASES)
def test_the_plant_with_the_effect_follows_the_program(tmp_path, effect):
    more = dict(CASES[effect])
    legs = more.pop("legs", orthoglide)()
    result, job = done(tmp_path, effect)
    tips, target = plant_tips(result, job, legs, **more)
    # inner vertices share the miss of their chords: up to the tolerance, plus rounding
    assert np.linalg.norm(tips - target, axis=1).max() < 1.1e-3
    plain = np.linalg.norm(result.before, axis=1).max()
    assert plain > 0.5


@pytest.mark.parametrize(
    "effects",
    [
        "{effect: friction, target: y, force_N: 208.5, presliding_mm: 0.006}",
        "{effect: friction, target: x, force_N: 300, presliding_mm: 0.003}, {effect: drive_stiffness, target: x, factor: 0.45}",
    ],
)
def test_friction_is_turned_round_from_the_first_line_on(tmp_path, effects):
    """Where the program begins with the cut, too, and without finer lines on the rest of the circle."""
    program = tmp_path / "in.nc"
    program.write_text("G21 G90 G17 G94\nG0 X25 Y0 Z0\nG3 X25 Y0 I-25 J0 F1000\nM2\n")
    result, _ = done(tmp_path, effects, program)
    assert np.linalg.norm(result.after, axis=1).max() < 1e-3
    assert len(result.rows.piece) < 320


@pytest.mark.parametrize("machine", ["cartesian", "orthoglide"])
def test_a_drive_that_turned_round_may_stand_while_others_go_round_a_bend(tmp_path, machine):
    lines = "G21 G90 G17 G94\nG0 X0 Y0 Z0\nG1 X10 F600\nG19 G3 Y0 Z0 J-6 K8\nG3 Y0 Z0 J-0.6 K0.8\nG1 X0\nM2\n"
    (tmp_path / "in.nc").write_text(lines)
    effect = "{effect: backlash, target: x, width_mm: 0.04}"
    result, _ = done(tmp_path, effect, tmp_path / "in.nc", machine)
    assert np.linalg.norm(result.after, axis=1).max() < 1e-3


@pytest.mark.parametrize(("axis", "width"), [(0, 0.02), (1, 0.1), (2, 0.05)])
def test_play_is_made_up_for_where_drives_turn_round_too(tmp_path, axis, width):
    """Lines between the commands written, through a play of our own, on the energy plant: the groove stays a circle."""
    result, job = done(tmp_path, f"{{effect: backlash, target: {'xyz'[axis]}, width_mm: {width}}}")
    assert np.linalg.norm(result.after, axis=1).max() < 1e-3
    assert np.linalg.norm(result.before, axis=1).max() > 0.5
    ends = np.concatenate((np.zeros((1, 3)), result.written.end))
    row, f = np.repeat(np.arange(len(ends) - 1), 3), np.tile([[0.25], [0.5], [1.0]], (len(ends) - 1, 1))
    told = ends[row] + f * (ends[row + 1] - ends[row])
    load = np.concatenate((np.zeros((1, 3)), job.frame.vectors(result.rows.force)))
    load = load[row] + f * (load[row + 1] - load[row])
    encoder = energy.inverse(orthoglide(), job.frame.to_machine(told))
    carriage, at = encoder.copy(), encoder[0, axis]
    for i, x in enumerate(encoder[:, axis]):
        at = max(min(at, x + width / 2), x - width / 2)
        carriage[i, axis] = at
    groove = (result.rows.motion[row] == 2) & ~result.rows.joining[row] & ~result.rows.joining[np.maximum(row - 1, 0)]
    groove &= np.linalg.norm(result.rows.force[np.maximum(row - 1, 0)], axis=1) > 1.0
    tip = job.frame.to_program(energy.settle(orthoglide(), carriage[groove], load[groove]).tip)
    assert groove.sum() > 600
    assert np.abs(np.hypot(tip[:, 0], tip[:, 1]) - 25.0).max() < 1.2e-3
    assert np.abs(tip[:, 2]).max() < 1.2e-3


@pytest.mark.parametrize("period", [0.6, 1.0, 2.0])
def test_a_short_wave_of_a_scale_is_made_up_for(tmp_path, period):
    """The signal period of an encoder in the loop: as a screw that runs out; points half a millimetre apart miss it at 1 mm."""
    program = tmp_path / "in.nc"
    program.write_text("G21 G90 G17 G94\nG0 X0 Y0 Z0\nG1 X20 F600\nM2\n")
    effect = f"{{effect: screw_cyclic, target: x, amplitude_mm: 0.01, pitch_mm: {period}}}]\nprocess: {{force: {{model: none}}}}\n#"
    result, _ = done(tmp_path, effect, program, "cartesian")
    assert np.linalg.norm(result.before, axis=1).max() > 9e-3
    ends = np.concatenate(([0.0], result.written.end[:, 0]))
    told = np.interp(np.linspace(0.0, len(ends) - 1.0, 20 * len(ends)), np.arange(len(ends)), ends)
    tip = told + 0.01 * np.sin(2.0 * np.pi * told / period)
    asked = np.interp(told, ends, np.concatenate(([0.0], result.rows.target[:, 0])))
    assert np.abs(tip - asked).max() < 1.2e-3


@pytest.mark.parametrize(("time_constant_ms", "verified_um"), [(2.0, 1.2), (20.0, 6.0)])
def test_a_lag_is_led_behind_and_in_front_of_stops_too(tmp_path, time_constant_ms, verified_um):
    """verify finds the same on the lines; it does not know how fast moves follow one another within a piece."""
    lines = "G21 G90 G17 G94\nG0 X0 Y0 Z5\nG1 Z0 F300\nX30 F1200\nG3 X30 Y30 J15\nG1 X0\nY0\nG0 Z5\nM2\n"
    (tmp_path / "in.nc").write_text(lines)
    effect = f"{{effect: servo_lag, time_constant_ms: {time_constant_ms}}}"
    result, job = done(tmp_path, effect, tmp_path / "in.nc")
    assert 1e3 * np.linalg.norm(result.before, axis=1).max() > 20.0 * time_constant_ms
    assert 1e3 * np.linalg.norm(result.after, axis=1).max() <= 1.1
    checked = verify(read_program(result.written.data, name="out.nc"), result.program, job)
    assert max(each.residual_um for each in checked.lines if each.line != 5) < verified_um


def test_verify_finds_what_is_left_of_a_late_drive_with_play(tmp_path):
    """Its lines at reversals are those that the correction made."""
    angles = np.linspace(0.0, 2.0 * np.pi, 1200)
    circle = "".join(f"X{x:.4f} Y{y:.4f}\n" for x, y in zip(22.0 * np.cos(angles), 22.0 * np.sin(angles), strict=True))
    (tmp_path / "in.nc").write_text(f"G21 G90 G17 G94\nG0 X22 Y0 Z5\nG1 Z0 F300\nF1200\n{circle}M2\n")
    effect = "{effect: servo_lag, time_constant_ms: 5}, {effect: backlash, target: x, width_mm: 0.02}"
    result, job = done(tmp_path, effect, tmp_path / "in.nc")
    stated = 1e3 * np.linalg.norm(result.after, axis=1).max()
    checked = verify(read_program(result.written.data, name="out.nc"), result.program, job)
    assert stated < 1.0
    assert abs(1e3 * checked.residual.max() - stated) < 0.3
