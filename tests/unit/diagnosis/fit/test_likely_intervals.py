"""The interval of a temporary effect, from a residual with correlated noise."""

from types import SimpleNamespace

import numpy as np
import pytest

from camcomp.diagnosis.fit.intervals_in_time import likely_interval

ROWS, STEP_S, BEGAN, OVER = 800, 0.01, 150, 420
CANDIDATE = SimpleNamespace(
    shapes=(SimpleNamespace(name="from_s"), SimpleNamespace(name="to_s")), effect=SimpleNamespace(RISE_S=0.005)
)


def found_in(left):
    """The interval of a run with rows left (n,) of one channel, in which a constant explains most."""
    path = SimpleNamespace(started=5.0, ordered=True)
    bench = SimpleNamespace(runs=[SimpleNamespace(run_path=path)])
    return likely_interval(bench, CANDIDATE, [np.ones((ROWS, 1, 1))], [left[:, None]], [STEP_S * np.arange(ROWS)])


def noise(seed, memory):
    """White noise of size 0.7 and a slow part of size 0.7 with memory."""
    rng = np.random.default_rng(seed)
    white, drawn = rng.normal(0.0, 0.7, (2, ROWS))
    for n in range(1, ROWS):
        drawn[n] = memory * drawn[n - 1] + np.sqrt(1.0 - memory**2) * drawn[n]
    return white + drawn


@pytest.mark.parametrize("memory", [0.0, 0.5, 0.99, 0.999])
def test_begin_and_end_are_found_whatever_memory_the_noise_has(memory):
    """Of a shift of forty units, sixty times the noise."""
    at = np.arange(ROWS)
    found = found_in(np.where((at >= BEGAN) & (at < OVER), 40.0, 0.0) + noise(3, memory))
    assert found["from_s"] == pytest.approx(5.0 + STEP_S * BEGAN, abs=1.5 * STEP_S)
    assert found["to_s"] == pytest.approx(5.0 + STEP_S * OVER, abs=1.5 * STEP_S)


def test_noise_alone_has_none():
    assert found_in(noise(4, 0.0)) is None
