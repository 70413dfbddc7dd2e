"""Sets of causes that rows and stated tolerances cannot separate are alternatives, whatever the priors of their sizes."""

from types import SimpleNamespace

import numpy as np

from camcomp.diagnosis.fit.cause_sets import CausePrior, Fitted, Scale
from camcomp.diagnosis.search.cause_search import _same
from camcomp.diagnosis.statistics.evidence import Prior, estimate, gram
from camcomp.diagnosis.statistics.probability import EQUAL_LOG_ODDS


def problem_of(twin):
    """Rows that follow the first column 0.7 of its scale; the second does the same with 10 of its own, `twin` its share."""
    rng = np.random.default_rng(2)
    D = rng.standard_normal((400, 2))
    D[:, 1] = 0.07 * (twin * D[:, 0] + np.sqrt(1.0 - twin**2) * D[:, 1])
    data = gram(D, 0.7 * D[:, 0] + rng.standard_normal(400))
    one = np.ones(2)
    prior = Prior(1e-3 * one, 0.0 * one, np.inf * one)
    candidates = CausePrior(((0,), (1,)), np.log(0.5 * one), lambda i, j: True)
    scale = Scale(data, prior, candidates)
    fits = tuple(
        Fitted(
            members=(i,),
            theta=estimate(data, prior, [i])[0][[i]],
            log_evidence=scale((i,)),
            grams=(data,),
        )
        for i in range(2)
    )
    return SimpleNamespace(prior=prior, candidates=candidates), fits


def test_an_unusual_size_alone_excludes_no_set():
    problem, fits = problem_of(twin=1.0)
    assert fits[0].log_evidence - fits[1].log_evidence > EQUAL_LOG_ODDS
    assert _same(problem, fits, fits[0]) == [(1,)]


def test_rows_that_follow_another_set_worse_exclude_it():
    problem, fits = problem_of(twin=0.9)
    assert _same(problem, fits, fits[0]) == []
