"""A loop that is late makes the force late where no encoder says when it was: with a clock that is off, too."""

import numpy as np

from camcomp.diagnosis.experiment.open_experiment import open_experiment
from camcomp.diagnosis.fit.bench import Bench
from camcomp.ground import shelf
from camcomp.model.effect import Cause
from tests.diagnosis.test_worn_before_the_log import opened


def cause(name, **values):
    return Cause(name, shelf.load("effects", name), None, values)


def test_a_clock_that_is_off_by_nothing_changes_nothing_beside_a_lag(tmp_path):
    opened(tmp_path / "e", 0.0, without=("act_",))
    found = open_experiment(tmp_path / "e" / "experiment.yaml")
    assert found.runs[0].run_path.told
    bench = Bench(twin=found.twin, runs=found.runs)
    lag = cause("servo_lag", time_constant_ms=5.0)
    alone = bench.read(0, [lag])
    both = bench.read(0, [lag, cause("time_sync", offset_s=1e-9)])
    plain = bench.read(0, [])
    apart = np.abs(both.tip - alone.tip).max(axis=1)
    assert (apart < 1e-5).mean() > 0.99  # but for rows at a jump of the force, which has a side
    assert np.abs(alone.dyno - plain.dyno).max() > 1.0  # N
