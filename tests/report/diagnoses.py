"""Results and runs made up for reports, with known answers."""

import numpy as np

from camcomp.diagnosis.report.run_view import RunView
from camcomp.diagnosis.result.types import DiagnosisResult


def run_view(name, held_out, *, size=20.0, left=2.0, seed=0, frequency=0.5):
    """A circle of 25 mm in 20 s whose gap in x swings with `frequency` Hz; noise in all channels."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0, 20, 1001)
    angle = 2 * np.pi * t / 20
    position = np.column_stack((25 * np.cos(angle), 25 * np.sin(angle), np.zeros_like(t)))
    noise = rng.normal(0, 0.5, (len(t), 3))
    swing = np.column_stack((np.sin(2 * np.pi * frequency * t), *np.zeros((2, len(t)))))
    channels = ("tip x", "tip y", "tip z")
    return RunView(
        name=name,
        held_out=held_out,
        time=t,
        position=position,
        before=size * swing + noise,
        after=left * swing + noise,
        channels=channels,
    )


def cause(effect, target, probability, share, **parameters):
    values = {name: {"value": v, "ci95": [0.9 * v, 1.1 * v]} for name, v in parameters.items()}
    return {"effect": effect, "target": target, "probability": probability, "share": share, "parameters": values}


BACKLASH = cause("backlash", "x", 0.97, 0.9, width_mm=0.0213)
GRAVITY = cause("gravity", None, 0.91, 0.1, weight_N=12.5)
UNKNOWN = {"effect": "unknown", "target": "y", "probability": 0.999, "share": 0.4, "parameters": {}}


def result(verdict):
    """A result with this verdict."""
    causes = {"none": [], "identified": [BACKLASH, GRAVITY], "ambiguous": [BACKLASH], "unknown": [GRAVITY, UNKNOWN]}[
        verdict
    ]
    steps = [
        {"effect": each["effect"], "target": each["target"], "after_rms_um": 14.1 / (4 * k)}
        for k, each in enumerate((each for each in causes if each["effect"] != "unknown"), 1)
    ]
    after = steps[-1]["after_rms_um"] if steps else 14.1
    sets = [
        [{"effect": "backlash", "target": "x"}],
        [{"effect": "friction", "target": "x"}, {"effect": "gravity", "target": None}],
    ]
    return DiagnosisResult.model_validate({
        "verdict": verdict,
        "gap": {"rms_um": 14.1, "p95_um": 19.8, "max_um": 21.3, "noise_floor_um": 0.87},
        "where": {
            "stage": "drive",
            "axes": {"x": 0.93, "y": 0.05, "z": 0.02},
            "actuators": {"x": 0.9, "y": 0.06, "z": 0.04},
            "lines": [{"run": "a", "line": 8, "share": 0.6, "rms_um": 15.0}, {"run": "a", "line": 9, "share": 0.3, "rms_um": 11.0}],
            "intervals": [{"run": "a", "t0_s": 1.2, "t1_s": 4.0, "share": 0.2}],
            "drivers": [{"covariate": "reversal:x", "share": 0.8}, {"covariate": "velocity:y", "share": 0.1}],
        },
        "causes": causes,
        "alternatives": sets if verdict == "ambiguous" else [],
        "shrinkage": {
            "holdout": ["a", "b"], "before_rms_um": 14.1, "after_rms_um": after, "ratio": round(1 - after / 14.1, 4),
            "ci95": [0.7, 0.9], "steps": steps,
        },
        "next_experiment": None
        if verdict in ("none", "identified")
        else {"action": "Mill the circle in air at 2000 mm/min.", "separates": ["backlash(x)", "friction(x)"], "gain": 0.83},
        "floor": {"um": 0.87, "source": "rows"},
    })  # fmt: skip


def views():
    """Two held-out runs and one of the fit."""
    return [
        run_view("a", True),
        run_view("b", True, size=30.0, seed=1, frequency=1.25),
        run_view("c", False, size=90.0, seed=2),
    ]
