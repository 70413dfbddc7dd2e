"""Rows of arrays that are chosen by a mask."""

import numpy as np
import pytest

from camcomp.ground.vectors import chosen

VALUES = np.arange(12.0).reshape(6, 2)


@pytest.mark.parametrize("on", ["000000", "000001", "100000", "011100", "010100", "101111", "111111"])
def test_rows_are_those_of_the_mask(on):
    on = np.array([each == "1" for each in on])
    assert (chosen(VALUES, on) == VALUES[on]).all() and chosen(VALUES, on).shape == VALUES[on].shape


def test_no_rows_of_no_values():
    assert chosen(VALUES[:0], np.zeros(0, bool)).shape == (0, 2)


@pytest.mark.parametrize(("on", "shares"), [("011100", True), ("111111", True), ("010100", False)])
def test_rows_in_sequence_are_not_copied(on, shares):
    assert np.shares_memory(chosen(VALUES, np.array([each == "1" for each in on])), VALUES) is shares
