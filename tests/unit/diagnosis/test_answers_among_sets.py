"""Which fitted sets are answers, and what those with small members count for."""

from types import SimpleNamespace

import numpy as np
import pytest

from camcomp.diagnosis.fit.cause_sets import CausePrior, Fitted, probabilities
from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.search import fitted_sets


def test_small_members_move_the_tip_by_less_than_is_minor():
    sizes = {0: 1.0, 1: 4.0, 2: 60.0}
    problem = SimpleNamespace(moved_um=lambda f, members: sizes[members[0]], floor=SimpleNamespace(tip_um=5.0))
    assert Problem.small_members(problem, SimpleNamespace(members=(0, 1, 2))) == (0,)


FREE = CausePrior(tuple((i,) for i in range(6)), np.log(np.full(6, 1 / 6)), lambda i, j: {i, j} == {1, 5})


def fitted(evidence, *members):
    return Fitted(members=members, theta=np.zeros(len(members)), log_evidence=evidence, grams=())


@pytest.fixture
def weighed():
    """A search in which 2 is always minor, and sets that were not fitted have no evidence."""

    def search(*done):
        sets = fitted_sets.FittedSets.__new__(fitted_sets.FittedSets)
        sets.problem = SimpleNamespace(
            candidates=FREE,
            refit=lambda members, theta: fitted(-90.0, *members),
            small_members=lambda f: tuple(i for i in f.members if i == 2),
        )
        sets.done = {f.members: f for f in done}
        return sets

    return search


def test_what_is_minor_is_there_and_nobody_names_it(weighed):
    """Without it (0, 1) explains less than (0, 3, 4), two that undo one another in its place; with it more."""
    sets = weighed(fitted(0.0, 0, 1), fitted(14.0, 0, 1, 2), fitted(10.0, 0, 3, 4))
    first, second = sets.answers()
    assert (first.members, first.minor, first.all_members) == ((0, 1), (2,), (0, 1, 2))
    assert second.members == (0, 3, 4)
    assert probabilities((first, second), FREE)[0] == pytest.approx(1 / (1 + np.exp(-4.0)))


def test_what_is_minor_makes_no_answer_likelier_once_evidence_is_tempered(weighed):
    sets = weighed(fitted(0.0, 0, 1), fitted(2.0, 0, 1, 2))
    done = sets.done
    assert FREE.value(done[0, 1, 2]) > FREE.value(done[0, 1])
    assert [f.minor for f in sets.answers()] == [(2,)]
    assert [f.minor for f in sets.answers(1.5)] == [()]
