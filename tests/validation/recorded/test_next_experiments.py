"""The designed next experiment has as much information on the truth plant as the best of a grid, and far more than random ones.

`python -m tests.validation.recorded.next_experiments` asks more questions, of a finer grid.
"""

import pytest

from tests.validation.recorded.next_experiments import QUESTIONS, compare, told_of_two

SHARE = 0.9  # of what the best of the grid is worth
TIMES = 1.5  # what designs by chance are worth


def test_information_between_two_causes():
    """Means two standard deviations apart: the capacity of binary signals at 0 dB, 0.486 bits."""
    assert told_of_two(0.0) == pytest.approx(0.0, abs=1e-9)
    assert told_of_two(4.0) == pytest.approx(0.486, abs=1e-3)
    assert told_of_two(100.0) > 0.999


@pytest.mark.campaign  # asks many whole experiments
def test_a_designed_experiment_beats_chance_and_is_as_good_as_brute_force(tmp_path):
    found = compare(QUESTIONS[0], tmp_path, steps=2, random=8)
    assert found["tried"] >= 15
    assert found["designed"] >= SHARE * found["brute force"]
    assert found["designed"] >= TIMES * found["random"]
