"""Patterns that say the same thing twice say it once."""

import numpy as np
import pytest

from camcomp.diagnosis.statistics.score_test import Projected, score_test


def test_a_pattern_told_twice_counts_once():
    def left(n):
        return Projected(np.full((n, n), 50.0), np.full(n, 40.0), 1000, tuple("ab"[:n]), ("tip",) * n, np.full(n, 50.0))

    once, twice = (score_test(left(n), {"tip": 1000})["tip"] for n in (1, 2))
    assert twice.rms == pytest.approx(once.rms) and once.rms > 0.0
