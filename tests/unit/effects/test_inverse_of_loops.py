"""Set-points ahead of control loops: through the loop they lead to the positions that were asked for."""

import numpy as np
import pytest

from camcomp.ground import shelf
from camcomp.model.effect import Cause, Motion
from camcomp.model.hysteresis import play
from camcomp.model.signal_path import controlled, set_points_for

TAU_S = 0.005
LAG = "servo_lag", {"time_constant_ms": 1e3 * TAU_S}
LEAD = "servo_lag", {"time_constant_ms": -3.0}
SWING = "servo_overshoot", {"period_ms": 40.0, "damping": 0.4}
ACTUATORS = ("x", "y")


def causes(*loops, target=None):
    return [Cause(name, shelf.load("effects", name), target, values) for name, values in loops]


def motion(time, position):
    zero = np.zeros_like(position)
    return Motion(
        time=time, common=time, cut_min=time, temperature=None, encoder=position, speed=zero, direction=zero,
        home=np.zeros(2), stiffness=np.full(2, 1e4),
    )  # fmt: skip


def led(loops, time, wanted):
    """Set-points (n, 2) for wanted positions (n, 2), and the positions that they lead to."""
    ahead = set_points_for(loops, ACTUATORS, motion(time, wanted))
    return ahead, controlled(loops, ACTUATORS, motion(time, ahead))


def instants(step_s):
    """Uneven ones, from half to one and a half steps apart, and a rest in the middle."""
    time = np.cumsum(np.random.default_rng(1).uniform(0.5, 1.5, 600) * step_s)
    time[300:] += 60.0
    return time


def smooth(time):
    """A motion that begins and ends gently, before and behind the rest."""
    run = np.where(np.arange(len(time)) < 300, time, time - time[300])
    share = np.clip(run / run[299], 0.0, 1.0)
    way = 10.0 * run[299] * (share - np.sin(2.0 * np.pi * share) / (2.0 * np.pi))
    return np.column_stack((way, -0.5 * way))


@pytest.mark.parametrize("step_s", [2e-4, 1e-3, 6e-3, 2e-2])
@pytest.mark.parametrize("loops", [(LAG,), (LEAD,), (SWING,), (SWING, LAG), (LAG, SWING)])
def test_a_smooth_motion_is_met(loops, step_s):
    time = instants(step_s)
    wanted = smooth(time)
    late = controlled(causes(*loops), ACTUATORS, motion(time, wanted)) - wanted
    got = led(causes(*loops), time, wanted)[1] - wanted
    assert np.abs(got).max() < 0.02 * np.abs(late).max() or loops == (LEAD,) and np.abs(got).max() < 5e-3


@pytest.mark.parametrize("share", [1e-3, 0.1, 1.0])
def test_behind_a_jump_of_the_speed_a_lag_soon_misses_nothing_and_set_points_do_not_alternate(share):
    """The first step is a share of the others."""
    step = 0.2 * TAU_S
    time = np.concatenate(([0.0], share * step + step * np.arange(200)))
    wanted = np.column_stack((20.0 * time, 0.0 * time))
    ahead, got = led(causes(LAG), time, wanted)
    off = np.abs(got - wanted)[:, 0]
    assert off.max() < 20.0 * share * step and off[time > 2.0 * TAU_S].max() < 2e-3 * 20.0 * step
    turns = np.diff(ahead[time > 0.5 * TAU_S, 0], n=2)
    assert np.abs(turns).max() < 0.1 * 20.0 * TAU_S * share and np.abs(turns[10:]).max() < 1e-4 * 20.0 * TAU_S


def test_a_jump_within_no_time_takes_no_large_excursion_of_a_lag():
    """As where a drive goes through its play in a line of a micrometre."""
    time = np.concatenate((1e-3 * np.arange(50), 0.049 + 1e-5 * np.arange(1, 3), 0.05 + 1e-3 * np.arange(50)))
    wanted = np.column_stack((0.02 * (time > 0.049), 0.0 * time))
    ahead, got = led(causes(LAG), time, wanted)
    assert -0.05 < ahead.min() and ahead.max() < 0.1
    assert np.abs(got - wanted)[time > 0.06].max() < 1e-3


@pytest.mark.parametrize("share", [0.02, 0.1, 0.5, 0.9])
@pytest.mark.parametrize("tau_s", [2e-4, 1e-3, 3e-3, 5e-3, 2e-2])
def test_a_carriage_that_turns_round_follows_a_late_drive_through_its_play(tau_s, share):
    """Its encoder neither leaves the flank before the turn nor goes too far behind it. Share of a step within which it goes through."""
    step, width = 6e-3, 0.02
    time = step * np.concatenate((np.arange(-40, 1), [share], np.arange(1, 40)))
    fine = np.linspace(time[0], time[-1], 50_000)

    def carriage(t):
        return 9.0 * t**2

    encoder = carriage(time) + np.where(time > 0.0, 0.5 * width, -0.5 * width)
    lag = "servo_lag", {"time_constant_ms": 1e3 * tau_s}
    ahead = led(causes(lag), time, np.column_stack((encoder, encoder)))[0]
    between = np.column_stack([np.interp(fine, time, each) for each in ahead.T])
    got = controlled(causes(lag), ACTUATORS, motion(fine, between))
    off = np.abs(got + play(got, width) - carriage(fine)[:, None])
    assert off[fine > -0.1].max() < 5e-4


@pytest.mark.parametrize("damping", [0.1, 1.0, 3.0])
@pytest.mark.parametrize("step_s", [1e-3, 5e-3, 0.05])
def test_a_swinging_loop_meets_any_motion_at_every_instant(step_s, damping):
    time = instants(step_s)
    rough = np.cumsum(np.random.default_rng(2).normal(size=(600, 2)), axis=0)
    loops = causes(("servo_overshoot", {"period_ms": 40.0, "damping": damping}))
    assert np.abs(led(loops, time, rough)[1] - rough).max() < 1e-8


@pytest.mark.parametrize("loop", [LAG, LEAD, SWING])
def test_other_actuators_and_instants_at_the_same_time_stay(loop):
    time = instants(6e-3)
    time, wanted = np.repeat(time, 2), np.repeat(smooth(time), 2, axis=0)
    ahead, got = led(causes(loop, target="y"), time, wanted)
    assert np.array_equal(ahead[:, 0], wanted[:, 0]) and not np.array_equal(ahead[:, 1], wanted[:, 1])
    assert np.isfinite(ahead).all() and np.abs(got - wanted).max() < 2e-3
