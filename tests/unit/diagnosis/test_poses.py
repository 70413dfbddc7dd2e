"""Static poses: stretches in which a joint was shifted, shapes that are tried, mistakes among poses, cells that are empty."""

from types import SimpleNamespace

import numpy as np
import pytest

from camcomp.diagnosis.arm.noise_floor import far_off
from camcomp.diagnosis.arm.poses import _shapes
from camcomp.diagnosis.model.window import best_window
from camcomp.diagnosis.studies import _poses
from camcomp.effects import disturbance, thermal_growth


@pytest.mark.parametrize("shift", [0.0, 0.3])
@pytest.mark.parametrize("seed", range(4))
def test_the_spell_that_explains_most_is_that_of_all_windows_fitted_beside_the_frames(shift, seed):
    rng = np.random.default_rng(seed)
    joint, frame = 1.0 + rng.normal(size=(24, 3)), rng.normal(size=(24, 3, 9))
    frame[:, :, 3:6] = np.eye(3)
    left = shift * joint * ((np.arange(24) >= 7) & (np.arange(24) < 15))[:, None] + 0.1 * rng.normal(size=(24, 3))
    F = frame.reshape(-1, 9)
    left = left - (F @ np.linalg.lstsq(F, left.ravel(), rcond=None)[0]).reshape(24, 3)

    def left_over(begin, end):
        spell = np.where(((np.arange(24) >= begin) & (np.arange(24) < end))[:, None], joint, 0.0).ravel()
        A = np.column_stack([F, spell])
        return np.sum((left.ravel() - A @ np.linalg.lstsq(A, left.ravel(), rcond=None)[0]) ** 2)

    windows = [(i, j) for i in range(24) for j in range(i + 4, 25) if j - i <= 0.5 * 24]
    best = min(windows, key=lambda w: left_over(*w))
    Q = np.linalg.qr(F)[0].reshape(24, 3, 9)
    assert best_window(joint, left, Q, np.arange(25), 4)[1:] == best
    assert not shift or np.abs(np.subtract(best, (7, 15))).max() <= 1  # noise moves an edge by a row


def test_a_time_of_warming_up_is_tried_only_where_no_temperature_is_logged():
    own = thermal_growth.ROTARY
    tried = [shape[0] for shape in _shapes(own, warm=False)]
    assert [value for _, value, _, _ in tried] == list(own[1].scan)
    assert all(low < value < high for _, value, low, high in tried)
    assert _shapes(own, warm=True) == [()]
    assert _shapes(disturbance.ROTARY, warm=False) == []  # when it was is looked for in the leftovers


def test_poses_far_off_are_mistakes_unless_they_come_one_after_the_other():
    size, time = np.full(200, 0.03), np.random.default_rng(1).permutation(200).astype(float)
    at = np.argsort(time)
    size[at[[20, 90]]] = 5.0
    assert far_off(size, time).sum() == 2
    size[at[150:153]] = 5.0
    assert set(np.flatnonzero(far_off(size, time))) == set(at[[20, 90]])


@pytest.mark.parametrize(("rows", "mistakes", "found"), [(28, 1, 1), (28, 2, 0), (200, 6, 6)])
def test_one_of_few_poses_may_be_a_mistake(rows, mistakes, found):
    size = np.full(rows, 0.03)
    size[3 : 3 + 4 * mistakes : 4] = 5.0
    assert far_off(size, np.arange(float(rows))).sum() == found


def test_empty_cells_of_deviations_and_temperatures_are_filled():
    n = 6
    nan = np.where(np.arange(n) == 2, np.nan, 1.0)
    log = SimpleNamespace(
        time=np.arange(6.0), encoder=np.zeros((n, 2)), tip=np.zeros((n, 3)), temperature=20.0 + np.arange(6.0) * nan,
        tip_sd=np.full((n, 3), 0.02) * nan[:, None], has=lambda channel: False,
    )  # fmt: skip
    poses = _poses(SimpleNamespace(clamping=None, started_s=0.0, name="a"), log)
    np.testing.assert_allclose(poses.temperature, 20.0 + np.arange(6.0))
    np.testing.assert_allclose(poses.sd, 0.02)
