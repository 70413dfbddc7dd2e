"""Signs and sizes of single effects, from their definitions, on motions simple enough to do by hand."""

from dataclasses import replace

import numpy as np
import pytest

from camcomp.ground import shelf
from camcomp.model.effect import Load, Motion
from camcomp.model.hysteresis import direction, first_order, play


def ramp(speed=1.0, n=401):
    """One actuator that goes up by 2 and down again."""
    t = np.linspace(0.0, 4.0, n)
    x = (speed * np.where(t < 2.0, t, 4.0 - t))[:, None]
    v = np.gradient(x, t, axis=0)
    return Motion(
        time=t,
        common=60.0 + t,
        cut_min=t / 60.0,
        temperature=None,
        encoder=x,
        speed=v,
        direction=direction(x),
        home=np.array([-300.0]),
        stiffness=np.array([1e4]),
    )


def drive(name, motion, **p):
    return shelf.load("effects", name).on_drive(np.zeros_like(motion.encoder), motion, np.ones(1), p)[:, 0]


def test_backlash_lags_by_half_its_width_on_either_side():
    error = drive("backlash", ramp(), width_mm=0.02)
    assert error[100] == pytest.approx(-0.01) and error[-1] == pytest.approx(+0.01)


def test_a_play_moves_the_carriage_only_after_its_full_width():
    x = np.array([[0.0], [0.05], [0.045], [0.031], [0.029]])
    carriage = (x + play(x, 0.02))[:, 0]
    assert carriage == pytest.approx([0.0, 0.04, 0.04, 0.04, 0.039])


def test_friction_winds_up_the_spring_against_the_travel_and_shows_in_the_drive():
    m, effect = ramp(), shelf.load("effects", "friction")
    assert drive("friction", m, force_N=100.0)[100] == pytest.approx(-0.01)
    force = effect.on_drive_force(np.zeros_like(m.encoder), m, np.ones(1), {"force_N": 100.0})[:, 0]
    assert force[100] == pytest.approx(100.0) and force[-1] == pytest.approx(-100.0)


def test_lag_on_a_ramp_is_speed_times_time_constant():
    m = ramp(speed=50.0)
    got = first_order(m.encoder, m.time, 0.004)[:, 0] - m.encoder[:, 0]
    assert got[150] == pytest.approx(-0.2) and got[-1] == pytest.approx(0.2)


def test_pitch_counts_from_home_and_offset_adds():
    m = ramp()
    assert drive("screw_pitch", m, error_ppm=100.0) == pytest.approx(1e-4 * (m.encoder[:, 0] + 300.0))
    assert drive("joint_offset", m, offset_mm=0.3) == pytest.approx(0.3)


def test_cyclic_error_repeats_with_its_pitch():
    m = ramp()
    error = drive("screw_cyclic", m, amplitude_mm=0.005, pitch_mm=0.5, phase_rad=0.3)
    assert error[50] == pytest.approx(error[100]) and error.max() == pytest.approx(0.005, rel=1e-2)


def test_warm_up_without_a_thermometer_follows_the_common_clock():
    m = ramp()
    error = drive("thermal_growth", m, growth_mm_per_K=0.01, warm_up_s=60.0)
    assert error[0] == pytest.approx(0.1 * (1.0 - np.exp(-1.0)))


def test_wear_counts_minutes_of_cutting_and_spares_the_weight():
    m = ramp()
    load = Load(np.ones((len(m.time), 3)), np.full((len(m.time), 6), 7.0))
    worn = shelf.load("effects", "tool_wear").on_load(load, m, {"growth_per_min": 3.0})
    assert worn.force[-1] == pytest.approx(1.0 + 3.0 * 4.0 / 60.0) and worn.wrench is load.wrench


def test_a_new_tool_in_every_run_does_not_wear_by_what_was_cut_before():
    m = replace(ramp(), cut_before_min=0.5)
    m = replace(m, cut_min=m.cut_min + 0.5)
    load, on_load = (
        Load(np.ones((len(m.time), 3)), np.zeros((len(m.time), 6))),
        shelf.load("effects", "tool_wear").on_load,
    )
    worn, new = (on_load(load, m, {"growth_per_min": 3.0, "one_tool": one}).force[-1, 0] for one in (1.0, 0.0))
    assert (worn, new) == pytest.approx((1.0 + 3.0 * (0.5 + 4.0 / 60.0), 1.0 + 3.0 * 4.0 / 60.0))


def test_the_displaced_workpiece_sees_the_tip_on_the_other_side():
    see = shelf.load("effects", "workpiece_frame").on_workpiece
    p = {"shift_x_mm": 1.0, "shift_y_mm": 0.0, "shift_z_mm": 0.0, "rotation_deg": 90.0}
    assert see(np.array([[1.0, 2.0, 3.0]]), p)[0] == pytest.approx([2.0, 0.0, 3.0])


def test_a_late_tip_is_where_the_machine_was_earlier():
    assert shelf.load("effects", "time_sync").on_clock(np.array([1.0]), {"offset_s": 0.25}) == pytest.approx(0.75)
