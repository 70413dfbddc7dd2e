"""Stepwise selection from an effect at all of its targets, where a search that adds and exchanges has ended."""

import numpy as np
import pytest

from camcomp.diagnosis.statistics import stepwise as module
from camcomp.diagnosis.statistics.cause_sets import CausePrior, Scale, exchanges, extensions, parted
from camcomp.diagnosis.statistics.evidence import Prior, gram
from camcomp.diagnosis.statistics.stepwise import stepwise

SPRINGS, FORCE, WEIGHT, LENGTH, TWO = (0, 1, 2, 3), 4, 5, 6, 7
ALL = range(8)
TRUTH = (0, 1, FORCE)


@pytest.fixture
def scale():
    """Two springs and a force are wrong; a weight and a length, each far larger, undo one another down to nearly the same."""
    rng = np.random.default_rng(2)
    D = rng.standard_normal((900, 9))
    wrong = D[:, list(TRUTH)].sum(axis=1)
    D[:, WEIGHT] = wrong + D[:, LENGTH] + 0.15 * D[:, WEIGHT]
    columns = (*((i,) for i in range(7)), (7, 8))
    prior = Prior(np.full(9, 1e-3), np.ones(9), np.zeros(9), np.ones(9), np.full(9, np.inf))
    known = CausePrior(columns, np.full(8, -np.log(8.0)), lambda i, j: {i, j} == {2, TWO}, (SPRINGS,))
    return Scale(gram(D, wrong + rng.standard_normal(900)), prior, known)


def value(scale, members):
    return scale(members) + scale.candidates.prior(members)


def test_springs_and_force_are_found_where_no_step_leads_from_two_that_undo_one_another(scale):
    two = (WEIGHT, LENGTH)
    steps = [*extensions(scale, two, ALL), *exchanges(scale, two, ALL, 9), *parted(scale, two, ALL, 9)]
    assert max(steps)[0] < value(scale, two) < value(scale, TRUTH) - 3.0
    assert stepwise(scale, SPRINGS, ALL, 5) == TRUTH


def test_a_cause_of_two_columns_is_taken_where_it_is_one_and_beside_none_that_it_excludes():
    rng = np.random.default_rng(3)
    D = rng.standard_normal((900, 9))
    prior = Prior(np.full(9, 1e-3), np.ones(9), np.zeros(9), np.ones(9), np.full(9, np.inf))
    columns = (*((i,) for i in range(7)), (7, 8))
    seen = gram(D, D[:, 0] + D[:, 7] - D[:, 8] + rng.standard_normal(900))
    for excluded, found in ((2, (0, TWO)), (0, (0,))):
        known = CausePrior(columns, np.full(8, -np.log(8.0)), lambda i, j, no=excluded: {i, j} == {no, TWO}, (SPRINGS,))
        assert stepwise(Scale(seen, prior, known), (0, 1), ALL, 5) == found


def test_no_more_members_are_left_than_are_asked_for(scale):
    assert stepwise(scale, SPRINGS, SPRINGS, 1) in {(0,), (1,)}
    assert stepwise(scale, (), ALL, 0) == ()


def test_a_selection_that_goes_round_ends(scale, monkeypatch):
    """A candidate gains by coming and, once it is there, by going."""
    monkeypatch.setattr(
        module, "_gains", lambda at, prior, known, rest, more: np.full(len(more), 1.0 if len(more) > 1 else -1.0)
    )
    assert stepwise(scale, (), ALL, 1) == ()
