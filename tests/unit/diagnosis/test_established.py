"""What is no answer, because a member of it may be minor, speaks against those that name something else."""

from types import SimpleNamespace

import numpy as np
import pytest

from camcomp.diagnosis.search.established import held_against
from camcomp.diagnosis.statistics.cause_sets import CausePrior, Fitted
from camcomp.diagnosis.statistics.verdict import judge

PROBLEM = SimpleNamespace(
    candidates=CausePrior(tuple((i,) for i in range(5)), np.log(np.full(5, 0.2)), lambda i, j: False)
)


def fitted(evidence, *members):
    return Fitted(members, np.zeros(len(members)), np.eye(len(members)), evidence, ())


@pytest.mark.parametrize(("evidence", "share"), [(30.0, 0.5), (-60.0, 1.0)])
def test_what_it_lacks_is_less_sure_by_as_much_as_it_is_likely_but_never_by_more_than_one_word_against_another(
    evidence, share
):
    best = fitted(0.0, 0, 1)
    said = judge((best,), np.ones(1), [])
    after = held_against(PROBLEM, (best,), np.ones(1), said, [fitted(evidence, 0, 2, 3)], 1.5)
    assert (after.inclusion[0], after.inclusion[1]) == pytest.approx((1.0, share))
    assert (after.word, after.best, after.rivals) == (said.word, said.best, said.rivals)


def test_a_set_that_is_an_answer_is_not_held_against_the_others_once_more():
    fits = (fitted(0.0, 0), fitted(0.0, 1))
    said = judge(fits, np.array([0.6, 0.4]), [])
    assert held_against(PROBLEM, fits, np.array([0.6, 0.4]), said, [fits[1]], 1.5).inclusion == said.inclusion
