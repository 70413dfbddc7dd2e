"""Logs whose rows were not read when they say: noise that grows with the speed is noise."""

from dataclasses import replace

import pytest

from camcomp.diagnosis.experiment.open_experiment import open_experiment
from camcomp.diagnosis.fit.bench import Bench
from camcomp.diagnosis.fit.noise import jitter
from tests.diagnosis.conftest import plan_of


@pytest.mark.parametrize("unsteady", [pytest.param(3e-4, marks=pytest.mark.campaign), 1e-3])
def test_jitter_is_measured(workshop, unsteady):
    plan = plan_of(design="six", samples=250)
    plan = replace(plan, noise=replace(plan.noise, jitter_s=unsteady))
    campaign = open_experiment(workshop.made(plan)[0])
    assert jitter(Bench(twin=campaign.twin, runs=campaign.runs)) == pytest.approx(unsteady, rel=0.35)


@pytest.mark.campaign
def test_jitter_is_no_effect(workshop):
    plan = plan_of(design="six", samples=250)
    plan = replace(plan, noise=replace(plan.noise, jitter_s=3e-4))
    assert workshop.answer(plan)[0]["verdict"] == "none"
