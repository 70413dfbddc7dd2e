"""Sets of causes that rows and stated tolerances cannot separate are alternatives, whatever the priors of their sizes."""

import numpy as np
import pytest

from camcomp.diagnosis.fit.cause_sets import CausePrior, Fitted, Prior, estimate, weighed
from camcomp.diagnosis.model.candidates import PlacedCause
from camcomp.diagnosis.search.cause_search import _same
from camcomp.diagnosis.statistics.normal_equations import gram


def fits_of(twin):
    """Rows that follow the first column 0.7 of its scale; the second does the same with 10 of its own, `twin` its share."""
    rng = np.random.default_rng(2)
    D = rng.standard_normal((400, 2))
    effect = np.array([1.0, 0.07])
    D[:, 1] = effect[1] * (twin * D[:, 0] + np.sqrt(1.0 - twin**2) * D[:, 1])
    data = gram(D, 0.7 * D[:, 0] + rng.standard_normal(400))
    prior = Prior(1e-3 / effect, 0.0 * effect, 0.02 / effect)
    sets = weighed(data, prior, CausePrior(tuple(PlacedCause(str(i), None, (i,)) for i in range(2))))
    return tuple(
        Fitted(
            members=(i,),
            theta=estimate(data, prior, [i])[0][[i]],
            covariance=np.eye(1),
            log_evidence=sets.evidence((i,)),
            grams=(data,),
        )
        for i in range(2)
    )


def test_an_unusual_size_alone_excludes_no_set():
    fits = fits_of(twin=1.0)
    assert fits[0].log_evidence == pytest.approx(fits[1].log_evidence, abs=0.1)
    assert _same(fits, fits[0]) == [(1,)]


def test_rows_that_follow_another_set_worse_exclude_it():
    fits = fits_of(twin=0.9)
    assert _same(fits, fits[0]) == []
