"""The iterations of eqs. (4) and (5) where a whole step would lead away from the solution."""

from types import SimpleNamespace

import numpy as np
import pytest

from camcomp.model.statics import target

AIM = np.array([[1.0, 2.0, -3.0], [0.0, 0.5, 4.0]])


@pytest.mark.parametrize("gain", [1.0, 1.5, 3.0, 6.0])
def test_steps_are_halved_until_the_iteration_converges(gain, monkeypatch):
    """A machine whose tip goes `gain` times as far as commanded: whole steps converge for a gain below 2 alone."""

    def solve(machine, mode, commanded, **_):
        tip = gain * np.asarray(commanded)
        n = len(tip)
        return SimpleNamespace(tip=tip, status=np.zeros(n, np.int64), force=np.zeros((n, 3)))

    def settle(machine, commanded, force, wrench, aim):
        n = len(commanded)
        blank, whole = np.zeros((n, 3)), np.zeros(n, np.int64)
        return None, target.Correction(
            commanded=commanded,
            rho_nominal=blank,
            rho=blank,
            drive=blank,
            tilt=blank,
            status=whole,
            iterations=whole,
            rotation=np.tile(np.eye(3), (n, 1, 1)),
        )

    monkeypatch.setattr(target, "solve", solve)
    monkeypatch.setattr(target, "settle", settle)
    found = target.correct(None, AIM, np.zeros(3), method="fixed-point")
    assert not found.status.any()
    np.testing.assert_allclose(found.commanded, AIM / gain, atol=1e-6)
