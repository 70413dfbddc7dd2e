"""Loops that are late against the rows of a log: rows further apart than moves accelerate, logs that begin amid a move."""

import numpy as np
import pytest

from camcomp.diagnosis.axis.findings import AxisRun
from camcomp.diagnosis.axis.noise_floor import between_rows
from tests.studies import axis_study

STEP_S = 0.1  # between rows
FINE_S = 1e-3


def moves(rng, seconds, every_s):
    """Set-points (n,) mm every FINE_S of lines at speeds up to 20 mm/s with 150 mm/s2, one in `every_s`."""
    speed, each = np.zeros(round(seconds / FINE_S)), round(every_s / FINE_S)
    for start in range(0, len(speed), each):
        speed[start : start + rng.integers(each // 3, each)] = rng.uniform(-20.0, 20.0)
    for k in range(1, len(speed)):
        speed[k] = speed[k - 1] + np.clip(speed[k] - speed[k - 1], -150 * FINE_S, 150 * FINE_S)
    return np.cumsum(speed) * FINE_S


def followed(setpoint, late):
    """A loop of first order behind set-points (n,) mm that go straight within a fine step: how far it is behind, exactly."""
    keep, behind, out = np.exp(-FINE_S / late), 0.0, [0.0]
    for speed in np.diff(setpoint) / FINE_S:
        behind = keep * behind + (1.0 - keep) * late * speed
        out.append(behind)
    return setpoint - np.array(out)


def seen(values):
    """What a log says every STEP_S, rounded to 1 um."""
    return np.round(values[:: round(STEP_S / FINE_S)], 3)


def test_what_a_straight_line_between_rows_misses_is_expected_at_its_size():
    rng, late = np.random.default_rng(1), 0.03
    setpoint = moves(rng, 120.0, 1.0)
    rows = setpoint[:: round(STEP_S / FINE_S)]
    straight = np.interp(np.arange(len(setpoint)) * FINE_S, np.arange(len(rows)) * STEP_S, rows)
    off = seen(followed(setpoint, late)) - seen(followed(straight, late))
    expected = np.abs(between_rows(np.arange(len(rows)) * STEP_S, rows, late)).max(axis=1)
    for low, high in ((2e-3, 2e-2), (2e-2, 5e-2), (5e-2, 1.0)):
        rows = (expected > low) & (expected < high)
        assert rows.sum() > 100
        assert 0.4 < np.sqrt(np.mean((off[rows] / expected[rows]) ** 2)) < 1.5
    assert np.sqrt(np.mean(off[expected < 2e-3] ** 2)) < 1e-3


def test_a_lag_is_named_alone_with_its_time_constant():
    runs, late = [], 0.036
    for k in range(3):
        setpoint = moves(np.random.default_rng(10 + k), 100.0, 4.0)
        asked, moved = seen(setpoint), seen(followed(setpoint, late))
        time = np.arange(len(asked)) * STEP_S
        runs.append(AxisRun(name=f"r{k}", time=time, setpoint=asked, encoder=moved, force=np.full(len(asked), np.nan)))
    result = axis_study({"x": runs})
    assert result.verdict == "identified"
    (cause,) = result.causes
    assert cause.effect == "servo_lag"
    found = cause.parameters["time_constant_ms"]
    assert found.value == pytest.approx(1e3 * late, rel=0.02) and found.ci95[0] < 1e3 * late < found.ci95[1]
    assert result.shrinkage.holdout == ("r0", "r1", "r2") and result.shrinkage.ratio > 0.85


def test_a_log_that_begins_amid_a_move_of_a_slow_loop_is_explained_by_its_lag():
    """What the loop remembers of the time before the log is no cause; 0.3 s are behind joints of arms, not only 0.1 s."""
    late, before = 0.3, 5.0
    time = np.arange(0.0, 40.0, FINE_S)
    setpoint = 60.0 * np.sin(0.9 * time) + 25.0 * np.sin(2.3 * time + 0.4)
    on = np.arange(round(before / FINE_S), len(time), 10)
    moved = followed(setpoint, late)[on] + 1e-3 * np.random.default_rng(4).standard_normal(len(on))
    run = AxisRun(name="r", time=time[on], setpoint=setpoint[on], encoder=moved, force=np.full(len(on), np.nan))
    result = axis_study({"x": [run]})
    (cause,) = result.causes
    assert (result.verdict, cause.effect) == ("identified", "servo_lag")
    assert cause.parameters["time_constant_ms"].value == pytest.approx(1e3 * late, rel=1e-3)
