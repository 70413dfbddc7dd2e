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
    motion = Motion(
        time=t,
        common=t,
        cut_min=t,
        temperature=None,
        encoder=x,
        speed=np.gradient(x, t, axis=0),
        direction=np.sign(np.gradient(x, t, axis=0)),
        home=np.zeros(1),
        stiffness=rigid,
    )
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
        time=t,
        common=t,
        cut_min=t,
        temperature=None,
        encoder=x,
        speed=np.gradient(x, t, axis=0),
        direction=np.sign(np.gradient(x, t, axis=0)),
        home=np.zeros(1),
        stiffness=np.array([spring]),
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


@pytest.mark.parametrize(("force", "more"), [
    ("force_N", {"stribeck_N": 12.0, "stribeck_mm_per_s": 2.0, "viscous_Ns_per_mm": 0.5}),
    ("force_Nmm", {"stribeck_Nmm": 12.0, "stribeck_rad_per_s": 2.0, "viscous_Nmms_per_rad": 0.5}),
])  # fmt: skip
@pytest.mark.parametrize("speed", [0.2, 2.0, 15.0])
def test_friction_falls_from_breakaway_to_sliding_with_speed(force, more, speed):
    """The Stribeck curve: 30 + 12 exp(-(v / 2)^2) + v / 2, both ways."""
    t = np.linspace(0.0, 2.0, 401)
    x = (speed * np.where(t < 1.0, t, 2.0 - t))[:, None]
    way = np.gradient(x, t, axis=0)
    motion = Motion(
        time=t,
        common=t,
        cut_min=t,
        temperature=None,
        encoder=x,
        speed=way,
        direction=np.sign(way),
        home=np.zeros(1),
        stiffness=np.array([np.inf]),
    )
    p = {**nominal(friction), force: 30.0, "presliding_mm": 1e-4, "presliding_rad": 1e-4, **more}
    drive = friction.on_drive_force(np.zeros_like(x), motion, np.ones(1), p)[:, 0]
    want = 30.0 + 12.0 * np.exp(-((speed / 2.0) ** 2)) + 0.5 * speed
    assert drive[150] == pytest.approx(want, rel=1e-6) and drive[350] == pytest.approx(-want, rel=1e-6)
