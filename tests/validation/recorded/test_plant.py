"""The plant of the trials against laws of mechanics, the contract's signs and the reference numbers of the Orthoglide."""

import numpy as np
import pytest

from tests.validation.recorded import drives
from tests.validation.recorded.faults import LIBRARY, Fault, Faults, every, sized
from tests.validation.recorded.machines import MACHINES
from tests.validation.recorded.plant import Character, Motion, Run, cutting_lines, observe
from tests.validation.recorded.unmodelled import ON_ACTUATORS, strange
from tests.validation.recordings import recording

ORTHOGLIDE = MACHINES["orthoglide"]
WAYS = Character()
NOTHING = Faults()


def rows(name, count=60):
    record = recording.load(name)
    return record.t[np.linspace(5, len(record.t) - 6, count).astype(int)]


def wrong(effect, target, size, seed=0):
    return Faults((sized(effect, target, size, seed),))


def tips(name, faults, *, cutting=False, t=None):
    return observe(ORTHOGLIDE, Run(recording.load(name), cutting, 100.0), faults, WAYS, rows(name) if t is None else t)


@pytest.mark.parametrize("name", recording.names())
def test_a_perfect_machine_in_air_is_where_it_is_commanded(name):
    state = tips(name, NOTHING)
    assert np.abs(state.tip - state.commanded).max() < 1e-9
    assert np.abs(state.drive).max() < 1e-6


def test_recordings_of_two_sets_may_share_a_name():
    for name in ("pockets", "fast_machine"):
        with recording.taken_from(name):
            state = tips("circles-blended", NOTHING)
        assert np.abs(state.tip - state.commanded).max() < 1e-9


def test_a_rigid_machine_stays_there_under_force():
    stiff = [Fault("link_stiffness", None, {"factor": 1e7})]
    stiff += [Fault("drive_stiffness", a, {"factor": 1e7}) for a in "xyz"]
    state = tips("pocket-10um", Faults(stiff), cutting=True)
    assert np.linalg.norm(state.force, axis=1).max() > 200
    assert np.abs(state.tip - state.commanded).max() < 1e-6


def test_the_loaded_minimum_obeys_virtual_work():
    """Of the least potential V, drive = dV/djoint and tip = -dV/dforce: ddrive/dforce = -dtip/djoint."""
    joints = ORTHOGLIDE.inverse(np.array([[20.0, -15.0, 5.0]]) + ORTHOGLIDE.origin)
    force, faults = np.array([[180.0, 90.0, -40.0]]), wrong("chain_error", "y", 0.3)

    def slope(joint, pull):
        near, far = (ORTHOGLIDE.settle(faults, joints + s * joint, force + s * pull) for s in (-1, 1))
        return (far[0] - near[0])[0] / 2, (far[1] - near[1])[0] / 2

    by_joint = np.stack([slope(1e-2 * e, 0 * e)[0] / 1e-2 for e in np.eye(3)], 1)
    by_force = [slope(0 * e, e) for e in np.eye(3)]
    tip, drive = (np.stack([each[k] for each in by_force], 1) for k in (0, 1))
    assert drive == pytest.approx(-by_joint.T, abs=2e-5)
    assert np.abs(by_joint).max() > 0.5
    # Maxwell and Betti; not closer, as the stiffness of a parallelogram is held fixed while the energy is differentiated
    assert tip == pytest.approx(tip.T, rel=1e-4)


def test_reference_numbers_on_the_recorded_circle():
    """24 points of the counter-clockwise circle of radius 25 mm about Q1: 0.707, 0.854, 1.148 mm and 333.1 N."""
    record = recording.load("circles-exact")
    on = np.flatnonzero(record.line == 7)
    angle = np.unwrap(np.arctan2(*record.tip[on, 1::-1].T))
    t = record.t[on[np.searchsorted(angle, np.arange(24) * np.pi / 12 + 1e-3)]]
    rolled = Faults(Fault("chain_error", a, {"roll_deg": 1.0}) for a in "xyz")

    def worst(faults, cutting):
        state = tips("circles-exact", faults, cutting=cutting, t=t)
        return np.linalg.norm(state.tip - state.commanded, axis=1).max(), np.abs(state.drive).max()

    assert worst(NOTHING, True)[0] == pytest.approx(0.707, abs=1e-3)
    assert worst(rolled, False)[0] == pytest.approx(0.854, abs=1e-3)
    assert worst(rolled, True) == (pytest.approx(1.148, abs=1e-3), pytest.approx(333.1, abs=0.2))


def test_a_servo_is_late_by_its_delay():
    t = np.arange(3000) * drives.STEP_S
    assert drives.servo(20.0 * t, 3.0, 0.15)[-1] == pytest.approx(20.0 * (t[-1] - 0.003), abs=1e-9)
    assert drives.servo(np.full(100, 7.0), 3.0, 0.15) == pytest.approx(np.full(100, 7.0))


def test_friction_holds_back_and_winds_up_the_spring():
    way = np.concatenate([np.linspace(0, 5, 1000), np.linspace(5, 0, 1000)])
    held = drives.bristles(way, 60.0, 0.008, 1e4, 0.1, 1.0)
    assert (held[900], held[1900]) == (pytest.approx(60.0, rel=0.02), pytest.approx(-60.0, rel=0.02))
    record = recording.load("rectangle-exact")
    t = record.t[record.line == 7][100:-100:50]  # along +x at 25 mm/s
    state = [tips("rectangle-exact", f, t=t) for f in (NOTHING, wrong("friction", "x", 60.0))]
    assert (state[1].drive - state[0].drive)[:, 0] == pytest.approx(60.0, rel=0.05)
    late = ORTHOGLIDE.inverse(state[1].tip + ORTHOGLIDE.origin)[:, 0] - state[0].setpoint[:, 0]
    assert late == pytest.approx(-60.0 / 1e4, rel=0.05)


@pytest.mark.parametrize(
    ("effect", "size", "shift"),
    [
        ("joint_offset", 0.02, lambda s: 0.02 + 0 * s.setpoint[:, 1]),
        ("screw_pitch", 100.0, lambda s: 1e-4 * (s.setpoint[:, 1] + 300.0)),
        ("thermal_growth", 0.002, lambda s: 0.002 * (s.temperature - 20.0)),
    ],
)
def test_a_carriage_error_is_carriage_minus_encoder(effect, size, shift):
    state = tips("zigzag-blended", wrong(effect, "y", size))
    joints = ORTHOGLIDE.inverse(state.tip + ORTHOGLIDE.origin)
    assert joints[:, 1] - state.encoder[:, 1] == pytest.approx(shift(state), abs=1e-6)
    assert np.abs(joints - state.encoder)[:, [0, 2]].max() < 1e-6


def test_play_is_the_whole_width_between_both_ways():
    state = tips("zigzag-blended", wrong("backlash", "x", 0.04), t=rows("zigzag-blended", 400))
    lost = (ORTHOGLIDE.inverse(state.tip + ORTHOGLIDE.origin) - state.encoder)[:, 0]
    speed = np.gradient(state.setpoint[:, 0])
    assert np.median(lost[speed > 0.3]) == pytest.approx(-0.02, abs=1e-6)
    assert np.median(lost[speed < -0.3]) == pytest.approx(0.02, abs=1e-6)


def test_the_tip_of_a_late_clock_is_that_of_earlier():
    t = rows("circles-blended")
    late, plain = (
        tips("circles-blended", wrong("time_sync", None, 0.01), t=t),
        tips("circles-blended", NOTHING, t=t - 0.01),
    )
    assert late.tip == pytest.approx(plain.tip, abs=1e-9)


def test_a_longer_tool_reaches_deeper_and_a_shifted_workpiece_is_measured_the_other_way():
    plain, longer = tips("ramp-exact", NOTHING), tips("ramp-exact", wrong("tool_length", None, 0.05))
    assert longer.tip - plain.tip == pytest.approx(np.tile([0, 0, -0.05], (len(plain.t), 1)), abs=1e-9)
    shift = Fault(
        "workpiece_frame", None, {"shift_x_mm": 0.1, "shift_y_mm": 0.0, "shift_z_mm": 0.0, "rotation_deg": 0.0}
    )
    assert tips("ramp-exact", Faults((shift,))).tip - plain.tip == pytest.approx(
        np.tile([-0.1, 0, 0], (len(plain.t), 1)), abs=1e-9
    )


def test_the_force_follows_the_motion_and_stays_in_a_pause():
    record = recording.load("pause-blended")
    held = slice(3300, 3850)
    assert np.ptp(record.tip[held], axis=0).max() == 0.0
    force = Motion(ORTHOGLIDE, Run(record, True, 0.0), NOTHING, WAYS).force(record.t, 0.0)
    assert np.ptp(force[held], axis=0).max() == 0.0
    outward = record.tip[held.start, :2] - [10, -10]  # counter-clockwise: the force to the right points outward
    assert force[held.start, :2] @ outward > 0.99 * 215 * np.linalg.norm(outward)
    assert not force[record.kind == 1].any()
    assert not force[record.line == 6].any()  # plunge


@pytest.mark.parametrize("name", recording.names())
def test_lines_that_cut_are_feeds_by_the_control_too(name):
    record = recording.load(name)
    cuts = cutting_lines(record)[record.line]
    assert cuts.mean() > 0.5
    assert np.isin(record.kind[cuts], (2, 3)).all()
    assert np.linalg.norm(np.diff(record.tip, axis=0), axis=1).max() <= 100.1 * recording.STEP_S


def test_every_effect_moves_the_tip_or_the_drives():
    t = rows("zigzag-10um", 12)
    plain = tips("zigzag-10um", NOTHING, cutting=True, t=t)
    for effect, target in every(ORTHOGLIDE):
        got = tips("zigzag-10um", wrong(effect, target, LIBRARY[effect].fair), cutting=True, t=t)
        assert np.abs(got.tip - plain.tip).max() > 1e-4, (effect, target)


@pytest.mark.parametrize("effect", ON_ACTUATORS)
def test_strange_faults_have_actuators_of_any_name(effect):
    machine, run = MACHINES["delta"], Run(recording.load("circles-exact"), True, 100.0)
    odd = Faults((strange(effect, "b", 1.0, 3, (102.0, 103.0)),))
    t = rows("circles-exact")
    plain, changed = (observe(machine, run, each, WAYS, t) for each in (NOTHING, odd))
    assert np.abs(changed.tip - plain.tip).max() > 1e-3


def test_the_force_turns_as_evenly_as_the_way():
    """On a circle the force at times between the milliseconds stands as the way stands there: none is held."""
    record = recording.load("circles-exact")
    motion = Motion(ORTHOGLIDE, Run(record, True, 0.0), NOTHING, WAYS)
    middle = record.t[:-1][motion.cuts[:-1] & motion.cuts[1:]] + 0.5 * drives.STEP_S
    middle = middle[len(middle) // 4 : len(middle) // 4 + 200]
    early, half, late = (motion.force(middle + step, 0.0) for step in (-0.25e-3, 0.0, 0.25e-3))
    turned = np.linalg.norm(late - early, axis=1)
    assert turned.min() > 0.0
    assert np.abs(0.5 * (early + late) - half).max() < 1e-3 * np.linalg.norm(half, axis=1).max()
