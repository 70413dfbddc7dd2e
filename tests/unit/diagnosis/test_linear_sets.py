"""The best-subset search on sets weighed by linearised evidence."""

import numpy as np
import pytest

from camcomp.diagnosis.fit.cause_sets import CausePrior, Scale, scored
from camcomp.diagnosis.model.search import best_of, search_sets
from camcomp.diagnosis.statistics.evidence import Prior, gram

SPRINGS, FORCE, WEIGHT, LENGTH, TWO = (0, 1, 2, 3), 4, 5, 6, 7
COLUMNS = (*((i,) for i in range(7)), (7, 8))
TRUTH = (0, 1, FORCE)


def scale(D, r, excluded=2):
    """Evidence of sets of the columns D (n, 9) that explain r (n,); a candidate excludes that of two columns."""
    prior = Prior(np.full(9, 1e-3), np.zeros(9), np.full(9, np.inf))
    known = CausePrior(COLUMNS, np.full(8, -np.log(8.0)), lambda i, j: {i, j} == {excluded, TWO}, (SPRINGS,))
    return Scale(gram(D, r), prior, known)


def sets(D, r, excluded=2):
    return scale(D, r, excluded).sets(range(8))


def drawn(seed):
    rng = np.random.default_rng(seed)
    return rng.standard_normal((900, 9)), rng.standard_normal(900)


def test_springs_and_force_are_found_though_two_that_undo_one_another_do_nearly_the_same():
    D, noise = drawn(2)
    wrong = D[:, list(TRUTH)].sum(axis=1)
    D[:, WEIGHT] = wrong + D[:, LENGTH] + 0.15 * D[:, WEIGHT]
    assert best_of(search_sets(sets(D, wrong + noise))) == TRUTH
    assert scored(scale(D, wrong + noise), [(WEIGHT, LENGTH), TRUTH])[0][1] == TRUTH


def test_a_cause_of_two_columns_is_found_and_never_jointly_with_one_that_it_excludes():
    D, noise = drawn(3)
    r = D[:, 0] + D[:, 7] - D[:, 8] + noise
    assert best_of(search_sets(sets(D, r))) == (0, TWO)
    found = search_sets(sets(D, r, excluded=0))
    assert best_of(found) == (TWO,)
    assert not [members for members in found if {0, TWO} <= set(members)]


def test_the_search_weighs_sets_as_they_are_ranked_where_no_tolerance_ends():
    D, noise = drawn(4)
    r = 0.3 * D[:, 0] + 0.2 * D[:, FORCE] + noise
    data, own = sets(D, r), scale(D, r)
    for members in ((), (0,), (0, 1), (0, FORCE), (0, FORCE, TWO)):
        assert data.value(members) == pytest.approx(own(members) + own.candidates.prior(members))
    more = data.with_one_more((0,), [1, FORCE])
    assert more == pytest.approx([data.value((0, 1)), data.value((0, FORCE))])
