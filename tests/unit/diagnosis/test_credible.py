"""How sure a cause is where functions of one covariate may do the same, or other things as well."""

from types import SimpleNamespace

import numpy as np
import pytest

from camcomp.diagnosis.fit.cause_sets import CausePrior, Fitted
from camcomp.diagnosis.search import credible
from camcomp.diagnosis.statistics.by_channel import ByChannel
from camcomp.diagnosis.statistics.evidence import Prior

ROWS = 400
U = np.linspace(0.0, 1.0, ROWS)
TIME = np.random.default_rng(0).permutation(U)  # places are visited in no order
COVARIATE = np.stack([np.sin(2 * np.pi * U), np.cos(2 * np.pi * U), np.sin(4 * np.pi * U)], axis=1)


def present(monkeypatch, column, left, *, surely=False):
    """Probability of a cause with a column (n,), and of something unmodelled in its place, given the measured rows (n,)."""
    one = np.ones(1)
    problem = SimpleNamespace(
        prior=Prior(0.01 * one, 0.0 * one, np.inf * one), member_columns=list,
        candidates=CausePrior(((0,),), np.log(0.5 * one), lambda i, j: True), columns=SimpleNamespace(names=["cause"]),
        dictionary=SimpleNamespace(kinds=["tip"] * 3, labels=["place:x"] * 3), white_patterns=[ByChannel.of([COVARIATE])],
        white_at=lambda _: [ByChannel.of([column[:, None]])], row_places=lambda _: TIME,
        row_cells=lambda _: (np.zeros(ROWS, int), np.arange(ROWS)), kind_of=lambda _: "tip",
    )  # fmt: skip
    monkeypatch.setattr(credible, "_weights", lambda _: [np.ones(ROWS)])
    amount = float(column @ left / (column @ column))
    f = Fitted(members=(0,), theta=np.array([amount]), log_evidence=0.0, grams=(), residual=(left,))
    there, replaced = credible.credibility(problem, f, surely=surely)
    return there[0], replaced[0]


def noise(seed):
    return np.random.default_rng(seed).normal(size=ROWS)


def test_a_cause_that_no_function_of_a_covariate_does_is_sure(monkeypatch):
    ramp = np.where(U > 0.3, 1.0, -1.0) * np.sin(23.0 * U)
    sure, replaced = present(monkeypatch, ramp, 0.6 * ramp + noise(1))
    assert sure > 0.95 and replaced < 0.05


def test_a_column_that_follows_the_half_of_an_unmodelled_effect_is_replaced_by_it(monkeypatch):
    """The residual is the covariate's function; the column of the cause goes along with three quarters of it."""
    effect = 2.0 * COVARIATE[:, 0] - 1.5 * COVARIATE[:, 2]
    column = COVARIATE[:, 0] + 0.5 * np.sign(COVARIATE[:, 1])
    sure, replaced = present(monkeypatch, column, effect + noise(2))
    assert sure < 0.5 and replaced > 0.5


@pytest.mark.parametrize("surely", [False, True])
def test_functions_that_draw_just_the_cause_are_the_cause_under_another_name(monkeypatch, surely):
    column = COVARIATE[:, 0] + 0.5 * COVARIATE[:, 2]
    sure, _ = present(monkeypatch, column, 8.0 * column + noise(3), surely=surely)
    assert sure > 0.95


def shift(begin, end):
    return np.where((begin < TIME) & (end > TIME), 1.0, 0.0)


def test_a_shift_for_a_while_where_a_run_wanders_all_the_time_is_the_wandering(monkeypatch):
    wandering = 2.0 * np.sin(19.0 * TIME) + 1.5 * np.cos(31.0 * TIME)
    sure, replaced = present(monkeypatch, shift(0.37, 0.46), wandering + noise(4))
    assert sure < 0.5 and replaced > 0.5


def test_a_shift_for_a_while_that_begins_and_ends_at_once_stays(monkeypatch):
    sure, _ = present(monkeypatch, shift(0.3, 0.5), 2.0 * shift(0.3, 0.5) + noise(5))
    assert sure > 0.95


def test_a_shift_for_a_while_where_a_run_jumps_from_row_to_row_is_some_of_the_jumps(monkeypatch):
    walk = np.cumsum(np.random.default_rng(3).normal(0.0, 0.5, ROWS))[np.argsort(np.argsort(TIME))]
    sure, replaced = present(monkeypatch, shift(0.15, 0.27), walk - walk.mean() + noise(6))
    assert sure < 0.5 and replaced > 0.5


def test_no_row_counts_for_more_than_what_is_minor_at_the_tip_and_runs_may_lack_a_channel():
    encoder_mm = np.array([np.nan, 1e-4])
    problem = SimpleNamespace(
        noise=SimpleNamespace(sigma=np.column_stack([np.full((2, 3), 0.01), encoder_mm])),
        bench=SimpleNamespace(tip_sizes=np.ones((2, 4))), floor=SimpleNamespace(tip_um=5.0),
        channels_of=lambda kind: {"tip": slice(0, 3), "encoder": slice(3, 4)}.get(kind, slice(4, 4)),
        row_cells=[(np.arange(3), np.zeros(3, int)), (np.arange(4), np.zeros(4, int))].__getitem__,
    )  # fmt: skip
    weights = credible._weights(problem)
    assert weights[0].tolist() == [1.0, 1.0, 1.0]
    assert weights[1] == pytest.approx([1.0, 1.0, 1.0, 0.1 / (0.3 * 5.0)])
