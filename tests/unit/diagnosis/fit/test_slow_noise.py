"""The slow noise of instruments: a dynamometer that shakes with the teeth drifts no more for it."""

from types import SimpleNamespace

import numpy as np
import pytest

from camcomp.diagnosis.fit.noise import instrument_noise

AIR_N, CUT_N = 2.0, 20.0


@pytest.mark.parametrize("air", [True, False])
def test_a_dynamometer_drifts_as_much_as_it_scatters_where_nothing_is_cut(air):
    rng = np.random.default_rng(5)
    runs = [CUT_N, AIR_N if air else CUT_N, CUT_N]
    gaps = [np.column_stack([rng.normal(0.0, 3e-3, (400, 3)), rng.normal(0.0, size, (400, 1))]) for size in runs]
    path = SimpleNamespace(ordered=True)
    bench = SimpleNamespace(runs=[SimpleNamespace(run_path=path)] * 3, residual=lambda k: gaps[k])
    floor = SimpleNamespace(fast=np.array([3e-3, 3e-3, 3e-3, CUT_N]), slow_mm=1e-3)
    noise = instrument_noise(bench, floor, np.full(4, 1e-6), [0.03 * np.arange(400)] * 3)
    whole = noise.sigma[0, 3] ** 2
    assert np.sqrt(noise.slow[0, 3] * whole) == pytest.approx(AIR_N if air else CUT_N, rel=0.15)
    assert np.sqrt((1.0 - noise.slow[0, 3]) * whole) == pytest.approx(CUT_N, rel=0.15)
    assert np.sqrt(noise.slow[0, 0]) * noise.sigma[0, 0] == pytest.approx(floor.slow_mm, rel=0.01)


def test_an_encoder_that_stands_in_one_run_drifts_in_the_others_as_before():
    rng = np.random.default_rng(6)
    gaps = [rng.normal(0.0, 1e-3, (400, 7)) * (1.0 if k != 1 else [1, 1, 1, 0, 1, 1, 1]) for k in range(3)]
    bench = SimpleNamespace(
        runs=[SimpleNamespace(run_path=SimpleNamespace(ordered=True))] * 3, residual=lambda k: gaps[k]
    )
    floor = SimpleNamespace(fast=np.full(7, 1e-3), slow_mm=1e-3)
    noise = instrument_noise(bench, floor, np.full(7, 1e-6), [0.03 * np.arange(400)] * 3)
    assert np.sqrt(noise.slow[0, 3]) * noise.sigma[0, 3] == pytest.approx(1e-3, rel=0.15)
