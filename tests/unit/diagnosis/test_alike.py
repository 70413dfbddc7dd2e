"""Sets of causes that rows and stated tolerances cannot separate are alternatives, whatever the priors of their sizes."""

from types import SimpleNamespace

import numpy as np
import pytest

from camcomp.diagnosis.fit.cause_sets import CausePrior, Fitted, Prior, estimate, weighed
from camcomp.diagnosis.model.candidates import PlacedCause
from camcomp.diagnosis.search.cause_search import _same
from camcomp.diagnosis.statistics.normal_equations import gram
from camcomp.diagnosis.statistics.probability import EQUAL_LOG_ODDS


def problem_of(twin, more=0):
    """Rows that follow the first column 0.7 of its scale; the second does the same with 10 of its own, `twin` its share, in a
    cause of so many columns more, of which the rows show nothing.
    """
    rng = np.random.default_rng(2)
    D = rng.standard_normal((400, 2 + more))
    effect = np.array([1.0, 0.07, *(1.0 for _ in range(more))])
    D[:, 1] = effect[1] * (twin * D[:, 0] + np.sqrt(1.0 - twin**2) * D[:, 1])
    data = gram(D, 0.7 * D[:, 0] + rng.standard_normal(400))
    prior, columns = Prior(1e-3 / effect, 0.0 * effect, 0.02 / effect), ((0,), tuple(range(1, 2 + more)))
    sets = weighed(data, prior, CausePrior(tuple(PlacedCause(str(i), None, own) for i, own in enumerate(columns))))
    fits = tuple(
        Fitted(
            members=(i,), theta=estimate(data, prior, own)[0][list(own)], covariance=np.eye(len(own)),
            log_evidence=sets.evidence((i,)), grams=(data,),
        )
        for i, own in enumerate(columns)
    )  # fmt: skip
    return SimpleNamespace(prior=prior, member_columns=lambda members: [c for i in members for c in columns[i]]), fits


def test_an_unusual_size_alone_excludes_no_set():
    problem, fits = problem_of(twin=1.0)
    assert fits[0].log_evidence == pytest.approx(fits[1].log_evidence, abs=0.1)
    assert _same(problem, fits, fits[0]) == [(1,)]


def test_parameters_of_which_rows_show_nothing_exclude_no_set():
    problem, fits = problem_of(twin=1.0, more=5)
    assert fits[0].log_evidence - fits[1].log_evidence > EQUAL_LOG_ODDS
    assert _same(problem, fits, fits[0]) == [(1,)]


def test_rows_that_follow_another_set_worse_exclude_it():
    problem, fits = problem_of(twin=0.9)
    assert _same(problem, fits, fits[0]) == []
