"""What stands under `effects:` in a config is part of the machine that compensate makes up for."""

import numpy as np
import pytest

from camcomp.compensate import compensate
from camcomp.config import load_config
from camcomp.job import Job
from camcomp.programs import open_program
from tests.plants import energy
from tests.plants.legs import orthoglide

FORCE = np.array([215.0, -10.0, -25.0])


def done(tmp_path, effect):
    (tmp_path / "effects.yaml").write_text(f"effects: [{effect}]\n")
    config = load_config(["config/orthoglide.yaml", tmp_path / "effects.yaml"])
    job = Job(config)
    program = open_program("samples/groove-circle-50.nc", config)
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

