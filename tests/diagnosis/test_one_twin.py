"""One forward model: what diagnose reads off its slopes is what simulate solves, also for causes that act on each other."""

import numpy as np
import pytest

from camcomp.diagnosis.experiment.open_experiment import open_experiment
from camcomp.diagnosis.fit.bench import Bench
from camcomp.ground import shelf
from camcomp.model.effect import Cause
from tests.diagnosis.conftest import plan_of

PLAN = plan_of(("servo_lag", None), design="both-ways", channels="tip", ratio=6.0)  # the one of test_equal


def cause(effect, target, **values):
    module = shelf.load("effects", effect)
    return Cause(effect, module, target, {p.name: p.nominal for p in module.PARAMETERS} | values)


TOGETHER = {
    "soft drive, strong cut": [cause("drive_stiffness", "y", factor=0.25), cause("cutting_force", None, factor=1.3)],
    "soft links, heavy head": [cause("link_stiffness", None, factor=0.7), cause("gravity", None, weight_N=100.0)],
    "soft drive, friction": [cause("drive_stiffness", "x", factor=0.5), cause("friction", "x", force_N=60.0)],
    "rolled chain, worn tool": [cause("chain_error", "z", roll_deg=0.5), cause("tool_wear", None, growth_per_min=1.0)],
    "long link, wrong home": [cause("link_length", "y", length_mm=0.1), cause("joint_offset", "x", offset_mm=0.1)],
}


@pytest.fixture(scope="module")
def bench(workshop):
    campaign = open_experiment(workshop.made(PLAN)[0])
    return Bench(twin=campaign.twin, runs=campaign.runs[:1])


@pytest.mark.parametrize("name", TOGETHER)
def test_the_slopes_agree_with_the_solution(bench, name):
    twin, run_path, causes = bench.twin, bench.runs[0].run_path, TOGETHER[name]
    _, solved = twin.sense(run_path, causes)
    exact, _ = twin.sense(run_path, causes, solved=solved, slopes=twin.slopes(run_path, causes, solved))
    quick = bench.read(0, causes)
    assert np.abs(exact.tip - bench.nominal[0].tip).max() > 0.005
    assert np.linalg.norm(quick.tip - exact.tip, axis=1).max() < 0.5e-3
    assert np.abs(quick.drive - exact.drive).max() < 0.5


def test_friction_winds_up_the_spring_that_the_drive_really_has(bench):

    def strayed(*causes):
        rubbed = bench.read(0, [*causes, cause("friction", "x", force_N=60.0)])
        return np.linalg.norm(rubbed.tip - bench.read(0, causes).tip, axis=1)

    stiff, soft = strayed(), strayed(cause("drive_stiffness", "x", factor=0.5))
    moving = stiff > 0.8 * stiff.max()
    assert np.median(soft[moving] / stiff[moving]) == pytest.approx(2.0, rel=0.05)
