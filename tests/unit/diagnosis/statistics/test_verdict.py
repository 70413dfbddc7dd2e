"""What a verdict says of a probability."""

import numpy as np
import pytest

from camcomp.diagnosis.search.stated import open_where_even, worth_a_mention
from camcomp.diagnosis.statistics.cause_sets import Fitted
from camcomp.diagnosis.statistics.verdict import Verdict


@pytest.mark.parametrize(
    ("found", "said"), [(0.3, 0.3), (0.5, 0.5), (0.6, 0.5), (0.74, 0.5), (0.76, 0.76), (0.99, 0.99)]
)
def test_a_lead_of_less_than_three_to_one_is_none(found, said):
    assert worth_a_mention(found) == said


@pytest.mark.parametrize(
    ("sure", "said"), [({0: 0.5, 1: 0.9}, ("ambiguous", (1, 3))), ({0: 0.9, 1: 0.9}, ("identified", ()))]
)
def test_what_is_no_more_likely_than_not_is_not_identified(sure, said):
    """Of two causes one is doubtful: larger sets without it, and that of the other one alone, are as good; others are too unlikely."""
    sets = [(0, 1), (1,), (0, 1, 2), (1, 2, 3), (3,), ()]
    fits = [
        Fitted(
            members=members, theta=np.zeros(len(members)), covariance=np.eye(len(members)), log_evidence=0.0, grams=()
        )
        for members in sets
    ]
    probability = np.array([0.4, 0.25, 0.15, 0.1, 0.01, 0.09])
    verdict = open_where_even(Verdict("identified", 0, (), sure), fits, probability)
    assert (verdict.word, verdict.rivals) == said


@pytest.mark.parametrize(("sure", "word"), [({0: 0.5}, "ambiguous"), ({0: 0.8}, "identified")])
def test_what_something_unknown_rivals_alone_is_not_identified(sure, word):
    fits = [
        Fitted(
            members=members, theta=np.zeros(len(members)), covariance=np.eye(len(members)), log_evidence=0.0, grams=()
        )
        for members in [(0,), ()]
    ]
    verdict = open_where_even(Verdict("identified", 0, (), sure), fits, np.array([1.0, 0.0]))
    assert (verdict.word, verdict.rivals) == (word, ())
