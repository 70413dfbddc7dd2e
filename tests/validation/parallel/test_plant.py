"""The plant against published values, against laws of mechanics, and every sign against a direct argument."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from tests.validation.parallel import __main__ as command
from tests.validation.parallel import motion, scenario, structure
from tests.validation.parallel.machine import read
from tests.validation.parallel.plant import LIBRARY, Deviation, simulate

pytestmark = pytest.mark.campaign  # of a generator of campaigns; compiles for half a minute
WARMING = {"rise_K": 8.0, "warm_up_s": 600.0}
NONE = structure.nominal()


def loaded(machine, reference, force, springs=NONE, tool=None):
    """Tip displacement (mm) and drive forces (N) with the platform commanded to a reference point (machine frame)."""
    machine = machine if tool is None else replace(machine, tool=tool)
    tip = np.atleast_2d(reference) - machine.origin - [0, 0, machine.tool]
    force = np.array(np.broadcast_to(np.asarray(force, float), tip.shape))
    out, drive, _ = structure.equilibrium(machine, tip, machine.inverse(tip)[0], force, springs)
    return out - tip, drive


@pytest.mark.parametrize(
    ("corner", "expected"),
    [(0.0, [2.599, 2.599, 2.599]), (-73.205, [1.751, 1.751, 10.944]), (126.795, [0.787, 12.592, 12.592])],
)
def test_orthoglide_compliances_are_the_published_ones(corner, expected):
    machine = read("orthoglide")
    columns = [loaded(machine, [corner] * 3, axis, tool=0.0)[0][0] for axis in np.eye(3)]
    found = np.linalg.eigvalsh((np.array(columns) + np.array(columns).T) / 2) * 1e4
    assert found == pytest.approx(expected, abs=2e-3)


def test_orthoglide_circle_has_the_published_errors_and_drive_forces():
    machine = read("orthoglide")
    a = np.arange(24) * np.pi / 12
    reference = -73.205 + np.stack([25 * np.cos(a), 25 * np.sin(a), 0 * a], 1)
    force = np.stack([215 * np.cos(a) + 10 * np.sin(a), 215 * np.sin(a) - 10 * np.cos(a), 0 * a - 25], 1)
    rolled = replace(NONE, roll=np.radians(np.ones(3)))
    bent = loaded(machine, reference, force)[0]
    crooked = loaded(machine, reference, 0 * force, rolled)[0]
    both, drive = loaded(machine, reference, force, rolled)
    largest = [np.linalg.norm(v, axis=1).max() for v in (bent, crooked, both)]
    assert largest == pytest.approx([0.707, 0.854, 1.148], abs=1e-3)
    assert np.abs(drive).max() == pytest.approx(333.1, abs=0.1)


@pytest.mark.parametrize(
    ("corner", "roll", "force", "expected"),
    [
        (0.0, 0, (215, 10, -25), (1.351604, 0.063311, 0.003047)),
        (-73.65, 0, (215, 10, -25), (1.413330, -0.377856, 0.093597)),
        (126.35, 0, (215, 10, -25), (3.630629, 0.359698, -0.949558)),
        (-73.65, 1, (0, 0, 0), (-2.481853, 2.325848, 0.008712)),
        (-73.65, 1, (215, 10, -25), (-0.879726, 1.848666, 0.090317)),
    ],
)
def test_puu_has_the_published_deflections(corner, roll, force, expected):
    springs = replace(NONE, roll=np.radians([roll] * 3))
    found = loaded(read("puu"), [corner] * 3, force, springs)[0][0]
    assert found == pytest.approx(expected, abs=2e-6)


@pytest.mark.parametrize("name", ["orthoglide", "delta", "puu"])
def test_drives_and_loads_are_reciprocal(name):
    """One energy has both: d tip_k / d carriage_i = - d drive force_i / d force_k, also in the loaded state."""
    machine = read(name)
    tip = np.array([[12.0, -9.0, 3.0]])
    rho, force = machine.inverse(tip)[0], np.array([[30.0, -12.0, 7.0]])

    def slope(first, second):
        ahead = structure.equilibrium(machine, tip, rho + first, force + second, NONE)
        behind = structure.equilibrium(machine, tip, rho - first, force - second, NONE)
        return (ahead[0] - behind[0])[0] / 2, (ahead[1] - behind[1])[0] / 2

    by_carriage = np.array([slope(0.05 * axis, 0 * axis)[0] / 0.05 for axis in np.eye(3)])
    by_force = np.array([slope(0 * axis, 20 * axis)[1] / 20 for axis in np.eye(3)])
    assert by_carriage == pytest.approx(-by_force.T, abs=2e-3)


def test_delta_moves_as_drawings_say():
    machine = read("delta")
    tip = np.zeros((1, 3))
    rho = machine.inverse(tip)[0]
    assert rho == pytest.approx(np.zeros((1, 3)), abs=1e-6)
    up, _, _ = structure.equilibrium(machine, tip, rho + 0.1, np.zeros((1, 3)), NONE)
    assert up[0] == pytest.approx([0, 0, 0.1], abs=1e-6)
    low = loaded(machine, [0, 0, 0], [0, 0, 0], replace(NONE, longer=np.full(3, 0.1)))[0][0]
    assert low == pytest.approx([0, 0, -0.1 * 400 / 346.410162], abs=1e-4)
    sag, drive = loaded(machine, [0, 0, 0], [0, 0, 0], replace(NONE, weight=30.0))
    assert sag[0, 2] < -1e-3
    assert drive.sum() == pytest.approx(30.0, rel=1e-4)


def run(name="circles-exact", cutting=True, machine=None, minutes=0.0):
    return motion.track(machine or read("orthoglide"), name, cutting, 100.0, minutes, WARMING)


def seen(deviations, one=None, times=None, machine=None):
    machine = machine or read("orthoglide")
    one = one or run(machine=machine)
    times = one.t[one.fed][::200] if times is None else times
    return simulate(machine, [one], [times], deviations, drives=True), times, one


def carriage(deviation):
    """Shift (n,) of carriage x and its motor (n,) mm, from the tip by the inverse kinematics (air cut)."""
    machine = read("orthoglide")
    one = run(cutting=False, machine=machine)
    with_it, times, _ = seen([deviation], one)
    without, _, _ = seen([], one)
    moved = machine.inverse(with_it.tip)[0] - machine.inverse(without.tip)[0]
    place = one.rho[np.rint(times * 1000).astype(int)]
    speed = np.gradient(one.rho[:, 0])[np.rint(times * 1000).astype(int)]
    assert np.abs(moved[:, 1:]).max() < 2e-6
    return moved[:, 0], place[:, 0], speed * 1e3, with_it, without, one, times


def test_play_lags_behind_the_motor():
    shift, _, speed, *_ = carriage(Deviation("backlash", "x", {"width_mm": 0.02}))
    fast = np.abs(speed) > 15
    assert shift[fast] == pytest.approx(-0.01 * np.sign(speed[fast]), abs=1e-5)


def test_friction_holds_the_carriage_back_and_loads_the_drive():
    d = Deviation("friction", "x", {"force_N": 40.0, "presliding_mm": 0.005})
    shift, _, speed, with_it, without, *_ = carriage(d)
    fast = np.abs(speed) > 15
    assert shift[fast] == pytest.approx(-40 / 1e4 * np.sign(speed[fast]), abs=1e-5)
    assert (with_it.drive - without.drive)[fast, 0] == pytest.approx(40 * np.sign(speed[fast]), abs=0.1)
    assert np.array_equal(with_it.motor, without.motor)


def test_carriage_errors_have_their_signs():
    assert carriage(Deviation("joint_offset", "x", {"offset_mm": 0.03}))[0] == pytest.approx(0.03, abs=2e-6)
    shift, place, *_ = carriage(Deviation("screw_pitch", "x", {"error_ppm": 100.0}))
    assert shift == pytest.approx(1e-4 * (place + 300), abs=2e-6)
    shift, place, *_ = carriage(Deviation("screw_cyclic", "x", {"amplitude_mm": 0.01, "pitch_mm": 5.0, "phase_rad": 1}))
    assert shift == pytest.approx(0.01 * np.sin(2 * np.pi * place / 5 + 1), abs=2e-6)
    d = Deviation("thermal_growth", "x", {"growth_mm_per_K": 0.002})
    shift, _, _, _, _, one, times = carriage(d)
    assert shift == pytest.approx(0.002 * (one.temperature[np.rint(times * 1000).astype(int)] - 20), abs=2e-6)
    assert shift[-1] > shift[0] > 0


def test_servo_lags_by_time_constant_times_speed_and_the_encoder_sees_it():
    with_it, times, one = seen([Deviation("servo_lag", None, {"time_constant_ms": 2.0})])
    speed = np.gradient(one.rho, axis=0) * 1e3
    index = np.rint(times * 1000).astype(int)
    steady = slice(3, -3)
    lag = (one.rho[index] - with_it.motor)[steady]
    assert lag == pytest.approx(0.002 * speed[index][steady], abs=2e-3)
    assert np.abs(lag).max() > 0.03


def test_force_is_outward_on_a_left_turn_and_none_in_plunges_rapids_and_air():
    one = run()
    index = np.flatnonzero(one.line == 7)[2000]
    outward = one.tip[index, :2] / np.linalg.norm(one.tip[index, :2])
    assert one.force[index, :2] @ outward == pytest.approx(215, abs=0.5)
    assert one.force[index, 2] == -25
    assert not one.force[(one.line == 6) | (one.line == 8) | (one.line == 0)].any()
    assert not run(cutting=False).force.any()
    feeds, cuts = motion.feed_lines("G0 X1\nG1 Z-1 F100\nX5\nG2 X5 Y1 I1\nG0 Z3\nG4 P0.5\n(G1 X1)\nG1 X3 Z2\n")
    assert (2 in feeds) and 2 not in cuts and {3, 4, 8} <= cuts and not {1, 5} & feeds


def test_the_rest_of_the_library_moves_the_tip_where_it_should():
    base, times, one = seen([])
    index = np.rint(times * 1000).astype(int)

    def change(effect, parameters, target=None):
        return seen([Deviation(effect, target, parameters)])[0].tip - base.tip

    assert change("tool_length", {"length_mm": 0.1}) == pytest.approx(
        np.tile([0, 0, -0.1], (len(times), 1)), abs=1e-3)  # fmt: skip
    assert change("tool_deflection", {"compliance_mm_per_N": 1e-4}) == pytest.approx(
        1e-4 * one.force[index] * [1, 1, 0])  # fmt: skip
    bend = base.tip - one.tip[index]
    more = change("cutting_force", {"factor": 1.1})
    assert (more * bend).sum() / (bend**2).sum() == pytest.approx(0.1, abs=0.005)
    worn = change("tool_wear", {"growth_per_min": 0.5})
    share = (worn * bend).sum(1) / (bend**2).sum(1)
    assert share == pytest.approx(0.5 * one.minutes[index], rel=0.05, abs=1e-4)
    soft = change("link_stiffness", {"factor": 0.9})
    soft = soft + sum(change("drive_stiffness", {"factor": 0.9}, drive) for drive in "xyz")
    assert (soft * bend).sum() / (bend**2).sum() == pytest.approx(1 / 9, abs=0.005)
    frame = {"shift_x_mm": 0.1, "shift_y_mm": 0.0, "shift_z_mm": 0.0, "rotation_deg": 0.0}
    assert change("workpiece_frame", frame) == pytest.approx(np.tile([-0.1, 0, 0], (len(times), 1)))
    turned = change("workpiece_frame", {**frame, "shift_x_mm": 0.0, "rotation_deg": 0.1})
    assert turned[:, 1] == pytest.approx(-np.radians(0.1) * base.tip[:, 0], abs=1e-4)
    early = change("time_sync", {"offset_s": 0.004})
    later = seen([], one, times + 0.004)[0].tip - base.tip
    assert early == pytest.approx(later, abs=1e-6)


def test_every_effect_of_the_list_changes_something():
    machine = read("delta")
    base = seen([], machine=machine)[0]
    rng = np.random.default_rng(1)
    for effect, split in LIBRARY.items():
        one = scenario.deviation(rng, effect, "a" if split else None, 1.0, WARMING)
        assert np.abs(seen([one], machine=machine)[0].tip - base.tip).max() > 1e-5, effect


def test_an_experiment_is_the_same_again_and_keeps_its_answer_apart(tmp_path):
    command.write(4, tmp_path / "a", "delta")
    command.write(4, tmp_path / "b", "delta")
    files = sorted(path.relative_to(tmp_path / "a") for path in (tmp_path / "a").rglob("*") if path.is_file())
    assert all((tmp_path / "a" / f).read_bytes() == (tmp_path / "b" / f).read_bytes() for f in files)
    inside = {f.name.split("-")[0] for f in files if f.parts[0] != "truth"}
    assert inside == {"experiment.yaml", "program", "log"}
    truth = json.loads((tmp_path / "a" / "truth" / "e-4.json").read_text())
    assert truth["small_um"] < 0.55 * truth["noise_um"]
