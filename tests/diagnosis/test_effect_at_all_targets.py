"""An effect at all of its targets is found."""

import numpy as np
import pytest

from camcomp.diagnosis.experiment.open_experiment import open_experiment
from camcomp.diagnosis.fit.bench import Bench, CandidateCause
from camcomp.diagnosis.fit.open_problem import open_problem
from camcomp.diagnosis.search import cause_search
from camcomp.ground import shelf
from tests.validation.recorded.experiment import Made, Plan, row_times, write
from tests.validation.recorded.faults import Fault, Faults
from tests.validation.recorded.machines import MACHINES
from tests.validation.recorded.plant import Character, Run, observe
from tests.validation.recordings import recording

SPRINGS = (0, 1, 2)


@pytest.fixture
def problem(tmp_path):
    """Two runs of the router with three soft drives."""
    plan, machine = Plan(1, machine="router", rows=80, stated=True), MACHINES["router"]
    runs = [Run(recording.load(name), True, 300.0 * k) for k, name in enumerate(("circles-exact", "zigzag-blended"))]
    faults = Faults(tuple(Fault("drive_stiffness", axis, {"factor": 0.5}) for axis in "xyz"))
    rng = np.random.default_rng(1)
    states = [observe(machine, r, faults, Character(), row_times(r, plan, True, rng)) for r in runs]
    files = open_experiment(write(Made(runs, states, {"runs": [{} for _ in runs]}), plan, tmp_path))
    causes = [
        CandidateCause(name, axis, shelf.load("effects", name))
        for name in ("drive_stiffness", "screw_pitch")
        for axis in "xyz"
    ]
    return open_problem(Bench(twin=files.twin, runs=files.runs), causes, 0.003)


def test_springs_of_all_drives_are_fitted_together(problem):
    assert SPRINGS in {f.members for f in cause_search.search_causes(problem).sets.fits}
