"""Lines at a screw's pitch or at one frequency, on made-up gaps: found where they are, and not where they are not."""

import numpy as np
import pytest

from camcomp.diagnosis.statistics import places
from camcomp.diagnosis.statistics.periods import frequencies, screws

NAMES = ("x", "y", "z")


def run(seed, drives=None, gap=None, feed=10.0, noise=0.001):
    """A circle of 25 mm at `feed` mm/s with white noise, and an addition to the carriages or to the tip."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0.0, 2 * np.pi * 25.0 / feed, 400)
    angle = feed * t / 25.0
    position = np.column_stack([25 * np.cos(angle), 25 * np.sin(angle), 8 * np.sin(angle + 1.0)])
    direction = np.sign(np.gradient(position, axis=0))
    drives_ = noise * rng.standard_normal((400, 3)) + (0.0 if drives is None else drives(position, direction))
    gap_ = noise * rng.standard_normal((400, 3)) + (0.0 if gap is None else gap(t))
    gap_ = gap_ + (0.0 if drives is None else drives(position, direction))
    return places.RunGap(
        name="r",
        gap=gap_,
        noise=np.full(3, noise),
        thin=1.0,
        time=t,
        line=np.full(400, 5.0),
        drives=drives_,
        tip=position,
        position=position - 300.0,
        direction=direction,
    )


def wobble(position, direction):
    out = np.zeros_like(position)
    out[:, 1] = 0.004 * np.sin(2 * np.pi * position[:, 1] / 5.0 + 0.3)
    return out


def step(position, direction):
    return 0.01 * direction * [1.0, 0.0, 0.0]


def test_a_wobble_is_found_at_its_actuator_period_and_size():
    [line] = screws([run(1, wobble), run(2, wobble, feed=20.0)], NAMES)
    assert line.name == "y"
    assert line.at == pytest.approx(5.0, rel=0.01)
    assert line.amplitude == pytest.approx(0.004, rel=0.1)
    assert line.share > 0.6


def test_what_runs_out_in_one_direction_only_is_no_screw():
    def one_way(position, direction):
        return wobble(position, direction) * (direction[:, 1:2] > 0)

    assert screws([run(1, one_way), run(2, one_way, feed=20.0)], NAMES) == []


def test_a_vibration_is_found_in_runs_of_different_speed():
    def shake(t):
        return 0.005 * np.sin(2 * np.pi * 1.3 * t)[:, None] * [0.0, 0.0, 1.0]

    [line] = frequencies([run(1, gap=shake), run(2, gap=shake, feed=20.0)], NAMES)
    assert line.name == "z"
    assert line.at == pytest.approx(1.3, rel=0.02)
    assert line.amplitude == pytest.approx(0.005, rel=0.1)


def test_what_repeats_with_the_path_is_no_vibration():
    def lobes(feed):
        return lambda t: 0.005 * np.sin(6 * feed * t / 25.0)[:, None] * [1.0, 0.0, 0.0]

    runs = [run(i, gap=lobes(f), feed=f) for i, f in enumerate((8.0, 12.0, 20.0))]
    assert frequencies(runs, NAMES) == []


@pytest.mark.parametrize("seed", range(8))
def test_noise_has_no_lines(seed):
    runs = [run(10 * seed + i, feed=10.0 + 5 * i) for i in range(3)]
    assert screws(runs, NAMES) == [] and frequencies(runs, NAMES) == []
    assert places.places(runs) == [] and places.lines(runs) == [] and places.intervals(runs) == []


def test_play_turns_round_with_the_direction_of_travel_and_an_offset_does_not():
    found = places.travel([run(1, step), run(2, step, feed=20.0)], NAMES)
    assert found["x"]["with_direction"] > 0.9 and found["x"]["both_ways"] < 0.05
    found = places.travel([run(1, lambda p, d: np.full_like(p, 0.01))], NAMES)
    assert found["x"]["both_ways"] > 0.9 and found["x"]["with_direction"] < 0.05


def test_what_follows_a_reversal_counts_as_such():
    def spike(position, direction):
        gone = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(position[:, 0])))])
        turned = np.concatenate([[False], direction[1:, 0] != direction[:-1, 0]])
        last = np.maximum.accumulate(np.where(turned, gone, -np.inf))
        return (0.02 * np.exp(-(gone - last) / 1.0))[:, None] * [1.0, 0.0, 0.0]

    found = places.travel([run(1, spike), run(2, spike, feed=20.0)], NAMES)
    assert found["x"]["after_reversal"] > 0.5


def test_a_gap_in_one_corner_is_found_there():
    def corner(position, direction):
        inside = (position[:, 0] > 15.0) & (position[:, 1] < 0.0)
        return 0.01 * inside[:, None] * [0.0, 0.0, 1.0]

    [first, *_] = places.places([run(1, corner), run(2, corner, feed=20.0)])
    assert first["x_mm"][1] == pytest.approx(25.0, abs=0.1) and first["y_mm"][0] < 0.0 and first["share"] > 0.3
