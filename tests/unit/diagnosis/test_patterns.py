"""Patterns of the covariates of a residual: runs need not have logged the same."""

from types import SimpleNamespace

import numpy as np

from camcomp.diagnosis.fit.patterns import dictionary
from camcomp.model.effect import Motion

ROWS = 50


def run(temperature):
    """One run of a drive that moves evenly, and its readings."""
    time = np.linspace(0.0, 5.0, ROWS)
    place = 10.0 * time[:, None]
    still = np.zeros_like(place)
    motion = Motion(
        time=time,
        common=time,
        cut_min=time,
        temperature=temperature,
        encoder=place,
        speed=still + 10.0,
        direction=still + 1.0,
        home=np.zeros(1),
        stiffness=np.full(1, np.inf),
        ordered=True,
    )
    measured = SimpleNamespace(has=lambda kind: kind == "tip")
    path = SimpleNamespace(time=time, ordered=True)
    reading = SimpleNamespace(
        tip=np.column_stack([place, still, still]), motion=motion, drive=still, dyno=np.zeros((ROWS, 3))
    )
    return SimpleNamespace(run_path=path, thin=1, measured=measured, by="encoder"), reading


def test_a_run_without_temperatures_says_nothing_of_them():
    runs, nominal = zip(run(np.linspace(20.0, 25.0, ROWS)), run(None), strict=True)
    parts = {"tip": slice(0, 3), "encoder": slice(3, 4), "drive": slice(4, 5), "dyno": slice(5, 8)}
    tip = dictionary(SimpleNamespace(runs=runs, nominal=nominal, actuators=("x",), parts=parts))
    warm = [n for n, label in enumerate(tip.labels) if label.startswith("temperature")]
    assert warm
    assert np.abs(tip.blocks[0][:, warm]).max() > 0.0
    assert np.abs(tip.blocks[1][:, warm]).max() == 0.0
