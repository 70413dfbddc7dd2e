"""Laws over every member of the effects shelf: nothing at nominal, something away from it, and only where it says."""

import numpy as np
import pytest

from camcomp.ground import shelf
from camcomp.model.axes import axes_of
from camcomp.model.effect import Cause, Load, Motion, nominal
from camcomp.model.signal_path import HOOKS, STAGES
from camcomp.model.statics.description import Actuator, Chain, Link, Parallelogram, Passive, Robot
from camcomp.model.statics.masses import MassLoads

CONTRACT = {
    "servo_lag", "backlash", "friction", "joint_offset", "screw_pitch", "screw_cyclic", "thermal_growth", "drive_stiffness",
    "link_stiffness", "chain_error", "link_length", "gravity", "cutting_force", "tool_length", "tool_deflection", "tool_wear",
    "workpiece_frame", "time_sync", "squareness", "axis_error", "disturbance", "inertia", "link_growth", "base_compliance",
    "speed_limit",
}  # fmt: skip
NAMES = [
    name
    for name in shelf.members("effects")
    if shelf.load("effects", name).PARAMETERS and not getattr(shelf.load("effects", name), "ARM_ONLY", False)
]
ACTUATORS = ("x", "y", "z")


def robot():
    x, y, z = np.eye(3)
    elements = (
        Actuator(name="?", revolute=False, axis=x, stiffness=1e4, home=-300.0),
        Link(1e4 * np.eye(6)),
        Passive(True, z),
        Parallelogram(arm=310.0 * x, hinge=y, crossbar=z, width=80.0, bar_stiffness=1e4 * np.eye(6)),
        Passive(True, z),
    )
    chains = []
    for k, name in enumerate(ACTUATORS):
        drive = Actuator(name=name, revolute=False, axis=x, stiffness=1e4, home=-300.0)
        chains.append(Chain(name, (drive, *elements[1:]), np.roll(np.eye(3), k, axis=0)))
    return Robot(name="three legs", chains=tuple(chains), tool=np.array([0.0, 0.0, -100.0]))


def motion():
    t = np.linspace(0.0, 2.0, 201)
    encoder = -350.0 + 20.0 * np.column_stack([np.sin(3 * t), np.cos(3 * t), np.sin(5 * t)])
    speed = np.gradient(encoder, t, axis=0)
    masses = MassLoads(-0.4 * encoder, np.tile([30.0, -20.0, -900.0, 4e5, 6e5, 1e4], (len(t), 1)))
    return Motion(
        time=t,
        common=100.0 + t,
        cut_min=t / 60.0,
        temperature=22.0 + t,
        encoder=encoder,
        speed=speed,
        direction=np.sign(speed),
        home=np.full(3, -300.0),
        stiffness=np.full(3, 1e4),
        masses=lambda: masses,
    )


def inputs(hook, named=None):
    m = motion()
    n = len(m.time)
    load = Load(np.tile([200.0, -10.0, -25.0], (n, 1)), np.zeros((n, 6)))
    which = np.array([1.0, 0.0, 0.0])
    tip = m.encoder.copy()
    return {
        "on_servo": (tip, m, which), "on_drive": (np.zeros((n, 3)), m, which), "on_drive_force": (np.zeros((n, 3)), m, which),
        "on_links": (np.zeros((n, 3)), m, which), "on_guideway": (tip, axes_of(robot(), m, tip, np.zeros(3)), named),
        "on_robot": (robot(), ("x",)), "on_load": (load, m), "on_pose": (tip, load, m), "on_workpiece": (tip,), "on_place": (tip, load, m),
        "on_clock": (m.time,), "on_reading": ({"tip": tip}, m),
    }[hook]  # fmt: skip


def hooks(effect):
    return [each for each in HOOKS if hasattr(effect, each)]


def away(effect):
    """Parameters one typical size from nominal; shapes and phases stay, and temporary effects act in the middle."""
    values = nominal(effect)
    fitted = getattr(effect, "FITTED", effect.PARAMETERS)
    out = {p.name: p.nominal if p.scan else p.value(p.scale) for p in fitted}
    if instants := [p.name for p in fitted if p.placed]:
        out |= {p.name: p.value(p.scale) for p in effect.PARAMETERS if not p.scan} | dict(
            zip(instants, (100.5, 101.5), strict=True)
        )
    return {**values, **(effect.public(out) if hasattr(effect, "public") else out)}


def same(a, b):
    if isinstance(a, Load):
        return same(a.force, b.force) and same(a.wrench, b.wrench)
    if isinstance(a, Robot):
        return a is b
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[k], b[k]) for k in a)
    return np.array_equal(a, b)


def test_the_library_has_what_the_contract_asks_for():
    assert set(NAMES) >= CONTRACT


@pytest.mark.parametrize("name", NAMES)
def test_every_effect_says_what_it_is(name):
    effect = shelf.load("effects", name)
    assert effect.STAGE in STAGES and effect.TARGET in ("actuator", "machine", "either", "named")
    assert effect.__doc__ and effect.SOURCE and hooks(effect)
    for p in effect.PARAMETERS:
        assert p.low <= p.nominal <= p.high and p.scale > 0 and p.source and p.unit
    for p in getattr(effect, "FITTED", effect.PARAMETERS):
        assert p.tolerance < 0.2 * p.scale, f"{p.name}: what every machine has is no finding"


@pytest.mark.parametrize("name", NAMES)
def test_at_nominal_every_hook_returns_its_input_bit_for_bit(name):
    effect = shelf.load("effects", name)
    for hook in hooks(effect):
        given = inputs(hook, *getattr(effect, "TARGETS", ())[:1])
        assert same(getattr(effect, hook)(*given, nominal(effect)), given[0]), hook


@pytest.mark.parametrize("name", NAMES)
def test_away_from_nominal_some_hook_changes_something_finite(name):
    effect = shelf.load("effects", name)
    changed = False
    for hook in hooks(effect):
        given = inputs(hook, *getattr(effect, "TARGETS", ())[:1])
        got = getattr(effect, hook)(*given, away(effect))
        changed |= not same(got, given[0])
        if isinstance(got, np.ndarray):
            assert got.shape == given[0].shape and np.isfinite(got).all()
    assert changed


@pytest.mark.parametrize("name", [n for n in NAMES if shelf.load("effects", n).TARGET != "machine"])
@pytest.mark.parametrize("hook", ["on_servo", "on_drive", "on_drive_force", "on_links"])
def test_an_effect_of_one_actuator_leaves_the_others_alone(name, hook):
    effect = shelf.load("effects", name)
    if not hasattr(effect, hook):
        pytest.skip("hook not used")
    given = inputs(hook)
    got = getattr(effect, hook)(*given, away(effect))
    assert np.array_equal(got[:, 1:], given[0][:, 1:])
    assert not np.array_equal(got[:, 0], given[0][:, 0])


def test_a_common_target_acts_on_every_actuator():
    cause = Cause("servo_lag", shelf.load("effects", "servo_lag"), None, {})
    assert cause.which(ACTUATORS).tolist() == [1.0, 1.0, 1.0] and cause.aimed(ACTUATORS) == ACTUATORS


@pytest.mark.parametrize(
    "name", [n for n in shelf.members("effects") if hasattr(shelf.load("effects", n), "MOMENTARY")]
)
def test_what_says_that_it_acts_at_every_instant_alone_does(name):
    effect = shelf.load("effects", name)
    for hook in {"on_drive", "on_drive_force"} & set(hooks(effect)):
        before, m, which = inputs(hook)
        some = np.arange(3, len(m.time), 7)
        got = getattr(effect, hook)(before[some], m.at(some), which, away(effect))
        whole = getattr(effect, hook)(before, m, which, away(effect))
        np.testing.assert_allclose(got, whole[some], rtol=1e-13)


@pytest.mark.parametrize("name", [n for n in shelf.members("effects") if hasattr(shelf.load("effects", n), "public")])
def test_what_a_fit_may_find_the_machine_file_takes(name):
    """The corners of the fitted box, and its middle with one end each."""
    module = shelf.load("effects", name)
    ends = np.array([[p.low, p.high] for p in module.FITTED])
    middle = np.clip(0.0, *ends.T)
    points = [
        *np.random.default_rng(1).choice([0, 1], (50, len(ends)))[:, :, None],
        *([[[0]] * len(ends), [[1]] * len(ends)]),
    ]
    points = [np.take_along_axis(ends, np.array(each), 1)[:, 0] for each in points]
    points += [np.where(np.arange(len(ends)) == j, ends[j, k], middle) for j in range(len(ends)) for k in (0, 1)]
    for point in points:
        values = module.public({p.name: float(v) for p, v in zip(module.FITTED, point, strict=True)})
        for p in module.PARAMETERS:
            assert p.low <= values[p.name] <= p.high, (p.name, point)
