"""The friction of every healthy guide bends a drive farther that is softer than stated."""

import numpy as np
import pytest

from camcomp.diagnosis.experiment.open_experiment import open_experiment
from camcomp.diagnosis.fit.bench import Bench, CandidateCause, cause_of
from camcomp.diagnosis.fit.open_problem import open_problem
from camcomp.ground import shelf
from tests.validation.recorded.experiment import Made, Plan, row_times, write
from tests.validation.recorded.faults import Fault, Faults
from tests.validation.recorded.machines import MACHINES
from tests.validation.recorded.plant import Character, Run, observe
from tests.validation.recordings import recording

FACTOR, FRICTION_N = 0.12, 4.0


@pytest.fixture(scope="module")
def problem(tmp_path_factory):
    """Runs of the router in which the drive of y is soft, and its guide as it may be."""
    plan, names = (
        Plan(1, machine="router", rows=150, stated=True),
        ("circles-exact", "zigzag-blended", "circles-blended"),
    )
    runs = [Run(recording.load(name), True, 300.0 * i) for i, name in enumerate(names)]
    faults = Faults(
        (
            Fault("drive_stiffness", "y", {"factor": FACTOR}),
            Fault("friction", "y", {"force_N": FRICTION_N, "presliding_mm": 0.005}),
        )
    )
    rng, truth = np.random.default_rng(1), MACHINES["router"]
    states = [observe(truth, r, faults, Character(), row_times(r, plan, True, rng)) for r in runs]
    files = open_experiment(
        write(Made(runs, states, {"runs": [{} for _ in runs]}), plan, tmp_path_factory.mktemp("soft"))
    )
    causes = [
        CandidateCause(name, "y", shelf.load("effects", name)) for name in ("drive_stiffness", "backlash", "friction")
    ]
    return open_problem(Bench(twin=files.twin, runs=files.runs), causes, 0.003)


def test_a_small_force_moves_a_soft_drive_as_much_farther_as_it_is_softer(problem):
    f = problem.refit((0,))
    (friction,), (soft,), (play,) = (problem.candidates.columns[i] for i in (2, 0, 1))
    assert f.farther[friction] == pytest.approx(1.0 / FACTOR, rel=0.02)
    assert f.farther[soft] == f.farther[play] == 1.0
    push, bench = CandidateCause("friction", "y", problem.columns.candidates[2].effect), problem.bench
    causes = problem.causes(f.members, f.theta, f.extra)
    more = cause_of(push, {"force_N": 1.0, "presliding_mm": 0.005})
    at_soft = bench.change(0, bench.read(0, [*causes, more]), bench.read(0, causes))
    nominal = bench.change(0, bench.read(0, [more]), bench.nominal[0])
    assert np.linalg.norm(at_soft[:, 1]) == pytest.approx(f.farther[friction] * np.linalg.norm(nominal[:, 1]), rel=0.02)


def test_friction_within_tolerance_on_a_soft_drive_is_no_play(problem):
    value = problem.candidates.value
    assert value(problem.refit((0,))) > value(problem.refit((0, 1)))
