"""The fit of a loop and the written machine file predict the same between the rows of a log."""

import numpy as np
import pytest

from camcomp.diagnosis.axis.effect_columns import DrivenAxis
from camcomp.diagnosis.axis.findings import AxisRun
from camcomp.diagnosis.axis.predicted import predict_encoders
from camcomp.diagnosis.fit.measured import Measured
from camcomp.ground import shelf
from camcomp.model.config.load import load_config
from camcomp.model.effect import Cause
from camcomp.model.statics.build import build_robot
from tests.commandline import ROOT

PERIOD_S, DAMPING, TURN = 0.04, 0.4, 2.0 * np.pi * 3.0


def both_predictions(step, cause, wanted):
    """Encoder minus set-point (n,) mm at rows `step` s apart: by the machine file, and by the fit."""
    config = load_config([ROOT / "config/cartesian.yaml"])
    robot, _ = build_robot(config.robot, config.tool.tip)
    t = np.arange(0.0, 4.0, step)
    nothing, n = np.full((len(t), 3), np.nan), len(t)
    asked = nothing.copy()
    asked[:, 0] = wanted(t)
    log = Measured(
        time=t, line=np.zeros(n), tip=nothing, setpoint=asked, encoder=asked, drive=nothing, load=nothing, dyno=nothing,
        temperature=np.full(n, np.nan), tip_sd=nothing,
    )  # fmt: skip
    axis = DrivenAxis(
        run=AxisRun(name="r", time=t, setpoint=wanted(t), encoder=wanted(t), force=np.full(n, np.nan)),
        actuator=robot.actuators[0], lever=1.0, weight=0 * t, inertia=0 * t,
    )  # fmt: skip
    return t, predict_encoders(robot, [cause], log, 0.0)[:, 0], -axis.channel("following", [cause])


def test_a_loop_swings_between_rows_alike_in_the_fit_and_in_the_file():
    effect = shelf.load("effects", "servo_overshoot")
    cause = Cause("servo_overshoot", effect, "x", {"period_ms": 1e3 * PERIOD_S, "damping": DAMPING})
    t, by_file, by_fit = both_predictions(0.01, cause, lambda t: 10.0 * np.sin(TURN * t))
    w = 2.0 * np.pi / PERIOD_S
    steady = 10.0 * TURN**2 * np.imag(np.exp(1j * TURN * t) / (w**2 - TURN**2 + 2j * DAMPING * w * TURN))
    settled = (t > 1.0) & (t < 3.9)
    assert np.nanmax(np.abs(by_file - by_fit)) < 1e-9
    assert np.abs(by_fit - steady)[settled].max() < 0.03 * np.abs(steady).max()  # curvature between rows


def test_rows_far_apart_are_taken_as_they_are():
    """A staircase of set-points every 0.1 s: a smooth way between its rows is none."""
    effect = shelf.load("effects", "speed_limit")
    cause = Cause("speed_limit", effect, "x", {"speed_mm_per_s": 20.0})
    _, by_file, by_fit = both_predictions(0.1, cause, lambda t: 10.0 * np.round(t / 0.8))
    seen = np.isfinite(by_file)
    assert seen.any() and np.ptp(by_fit) > 5.0
    assert by_file[seen] == pytest.approx(by_fit[seen], abs=1e-9)
