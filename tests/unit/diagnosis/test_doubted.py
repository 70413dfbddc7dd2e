"""How sure a cause is beside something unknown: it may be an imitation of that, as far as it is there and goes by what that goes by."""

from types import SimpleNamespace

import numpy as np
import pytest

from camcomp.diagnosis.search import beside
from camcomp.diagnosis.search.beside import _Beside, doubted
from camcomp.diagnosis.search.families import Family
from camcomp.diagnosis.search.imitation import _drawn
from camcomp.diagnosis.statistics.by_channel import ByChannel

PROBLEM = SimpleNamespace(bench=SimpleNamespace(actuators=("x", "y", "z")))
ONE = SimpleNamespace(members=(0,))


def sure(monkeypatch, *, size, share=1.0, anywhere=False, drawn=0.0):
    each = {0: _Beside(size, size, share, not anywhere, anywhere)}
    monkeypatch.setattr(beside, "_beside", lambda *_: each)
    return doubted(PROBLEM, ONE, {}, {0: drawn})[0]


def test_what_is_twice_as_large_as_the_rest_of_its_own_actuator_is_as_likely_a_part_of_it(monkeypatch):
    """Two thirds of chance for another actuator, four tenths for a second cause at all; a fifth of all imitations are so good."""
    assert 0.3 < sure(monkeypatch, size=2.15, share=0.94) < 0.5
    assert sure(monkeypatch, size=2.15, share=0.02) > 0.9  # the rest is another actuator's
    assert sure(monkeypatch, size=8.0, share=0.94) > 0.8  # nothing imitates so well


def test_what_goes_by_what_the_rest_goes_by_is_doubted_and_anything_else_is_not(monkeypatch):
    """A bending tool beside what slips under force; softer links beside a bent guide."""
    assert sure(monkeypatch, size=1.7, anywhere=True, drawn=0.76) < 0.3
    assert sure(monkeypatch, size=3.8, anywhere=True, drawn=0.46) < 0.8
    assert sure(monkeypatch, size=2.3, anywhere=True, drawn=0.0) > 0.95


@pytest.mark.parametrize("angle", [0.0, 0.4, np.pi / 2])
def test_a_family_draws_the_part_of_a_member_that_lies_among_its_functions(angle):
    rows = np.arange(400) / 400
    seen, beside_it = np.sin(2 * np.pi * rows), np.cos(2 * np.pi * rows)
    W = ByChannel.of([3.0 * (np.cos(angle) * seen + np.sin(angle) * beside_it)[:, None]])
    every = np.ones(len(rows), bool)
    family = Family("place", every, ByChannel.of([np.stack([seen, seen**3], axis=1)]), (np.arange(2),))
    problem = SimpleNamespace(member_columns=list)
    f = SimpleNamespace(members=(0,), theta=np.array([0.7]))
    assert _drawn(problem, f, W, family)[0] == pytest.approx(np.cos(angle) ** 2, abs=1e-6)
    assert _drawn(problem, f, W, None) == {0: 0.0}
