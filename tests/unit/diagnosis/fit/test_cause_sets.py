"""From sets of causes and their evidence to one answer: priors of sets, tolerances, rivals."""

from dataclasses import replace
from math import comb

import numpy as np
import pytest

from camcomp.diagnosis.fit.cause_sets import CausePrior, Fitted, Prior, estimate, weighed
from camcomp.diagnosis.model.candidates import PlacedCause
from camcomp.diagnosis.model.evidence import SIZES
from camcomp.diagnosis.model.search import best_of, search_sets
from camcomp.diagnosis.search.cause_search import rank
from camcomp.diagnosis.statistics.normal_equations import gram


def candidates(n, kind=0):
    """Candidates of one column each, the first `kind` of which are one effect at several targets."""
    return CausePrior(
        tuple(PlacedCause("spring", str(i), (i,)) if i < kind else PlacedCause(str(i), None, (i,)) for i in range(n))
    )


def prior(k, sign=None, tolerance=1e-3):
    every = np.ones(k)
    return Prior(tolerance * every, 0.0 * every if sign is None else np.array(sign), 0.02 * every)


def data(truth, n=300, seed=1):
    rng = np.random.default_rng(seed)
    D = rng.standard_normal((n, len(truth)))
    return gram(D, D @ np.array(truth) + rng.standard_normal(n))


def fitted(*members):
    return Fitted(
        members=members, theta=np.zeros(len(members)), covariance=np.eye(len(members)), log_evidence=0.0, grams=()
    )


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
    sets = weighed(gram(D, 0.7 * (D[:, 0] + D[:, 1]) + rng.standard_normal(400)), prior(5), candidates(5))
    assert best_of(search_sets(sets)) == (0, 1)


def test_a_member_that_stood_for_two_is_parted_beside_the_others():
    """Column 2 does what 0 and 1 leave of each other: either of them alone in its place does far worse."""
    rng = np.random.default_rng(6)
    D = rng.standard_normal((400, 6))
    D[:, 1] = 0.3 * D[:, 1] - D[:, 0]
    both = D[:, 0] + D[:, 1]
    D[:, 2] = both / 0.3 + 0.6 * D[:, 2]
    sets = weighed(gram(D, 4.0 * both + 0.7 * D[:, 4] + rng.standard_normal(400)), prior(6), candidates(6))
    assert best_of(search_sets(sets)) == (0, 1, 4)


def test_one_effect_at_three_targets_is_likelier_than_three_effects_and_at_two_it_is_not():
    kinds = candidates(12, kind=6)
    apart = [kinds.prior((i, 6, 7)) - kinds.prior((6, 7, 8)) for i in range(3)]
    assert kinds.prior((0, 1, 6)) - kinds.prior((6, 7, 8)) == pytest.approx(apart[0] + apart[1])
    assert kinds.prior((0, 1, 2)) - kinds.prior((6, 7, 8)) > sum(apart) + 1.0
    assert kinds.prior((0, 1, 2)) > kinds.prior((0, 1, 2, 3))


def test_of_two_that_do_the_same_the_one_of_larger_typical_size_is_as_likely():
    for size in (0.5, 0.25, 0.1):
        small = data([size], n=10_000)
        large = replace(small, A=25.0 * small.A, b=5.0 * small.b)
        stated = prior(1)
        other = Prior(stated.tolerance / 5.0, stated.sign, stated.unit / 5.0)
        odds = [weighed(g, p, candidates(1)) for g, p in ((small, stated), (large, other))]
        assert odds[0].evidence((0,)) == pytest.approx(odds[1].evidence((0,)))


def test_a_cause_of_the_wrong_sign_is_held_against_it():
    free, signed = (weighed(data([-0.5]), prior(1, sign), candidates(1)) for sign in (None, [1.0]))
    assert signed.evidence((0,)) < free.evidence((0,)) - 10.0


def test_what_is_within_tolerance_is_no_finding():
    slight, plain = (weighed(data([size, 0, 0, 0]), prior(4, tolerance=0.3), candidates(4)) for size in (0.2, 2.0))
    assert slight.evidence((0,)) - slight.none < 1.0
    assert plain.evidence((0,)) - plain.none > 4.0


def test_the_right_cause_wins_and_its_estimate_covers_the_truth():
    hits = 0
    for seed in range(20):
        g = data([0, 0.4, 0, 0], seed=seed)
        assert best_of(search_sets(weighed(g, prior(4), candidates(4)))) == (1,)
        mean, covariance = estimate(g, prior(4), [1])
        hits += abs(mean[1] - 0.4) < 1.96 * np.sqrt(covariance[1, 1])
    assert hits >= 16


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
    kinds = candidates(8, kind=3)
    assert kinds.prior((0, 1, 2)) > kinds.prior((0, 1))
    beside = kinds.value(replace(fitted(0, 1), minor=(2,)))
    assert beside < kinds.prior((0, 1))
    one = kinds.prior((0,)) - kinds.prior((3,))  # a target of the effect against another effect: no lead over that
    assert beside == pytest.approx(kinds.value(replace(fitted(0, 3), minor=(2,))) + one)
