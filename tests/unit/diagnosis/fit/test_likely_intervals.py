"""The interval of a temporary effect, from a residual with correlated noise."""

from types import SimpleNamespace

import numpy as np
import pytest

from camcomp.diagnosis.fit.intervals_in_time import likely_intervals
from camcomp.diagnosis.statistics.by_channel import ByChannel

ROWS, STEP_S, BEGAN, OVER = 800, 0.01, 150, 420
CANDIDATE = SimpleNamespace(
    shapes=(SimpleNamespace(name="from_s"), SimpleNamespace(name="to_s")), effect=SimpleNamespace(RISE_S=0.005)
)


def filtered(values, memory, gain):
    """Rows minus their prediction from earlier rows."""
    expected, out = 0.0, []
    for value in values:
        out.append(value - expected)
        expected = memory * (expected + gain * out[-1])
    return np.array(out)


@pytest.mark.parametrize(("memory", "gain"), [(0.0, 0.0), (0.5, 1.0), (0.99, 0.3), (0.999, 0.1)])
def test_begin_and_end_are_among_what_is_likely_whatever_memory_the_noise_has(memory, gain):
    """Of a shift of forty units, sixty times the noise."""
    at = np.arange(ROWS)
    shift = np.where((at >= BEGAN) & (at < OVER), 40.0, 0.0) + np.random.default_rng(3).normal(0.0, 0.7, ROWS)
    always = ByChannel(1, ((np.arange(1), filtered(np.ones(ROWS), memory, gain)[:, None]),))
    path = SimpleNamespace(started=5.0, time=STEP_S * at)
    bench = SimpleNamespace(runs=[SimpleNamespace(run_path=path)])
    rest = filtered(shift, memory, gain)
    found = likely_intervals(bench, CANDIDATE, [always], [rest], lambda k: np.linspace(0.0, 1.0, ROWS))
    off = [max(abs(each["from_s"] - 5.0 - STEP_S * BEGAN), abs(each["to_s"] - 5.0 - STEP_S * OVER)) for each in found]
    assert min(off) < 1.5 * STEP_S


def test_noise_alone_has_none():
    path = SimpleNamespace(started=0.0, time=STEP_S * np.arange(ROWS))
    bench = SimpleNamespace(runs=[SimpleNamespace(run_path=path)])
    always = ByChannel(1, ((np.arange(1), np.ones((ROWS, 1))),))
    rest = np.random.default_rng(4).normal(0.0, 1.0, ROWS)
    assert likely_intervals(bench, CANDIDATE, [always], [rest], lambda k: np.linspace(0.0, 1.0, ROWS)) == []
