"""A set with a member that may be minor is the answer without it."""

from types import SimpleNamespace

import numpy as np
import pytest

from camcomp.diagnosis.search import established as module
from camcomp.diagnosis.statistics.cause_sets import CausePrior, Fitted, probabilities, with_minor

PROBLEM = SimpleNamespace(
    candidates=CausePrior(tuple((i,) for i in range(5)), np.log(np.full(5, 0.2)), lambda i, j: False)
)


def fitted(evidence, *members):
    return Fitted(
        members=members, theta=np.zeros(len(members)), covariance=np.eye(len(members)), log_evidence=evidence, grams=()
    )


def test_what_may_as_well_be_minor_is_not_named_and_the_others_are_as_likely_as_with_it(monkeypatch):
    """Without it (0, 1) explains less than (0, 3), which stands for it; with it more."""
    monkeypatch.setattr(module, "weakest", lambda problem, f: 2 if 2 in f.members else None)
    fits = (fitted(20.0, 0, 1, 2), fitted(16.0, 0, 3, 4))
    after, probability = module.established(
        PROBLEM, fits, lambda members: fitted(0.0, *members), 1.5, probabilities(fits, PROBLEM.candidates, 1.5)
    )
    assert {(f.members, f.minor) for f in after} == {((0, 1), (2,)), ((0, 3, 4), ())}
    assert probability == pytest.approx(probabilities(fits, PROBLEM.candidates, 1.5)[::-1])


def test_what_takes_the_place_of_a_set_keeps_what_makes_it_likeliest(monkeypatch):
    """It may be among the sets already, with something else that is minor."""
    monkeypatch.setattr(module, "weakest", lambda problem, f: 2 if 2 in f.members else None)
    less = with_minor(fitted(0.0, 0), fitted(30.0, 0, 4))
    fits = (fitted(20.0, 0, 2), less)
    after, _ = module.established(PROBLEM, fits, fitted, 1.5, np.array([0.5, 0.5]))
    assert after == (less,)
