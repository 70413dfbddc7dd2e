"""The plant against laws: statics by virtual work, signs of every effect by a direct argument, what a log may show."""

import csv
import json

import numpy as np
import pytest

from tests.validation.serial import drives
from tests.validation.serial.causes import Local, library, remains, rms
from tests.validation.serial.make import make
from tests.validation.serial.plant import Off, Plant, Warmth, apply, central, make_run, pick
from tests.validation.serial.structure import Springs, load_machine, triple


def plant(name, *recordings, cutting=True):
    machine = load_machine(name)
    runs = [make_run(machine, r, cutting, 600.0 * k) for k, r in enumerate(recordings)]
    for run in runs:
        run.rows = np.arange(0.2, run.t[-1] - 0.2, 0.05)
    return Plant(machine, runs, Warmth(10.0, 900.0))


def change(p, effect, target, **parameters):
    """Tips with an effect minus tips without, and the set-point velocity, of the first run."""
    off = Off.nothing(p.machine)
    at = p.runs[0].rows
    with_it = p.rows(0, apply(p.machine, off, effect, target, parameters), at, True)
    without = p.rows(0, off, at, True)
    return with_it, without, with_it.tip - without.tip, pick(p.runs[0].t, central(p.runs[0].tip), at)


# --- statics


@pytest.mark.parametrize(
    ("name", "corrected", "force", "tip", "drive"),
    [
        # Rows of the joint table of `compensate`: what is commanded there has to arrive at what was programmed.
        (
            "router",
            [25.614, 0.058, 0.026],
            [-47.907836, -15.118047, -23.752185],
            [25, 0, 0],
            [47.907836, 15.107416, 63.834962],
        ),
        ("kuka-kr210", [25.3907, 0.013, 1.2963], [215, -10, -25], [25, 0, 0], None),
        ("cartesian", [24.9892, 0.0005, 0.0006], [215, -10, -25], [25, 0, 0], [-215, 10, 25]),
    ],
)
def test_agrees_with_the_corrected_rows_of_the_nominal_machine(name, corrected, force, tip, drive):
    machine = load_machine(name)
    q = machine.inverse(np.array([corrected], float))
    got, load = machine.solve(q, np.array([force], float), Springs(np.ones(len(machine.names))))
    assert np.abs(got[0] - machine.origin - tip).max() < 1e-3
    if drive:
        assert load[0] == pytest.approx(drive, abs=1e-3)


def test_router_moves_by_the_energy_in_its_springs():
    machine = load_machine("router")
    machine.steps = [(s[0], 0.0, s[2]) if s[0] == "weight" else s for s in machine.steps]
    q = np.array([[310.0, 180.0, -50.0]])
    for force in np.array([[3.0, 0, 0], [0, 3, 0], [0, 0, 3], [1, 2, -1]]):
        tip, _ = machine.solve(q, force[None], Springs(np.ones(3)))
        work = force @ (tip[0] - q[0] + [0, 0, 40])
        end = q[0] - [0, 0, 40]
        stored = force @ (force / [3e3, 4e3, 6e3])
        moment = np.cross(end - [310, 200, 250], force)  # at the top of the legs and in the beam
        stored += force @ (force * [5e-5, 1e-5, 1e-4]) + moment @ (moment * [2e-8, 1e-7, 2e-8])
        young, length, shear = 70000, 250, 70000 / 2.66
        stored += force[2] ** 2 * length / (young * 6000) + moment[2] ** 2 * length / (shear * 8.98e7)
        # Bending energy of an upright cantilever: M(s) = M_end + F (length - s), along x about y and along y about x.
        s = (np.arange(4000) + 0.5) * length / 4000
        stored += np.sum((moment[1] + force[0] * (length - s)) ** 2) * length / 4000 / (young * 1.125e7)
        stored += np.sum((moment[0] - force[1] * (length - s)) ** 2) * length / 4000 / (young * 2.0e5)
        ram = np.cross([0, 0, -40], force)
        stored += force @ (force * [1e-4, 8e-5, 1e-5]) + ram @ (ram * [5e-8, 5e-8, 3e-8])
        assert work == pytest.approx(stored, rel=2e-3)


def test_arm_is_held_by_the_work_of_its_loads():
    machine = load_machine("kuka-kr210")
    rng = np.random.default_rng(1)
    q0, force = machine.inverse(np.array([[20.0, -30, 5]]))[0] + rng.normal(0, 0.05, 6), np.array([50.0, -80, -30])

    def matrix(theta, a, alpha, d):
        c, s, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
        return np.array([[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]])

    table = [
        (0, 350, -90, 449.4),
        (0, 1150, 0, 0),
        (90, 41, -90, 0),
        (0, 0, 90, -1200),
        (0, 0, -90, 0),
        (180, 0, 180, -420),
    ]
    masses = [259.9, 334.7, 217.5, 12.2, 29.5, 46.5]
    centres = [(-175, 0, 0), (-575, 0, 0), (0, 0, -300), (0, 100, 0), (0, 0, -100), (0, 0, -80)]

    def work(q):
        frame, out = np.eye(4), 0.0
        frame[2, 3] = 225.6
        for angle, (theta, a, alpha, d), mass, centre in zip(q, table, masses, centres, strict=True):
            frame = frame @ matrix(angle + np.radians(theta), a, np.radians(alpha), d)
            out -= mass * 9.80665 * (frame @ [*centre, 1])[2]
        tip = (frame @ [0, 0, 250, 1])[:3]  # the flange's z points out of it, towards the work
        return out + force @ tip, tip

    machine.stiffness = machine.stiffness * 1e6
    tip, drive = machine.solve(q0[None], force[None], Springs(np.ones(6)))
    assert np.abs(tip[0] - work(q0)[1]).max() < 1e-3
    for k in range(6):
        step = np.eye(6)[k] * 1e-5
        pushed = (work(q0 + step)[0] - work(q0 - step)[0]) / 2e-5
        assert drive[0, k] == pytest.approx(-pushed, rel=1e-4, abs=30)


def test_arm_comes_to_where_it_is_sent_with_its_tool_upright():
    p = plant("kuka-kr210", "circles-exact")
    q = p.runs[0].q[::50]
    assert np.abs(p.rigid(q) - p.machine.origin - p.runs[0].tip[::50]).max() < 1e-6
    assert np.abs(q[:, 3]).max() == 0 and np.abs(q[:, 5] + q[:, 0]).max() == 0


# --- cutting force


def test_force_points_outwards_on_a_circle_against_the_clock_and_never_acts_in_air_or_plunge():
    p = plant("cartesian", "circles-exact")
    run = p.runs[0]
    force = p.force(0, central(run.tip), Off.nothing(p.machine))
    rows = np.flatnonzero((run.line == 8) | (run.line == 7))
    rows = rows[(run.kind[rows] == 3)]
    middle = rows[len(rows) // 2]
    outward = run.tip[middle, :2] / np.linalg.norm(run.tip[middle, :2])
    assert force[middle, :2] @ outward == pytest.approx(215, rel=1e-3) and force[middle, 2] == -25
    along = central(run.tip)[middle]
    assert force[middle] @ along / np.linalg.norm(along) == pytest.approx(-10, abs=0.1)
    assert not force[~run.cuts].any() and np.all(np.linalg.norm(force[run.cuts], axis=1) > 216)
    plunge = (run.kind == 2) & (np.abs(central(run.tip)[:, 2]) > 1)
    assert plunge.any() and not force[plunge & ~run.cuts].any() and not run.cuts[plunge].any()
    air = plant("cartesian", "circles-exact", cutting=False)
    assert not air.force(0, central(run.tip), Off.nothing(p.machine)).any()


def test_force_on_a_ramp_is_that_of_the_nominal_machine():
    p = plant("router", "ramp-exact")
    run = p.runs[0]
    force = p.force(0, central(run.tip), Off.nothing(p.machine))
    middle = np.flatnonzero(run.line == 7)[1000]
    assert force[middle] == pytest.approx([13.057563, -72.770028, -36.746575], abs=0.1)


def test_force_stays_while_a_cut_is_paused():
    p = plant("cartesian", "pause-blended")
    run = p.runs[0]
    still = run.cuts & (np.linalg.norm(central(run.tip), axis=1) == 0) & (run.t > 2)
    assert np.count_nonzero(still) > 300
    force = p.force(0, central(run.tip), Off.nothing(p.machine))[still]
    assert np.all(np.linalg.norm(force, axis=1) > 216)


def test_slot_force_of_the_mechanistic_model_has_its_closed_form():
    right, along, axial = triple(load_machine("router"), 1200, 8000)
    chip = 1200 / 16000
    assert right == pytest.approx(-(1.5 * 2 / 4 * 631 * chip + 3 / np.pi * 13), rel=1e-6)
    assert along == pytest.approx(-(1.5 * 2 / 4 * 99 * chip + 3 / np.pi * 10), rel=1e-6)
    assert axial == pytest.approx(-(3 / np.pi * 273 * chip + 1.5 * 2.8), rel=1e-6)


# --- effects, on the machine where each is plain to see


def test_lag_leaves_encoder_and_tip_behind_the_set_point():
    p = plant("cartesian", "circles-exact", cutting=False)
    got, _, moved, v = change(p, "servo_lag", "x", time_constant_ms=2.0)
    fast = np.linalg.norm(v, axis=1) > 15
    assert (got.motor - got.command)[fast, 0] == pytest.approx(-2e-3 * v[fast, 0], abs=6e-3)  # more while it speeds up
    assert moved[fast, 0] == pytest.approx(-2e-3 * v[fast, 0], abs=6e-3)
    assert np.abs(moved[:, 1:]).max() < 1e-12


def test_servo_is_of_second_order():
    step = np.zeros(60)
    step[1:] = 1.0
    out = drives.servo(step, 5e-3)
    t = np.arange(59) * 1e-3
    slow, quick = np.roots([1 / (200 * 2000), 1 / 200, 1])[::-1]
    want = 1 + (quick * np.exp(slow * t) - slow * np.exp(quick * t)) / (slow - quick)
    assert out[1:][5:] == pytest.approx(want[5:], abs=0.06)  # the command rises within one step, not at once
    assert out[-1] == pytest.approx(1, abs=1e-3)


def test_play_and_friction_hold_the_carriage_back_and_the_drive_pushes():
    p = plant("cartesian", "zigzag-100um", cutting=False)
    _, _, moved, v = change(p, "backlash", "x", width_mm=0.02)
    ahead, back = v[:, 0] > 20, v[:, 0] < -20
    assert moved[ahead, 0] == pytest.approx(-0.01, abs=1e-3) and moved[back, 0] == pytest.approx(0.01, abs=1e-3)
    got, without, moved, _ = change(p, "friction", "x", force_N=100.0, presliding_mm=0.005)
    assert moved[ahead, 0] == pytest.approx(-100 / 2e4, rel=0.01)
    assert (got.drive - without.drive)[ahead, 0] == pytest.approx(100, rel=0.01)
    assert (got.drive - without.drive)[back, 0] == pytest.approx(-100, rel=0.01)
    assert np.abs(got.motor - got.command).max() == 0


def test_bristles_give_way_within_their_presliding_distance():
    state = drives.bristles(np.concatenate([np.arange(0, 1, 1e-2), 1 - np.arange(0, 0.5, 1e-4)]), 0.005, 1e-9)
    assert state[99] == pytest.approx(1) and state[-1] == pytest.approx(-1)
    assert state[100 + 50] == pytest.approx(2 * np.exp(-50 * 1e-4 / 0.005) - 1, rel=1e-6)


@pytest.mark.parametrize("effect", ["joint_offset", "screw_pitch", "thermal_growth", "screw_cyclic"])
def test_carriage_minus_encoder(effect):
    p = plant("router", "circles-exact", cutting=False)
    x = p.runs[0].tip[:, 0] + 300
    t = p.runs[0].t
    parameters, want = {
        "joint_offset": ({"offset_mm": 0.03}, 0.03 + 0 * t),
        "screw_pitch": ({"error_ppm": 100.0}, 1e-4 * x),
        "thermal_growth": ({"growth_mm_per_K": 0.002}, 0.002 * (p.warmth.at(t) - 20)),
        "screw_cyclic": (
            {"amplitude_mm": 0.01, "pitch_mm": 5.0, "phase_rad": 1.0},
            0.01 * np.sin(2 * np.pi * x / 5 + 1.0),
        ),
    }[effect]
    got, _, moved, _ = change(p, effect, "x", **parameters)
    assert moved[:, 0] == pytest.approx(np.interp(p.runs[0].rows, t, want), abs=2e-6)
    assert np.abs(got.motor - got.command).max() == 0


def test_soft_springs_and_a_larger_force_give_way_more_along_the_force():
    p = plant("cartesian", "circles-exact")
    got, without, moved, _ = change(p, "drive_stiffness", "x", factor=0.5)
    assert moved[:, 0] == pytest.approx(without.force[:, 0] / 2e4, abs=1e-9)
    assert without.drive == pytest.approx(-without.force, abs=1e-9)
    got, without, moved, _ = change(p, "cutting_force", None, factor=1.2)
    assert moved == pytest.approx(0.2 * without.force / [2e4, 2e4, 4e4], abs=1e-9)
    assert got.force == pytest.approx(1.2 * without.force)
    _, without, moved, _ = change(p, "tool_deflection", None, compliance_mm_per_N=1e-4)
    assert moved == pytest.approx(1e-4 * without.force * [1, 1, 0], abs=1e-9)
    p = plant("router", "circles-exact")
    _, without, moved, _ = change(p, "link_stiffness", None, factor=0.5)
    cut = np.linalg.norm(without.force, axis=1) > 0
    assert np.all(np.einsum("ni,ni->n", moved, without.force)[cut] > 0)


def test_weight_longer_tool_frame_clock_and_square():
    p = plant("cartesian", "circles-exact", cutting=False)
    got, without, moved, v = change(p, "gravity", None, weight_N=100.0)
    assert moved == pytest.approx(np.tile([0, 0, -100 / 4e4], (len(v), 1)), abs=1e-9)
    assert (got.drive - without.drive)[:, 2] == pytest.approx(100)
    _, _, moved, _ = change(p, "tool_length", None, length_mm=0.1)
    assert moved == pytest.approx(np.tile([0, 0, -0.1], (len(v), 1)), abs=1e-9)
    shift = {"shift_x_mm": 0.1, "shift_y_mm": 0.0, "shift_z_mm": -0.2, "rotation_deg": 0.0}
    _, _, moved, _ = change(p, "workpiece_frame", None, **shift)
    assert moved == pytest.approx(np.tile([-0.1, 0, 0.2], (len(v), 1)), abs=1e-9)
    shift = dict.fromkeys(shift, 0.0) | {"rotation_deg": 0.1}
    _, without, moved, _ = change(p, "workpiece_frame", None, **shift)
    side = np.cross(
        [0, 0, -np.radians(0.1)], without.tip
    )  # the work turned to the left, so the tip is more to the right
    assert moved == pytest.approx(side, abs=2e-4)
    _, _, moved, v = change(p, "time_sync", None, offset_s=1e-3)
    smooth = np.linalg.norm(v, axis=1) > 15
    assert moved[smooth] == pytest.approx(-1e-3 * v[smooth], abs=1e-3)
    _, without, moved, _ = change(p, "squareness", "xy", angle_mrad=0.5)
    assert moved == pytest.approx(np.outer(without.tip[:, 1] * 5e-4, [1, 0, 0]), abs=1e-9)
    _, without, moved, _ = change(p, "squareness", "yz", angle_mrad=0.5)
    assert moved == pytest.approx(np.outer(without.tip[:, 2] * 5e-4, [0, 1, 0]), abs=1e-9)


def test_wear_grows_with_the_minutes_cut_in_all_runs_before():
    p = plant("cartesian", "circles-exact", "zigzag-100um")
    off = apply(p.machine, Off.nothing(p.machine), "tool_wear", None, {"growth_per_min": 1.0})
    at = p.runs[1].rows
    worn, new = (p.rows(1, o, at).force for o in (off, Off.nothing(p.machine)))
    first = np.flatnonzero(np.linalg.norm(new, axis=1) > 216)[0]
    minutes = np.count_nonzero(p.runs[0].cuts & (np.linalg.norm(central(p.runs[0].tip), axis=1) > 0.1)) * 1e-3 / 60
    assert 0.1 < minutes < 0.3
    assert worn[first] == pytest.approx(new[first] * (1 + minutes), rel=0.01)


@pytest.mark.parametrize("name", ["router", "kuka-kr210"])
def test_quick_sensitivities_are_those_of_the_plant_and_lie_in_the_span(name):
    p = plant(name, "circles-exact", "ramp-exact")
    for run in p.runs:
        run.rows = run.rows[::6]
    rng = np.random.default_rng(3)
    local, items = Local(p), library(p, rng)
    span = local.span(items, rng)
    for item in items:
        quick, full = local.quick(item), local.of(item)
        assert rms(quick - full) <= 0.12 * rms(full) + 0.02, item.key
        assert rms(remains(span, full)) <= 0.06 * rms(full) + 0.02, item.key


# --- experiments


def test_an_experiment_says_nothing_of_its_answer_and_comes_again(tmp_path):
    make(5, tmp_path, "cartesian")
    truth = json.loads((tmp_path / "truth" / "e-5.json").read_text())
    names = sorted(path.name for path in (tmp_path / "e-5").iterdir())
    runs = len(truth["sensors"]["rows"])
    stems = [f"{stem}-{k}" for stem in ("log", "program") for k in range(1, runs + 1)]
    assert [name.split(".")[0] for name in names] == ["experiment", *stems]
    text = (tmp_path / "e-5" / "experiment.yaml").read_text()
    assert not any(word in text for word in ("kind", "seed", truth["kind"], "truth"))
    for k, count in enumerate(truth["sensors"]["rows"], 1):
        with open(tmp_path / "e-5" / f"log-{k}.csv") as file:
            assert len(list(csv.DictReader(file))) == count
    assert truth["small_um"] < 0.5 * truth["noise_um"]
    make(5, tmp_path / "again", "cartesian")
    for path in (tmp_path / "again" / "e-5").iterdir():
        assert path.read_bytes() == (tmp_path / "e-5" / path.name).read_bytes()
