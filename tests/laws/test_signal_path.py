"""One signal path: for every effect the twin in time and the model along a program say the same, and no file has an order of its own.

The twin answers a time, as `simulate` prints it; the model along a program answers points, as `compensate` and `verify`
ask it. They share the functions of camcomp/model/signal_path.py and nothing else in between.
"""

import ast
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import camcomp
from camcomp.compensation.program.moves import travel_of
from camcomp.compensation.set_points.stream import Stream
from camcomp.diagnosis.arm.poses import ArmBench, Poses, combined
from camcomp.diagnosis.fit.bench import CandidateCause
from camcomp.gcode.interpret import read_program
from camcomp.ground import shelf
from camcomp.model import signal_path
from camcomp.model.config.load import load_config
from camcomp.model.cutting.track import lay_track
from camcomp.model.effect import Cause
from camcomp.model.job import Job
from camcomp.model.law.spec import FormulaSpec
from camcomp.model.motion.response import respond
from camcomp.model.motion.run_path import path_of_program
from camcomp.model.motion.timeline import schedule
from camcomp.model.motion.travel import Travel
from camcomp.model.motion.twin import twin_of
from camcomp.model.statics.solve import FREE, solve
from camcomp.plugins.effects import EffectHooks

ROOT = Path(camcomp.__file__).parent
CONFIG = ROOT.parent / "config"
PROGRAM = b"""G21 G90 G17
G0 X10 Y10 Z20
G1 Z0 F600
X60 Y25 F1500
G3 X60 Y65 I0 J20
G1 X15 Y45 Z4
X10 Y10
M30
"""
ARM_PROGRAM = b"G21 G90 G17\nG0 X0 Y0 Z10\nG1 Z0 F1200\nX60 Y30\nX20 Y60 Z5\nM30\n"
STEP_S = 0.005
# Between its nodes the twin interpolates within 0.04 um on this arc; along a program no time is lost in ramps, which a
# clock of wear or of warming up sees as less than 0.1 um.
TOLERANCE_MM = 1e-4
TOLERANCE_N = 0.5  # rows of 5 ms and instants of 1 ms meet a drive that turns round at other places, in a guide of 60 N
LEAST_MM = 1e-3  # an effect that moves less tells nothing
# Ramps of the speed are only in the twin: the model along a program has pauses at stops and one speed between them. Both
# have a tip that lags, or rubs by its speed, where the speed has been the programmed one for a while.
BY_SPEED = ("servo_lag", "servo_overshoot", "viscous friction", "all together")
SETTLED_S = 0.15

# Not nominal, and not one typical size either: what would hardly show in ten seconds, or has a size of its own.
VALUES = {
    "thermal_growth": {"growth_mm_per_K": 0.004, "warm_up_s": 300.0},
    "link_growth": {"growth_mm_per_K": 0.01, "warm_up_s": 300.0},
    "screw_growth": {"expansion_ppm_per_K": 100.0, "warm_up_s": 300.0},
    "servo_overshoot": {"period_ms": 60.0, "damping": 0.7},
    "friction": {"force_N": 60.0, "presliding_mm": 0.005},
    "joint_offset": {"offset_mm": 0.1},
    # all the time: along a program no time is lost in ramps, so that it would begin elsewhere
    "disturbance": {"shift_mm": 0.03, "force_N": 50.0, "from_s": -10.0, "to_s": 1000.0},
}


def cause(name, target="x", **values):
    """An effect at work, one typical size from nominal where no values are given."""
    effect = shelf.load("effects", name)
    usual = {p.name: p.nominal for p in effect.PARAMETERS}
    if not values:
        fitted = getattr(effect, "FITTED", effect.PARAMETERS)
        values = {p.name: p.nominal if p.scan else p.value(p.scale) for p in fitted}
        values = effect.public(values) if hasattr(effect, "public") else values
        values = VALUES.get(name, values)
    if effect.TARGET == "named":
        target = effect.TARGETS[0]
    return Cause(name, effect, None if effect.TARGET == "machine" else target, usual | values)


def law(formula, target=None, **place):
    """A law at work."""
    spec = FormulaSpec.model_validate({**place, "formula": formula})
    return Cause("formula", shelf.load("effects", "formula"), target, spec.effect_values())


WITH_MASSES = ("inertia", "base_compliance")  # the Orthoglide states none
LIMITED = ("speed_limit",)  # how far a drive falls behind depends on ramps, and no set-point makes up for it
NAMES = [name for name in shelf.members("effects") if shelf.load("effects", name).PARAMETERS]
ON_ARMS = [name for name in NAMES if getattr(shelf.load("effects", name), "ARM_ONLY", False)]
ANYWHERE = [name for name in NAMES if name not in (*ON_ARMS, *WITH_MASSES, *LIMITED)]
CASES = {name: [cause(name)] for name in ANYWHERE} | {
    "viscous friction": [cause("friction", "y", force_N=40.0, viscous_Ns_per_mm=0.5, asymmetry_Ns_per_mm=0.1)],
    "all together": [cause(name) for name in ANYWHERE],
    "place of the tip": [law("0.05*sin(y_mm/2)", stage="structure", axis="x")],
    "loads of drives": [law("1e-6*load_N*abs(load_N) - 2e-4*load_x_N", "y", stage="drive")],
}
ARM_CASES = {name: [cause(name, "A2")] for name in (*ON_ARMS, "base_compliance")} | {
    "link_growth": [cause("link_growth", "A2", growth_mm_per_K=0.01, warm_up_s=300.0)],
    "joint_coupling": [cause("joint_coupling", "A3")],  # A1 stands still
    "joint_hysteresis": [cause("joint_hysteresis", "A5")],  # A2 and A3 turn round between rows
    "joint_offset": [cause("joint_offset", "A2", offset_rad=1e-3)],
    "screw_pitch": [cause("screw_pitch", "A3")],
    "loads of drives": [law("1e-18*load_Nmm^2 - 1e-12*load_A3_Nmm", "A2", stage="drive")],
}


class Scene:
    """A machine and a program: what the twin and the model along the program say at rows (n,) of time."""

    def __init__(self, config, program):
        self.job = Job(load_config([CONFIG / config]))
        path = read_program(program, name="law").path
        self.timeline = schedule(path, self.job.config.control.acceleration_mm_per_s2)
        self.track = lay_track(path, self.job.conditions)
        self.time = np.arange(0.0, self.timeline.end, STEP_S)
        self.nominal = self.in_time(())[0], self.along((), self.time)[0]

    def in_time(self, causes):
        """Tips (n, 3) and drive forces (n, m) that `simulate` prints."""
        job = with_causes(self.job, causes)
        twin = twin_of(job)
        run_path = path_of_program(twin, "law", self.timeline, self.track, self.time, started=0.0)
        _, solved = twin.sense(run_path)
        reading, _ = twin.sense(run_path, solved=solved, slopes=twin.slopes(run_path, (), solved))
        return reading.tip, reading.drive

    def along(self, causes, time):
        """The same at the places of the program that the control has reached at times (n,), as `verify` asks for them."""
        job = with_causes(self.job, causes)
        k, share = self.timeline.locate(time)
        motion, track = self.timeline.index[k], self.track
        at = motion + np.minimum(share, 1.0 - 1e-12)
        piece = np.searchsorted(track.motion + track.u0, at, side="right") - 1
        w = np.clip((share - track.u0[piece]) / (track.u1[piece] - track.u0[piece]), 0.0, 1.0)
        tip, state = respond(job, track.points(piece, w), travel_of(job, track, piece, w))
        return tip, state.drive

    def steady(self, margin):
        """Rows (n,) whose motion has run for `margin` s and is to run for as long."""
        k, _ = self.timeline.locate(self.time)
        since = self.time - self.timeline.start[k]
        return (since > margin) & (self.timeline.duration[k] - since > margin)

    def compared(self, causes, rows):
        """By how much the causes move the tip (mm) in time and along the program, and how far both are apart."""
        # the clock of a log moves no tip: it says when the rows were taken
        late = sum(each.values.get("offset_s", 0.0) for each in causes)
        twin, model = self.in_time(causes)[0], self.along(causes, self.time - late)[0]
        moved = (largest(a - b, rows) for a, b in zip((twin, model), self.nominal, strict=True))
        return *moved, largest(twin - model, rows)


def largest(gap, rows):
    return float(np.linalg.norm(gap[rows], axis=1).max())


def with_causes(job, causes, measured_force=False):
    """The job as if its config named the causes."""
    other = Job(job.config, measured_force=measured_force)
    vars(other)["causes"] = signal_path.under_measured_force(causes) if measured_force else tuple(causes)
    return other


@cache
def orthoglide():
    return Scene("orthoglide.yaml", PROGRAM)


@cache
def arm():
    return Scene("kuka-kr210.yaml", ARM_PROGRAM)


@pytest.mark.parametrize("name", CASES)
def test_in_time_and_along_a_program_every_effect_does_the_same(name):
    scene = orthoglide()
    rows = scene.steady(SETTLED_S if name in BY_SPEED else 0.0)
    twin, model, apart = scene.compared(CASES[name], rows)
    assert min(twin, model) > LEAST_MM
    assert apart < TOLERANCE_MM * (1.0 if name != "all together" else 2.0)


@pytest.mark.parametrize("name", ["friction", "viscous friction", "gravity", "cutting_force"])
def test_so_do_the_drives(name):
    scene = orthoglide()
    rows = scene.steady(SETTLED_S)
    twin, model, plain = (
        each[1] for each in (scene.in_time(CASES[name]), scene.along(CASES[name], scene.time), scene.in_time(()))
    )
    assert largest(twin - plain, rows) > 10.0 * TOLERANCE_N
    assert largest(twin - model, rows) < TOLERANCE_N


@pytest.mark.parametrize("name", ARM_CASES)
def test_so_does_every_effect_of_arms_alone(name):
    scene = arm()
    twin, model, apart = scene.compared(ARM_CASES[name], scene.steady(0.0))
    assert min(twin, model) > LEAST_MM
    assert apart < TOLERANCE_MM


class Planted:
    """An effect of one hook that adds 0.01 mm where it can."""

    PARAMETERS = ()

    def __init__(self, hook):
        setattr(self, hook, getattr(self, f"_{hook}"))

    def _on_reading(self, reading, motion, p):
        return replace(reading, tip=reading.tip + 0.01)

    def _on_clock(self, time, p):
        return time - 0.01


@pytest.mark.parametrize("hook", ["on_reading", "on_clock"])
def test_an_effect_that_one_of_them_does_not_know_is_caught(hook):
    scene = orthoglide()
    assert scene.compared([Cause("planted", Planted(hook), None)], scene.steady(0.0))[2] > LEAST_MM


class Recorder:
    """An effect with every hook, which only notes its calls."""

    PARAMETERS = ()

    def __init__(self):
        self.asked = []

    def __getattr__(self, name):
        if name not in signal_path.HOOKS:
            raise AttributeError(name)

        def hook(value, *_):
            if name not in self.asked:
                self.asked.append(name)
            return value

        return hook


def asked(run):
    """Hooks in the order of their first call, without those of the machine and the clock."""
    recorder = Recorder()
    run([Cause("recorder", recorder, None)])
    return [hook for hook in recorder.asked if hook not in ("on_robot", "on_clock")], set(recorder.asked)


def in_order(hooks):
    return [hook for hook in signal_path.HOOKS if hook in hooks]


def test_the_twin_asks_every_hook_in_the_order_of_the_path():
    order, every = asked(orthoglide().in_time)
    assert every == set(signal_path.HOOKS)
    assert order == in_order(order)


ALL_BUT_SENSORS = set(signal_path.HOOKS) - {"on_clock", "on_reading"}


def test_so_does_the_model_along_a_program_up_to_the_sensors():
    scene = orthoglide()
    order, every = asked(lambda causes: scene.along(causes, scene.time[:9]))
    assert every == ALL_BUT_SENSORS
    assert order == in_order(order)


def test_a_stream_of_set_points_asks_the_same_hooks():
    def stream(causes):
        Stream(with_causes(orthoglide().job, causes)).correct((10.0, 10.0, 0.0), (100.0, 0.0, 0.0))

    assert asked(stream)[1] == ALL_BUT_SENSORS


@pytest.mark.parametrize("name", [name for name in CASES if name != "time_sync"])
def test_a_stream_of_set_points_makes_up_for_every_effect(name):
    """It takes forces as measured: effects that say how the force model errs leave them as they are."""
    job = with_causes(orthoglide().job, CASES[name], measured_force=True)
    stream, force = Stream(job), np.array([[100.0, 20.0, -30.0]] * 2)
    wanted = np.array([[10.0, 10.0, 0.0], [12.0, 11.0, 0.0]])
    told = np.array([stream.correct(tip, load).commanded for tip, load in zip(wanted, force, strict=True)])
    travel = Travel(force=force, time=np.array([0.0, 1.0]), cut_min=np.zeros(2), stop=np.zeros(2, np.bool_))
    reached, _ = respond(job, told, travel)
    assert np.abs(reached[1] - wanted[1]).max() < TOLERANCE_MM


TIPS = np.array([[0, 0, 10], [60, 30, 0], [20, 60, 5], [-100, 100, 50], [100, -50, 30], [0, 200, 100]], float)


# Nothing cuts, and no link of this arm bends.
STILL = ("cutting_force", "tool_deflection", "tool_wear", "link_stiffness")


@cache
def bench():
    """The arm in six poses, as a tracker sees it that stands in the machine frame."""
    job = arm().job
    tip = job.frame.to_machine(TIPS)
    q = solve(job.machine, FREE, tip, check=False).rho_nominal
    n = len(q)
    out = ArmBench(
        robot=job.machine.robot,
        causes=(),
        campaigns=[Poses(label="law", q=q, tip=tip, time=np.arange(n) * 1.0, temperature=None, run=np.zeros(n, int))],
    )
    return out, replace(out.start[0], rotation=np.eye(3), origin=np.zeros(3), tool=np.asarray(job.machine.robot.tool))


def standing(causes):
    out, at = bench()
    return out.standing(out.campaigns[0], causes).tips(at)


def test_poses_of_an_arm_ask_the_hooks_that_a_tracker_can_see():
    order, every = asked(standing)
    assert every == {"on_servo", "on_drive", "on_robot", "on_load", "on_links", "on_guideway", "on_pose"}
    assert order == in_order(order)


def test_poses_of_an_arm_and_the_model_along_a_program_agree():
    job, n = arm().job, len(TIPS)
    travel = Travel(force=np.zeros((n, 3)), time=np.arange(n) * 1.0, cut_min=np.zeros(n), stop=np.zeros(n, np.bool_))
    # nobody knows how these joints came there, and those of the wrist move no tip
    without = (*STILL, "joint_hysteresis", "joint_coupling")
    every = [each for each in bench()[0].columns(without) if not each.shape]
    waves = [each for each in every if each.effect == "joint_curve"]
    every = [each for each in every if each.effect != "joint_curve" or each in waves[::7]]
    columns = [each for each in every if each.target in (None, "A2")]
    known = set(ON_ARMS) - set(without) | {"joint_offset", "screw_pitch", "gravity"}
    assert {each.effect for each in columns} >= known
    plain = respond(with_causes(job, ()), TIPS, travel)[0]
    for column in columns:
        one = combined([column], {0: 1.0})[0]
        one = replace(one, values={p.name: p.nominal for p in column.module.PARAMETERS} | dict(one.values))
        model = (respond(with_causes(job, [one]), TIPS, travel)[0] - plain) @ job.frame.rotation.T
        seen = standing([one]) - standing([])
        assert np.abs(seen).max() > LEAST_MM, column
        assert np.abs(seen - model).max() < TOLERANCE_MM, column


@pytest.mark.parametrize("hook", [hook for hook in signal_path.HOOKS if hook not in ("on_drive", "on_drive_force")])
def test_an_effect_of_drives_and_more_takes_no_short_cut_through_the_twin(hook):
    effect = SimpleNamespace(on_drive=None, PARAMETERS=(), **{hook: None})
    assert not CandidateCause("planted", "x", effect).of_drive_alone


# Files that may name a hook: the path itself, the effects, and what users' effects are held against, which tells what hooks
# are given and calls each by itself. A table of forces has a key `on_workpiece`, which is none.
# the last two ask which channels of an axis, or which parts of an arm, an effect acts on
MAY_NAME_HOOKS = (
    "model/signal_path.py",
    "effects/",
    "plugins/effects.py",
    "plugins/trial.py",
    "forces/",
    "diagnosis/arm/poses.py",
    "diagnosis/axis/effect_columns.py",
)


def hooks_named(source):
    """Hooks that code names as strings or asks of something, line by line; defining one is an effect's own business."""
    for node in ast.walk(ast.parse(source)):
        name = getattr(node, "attr", None) if isinstance(node, ast.Attribute) else getattr(node, "value", None)
        if isinstance(node, (ast.Attribute, ast.Constant)) and isinstance(name, str) and name in signal_path.HOOKS:
            yield f"{node.lineno}: {name}"


def test_no_other_file_knows_a_hook():
    files = {path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8") for path in ROOT.rglob("*.py")}
    others = {name: text for name, text in files.items() if not name.startswith(MAY_NAME_HOOKS)}
    assert [f"{name}:{each}" for name, text in others.items() for each in hooks_named(text)] == []
    assert list(hooks_named(files["model/signal_path.py"]))


@pytest.mark.parametrize("source", ["cause.hook('on_drive')", "effect.on_load(1)", "HOOKS = ('on_pose',)"])
def test_a_planted_hook_is_found(source):
    assert list(hooks_named(source))


def test_every_hook_of_the_contract_has_its_place():
    assert tuple(each for each in vars(EffectHooks) if each.startswith("on_")) == signal_path.HOOKS
