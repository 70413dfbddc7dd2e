"""A slide whose speed controller has an integrator: friction deflects the loop for a while at every turn-round, no longer.

The plant integrates Newton's equation of a carriage with a P controller of the position and a PI controller of the speed; it
imports nothing of camcomp. No drive forces are logged, so that the friction shows in the encoder alone.
"""

import json

import numpy as np
import pytest

from tests.validation import runner

KP, KV, KI = 30.0, 300.0, 25.0  # 1/s: position loop, speed loop, inverse of its integral time
COULOMB, TURNS = 2e3, 0.1  # mm/s2: friction by the mass; mm/s: speed about which it turns round
SLIDE = {"name": "x", "type": "actuator", "joint": "prismatic", "axis": "x", "stiffness_N_per_mm": 2e4}
MACHINE = {
    "robot": {"name": "slide", "chains": {"x": {"elements": [SLIDE]}}},
    "tool": {"length_mm": 0},
    "workpiece": {"origin_mm": [0, 0, 0]},
}


def driven(rng, until=20.0, step=2.5e-4):
    """Times, set-points and encoders (n, 3) in s and mm, at 100 Hz."""
    t = np.arange(0.0, until, step)
    x = sum(rng.uniform(4.0, 12.0) / k * np.sin(1.3 * k * t + rng.uniform(0.0, 6.0)) for k in range(1, 5))
    place, speed, integral, rows = x[0], (x[1] - x[0]) / step, 0.0, np.zeros(len(t))
    for i, asked in enumerate(x):
        error = KP * (asked - place) - speed
        integral += step * KI * error
        speed += step * (KV * (error + integral) - COULOMB * np.tanh(speed / TURNS))
        place += step * speed
        rows[i] = place
    return np.column_stack([t, x, rows + rng.normal(0.0, 3e-4, len(t))])[400::40]


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    folder, rng = tmp_path_factory.mktemp("slide"), np.random.default_rng(2)
    (folder / "slide.yaml").write_text(json.dumps(MACHINE))
    runs = []
    for name in ("a", "b", "c"):
        header = "t_s,cmd_x_mm,act_x_mm"
        np.savetxt(folder / f"{name}.csv", driven(rng), fmt="%.6f", delimiter=",", comments="", header=header)
        runs.append({"name": name, "log": f"{name}.csv", "cutting": False})
    (folder / "e.yaml").write_text(json.dumps({"config": ["slide.yaml"], "runs": runs, "holdout": ["c"]}))
    return runner.ask(folder / "e.yaml")


def test_what_the_integrator_takes_over_is_no_longer_there(found):
    moved = found["shrinkage"]
    assert moved["after_rms_um"] < 0.02 * moved["before_rms_um"]


def test_the_lag_is_that_of_the_position_loop(found):
    lag = next(c for c in found["causes"] if c["effect"] == "servo_lag")
    assert lag["probability"] > 0.5
    assert lag["parameters"]["time_constant_ms"]["value"] == pytest.approx(1e3 / KP, rel=0.02)
