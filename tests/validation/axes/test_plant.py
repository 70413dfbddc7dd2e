"""The plant against laws and the scale of a real axis, the library's laws against the plant, and a written experiment."""

import csv
import json

import numpy as np
import pytest
import yaml

from tests.validation.axes import laws, motion, unmodelled
from tests.validation.axes.make import make
from tests.validation.axes.plant import Around, Axis, simulate

STROKES = motion.strokes([0, 120, 20, 90, 0], 120, 800, 0.05, [0.3, 0.1, 0.3, 0.3])
T = np.arange(len(STROKES)) * 1e-3
SPEED = np.gradient(STROKES, 1e-3)


def test_strokes_arrive_and_keep_their_speed():
    assert STROKES[-1] == pytest.approx(0, abs=1e-6) and STROKES.max() == pytest.approx(120, abs=1e-6)
    assert np.abs(SPEED).max() == pytest.approx(120, rel=1e-3)
    assert np.abs(np.gradient(SPEED, 1e-3)).max() <= 805


def test_a_healthy_axis_follows_and_its_force_is_mass_times_acceleration():
    moved = simulate(Axis(), STROKES)
    assert np.abs(moved.motor - STROKES).max() < 1e-4
    assert np.abs(moved.force - 0.05 * np.gradient(SPEED, 1e-3)).max() < 0.5


def test_the_axis_of_the_benchmark_lags_and_steps_as_it_was_measured():
    """EMPS: 95.1 kg, P and P without feed-forward; lag 6.39 ms, reversal step +-14.9 um in theory."""
    gain = 243.45 * 35.15065  # N s/m
    axis = Axis(mass=0.0951, kp=160.18, wv=gain / 95.1, vff=0, aff=0, reset_s=np.inf, coulomb=20.4, viscous=0.2035,
                friction_ff=0)  # fmt: skip
    moved = simulate(axis, STROKES)
    late = STROKES - moved.motor
    cruise = np.abs(SPEED) > 119.9
    cruise &= np.roll(cruise, 300)
    lag = np.mean((late * np.sign(SPEED))[cruise]) / 120
    step = 20.4 / (160.18 * gain * 1e-3)
    assert lag == pytest.approx(6.39e-3 + step / 120, rel=5e-3)
    assert step == pytest.approx(0.0149, rel=5e-3)
    assert 100 < np.abs(moved.force).max() < 200  # N; 150 in the recording


@pytest.mark.parametrize(
    ("axis", "law"),
    [
        (Axis(kp=200, vff=0), lambda c: laws.lagged(c, 0.005)),
        (Axis(kp=100, wv=120, aff=0, reset_s=np.inf), lambda c: laws.swung(c, 2 * np.pi / np.sqrt(12000), 120 / 2 / 12000**0.5)),
        (Axis(kp=100, wv=120, vff=0, aff=0, reset_s=np.inf), lambda c: laws.control(
            ("servo_lag", "servo_overshoot"), np.log([0.01, 2 * np.pi / np.sqrt(12000), 120 / 2 / 12000**0.5]), c)),
    ],
)  # fmt: skip
def test_loops_do_what_the_contract_says_of_their_effect(axis, law):
    error = simulate(axis, STROKES).motor - law(STROKES)
    assert laws.rms(error) < 2e-3 * laws.rms(law(STROKES) - STROKES)


def test_a_load_along_plus_gives_a_negative_drive_force_and_friction_pushes_along_the_speed():
    still = np.zeros(600)
    assert simulate(Axis(), still, Around(load=np.full(600, 7.0))).force[-1] == pytest.approx(-7, abs=0.01)
    moved = simulate(Axis(coulomb=20, viscous=0.1), STROKES)
    at = SPEED > 119
    assert (moved.force - 0.05 * np.gradient(SPEED, 1e-3))[at].mean() == pytest.approx(32, abs=0.3)
    assert simulate(Axis(weight=40.0), still).force[-1] == pytest.approx(40)


def test_friction_turns_round_within_its_presliding():
    way = motion.draw("sine", 0.05, 4, False, np.random.default_rng(3))
    moved = simulate(Axis(coulomb=20, presliding=0.005, spring=1e9), way)
    k = int(np.argmax(way[:2200]))
    after = np.searchsorted(way[k] - way[k : k + 400], 0.005) + k
    assert moved.force[after] == pytest.approx(20 * (1 - 2 * (1 - np.exp(-1))), abs=1.5)


@pytest.mark.parametrize("name", [*unmodelled.FORCED, *unmodelled.LOOPED])
def test_strange_faults_do_something_and_stay_finite(name):
    fault, way = unmodelled.draw(name, np.random.default_rng(5)), STROKES - 60
    axis, around = unmodelled.put(fault.scaled(2), Axis(), way, unmodelled.Most(60, 120, 800), way[::-1])
    moved, clean = simulate(axis, way, around), simulate(Axis(), way)
    assert np.isfinite(moved.motor).all() and np.abs(moved.motor - way).max() < 40
    assert laws.rms(moved.motor - clean.motor) > 1e-5 or laws.rms(moved.force - clean.force) > 0.1


@pytest.mark.parametrize("seed", [31000, 33044, 33089])
def test_an_experiment_has_what_its_truth_says(tmp_path, seed):
    make(seed, tmp_path)
    truth = json.loads((tmp_path / "truth" / f"e-{seed}.json").read_text())
    experiment = yaml.safe_load((tmp_path / f"e-{seed}" / "experiment.yaml").read_text())
    assert {"seed", "kind", "machine", "channels", "noise_um", "small_um", "causes"} <= set(truth)
    assert all({"effect", "target", "parameters", "ratio"} <= set(cause) for cause in truth["causes"])
    assert (truth["kind"] == "null") == (not truth["causes"])
    for run in experiment["runs"]:
        assert "program" not in run and run["cutting"] is False
        rows = list(csv.DictReader((tmp_path / f"e-{seed}" / run["log"]).read_text().splitlines()))
        assert len(rows) > 100
        for name in truth["sensors"]["moving"]:
            assert rows[5].keys() >= {"t_s", f"cmd_{name}_mm", f"act_{name}_mm"}
