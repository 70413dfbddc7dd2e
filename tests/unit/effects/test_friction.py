"""Friction turns round over the length that its parameter states: Dahl's law, written down anew."""

import numpy as np
import pytest

from camcomp.effects import friction
from camcomp.model.effect import Motion, nominal


@pytest.mark.parametrize("length", [0.002, 0.01])
def test_the_force_turns_round_over_the_presliding_length(length):
    x = np.concatenate((np.linspace(0.0, 0.1, 401), np.linspace(0.1, 0.0, 401)[1:]))[:, None]
    t = np.linspace(0.0, 8.0, len(x))
    rigid, zero = np.array([np.inf]), np.zeros_like(x)
    motion = Motion(t, t, t, None, x, np.gradient(x, t, axis=0), np.sign(np.gradient(x, t, axis=0)), np.zeros(1), rigid)
    p = {**nominal(friction), "force_N": 30.0, "presliding_mm": length}
    drive = friction.on_drive_force(zero, motion, np.ones(1), p)[:, 0]
    forth = 30.0 * (1.0 - np.exp(-x[:401, 0] / length))
    back = -30.0 + (forth[-1] + 30.0) * np.exp(-(0.1 - x[400:, 0]) / length)
    assert drive[:401] == pytest.approx(forth, abs=1e-6)
    assert drive[400:] == pytest.approx(back, abs=1e-6)


def test_it_turns_round_over_the_way_of_carriage_or_encoder():
    x = np.concatenate((np.linspace(0.0, 0.2, 2001), np.linspace(0.2, 0.0, 2001)[1:]))[:, None]
    t = np.linspace(0.0, 8.0, len(x))
    force, length, spring = 200.0, 0.005, 1e4
    motion = Motion(
        t, t, t, None, x, np.gradient(x, t, axis=0), np.sign(np.gradient(x, t, axis=0)), np.zeros(1), np.array([spring])
    )
    zero = np.zeros_like(x)
    p = {**nominal(friction), "force_N": force, "presliding_mm": length}
    pull = {
        way: friction.on_drive_force(zero, motion, np.ones(1), {**p, "carriage_way": way})[2000:, 0]
        for way in (0.0, 1.0)
    }
    back = 0.2 - x[2000:, 0]
    fade = {
        way: force * (2.0 * np.exp(-(back - way * (pull[1.0][0] - pull[way]) / spring) / length) - 1.0) for way in pull
    }
    assert pull[0.0] == pytest.approx(fade[0.0], abs=1e-6)
    assert pull[1.0] == pytest.approx(fade[1.0], abs=0.1)  # the carriage came with a little less than all of the force
    assert np.abs(pull[0.0] - pull[1.0]).max() > 0.5 * force
