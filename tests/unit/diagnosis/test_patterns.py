"""Patterns of the covariates of a residual: runs need not have logged the same."""

import numpy as np

from camcomp.diagnosis.fit.patterns import Ground, dictionary
from camcomp.model.effect import Motion

ROWS = 50


def ground(temperature):
    """One run of a drive that moves evenly."""
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
    tip = np.column_stack([place, still, still])
    measured = {"tip": True, "encoder": False, "drive": False, "dyno": False}
    return Ground(
        motion=motion,
        drive=still,
        force=np.zeros((ROWS, 3)),
        tip=tip,
        velocity=np.gradient(tip, time, axis=0),
        present=measured,
    )


def test_a_run_without_temperatures_says_nothing_of_them():
    tip = dictionary([ground(np.linspace(20.0, 25.0, ROWS)), ground(None)], ["x"])
    warm = [n for n, label in enumerate(tip.labels) if label.startswith("temperature")]
    assert warm
    assert np.abs(tip.blocks[0][:, warm]).max() > 0.0
    assert np.abs(tip.blocks[1][:, warm]).max() == 0.0
