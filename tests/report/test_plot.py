"""Thinning, gaps and numbers of plots."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camcomp.report.plot import brief, broken, gapped, numbers, thin


@given(n=st.integers(1, 30_000), columns=st.integers(1, 4), seed=st.integers(0, 9))
def test_thinning_keeps_ends_and_extremes(n, columns, seed):
    values = np.random.default_rng(seed).normal(size=(n, columns)).cumsum(axis=0)
    kept = thin(values, 1000)
    assert len(kept) <= max(1000, min(n, 40))
    assert kept[0] == 0 and kept[-1] == n - 1 and (np.diff(kept) > 0).all()
    assert np.array_equal(values[kept].max(axis=0), values.max(axis=0))
    assert np.array_equal(values[kept].min(axis=0), values.min(axis=0))


def test_hidden_moves_are_gaps():
    hidden = np.array([True, False, False, True, True, False])
    rows = np.array([0, 1, 2, 4, 5])
    index, gap = broken(rows, hidden)
    assert gapped(np.arange(6.0), index, gap) == [0.0, 1.0, 2.0, None, 4.0, 5.0]


def test_numbers_go_into_json():
    assert (
        json.dumps(numbers(np.array([1 / 3, -1e-9, np.nan, np.inf])), allow_nan=False) == "[0.33333, 0.0, null, null]"
    )


@pytest.mark.parametrize(
    ("value", "text"),
    [(0, "0"), (1234.5, "1234"), (0.0123456, "0.0123"), (-2.5, "-2.50"), (3e-9, "3.00e-09"), (7e7, "7.00e+07"),
     (np.nan, "–")],
)  # fmt: skip
def test_numbers_for_people(value, text):
    assert brief(value) == text
