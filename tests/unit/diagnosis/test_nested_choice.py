"""A run is judged with the causes of the others: what it alone has decided is no answer to it."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from camcomp.diagnosis.answer.held_out import causes_without
from camcomp.diagnosis.fit.cause_sets import CausePrior, Fitted, Scale, probabilities
from camcomp.diagnosis.statistics.evidence import Prior, estimate, gram
from camcomp.diagnosis.statistics.normal_equations import sum_grams


class Told(SimpleNamespace):
    """As much of a problem as the choice asks for: a cause is told by its number and its size."""

    def member_columns(self, members):
        return list(members)

    def determined_without(self, f, k, members):
        others = f.without(k)
        return estimate(others, self.prior, list(members))[0][list(members)], None

    def causes(self, members, theta, shapes):
        return list(zip(members, theta, strict=True))


def experiment(sizes, weights, *, only_last=False):
    """Three runs; what column 0 and column 1 do differs in the last one only, column 2 does something of its own.

    only_last: neither of the two does anything in the others.
    """
    rng = np.random.default_rng(8)
    runs = []
    for last in (False, False, True):
        D = rng.standard_normal((200, 3))
        D[:, 1] = 0.3 * D[:, 0] + D[:, 1] if last else D[:, 0] + 0.02 * D[:, 1]
        D[:, :2] *= last or not only_last
        runs.append(gram(D, D @ sizes + rng.standard_normal(200)))
    prior = Prior(np.full(3, 1e-3), np.zeros(3), np.full(3, np.inf))
    problem = Told(
        prior=prior,
        candidates=CausePrior(((0,), (1,), (2,)), np.log(weights), lambda i, j: False),
        bench=SimpleNamespace(runs=[None] * 3),
    )
    scale = Scale(sum_grams(runs), prior, problem.candidates)

    def fit(members):
        theta = estimate(sum_grams(runs), prior, list(members))[0][list(members)]
        return Fitted(
            members=members,
            theta=theta,
            log_evidence=scale(members),
            grams=tuple(runs),
        )

    return problem, fit


def test_what_one_run_decides_is_not_what_that_run_is_judged_with():
    problem, fit = experiment(np.array([1.0, 0.0, 0.0]), np.array([0.05, 0.9, 0.05]))
    fits = [fit((0,)), fit((1,)), fit(())]
    probability = probabilities(fits, problem.candidates)
    assert probability[0] > 0.99  # with all runs nobody doubts which one it is
    chosen = causes_without(problem, fits[0], fits, probability)
    assert [tuple(each) for each in chosen] == [(0,), (0,), (1,)]
    assert chosen[2][1][1] == pytest.approx(1.0, abs=0.2)


def test_what_shows_in_one_run_alone_is_not_named_by_the_others():
    problem, fit = experiment(np.array([1.0, 0.0, 0.0]), np.array([0.4, 0.3, 0.3]))
    both = fit((0, 2))
    chosen = causes_without(problem, both, [both, fit(())], np.array([0.9, 0.1]))
    assert [tuple(each) for each in chosen] == [(0,), (0,), (0,)]
    one = SimpleNamespace(**vars(problem) | {"bench": SimpleNamespace(runs=[None])})
    one.causes = problem.causes
    assert [tuple(each) for each in causes_without(one, both, [both], np.ones(1))] == [(0, 2)]


def test_what_is_minor_beside_the_answer_is_beside_its_parts_too():
    """Column 2 shows in all runs and is no cause: it is no reason to keep what the others do not ask for."""
    problem, fit = experiment(np.array([0.0, 1.0, 0.4]), np.array([0.4, 0.3, 0.3]), only_last=True)
    for minor in ((), (2,)):
        f = replace(fit((1,)), minor=minor)
        chosen = causes_without(problem, f, [f, fit(())], np.array([0.9, 0.1]))
        assert tuple(chosen[2]) == ()


def test_a_set_with_more_in_it_is_no_rival():
    """It was tried, and is not the answer."""
    problem, fit = experiment(np.array([1.0, 0.0, 1.0]), np.array([0.4, 0.3, 0.3]))
    chosen = causes_without(problem, fit((0,)), [fit((0,)), fit((0, 2)), fit((1, 2))], np.array([0.2, 0.7, 0.1]))
    assert [tuple(each) for each in chosen] == [(0,), (0,), (0,)]
