"""What a verdict says of a probability."""

import pytest

from camcomp.diagnosis.statistics.verdict import worth_a_mention


@pytest.mark.parametrize(
    ("found", "said"), [(0.3, 0.3), (0.5, 0.5), (0.6, 0.5), (0.74, 0.5), (0.76, 0.76), (0.99, 0.99)]
)
def test_a_lead_of_less_than_three_to_one_is_none(found, said):
    assert worth_a_mention(found) == said
