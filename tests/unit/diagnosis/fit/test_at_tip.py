"""How far the tip moves per unit of a channel."""

import numpy as np
import pytest

from camcomp.diagnosis.experiment.open_experiment import open_experiment
from camcomp.diagnosis.fit.bench import Bench
from camcomp.ground import shelf
from camcomp.ground.files import shipped
from camcomp.model.effect import Cause


def test_a_force_on_the_tool_moves_the_tip_as_a_larger_cutting_force_does():
    """The tool is 100 mm long: the moment of the force moves the tip as far as the force itself."""
    opened = open_experiment(str(shipped("samples/diagnosis/ambiguous/experiment.yaml")))
    bench = Bench(twin=opened.twin, runs=opened.runs[:1])
    larger = Cause("cutting_force", shelf.load("effects", "cutting_force"), None, {"factor": 1.001})
    after, before = bench.read(0, [larger]), bench.nominal[0]
    moved = np.einsum("nij,nj->ni", bench.at_tip(0)[:, :, -3:], after.dyno - before.dyno) @ opened.twin.rotation
    assert np.abs(moved).max() > 1e-4
    assert moved == pytest.approx(after.tip - before.tip, abs=1e-9)
