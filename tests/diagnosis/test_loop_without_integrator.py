"""A hinge whose loop has no integrator: friction and weight deflect it, and it follows their changes as late as its set-points.

The plant integrates Newton's equation of a pendulum with a position and a speed controller; it imports nothing of camcomp.
"""

import json

import numpy as np
import pytest

from camcomp.diagnosis.axis.effect_columns import DrivenAxis
from camcomp.diagnosis.axis.findings import AxisRun
from camcomp.ground import shelf
from camcomp.model import signal_path
from camcomp.model.effect import Cause, Motion
from camcomp.model.law.law import EmpiricalLaw
from camcomp.model.statics.description import Actuator
from tests.validation import runner

KP, KV, INERTIA = 20.0, 60.0, 1.5  # 1/s, N m s/rad, kg m2
COULOMB, VISCOUS, WEIGHT = 4.0, 4.0, 15.0  # N m, N m s/rad, N m
ARM = {
    "robot": {"name": "rig", "type": "serial", "convention": "dh", "joints": [{"name": "q", "a_mm": 500}]},
    "tool": {"length_mm": 0},
    "workpiece": {"origin_mm": [500, 0, 0]},
}


def driven(rng, until=16.0, step=0.001):
    """Times, set-points, encoders and torques (n, 4) in s, rad and N mm, at 250 Hz."""
    t = np.arange(0.0, until, step)
    x = sum(rng.uniform(0.2, 0.5) / k * np.sin(0.8 * k * t + rng.uniform(0.0, 6.0)) for k in range(1, 5))
    q, w, rows = x[0], 0.0, np.zeros((len(t), 2))
    for i, asked in enumerate(x):
        torque = KV * (KP * (asked - q) - w)
        w += step * (torque - COULOMB * np.tanh(w / 0.01) - VISCOUS * w - WEIGHT * np.sin(q + 0.4)) / INERTIA
        q += step * w
        rows[i] = q, 1e3 * torque
    return np.column_stack([t, x, rows + rng.standard_normal(rows.shape) * [2e-6, 50.0]])[::4]


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    folder, rng = tmp_path_factory.mktemp("rig"), np.random.default_rng(4)
    (folder / "rig.yaml").write_text(json.dumps(ARM))
    runs = []
    for name in ("a", "b", "c"):
        header = "t_s,cmd_q_rad,act_q_rad,act_q_Nmm"
        np.savetxt(folder / f"{name}.csv", driven(rng), fmt="%.8g", delimiter=",", comments="", header=header)
        runs.append({"name": name, "log": f"{name}.csv", "cutting": False})
    (folder / "e.yaml").write_text(json.dumps({"config": ["rig.yaml"], "runs": runs, "holdout": ["c"]}))
    return {cause["effect"]: cause for cause in runner.ask(folder / "e.yaml")["causes"]}


def test_the_lag_of_the_loop_is_that_of_its_gains(found):
    lag, want = found["servo_lag"], 1e3 * (1.0 + VISCOUS / KV) / KP
    assert lag["probability"] > 0.75  # weight deflects the loop, which is no effect of the library
    assert lag["parameters"]["time_constant_ms"]["value"] == pytest.approx(want, rel=0.02)


def test_friction_is_that_of_the_torque(found):
    own = found["friction"]["parameters"]
    assert own["force_Nmm"]["value"] == pytest.approx(1e3 * COULOMB, rel=0.01)
    assert own["viscous_Nmms_per_rad"]["value"] == pytest.approx(1e3 * VISCOUS, rel=0.02)


def encoders(names):
    """Encoders of a step by a lag of 50 ms, and a constant push of 1 mm, in the order of the machine file."""
    time, one = np.arange(0.0, 0.5, 0.001), np.ones(1)
    push = EmpiricalLaw(on="control", shape=_Step(), envelope={})
    values = {"servo_lag": {"time_constant_ms": 50.0}, "formula": {"law": push}}
    zero = np.zeros((len(time), 1))
    motion = Motion(
        time=time, common=time, cut_min=time, temperature=None, encoder=zero, speed=zero, direction=zero, home=0.0 * one,
        stiffness=one,
    )  # fmt: skip
    causes = [Cause(name, shelf.load("effects", name), "x", values[name]) for name in names]
    return time, signal_path.controlled(causes, ("x",), motion)[:, 0]


class _Step:
    names = ("followed_mm", "t_s")

    def __call__(self, rows, n):
        return (rows["t_s"] > 0.1).astype(float)


def test_a_push_on_a_loop_is_followed_as_late_as_its_set_points():
    time, late = encoders(("servo_lag", "formula"))
    assert late == pytest.approx(np.where(time > 0.1, 1.0 - np.exp(-(time - 0.1) / 0.05), 0.0), abs=0.02)
    assert encoders(("formula",))[1] == pytest.approx((time > 0.1).astype(float))


def test_a_lag_that_the_machine_file_has_delays_pushes_as_one_that_is_found_does():
    time = np.arange(0.0, 2.0, 0.001)
    rest = np.zeros(len(time))
    stated = Cause("servo_lag", shelf.load("effects", "servo_lag"), "x", {"time_constant_ms": 50.0})
    run = AxisRun(name="a", time=time, setpoint=rest, encoder=rest, force=rest, stated=(stated,))
    slide = Actuator(name="x", revolute=False, axis=np.array([1.0, 0.0, 0.0]), stiffness=None)
    axis = DrivenAxis(run=run, actuator=slide, lever=1.0, weight=rest, inertia=rest)
    late = axis.deflected(time, (time > 1.0)[:, None].astype(float), ())[:, 0]
    assert late == pytest.approx(np.where(time > 1.0, 1.0 - np.exp(-(time - 1.0) / 0.05), 0.0), abs=0.03)
