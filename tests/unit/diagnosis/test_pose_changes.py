"""What static poses show of a target that slips between two rounds, of mistakes among few poses, and of causes beside what is left."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from camcomp.diagnosis.arm.gate import change, stretches
from camcomp.diagnosis.arm.noise_floor import far_off

ROWS, SD = 160, 0.05
TIMES = (np.arange(ROWS, dtype=float),)


def rounds(slip, seed=0):
    """Leftovers of a grid that was gone through twice, a target slipping between the rounds, and the columns that frames have."""
    rng = np.random.default_rng(seed)
    turn = np.tile(Rotation.random(ROWS // 2, random_state=seed).as_matrix(), (2, 1, 1))
    tip = np.tile(rng.uniform(-1.0, 1.0, (ROWS // 2, 3)), (2, 1))
    across = np.stack([np.cross(axis, tip) for axis in np.eye(3)], axis=2)
    frame = np.concatenate([np.broadcast_to(np.eye(3), (ROWS, 3, 3)), across, turn], axis=2)
    late = (np.arange(ROWS) >= ROWS // 2)[:, None]
    left = late * (turn @ np.array([0.5, -0.2, -0.8])) * slip + SD * rng.standard_normal((ROWS, 3))
    return left - frame @ np.linalg.lstsq(frame.reshape(-1, 9), left.ravel(), rcond=None)[0], frame


def test_a_target_that_slips_between_two_rounds_is_a_change_in_time():
    left, frame = rounds(1.0)
    assert stretches([left], TIMES).log10_chance > -6.0  # every round scatters evenly about the target's mean place
    found = change([left], TIMES, [(0, frame)])
    assert found.covariate == "time" and found.log10_chance < -50.0 and found.share > 0.9


@pytest.mark.parametrize("seed", range(8))
def test_noise_is_no_change(seed):
    left, frame = rounds(0.0, seed)
    assert change([left], TIMES, [(0, frame)]).log10_chance > -2.5


def test_parts_of_a_campaign_are_looked_at_together():
    left, frame = rounds(1.0)
    odd = np.arange(ROWS) % 2 == 1
    parts = [left[odd], left[~odd]], [TIMES[0][odd], TIMES[0][~odd]], [(3, frame[odd]), (3, frame[~odd])]
    assert change(*parts).share == pytest.approx(change([left], TIMES, [(0, frame)]).share, rel=1e-9)


@pytest.mark.parametrize(("rows", "mistakes", "found"), [(28, 1, 1), (28, 2, 0), (200, 6, 6)])
def test_one_of_few_poses_may_be_a_mistake(rows, mistakes, found):
    size = np.full(rows, 0.03)
    size[3 : 3 + 4 * mistakes : 4] = 5.0
    assert far_off(size, np.arange(float(rows))).sum() == found


@pytest.mark.parametrize(("noise", "least"), [("tails", -2.5), ("louder", -4.6)])
@pytest.mark.parametrize("seed", [2, 14, 18, 21, 30])
def test_noise_of_another_kind_is_no_change_either(noise, least, seed):
    """Student's t of two degrees, and noise that becomes three times as loud; the gate believes what is below -4.6."""
    _, frame = rounds(0.0, seed)
    rng = np.random.default_rng(100 + seed)
    tails = SD * rng.standard_t(2, (ROWS, 3))
    louder = SD * rng.standard_normal((ROWS, 3)) * np.where(np.arange(ROWS) > 100, 3.0, 1.0)[:, None]
    left = {"tails": tails, "louder": louder}[noise]
    left = left - frame @ np.linalg.lstsq(frame.reshape(-1, 9), left.ravel(), rcond=None)[0]
    assert change([left], TIMES, [(0, frame)]).log10_chance > least


def test_what_lasts_for_a_while_in_a_short_campaign_changes_its_frames():
    """48 poses, of which 12 lie aside: to weigh rows by how loud a stretch is would take the half of what tells."""
    left, frame = rounds(0.0)
    left, frame = left[:48], frame[:48]
    left[10:22] += frame[10:22, :, 6:] @ np.array([1.0, -0.4, 0.3])
    left = left - frame @ np.linalg.lstsq(frame.reshape(-1, 9), left.ravel(), rcond=None)[0]
    assert change([left], (np.arange(48.0),), [(0, frame)]).log10_chance < -6.0
