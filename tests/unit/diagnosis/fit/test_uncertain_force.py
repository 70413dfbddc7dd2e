"""By how much the tip of a machine that cuts is less certain than its instrument: by a share of what the force does to it."""

import numpy as np
import pytest

from camcomp.diagnosis.experiment.open_experiment import open_experiment
from camcomp.diagnosis.fit import noise
from camcomp.diagnosis.fit.bench import Bench, CandidateCause, cause_of
from camcomp.ground import shelf
from tests.diagnosis.shipped import AIR, PROGRAMS, experiment

CUTS, AIRY = list(PROGRAMS).index("left"), list(PROGRAMS).index(AIR)


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    opened = open_experiment(experiment(tmp_path_factory.mktemp("orthoglide"), "orthoglide", None))
    return Bench(opened.twin, opened.runs)


def more_than_without(bench, monkeypatch):
    """What the share adds to every channel, per run (n, c): standard deviations."""
    whole = noise.inflation(bench)
    monkeypatch.setattr(noise, "FORCE_SHARE", 0.0)
    return [np.sqrt(np.maximum(a**2 - b**2, 0.0)) for a, b in zip(whole, noise.inflation(bench), strict=True)]


def test_it_is_a_share_of_the_deflection_where_the_machine_cuts(bench, monkeypatch):
    """Every component of the force errs by itself: three of them by a share of the whole move the tip by no less than it."""
    change = cause_of(
        CandidateCause("cutting_force", None, shelf.load("effects", "cutting_force")), {"factor": 0.01}
    )  # a logarithm
    by_force = bench.change(CUTS, bench.read(CUTS, [change]), bench.nominal[CUTS])[:, :3]
    moved = np.linalg.norm(by_force, axis=1) * noise.FORCE_SHARE / 0.01
    more = np.linalg.norm(more_than_without(bench, monkeypatch)[CUTS][:, :3], axis=1)
    cutting = np.isfinite(more) & (moved > 0.5 * np.nanmax(moved))
    assert cutting.mean() > 0.3
    assert np.all(more[cutting] > 0.99 * moved[cutting])
    assert np.all(more[cutting] < 3.0 * moved[cutting])


def test_nothing_is_added_in_the_air_and_to_no_other_channel(bench, monkeypatch):
    more = more_than_without(bench, monkeypatch)
    assert np.nanmax(more[AIRY]) == 0.0
    assert np.nanmax(more[CUTS][:, 3:]) == 0.0
