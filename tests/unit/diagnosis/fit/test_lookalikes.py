"""A slope of the guideways is asked about where runs change their level, be it for a plunge only."""

from types import SimpleNamespace

import numpy as np
import pytest

from camcomp.diagnosis.fit import lookalikes


def slope_on(*levels):
    """A bench, a slope, and its effect on the tip of each run: levels (n,) of the tool in um of shift."""
    columns = [np.column_stack([np.zeros((len(each), 2)), np.asarray(each, float)[:, None]]) for each in levels]
    run = SimpleNamespace(measured=SimpleNamespace(has=lambda kind: kind == "tip"))
    candidate = SimpleNamespace(effect=SimpleNamespace(TARGET="named"), shapes=(), switches=())
    return SimpleNamespace(runs=[run] * len(levels)), candidate, [columns]


@pytest.mark.parametrize(
    ("levels", "shift"),
    [
        (([3.0] * 100, [-5.0] * 100), True),  # one level each
        (([3.0] * 100, [*np.linspace(-4.0, -5.0, 5), *[-5.0] * 95]), True),  # what a row's noise hides
        (([*np.linspace(0.0, 3.0, 20), *[3.0] * 80], [-5.0] * 100), False),  # a plunge tells a slope from a slip
        ((np.linspace(-3.0, 3.0, 100), np.linspace(-3.0, 3.0, 100)), False),
    ],
)
def test_runs_that_stay_on_one_level_show_one_shift_each(monkeypatch, levels, shift):
    bench, candidate, columns = slope_on(*levels)
    monkeypatch.setattr(lookalikes, "candidate_columns", lambda *_: columns)
    monkeypatch.setattr(lookalikes, "shape_default", lambda *_: {})
    assert (lookalikes.without_lookalikes(bench, [candidate]) == []) is shift
