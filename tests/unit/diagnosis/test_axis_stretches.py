"""What logs of axes show for a while: how high and when a push is, and which stretches of a leftover are more than noise."""

import numpy as np
import pytest

from camcomp.diagnosis.axis.disturbance_window import find_window
from camcomp.diagnosis.axis.findings import AxisRun
from camcomp.diagnosis.axis.gate import intervals
from camcomp.diagnosis.model.noise import StatedDeviation
from tests.studies import axis_study as study

FORCE, NOISE = 60.0, 0.5
RAMP = 20  # rows of 1 ms, over which a push comes and goes: its middle is when it begins


def pushed(first, last, rows):
    push = np.zeros(rows)
    push[first:last] = FORCE
    return np.convolve(push, np.full(RAMP, 1.0 / RAMP), "same")


@pytest.mark.parametrize(("size", "found"), [(FORCE, True), (1.9 * NOISE, False)])
def test_a_push_above_the_wander_of_a_zero_lasts_from_the_middle_of_its_rise_to_that_of_its_fall(size, found):
    time = 1e-3 * np.arange(4000)
    force = size / FORCE * pushed(1500, 2000, 4000) + NOISE * np.random.default_rng(0).standard_normal(4000)
    best = find_window({0: force}, {0: np.sin(3.0 * time)[:, None]}, {0: time}, NOISE)
    assert (best is not None) == found
    if best is not None:
        assert abs(best[0].first - 1500) <= 1 and abs(best[0].last - 2000) <= 1


def test_a_force_that_fades_is_no_push():
    time = 1e-3 * np.arange(4000)
    force = NOISE * np.random.default_rng(0).standard_normal(4000)
    force[1500:] += FORCE * np.exp(-(time[1500:] - time[1500]) / 0.3)
    assert find_window({0: force}, {0: np.sin(3.0 * time)[:, None]}, {0: time}, NOISE) is None


@pytest.mark.parametrize("begin", [4000, pytest.param(4020, marks=pytest.mark.campaign)])
def test_a_push_that_begins_among_lost_rows_is_not_known_to_better(begin):
    rng = np.random.default_rng(begin)
    time = 1e-3 * np.arange(16000)
    way = 100.0 * np.sin(0.9 * time) + 40.0 * np.sin(2.3 * time + 0.4)
    speed = np.gradient(way, time)
    force = 0.08 * np.gradient(speed, time) + 30.0 * np.tanh(speed / 0.5) + NOISE * rng.standard_normal(len(time))
    force[begin:7000] += FORCE
    there = np.ones(len(time), bool)
    there[3998:4022] = False
    log = AxisRun(
        name="r", time=time[there], setpoint=way[there],
        encoder=(way + 5e-4 * rng.standard_normal(len(time)))[there], force=force[there],
    )  # fmt: skip
    (push,) = (c for c in study({"x": [log]}).causes if c.effect == "disturbance")
    for name, truth in (("from_s", begin), ("to_s", 7000)):
        low, high = push.parameters[name].ci95
        assert low < 1e-3 * truth < high
        assert high - low < (0.04 if name == "from_s" else 0.005)


def stretch(leftover):
    """Findings in half a second of given data within twenty of noise of size 1."""
    left = np.random.default_rng(3).standard_normal(4001)
    left[1001:1101] = leftover
    return intervals([left], [5e-3 * np.arange(4001)], 1.0, ["r"])[0]


def test_a_stretch_is_more_than_noise_that_is_larger_there():
    rng = np.random.default_rng(4)
    assert stretch(2.2 * rng.standard_normal(100)) == ()
    (found,) = stretch(2.0 + rng.standard_normal(100))
    assert (found.t0_s, found.t1_s) == pytest.approx((5.0, 5.5), abs=0.01)


def late(one_way_um):
    """Following errors of a lag that differs between the ways by so much (rms)."""
    rng = np.random.default_rng(5)
    time = 2e-3 * np.arange(8000)
    speed = 90.0 * np.cos(0.9 * time) + 92.0 * np.cos(2.3 * time + 0.4)
    way = 100.0 * np.sin(0.9 * time) + 40.0 * np.sin(2.3 * time + 0.4)
    behind = 5e-5 * speed + 1e-3 * one_way_um * np.abs(speed) / np.sqrt(np.mean(speed**2))
    log = AxisRun(
        name="r",
        time=time,
        setpoint=way,
        encoder=way - behind + 1e-4 * rng.standard_normal(len(time)),
        force=np.full(len(time), np.nan),
    )
    return study({"x": [log]}, stated=StatedDeviation(encoder_mm=3e-4))


def test_a_lag_that_differs_between_the_ways_by_less_than_the_floor_is_a_lag():
    assert late(0.085).verdict == "identified"
    much = late(0.6)
    assert much.verdict == "unknown" and much.where.drivers[0].covariate == "velocity:x"


@pytest.mark.parametrize(
    ("pulses", "first"), [(5, "time:x"), pytest.param(0, "position:x", marks=pytest.mark.campaign)]
)
def test_what_comes_and_goes_beside_a_ripple_is_of_time(pulses, first):
    rng = np.random.default_rng(6)
    time = 1e-3 * np.arange(24000)
    way = 100.0 * np.sin(0.9 * time) + 40.0 * np.sin(2.3 * time + 0.4)
    speed = np.gradient(way, time)
    force = 0.08 * np.gradient(speed, time) + 30.0 * np.tanh(speed / 0.5) + NOISE * rng.standard_normal(len(time))
    force += 4.0 * np.sin(2.0 * np.pi * way / 5.0)
    for begin in rng.permutation(np.arange(1000, 23000, 1500))[:pulses]:
        force[begin : begin + 200] += 20.0 * rng.choice([-1.0, 1.0])
    log = AxisRun(name="r", time=time, setpoint=way, encoder=way + 5e-4 * rng.standard_normal(len(time)), force=force)
    result = study({"x": [log]})
    covariates = [each.covariate for each in result.where.drivers]
    assert result.verdict == "unknown" and covariates[0] == first and "position:x" in covariates
    assert len(result.where.intervals) >= pulses
