"""The size from which a residual beyond a set of causes is an effect that the library lacks."""

from types import SimpleNamespace

import numpy as np
import pytest

from camcomp.diagnosis.fit.cause_sets import Fitted
from camcomp.diagnosis.search.cause_search import _stated, above_floor, unknown_kind
from camcomp.diagnosis.search.unexplained import Unexplained

PROBLEM = SimpleNamespace(
    floor=SimpleNamespace(tip_um=5.0),
    moved_um=lambda f, members=(0, 1): abs(float(np.sum(f.theta[list(members)]))),
)


@pytest.mark.parametrize(
    ("first", "second", "shown"), [(45.0, -32.0, None), (13.0, 0.0, "tip"), (45.0, 0.0, None), (200.0, -190.0, "tip")]
)
def test_causes_that_undo_each_other_are_modelled_no_better_for_it(first, second, shown):
    """3 um jointly with a force of 45 um and links that take 32 of them away again; but not beside two that leave 10 of 200."""
    f = Fitted(members=(0, 1), theta=np.array([first, second]), log_evidence=0.0, grams=())
    beyond = {"tip": Unexplained("tip", excess_um=3.0, z=8.0)}
    assert unknown_kind(PROBLEM, f, beyond) == shown
    assert above_floor(PROBLEM, beyond)


@pytest.mark.parametrize(("imitated", "share"), [(False, 1.0), (True, 0.8)])
def test_causes_whose_runs_exceed_the_floor_share_what_a_discrepancy_leaves(imitated, share):
    stated = _stated(SimpleNamespace(inclusion={0: 1.0, 2: 0.1}), {0: 1.0, 1: 0.6}, imitated=imitated)
    assert stated == pytest.approx({0: share, 1: 0.6 * share, 2: 0.1 * share}, abs=2e-4)
