"""A loop is followed between the rows of a log, where positions go on smoothly."""

import numpy as np
import pytest

from camcomp.diagnosis.axis.effect_columns import DrivenAxis
from camcomp.diagnosis.axis.findings import AxisRun
from camcomp.ground import shelf
from camcomp.model.config.load import load_config
from camcomp.model.effect import Cause
from camcomp.model.statics.build import build_robot
from tests.commandline import ROOT

PERIOD_S, DAMPING, TURN = 0.04, 0.4, 2.0 * np.pi * 3.0


def predicted(step, cause, wanted):
    """Encoder minus set-point (n,) mm at rows `step` s apart."""
    config = load_config([ROOT / "config/cartesian.yaml"])
    robot, _ = build_robot(config.robot, config.tool.tip)
    t = np.arange(0.0, 4.0, step)
    axis = DrivenAxis(
        run=AxisRun(name="r", time=t, setpoint=wanted(t), encoder=wanted(t), force=np.full(len(t), np.nan)),
        actuator=robot.actuators[0], lever=1.0, weight=0 * t, inertia=0 * t,
    )  # fmt: skip
    return t, -axis.channel("following", [cause])


def test_a_loop_swings_between_rows():
    effect = shelf.load("effects", "servo_overshoot")
    cause = Cause("servo_overshoot", effect, "x", {"period_ms": 1e3 * PERIOD_S, "damping": DAMPING})
    t, found = predicted(0.01, cause, lambda t: 10.0 * np.sin(TURN * t))
    w = 2.0 * np.pi / PERIOD_S
    steady = 10.0 * TURN**2 * np.imag(np.exp(1j * TURN * t) / (w**2 - TURN**2 + 2j * DAMPING * w * TURN))
    settled = (t > 1.0) & (t < 3.9)
    assert np.abs(found - steady)[settled].max() < 0.03 * np.abs(steady).max()  # curvature between rows


def test_rows_far_apart_are_taken_as_they_are():
    """A staircase of set-points of 10 mm every 0.8 s, at 20 mm/s: rows 0.1 s apart are 2 mm apart, and no smooth way leads between them."""
    effect = shelf.load("effects", "speed_limit")
    cause = Cause("speed_limit", effect, "x", {"speed_mm_per_s": 20.0})
    t, found = predicted(0.1, cause, lambda t: 10.0 * np.round(t / 0.8))
    asked = 10.0 * np.round(t / 0.8)
    at = [asked[0]]
    for target in asked[1:]:
        at.append(at[-1] + np.clip(target - at[-1], -2.0, 2.0))
    assert found == pytest.approx(np.array(at) - asked, abs=1e-6)
