"""From sets of causes and their evidence to one answer: priors of sets, tolerances, rivals."""

from dataclasses import replace
from math import comb

import numpy as np
import pytest

from camcomp.diagnosis.fit.cause_sets import (
    SIZES,
    CausePrior,
    Fitted,
    Scale,
)
from camcomp.diagnosis.model.search import best_of, search_sets
from camcomp.diagnosis.search.cause_search import rank
from camcomp.diagnosis.statistics.evidence import Prior, gram


def candidates(n):
    return CausePrior(tuple((i,) for i in range(n)), np.log(np.full(n, 1.0 / n)), lambda i, j: False)


def fitted(*members):
    return Fitted(members=members, theta=np.zeros(len(members)), log_evidence=0.0, grams=())


def found_in(scale):
    """The best set of candidates of one column each."""
    return best_of(search_sets(scale.sets(range(len(scale.candidates.columns)))))


@pytest.mark.parametrize("size", [0, 1, 2, 3])
def test_sets_of_one_size_share_the_prior_of_that_size(size):
    """Of n indistinguishable candidates, d drawn one after the other: every set comes in d! orders."""
    one = np.exp(candidates(400).prior(tuple(range(size))))
    assert comb(400, size) * one == pytest.approx(SIZES[size], rel=0.01)


def test_one_member_exchanged_or_left_out_leads_from_a_set_that_was_put_together_greedily():
    """Column 2 follows 0 and 1 together: it comes first and stays, although with them nobody wants it."""
    rng = np.random.default_rng(5)
    D = rng.standard_normal((400, 5))
    D[:, 2] = (D[:, 0] + D[:, 1]) / np.sqrt(2.0) + 0.1 * D[:, 2]
    prior = Prior(np.full(5, 1e-3), np.zeros(5), np.full(5, np.inf))
    scale = Scale(gram(D, 0.7 * (D[:, 0] + D[:, 1]) + rng.standard_normal(400)), prior, candidates(5))
    assert found_in(scale) == (0, 1)


def test_a_member_that_stood_for_two_is_parted_beside_the_others():
    """Column 2 does what 0 and 1 leave of each other: either of them alone in its place does far worse."""
    rng = np.random.default_rng(6)
    D = rng.standard_normal((400, 6))
    D[:, 1] = 0.3 * D[:, 1] - D[:, 0]
    both = D[:, 0] + D[:, 1]
    D[:, 2] = both / 0.3 + 0.6 * D[:, 2]
    prior = Prior(np.full(6, 1e-3), np.zeros(6), np.full(6, np.inf))
    scale = Scale(gram(D, 4.0 * both + 0.7 * D[:, 4] + rng.standard_normal(400)), prior, candidates(6))
    assert found_in(scale) == (0, 1, 4)


def test_one_effect_at_three_targets_is_likelier_than_three_effects_and_at_two_it_is_not():
    kinds = CausePrior(
        *(getattr(candidates(12), name) for name in ("columns", "weight", "exclusive")), ((0, 1, 2, 3, 4, 5),)
    )
    assert kinds.prior((0, 1)) == candidates(12).prior((0, 1))
    assert kinds.prior((0, 1, 6)) == candidates(12).prior((0, 1, 6))
    assert kinds.prior((0, 1, 2)) > kinds.prior((6, 7, 8)) + 1.0
    assert kinds.prior((0, 1, 2)) > kinds.prior((0, 1, 2, 3))


def test_causes_of_a_set_are_of_one_size():
    """Rows that two columns explain equally well: one at the size of its mates, or its twin at eight times that."""
    rng = np.random.default_rng(7)
    D = rng.standard_normal((400, 8))
    D[:, 3] = D[:, 2] / 8.0
    prior = Prior(np.full(8, 1e-3), np.zeros(8), np.full(8, np.inf))
    scale = Scale(gram(D, D[:, :3] @ np.full(3, 0.3) + rng.standard_normal(400)), prior, candidates(8))
    assert scale((0, 1, 2)) > scale((0, 1, 3)) + 1.0


def test_a_rival_is_another_set_that_is_neither_larger_nor_the_same_with_one_more_or_less():
    fits = [fitted(0), fitted(1), fitted(0, 1), fitted(1, 2), fitted()]
    assert rank(fits, np.full(5, 0.2) + [0.01, 0.0, 0.0, 0.0, 0.0], []).rivals == (1,)
    without = [each for each in fits if each.members != (1,)]
    assert rank(without, np.array([0.28, 0.24, 0.24, 0.24]), []).rivals == ()
    pair = rank([fitted(0, 1), fitted(1), fitted(2)], np.array([0.4, 0.3, 0.3]), [])
    assert pair.rivals == (2,)


def test_twins_have_equal_parts_of_their_probability_whatever_their_priors():
    fits = [fitted(0), fitted(1), fitted(2)]
    ranking = rank(fits, np.array([0.97, 0.02, 0.01]), [(1,)])
    assert (ranking.first, ranking.rivals) == (0, (1,))
    assert (ranking.inclusion[0], ranking.inclusion[1]) == pytest.approx((0.495, 0.495))


def test_sets_of_another_kind_break_no_tie():
    """Membership in many improbable sets does not make one of two indistinguishable candidates more probable."""
    fits = [fitted(0, 1), fitted(0, 2), fitted(1, 3)]
    inclusion = rank(fits, np.array([0.60, 0.35, 0.05]), [(0, 2)]).inclusion
    assert inclusion[1] == pytest.approx(0.5)
    assert inclusion[0] == pytest.approx(0.95)


def test_a_set_far_less_probable_is_a_rival_only_where_nothing_tells_it_apart():
    fits = [fitted(0), fitted(1)]
    assert rank(fits, np.array([0.99, 0.01]), []).rivals == ()
    assert rank(fits, np.array([0.99, 0.01]), [(1,)]).rivals == (1,)


def test_a_minor_one_makes_no_set_likelier_before_the_data():
    """All targets of an effect are one thing that happens; two of them and a minor third are three."""
    kinds = CausePrior(*(getattr(candidates(8), name) for name in ("columns", "weight", "exclusive")), ((0, 1, 2),))
    assert kinds.prior((0, 1, 2)) > kinds.prior((0, 1))
    beside = kinds.value(replace(fitted(0, 1), minor=(2,)))
    assert beside < kinds.prior((0, 1))
    assert beside == pytest.approx(kinds.value(replace(fitted(0, 3), minor=(2,))))  # no lead over what does the same
