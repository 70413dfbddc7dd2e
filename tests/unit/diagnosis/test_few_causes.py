"""Few causes of an arm: evidence against covariances written out, and what single steps of the search see."""

from dataclasses import dataclass
from itertools import combinations
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.special import logsumexp

from camcomp.diagnosis.arm.discrepancy import FREE, Discrepancy, Posterior, ResidualBlock
from camcomp.diagnosis.arm.few_causes import SMALL, WIDTHS, search, sways, weighed
from camcomp.diagnosis.arm.gate import FALSE, LeftOver, chance_of_move, lasting, moved, regions_above
from camcomp.diagnosis.arm.noise_floor import far_off
from camcomp.diagnosis.arm.placed_effects import PlacedEffect
from camcomp.diagnosis.arm.poses import _shapes
from camcomp.diagnosis.arm.spells import _window
from camcomp.diagnosis.studies import _poses
from camcomp.effects import disturbance, thermal_growth
from camcomp.model.effect import Parameter

ROWS, SD = 14, 0.03


@dataclass(frozen=True)
class Known:
    """A column as the search knows it."""

    parameter: Parameter
    shape: tuple = ()


def column(sign=0):
    return Known(Parameter("size", "1", 0.0, -1e9, 1e9, 1.0, 0.0, "test", sign=sign))


@pytest.fixture
def case():
    rng = np.random.default_rng(3)
    X = rng.normal(size=(ROWS, 3, 4)) * [0.02, 0.1, 0.05, 0.03]
    N = rng.normal(size=(ROWS, 3, 9))
    r = X[:, :, 1] * 1.4 + 0.7 * X[:, :, 2] + SD * rng.normal(size=(ROWS, 3))
    order = (rng.permutation(ROWS) + 0.5) / ROWS
    block = ResidualBlock(rng.uniform(-1, 1, (ROWS, 4)), X, N, r, 0, True, order=order)
    effects = [PlacedEffect("a", "1", (0,)), PlacedEffect("a", "2", (1,)), PlacedEffect("b", None, (2, 3))]
    return block, order, effects, [column() for _ in range(4)]


def written_out(case, discrepancy, members, width):
    """Log density of the leftovers with covariances of everything that may be there."""
    block, order, effects, _ = case
    flat = block.X.reshape(-1, 4)
    Q = np.linalg.svd(block.N.reshape(-1, 9), full_matrices=False)[0]
    size = np.sqrt(((flat - Q @ (Q.T @ flat)) ** 2).mean(axis=0)) / SD
    cov = np.kron(discrepancy.covariance(block.about(discrepancy.timed)), np.eye(3))
    cov += block.N.reshape(-1, 9) @ block.N.reshape(-1, 9).T / FREE
    waves = sways(order, SD).reshape(3 * ROWS, -1)
    cov += waves @ waves.T
    for i, effect in enumerate(effects):
        own = list(effect.columns)
        unit = flat[:, own] / (size[own] * np.sqrt(len(own)))
        cov += (SMALL**2 + (width**2 if i in members else 0.0)) * unit @ unit.T
    L = np.linalg.cholesky(cov)
    return -0.5 * np.sum(np.linalg.solve(L, block.r.ravel()) ** 2) - np.log(np.diag(L)).sum()


@pytest.mark.parametrize("discrepancy", [Discrepancy(0.0, 1.0, SD), Discrepancy(0.05, 0.6, 0.02, timed=True)])
def test_evidence_is_that_of_covariances_written_out(case, discrepancy):
    block, order, effects, columns = case
    w = weighed([block], [order], SD, discrepancy, effects, columns)
    sets = [c for size in (1, 2, 3) for c in combinations(range(3), size)]
    nothing = written_out(case, discrepancy, (), 0.0)
    for members in sets:
        (value,) = w.beside(members[:-1], members[-1:])
        each = [written_out(case, discrepancy, members, width) - nothing for width in WIDTHS]
        expected = logsumexp(each) - np.log(len(each))
        assert value - w.prior(members) == pytest.approx(expected, abs=1e-2)
    other = Discrepancy(0.0, 1.0, 2.0 * SD)
    difference = w.nothing - weighed([block], [order], SD, other, effects, columns).nothing
    assert difference == pytest.approx(nothing - written_out(case, other, (), 0.0), abs=1e-2)


def test_what_is_there_is_found_and_may_be_kept_out(case):
    block, order, effects, columns = case
    w = weighed([block], [order], SD, Discrepancy(0.0, 1.0, SD), effects, columns)
    found = search(w, 3)
    assert 1 in found.sets[0][0]
    assert found.places["a", "2"] > 0.99
    assert ("a", "2") not in search(w, 3, [("a", "1"), ("b", None)]).places


def test_an_amount_of_the_wrong_sign_is_no_cause(case):
    block, order, effects, columns = case
    turned = ResidualBlock(block.features, block.X, block.N, -block.r, 0, True, order=order)
    columns[1] = column(sign=1)
    places = [
        search(weighed([b], [order], SD, Discrepancy(0.0, 1.0, SD), effects, columns), 3).places
        for b in (block, turned)
    ]
    assert places[0]["a", "2"] > 0.99
    assert places[1].get(("a", "2"), 0.0) < 0.5


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

    windows = [(i, j) for i in range(24) for j in range(i + 4, 25) if j - i <= 0.7 * 24]
    best = min(windows, key=lambda w: left_over(*w))
    assert _window(joint, left, frame) == best
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
    squares = 3.0 * (size / 0.05) ** 2
    left = LeftOver((np.zeros((200, 3)),), (squares,))
    assert lasting(left, [time]) and not lasting(left, [np.random.default_rng(2).permutation(200).astype(float)])


def test_empty_cells_of_deviations_and_temperatures_are_filled():
    n = 6
    nan = np.where(np.arange(n) == 2, np.nan, 1.0)
    log = SimpleNamespace(
        time=np.arange(6.0), encoder=np.zeros((n, 2)), tip=np.zeros((n, 3)), temperature=20.0 + np.arange(6.0) * nan,
        tip_sd=np.full((n, 3), 0.02) * nan[:, None],
    )  # fmt: skip
    poses = _poses(SimpleNamespace(clamping=None, started_s=0.0, name="a"), log)
    np.testing.assert_allclose(poses.temperature, 20.0 + np.arange(6.0))
    np.testing.assert_allclose(poses.sd, 0.02)


def regions_of(means, rng):
    """A leftover in regions of postures with so many times the floor's square, five poses each."""
    features = np.repeat(np.column_stack([np.cos(np.arange(len(means))), np.sin(np.arange(len(means)))]), 5, axis=0)
    squares = 3.0 * np.repeat(means, 5) * rng.uniform(0.8, 1.2, 5 * len(means))
    return LeftOver((np.zeros((len(squares), 3)),), (squares,)), [10.0 * features]


def test_what_is_left_in_most_regions_is_above_the_floor_though_three_fall_below_it_and_two_have_nearly_all():
    left, features = regions_of(
        [-21, 42, -6, 56, 29, 25, 38, 568, -36, 81, 31, 13, 366, 9, 33, 36], np.random.default_rng(1)
    )
    assert regions_above(left, features) < np.log10(FALSE)


@pytest.mark.parametrize("seed", range(5))
def test_two_regions_alone_are_not_most_of_them(seed):
    rng = np.random.default_rng(seed)
    left, features = regions_of([568, 366, *rng.chisquare(12, 14) / 12.0], rng)
    assert regions_above(left, features) > np.log10(FALSE)


def test_blocks_move_a_fit_by_chance_as_far_as_is_said():
    """Two effects, one known as well as the block knows it and one a hundred times better, 2000 blocks of 50 rows."""
    rng = np.random.default_rng(3)
    D, open_to = rng.normal(size=(50, 2)), np.diag([1.0 / 50, 1e-4 / 50])
    others = Posterior(np.zeros(2), np.arange(2), np.linalg.inv(open_to), 0.0)
    r = rng.multivariate_normal(np.zeros(2), open_to, 2000) @ D.T + rng.normal(size=(2000, 50))
    near = r @ np.linalg.inv(np.eye(50) + D @ open_to @ D.T)
    chances = 10.0 ** np.array([chance_of_move(D.T @ D, others, each) for each in (r * near - near**2).sum(axis=1)])
    assert [(chances < level).mean() for level in (0.5, 0.1, 0.01)] == pytest.approx([0.5, 0.1, 0.01], rel=0.3)


def test_a_move_is_one_of_as_many_as_there_are_blocks():
    rest = (np.zeros((5, 3)),) * 10
    assert moved(LeftOver(rest, (), (-0.2, -4.1)))
    assert not moved(LeftOver(rest, (), (-3.9,)))
    assert not moved(LeftOver(rest, ()))
