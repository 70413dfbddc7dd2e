"""The truth machine in time: every sign and size stated in its docstring, checked by hand-made cases."""

import numpy as np
import pytest

from tests.validation.plants import causes, designs, experiments, unmodelled
from tests.validation.plants.machine import ORIGIN, Run, Truth, observe
from tests.validation.plants.motion import Timeline, read

CIRCLE = Timeline(read(designs.circle(25.0, 600.0, False, plunge=False)))
CUT, AIR = Run(CIRCLE, True, 100.0), Run(CIRCLE, False, 100.0)
T = (np.arange(400) + 0.5) * CIRCLE.log_end / 400
BUSY = [(100.0, 100.0 + CIRCLE.log_end)]


def tip_change(run=CUT, **wrong):
    return observe(run, Truth(**wrong), T, BUSY).tip - observe(run, Truth(), T, BUSY).tip


def one(i, value):
    return np.array([value if k == i else 0.0 for k in range(3)])


def test_perfect_machine_in_the_air_is_where_the_program_says():
    s = observe(AIR, Truth(), T, BUSY)
    assert np.abs(s.tip - s.programmed).max() < 1e-9
    assert np.abs(s.encoder - s.setpoint).max() == 0
    assert np.abs(s.drive).max() < 1e-6


def test_cut_circle_has_the_printed_error_and_forces():
    s = observe(CUT, Truth(), T, BUSY)
    assert np.linalg.norm(s.tip - s.programmed, axis=1).max() == pytest.approx(0.708, abs=1e-3)
    # counter-clockwise: e_r points outward, e_t along the feed
    first = np.argmin(T)
    assert s.force[first] == pytest.approx((215, -10, -25), abs=2)


def test_speed_profile_stops_at_every_end_and_keeps_its_acceleration():
    line = Timeline(read(designs.rectangle(40, 30, 600, plunge=False)))
    t = np.arange(0, line.log_end, 1e-3)
    s = line.sample(t)
    v = np.linalg.norm(np.diff(s["tip"], axis=0), axis=1) / 1e-3
    assert v.max() == pytest.approx(10.0, abs=1e-3)
    assert np.abs(np.diff(v)).max() / 1e-3 <= 1500 * 1.01
    ends = line.begin[2:-1]
    ends = ends[ends < line.log_end]
    assert line.sample(ends[:-1])["speed"].max() < 1e-6
    assert line.log_end == pytest.approx(sum(d / 10 + 10 / 1500 for d in (40, 30, 40, 30)))


def test_lag_delays_the_encoder():
    s = observe(AIR, Truth(lag_ms=np.full(3, 5.0)), T, BUSY)
    middle = slice(50, 350)
    late = s.setpoint - 5e-3 * s.velocity
    assert np.abs(s.encoder - late)[middle].max() < 5e-4
    assert np.abs(s.encoder - s.setpoint).max() > 0.04


def test_backlash_holds_the_carriage_back_by_half_its_width():
    from tests.validation.plants import drives

    x = np.concatenate([np.linspace(0, 1, 50), np.linspace(1, 0, 50)])
    y = drives.play(x, 0.02, 0.0)
    assert (y - x)[40] == pytest.approx(-0.01) and (y - x)[90] == pytest.approx(0.01)
    changed = tip_change(play_mm=one(0, 0.02))
    assert 0.009 < np.abs(changed[:, 0]).max() < 0.03


def test_friction_winds_the_spring_up_and_shows_in_the_drive_force():
    wrong = Truth(friction_N=one(1, 60.0))
    s, clean = observe(AIR, wrong, T, BUSY), observe(AIR, Truth(), T, BUSY)
    forward = s.velocity[:, 1] > 3.0
    assert np.median((s.drive - clean.drive)[forward, 1]) == pytest.approx(60, abs=0.5)
    assert np.median((s.carriage - clean.carriage)[forward, 1]) == pytest.approx(-60 / 1e4, rel=0.01)
    sticking = np.abs((s.drive - clean.drive)[:, 1])
    assert ((sticking > 5) & (sticking < 55)).sum() > 2  # it does not jump: presliding


@pytest.mark.parametrize(
    ("wrong", "carriage", "within"),
    [
        ({"offset_mm": one(0, 0.02)}, lambda s: 0.02, 1e-9),
        ({"pitch_ppm": one(0, 100.0)}, lambda s: 1e-4 * (s.encoder[:, 0] + 300), 1e-9),
        ({"growth_mm_per_K": one(0, 0.003)}, lambda s: 0.003 * (s.temperature - 20), 4e-4),
        (
            {"cyclic_mm": one(0, 0.004), "cyclic_phase": one(0, 0.7)},
            lambda s: 0.004 * np.sin(2 * np.pi * s.encoder[:, 0] / 5 + 0.7),
            1e-9,
        ),
    ],
)
def test_carriage_minus_encoder(wrong, carriage, within):
    s = observe(CUT, Truth(**wrong), T, BUSY)
    assert (s.carriage - s.encoder)[:, 0] == pytest.approx(np.broadcast_to(carriage(s), len(T)), abs=within)
    assert np.abs((s.carriage - s.encoder)[:, 1:]).max() == 0


def test_load_along_plus_gives_a_negative_drive_force():
    s = observe(CUT, Truth(), T, BUSY)
    assert s.drive[np.argmax(s.force[:, 0]), 0] < -150


def test_weight_is_carried_by_a_positive_z_drive():
    clean, heavy = observe(AIR, Truth(), T, BUSY), observe(AIR, Truth(weight_N=20.0), T, BUSY)
    assert (heavy.drive - clean.drive)[:, 2].min() > 10
    assert (heavy.tip - clean.tip)[:, 2].max() < 0


def test_tool_workpiece_and_clock():
    assert tip_change(tool_mm=0.1)[:, 2] == pytest.approx(-0.1, abs=2e-3)
    assert tip_change(shift_mm=np.array([0.1, 0, 0])) == pytest.approx(np.tile([-0.1, 0, 0], (len(T), 1)))
    turned = tip_change(AIR, rotation_deg=0.1)
    programmed = CIRCLE.sample(T)["tip"]
    assert turned[:, 0] == pytest.approx(np.deg2rad(0.1) * programmed[:, 1], abs=1e-4)
    late = observe(AIR, Truth(sync_s=0.01), T, BUSY)
    assert late.tip[50:] == pytest.approx(CIRCLE.sample(T[50:] - 0.01)["tip"], abs=1e-9)
    force = observe(CUT, Truth(), T, BUSY).force
    assert tip_change(deflection_mm_per_N=1e-4) == pytest.approx(1e-4 * force * [1, 1, 0], abs=1e-9)


def test_wear_counts_cutting_minutes_only():
    worn = Run(CIRCLE, True, 100.0, cut_before_min=2.0)
    s = observe(worn, Truth(wear_per_min=0.1), T, BUSY)
    size = np.linalg.norm(s.force[:, :2], axis=1) / np.hypot(215, 10)
    assert size == pytest.approx(1 + 0.1 * (2 + T / 60), rel=1e-3)


@pytest.mark.parametrize("pair", [*causes.every_cause(), *((n, "y") for n in unmodelled.NAMES)])
def test_every_cause_reaches_its_size_and_nothing_else_is_larger(pair):
    effect, target = pair
    plan = experiments.Plan(3, (causes.Cause(effect, target, 5),), (3.0,), "both-ways", samples=40)
    made = experiments.make(plan)
    rms = np.sqrt(np.mean([r["effect_rms_um"] ** 2 for r in made.record["runs"]]))
    assert rms == pytest.approx(3 * made.record["noise_rms_um"], rel=0.3)
    left = np.sqrt(np.mean([r["left_rms_um"] ** 2 for r in made.record["runs"]]))
    assert left < made.record["noise_rms_um"]


def test_same_seed_same_folder(tmp_path):
    plan = experiments.Plan(9, (causes.Cause("backlash", "x", 5),), (3.0,), design="circle", samples=50)
    config = tmp_path / "machine.yaml"
    config.write_text("robot: {}\n")
    for name in ("a", "b"):
        experiments.write(experiments.make(plan), plan, tmp_path / name, config)
    for path in sorted((tmp_path / "a").iterdir()):
        assert path.read_bytes() == (tmp_path / "b" / path.name).read_bytes()
        assert b"backlash" not in path.read_bytes()


def test_the_origin_puts_the_platform_at_q1():
    assert ORIGIN + [0, 0, 100] == pytest.approx([-73.205] * 3)
