"""Evidence in closed form against the integral itself, and its preferences."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import lsq_linear
from scipy.stats import norm

from camcomp.diagnosis.fit.cause_sets import CausePrior, Scale
from camcomp.diagnosis.statistics.evidence import (
    PRIOR_WIDTHS,
    Prior,
    estimate,
    gram,
    holding_back,
    posterior,
)

RNG = np.random.default_rng(7)


def prior(k, sign=None, tolerance=0.01, reach=np.inf):
    every = np.ones(k)
    return Prior(tolerance * every, 0.0 * every if sign is None else np.array(sign), reach * every)


def data(truth, n=300, k=4, seed=1):
    rng = np.random.default_rng(seed)
    D = rng.standard_normal((n, k))
    return gram(D, D @ np.array(truth) + rng.standard_normal(n))


def worth(g, p, *causes):
    """Log Bayes factor of causes with these columns."""
    scale = Scale(g, p, CausePrior(causes, np.zeros(len(causes)), lambda i, j: False))
    return scale(tuple(range(len(causes)))) - scale(())


def test_bayes_factor_of_one_cause_is_the_integral_it_stands_for():
    g, p = data([0.2], k=1), prior(1)
    a, b = g.A[0, 0], g.b[0]

    def integral(density):
        return quad(lambda x: np.exp(b * x - 0.5 * a * x * x) * density(x), -3, 3, points=[b / a, 0.0], limit=400)[0]

    wide = np.mean([integral(lambda x, s=s: norm.pdf(x, 0, np.hypot(s, 0.01))) for s in PRIOR_WIDTHS])
    narrow = integral(lambda x: norm.pdf(x, 0, 0.01))
    assert worth(g, p, [0]) == pytest.approx(np.log(wide / narrow), abs=1e-5)


def test_of_two_that_do_the_same_the_one_of_larger_typical_size_is_no_less_likely():
    """One column for two effects, of which one is typically five times as large: what is seen is 0.5 or 0.1 of it, or less."""
    for size in (0.5, 0.25, 0.1):
        g = data([size], n=10_000, k=1)
        large = replace(g, A=25.0 * g.A, b=5.0 * g.b)
        same = zip((g, large), (prior(1, tolerance=1e-3), prior(1, tolerance=2e-4)), strict=True)
        odds = [worth(own, p, [0]) for own, p in same]
        assert abs(odds[0] - odds[1]) < 0.4


def test_a_cause_of_the_wrong_sign_is_held_against_it():
    g = data([-0.5], k=1)
    free, signed = prior(1), prior(1, [1.0])
    assert worth(g, signed, [0]) < worth(g, free, [0]) - 10


def test_a_set_is_worth_what_its_columns_are_in_any_order():
    g, p = data([0.3, 0.0, -0.2, 0.05]), prior(4, [0.0, 1.0, 1.0, 1.0])
    assert worth(g, p, [0, 2], [1]) == pytest.approx(worth(g, p, [1], [2, 0]))
    assert worth(g, p) == 0.0


def test_what_is_within_tolerance_is_no_finding():
    p = prior(4, tolerance=0.3)
    assert worth(data([0.2, 0, 0, 0]), p, [0]) < 1.0
    assert worth(data([2.0, 0, 0, 0]), p, [0]) > 5.0


def test_the_right_cause_wins_and_its_estimate_covers_the_truth():
    p = prior(4)
    candidates = CausePrior(((0,), (1,), (2,), (3,)), np.log(np.full(4, 0.25)), lambda i, j: False)
    hits = 0
    for seed in range(20):
        g = data([0, 0.4, 0, 0], seed=seed)
        scale = Scale(g, p, candidates)
        values = {m: scale(m) + candidates.prior(m) for m in [(), (0,), (1,), (2,), (3,), (0, 1)]}
        assert max(values, key=values.get) == (1,)
        mean, covariance = estimate(g, p, [1])
        hits += abs(mean[1] - 0.4) < 1.96 * np.sqrt(covariance[0, 0])
    assert hits >= 16


def strained(reach):
    """Two similar columns, both far beyond their tolerances, a third that differs, and a small one."""
    rng = np.random.default_rng(3)
    D = rng.standard_normal((200, 4)) @ np.array([[1, 0.9, 0, 0], [0, 0.4, 0, 0], [0, 0, 1, 0.5], [0, 0, 0, 1]])
    r = D @ np.array([1.5, -1.2, 0.8, 0.02]) + rng.standard_normal(200)
    return D, r, gram(D, r), prior(4, tolerance=0.1, reach=reach)


def test_no_tolerance_goes_beyond_its_reach_and_the_others_follow():
    D, r, g, p = strained(0.3)
    for members in ([], [0], [1, 2]):
        precision = np.where(np.isin(np.arange(4), members), 0.1, 10.0)  # 1 over the prior deviation
        ends = np.where(np.isin(np.arange(4), members), np.inf, 0.3)
        asked = lsq_linear(np.vstack([D, np.diag(precision)]), np.append(r, np.zeros(4)), (-ends, ends), tol=1e-14)
        assert estimate(g, p, members)[0] == pytest.approx(asked.x, abs=1e-6)
        free = prior(4, tolerance=0.1)
        mean = estimate(g, free, members)[0]
        chi2 = [np.sum((r - D @ x) ** 2) + np.sum((precision * x) ** 2) for x in (mean, asked.x)]
        assert holding_back(posterior(g, free), p, members) == pytest.approx(0.5 * (chi2[1] - chi2[0]), rel=1e-4)


def test_what_needs_no_tolerance_beyond_its_reach_wins():
    """1000 rows strain a tolerance as far as they like for what a prior of sets asks for a second cause."""
    rng = np.random.default_rng(5)
    D = rng.standard_normal((1000, 2))
    g = gram(D, D @ np.array([0.5, 0.35]) + rng.standard_normal(1000))
    candidates = CausePrior(((0,), (1,)), np.log(np.full(2, 1e-4)), lambda i, j: False)

    def lead(p):
        scale = Scale(g, p, candidates)
        return scale((0, 1)) + candidates.prior((0, 1)) - scale((0,)) - candidates.prior((0,))

    assert lead(prior(2, tolerance=0.1)) < 0.0 < lead(prior(2, tolerance=0.1, reach=0.2))


def test_an_absent_column_takes_no_part():
    g = data([0.3, 0.0, -0.2, 0.05])
    without = replace(g, A=g.A[:3, :3], b=g.b[:3])
    got, wanted = posterior(g, prior(4), [0], absent=[3]), posterior(without, prior(3), [0])
    assert got.log_evidence == pytest.approx(wanted.log_evidence)
    assert got.across([0, 2])[:3] == pytest.approx(wanted.across([0, 2]))
    assert not got.across([0])[3]
