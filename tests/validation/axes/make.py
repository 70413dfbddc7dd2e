"""Draws an experiment from a seed, runs its axes through the plant and the sensors, and writes the sealed answer."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import yaml

from tests.validation.axes import laws, motion, sensors, unmodelled
from tests.validation.axes.plant import Around, Axis, Moved, bristles, simulate

ROOT = Path(__file__).resolve().parents[3]
Array = np.ndarray
KINDS = ("null", "single", "pair", "imperfect", "unknown")
FAULTS = (
    tuple(name for pair in zip(unmodelled.FORCED, unmodelled.LOOPED, strict=False) for name in pair)
    + unmodelled.LOOPED[10:]
)
# Where an axis may be (mm, middle and reach) and what its drive carries at rest (N).
MACHINES = {
    "cartesian": {"x": (0.0, 250.0, 0.0), "y": (0.0, 250.0, 0.0), "z": (0.0, 150.0, 0.0)},
    "router": {"x": (300.0, 200.0, 0.0), "y": (200.0, 150.0, 0.0), "z": (-30.0, 50.0, 40.0)},
    "orthoglide": {"x": (-310.0, 40.0, 0.0), "y": (-310.0, 40.0, 0.0), "z": (-310.0, 40.0, 0.0)},
}
SIMPLE = (("friction",), ("servo_lag",), ("servo_overshoot",), ("disturbance",), ("servo_lag", "common"))
PAIRS = (
    ("servo_lag", "friction"), ("servo_lag", "servo_overshoot"), ("friction", "friction"), ("servo_lag", "servo_lag"),
    ("friction", "disturbance"), ("servo_overshoot", "friction"), ("servo_lag", "disturbance"), ("servo_lag", "emps"),
)  # fmt: skip
QUIET = 0.22  # of the noise: what a healthy axis may leave
TRIPS_MM = 5.0  # following error at which a drive gives up
TOLD = 0.35  # of the noise: above it an honest judge may call a rest unknown


class AgainError(Exception):
    """The drawn experiment is impossible; draw again."""


@dataclass
class Push:
    """A force on a carriage for a while, along plus."""

    run: int
    t0_s: float
    t1_s: float
    force_N: float


@dataclass
class Driven:
    """An axis of the experiment: what is there of it in every run (None: it stands), and what is off."""

    name: str
    commands: list[Array | None]
    place: float
    axis: Axis
    forced: bool  # its force is logged
    push: Push | None = None
    fault: unmodelled.Fault | None = None
    others: list[Array | None] = field(default_factory=list)

    @property
    def most(self) -> unmodelled.Most:
        """Of all runs."""
        some = [c for c in self.commands if c is not None]
        speeds = [np.gradient(c, motion.STEP_S) for c in some]
        change = max(np.abs(np.gradient(v, motion.STEP_S)).max() for v in speeds)
        return unmodelled.Most(max(np.abs(c).max() for c in some), max(np.abs(v).max() for v in speeds), change)

    def run(self, axis: Axis | None = None, push: bool = True, fault: bool = True) -> list[Moved | None]:
        """Its motion in every run; with another axis in its place, without its disturbance or its fault."""
        out, top = [], self.most
        for number, command in enumerate(self.commands):
            if command is None:
                out.append(None)
                continue
            here, around = axis or self.axis, Around()
            if self.fault and fault:
                here, around = unmodelled.put(self.fault, here, command, top, self.others[number])
            if push and self.push and self.push.run == number:
                around = Around(pushed(self.push, len(command)), around.rub, around.seen, around.more_ff)
            out.append(simulate(here, command, around))
        return out


def pushed(push: Push, n: int) -> Array:
    """Its force per millisecond, with edges of 10 ms."""
    t = np.arange(n) * motion.STEP_S
    return motion.smooth(push.force_N * ((t >= push.t0_s) & (t < push.t1_s)), 0.01)


@dataclass
class Scene:
    """An experiment before its logs are written."""

    machine: str
    axes: list[Driven]
    still: list[str]  # axes that are logged and never move
    rows: list[Array]  # times of each run
    started: list[float]
    s: sensors.Sensors

    def at_rows(self, axis: Driven, moved: list[Moved | None], channel: str) -> Array:
        """Following error (mm) or force (N) at all rows of the runs that move it."""
        out = []
        for times, command, one in zip(self.rows, axis.commands, moved, strict=True):
            if one is not None:
                values = one.force if channel == "force" else one.motor - command
                out.append(sensors.at(times, values))
        return np.concatenate(out)

    def difference(self, axis: Driven, one: list, other: list, channel: str) -> float:
        """Rms difference of two channels over all rows of the log, divided by the channel's noise."""
        unit = self.s.whole_N if channel == "force" else self.s.whole_mm
        change = self.at_rows(axis, one, channel) - self.at_rows(axis, other, channel)
        share = len(change) / sum(map(len, self.rows))
        return laws.rms(change) * np.sqrt(share) / unit

    def indices(self, axis: Driven) -> list[Array]:
        """Rows of the moving runs as whole milliseconds."""
        return [np.round(t * 1e3).astype(int) for t, c in zip(self.rows, axis.commands, strict=True) if c is not None]


def draw_scene(rng: np.random.Generator, count: int, forced: bool) -> Scene:
    """Runs of one to three axes, healthy as yet."""
    machine = str(rng.choice(list(MACHINES), p=[0.45, 0.35, 0.2]))
    names = [str(n) for n in rng.permutation(list(MACHINES[machine]))]
    moving, still = names[:count], names[count:]
    still = still if rng.random() < 0.5 else []
    runs = int(rng.choice([1, 2, 3, 4, 5], p=[0.25, 0.2, 0.25, 0.15, 0.15]))
    budget = min(25.0, float(rng.uniform(40, 60)) / runs / count)
    rate = float(rng.choice(sensors.RATES_HZ, p=[0.12, 0.08, 0.15, 0.2, 0.2, 0.25]))
    repeats = rng.random() < 0.35
    axes = [Driven(n, [], 0.0, healthy(rng, MACHINES[machine][n][2]), forced) for n in moving]
    lengths = []
    for number in range(runs):
        seconds = float(rng.uniform(0.5, 1.0)) * budget if runs > 1 else budget
        again = repeats and number > 0 and rng.random() < 0.7
        parts: list = []
        if count > 1 and not again and rng.random() < 0.25:
            parts = motion.contour(count, min(MACHINES[machine][one.name][1] for one in axes), seconds, rng)
            parts = [part if np.ptp(part) > 0.5 else None for part in parts]
        for k, one in enumerate(axes[len(parts) :]):
            if again:
                parts.append(one.commands[int(number - 1)])
                continue
            if number > 0 and count > 1 and rng.random() < 0.2:
                parts.append(None)
                continue
            reach = MACHINES[machine][one.name][1] * float(np.exp(rng.uniform(np.log(0.1), 0)))
            kind = str(rng.choice(motion.KINDS))
            kind = "recording" if kind == "recording" and k < 2 else kind if kind != "recording" else "s_curve"
            parts.append(motion.draw(kind, reach, seconds, rate >= 500, rng))
        if all(p is None for p in parts):
            parts[0] = motion.draw("s_curve", MACHINES[machine][axes[0].name][1] * 0.5, seconds, False, rng)
        n = max(len(p) for p in parts if p is not None)
        lengths.append((n - 1) * motion.STEP_S)
        for one, part in zip(axes, parts, strict=True):
            if part is not None and np.ptp(part) < 0.5:
                raise AgainError
            one.commands.append(None if part is None else motion.lengthened(part, n))
    for one in axes:
        if all(c is None for c in one.commands):
            raise AgainError
        middle, reach, _ = MACHINES[machine][one.name]
        one.place = round(middle + float(rng.uniform(-1, 1)) * max(0.0, reach - one.most.way), 3)
        one.others = [next((o.commands[k] for o in axes if o is not one), None) for k in range(runs)]
    s = sensors.draw(rng, rate)
    rows = [sensors.rows_of(seconds, s, rng) for seconds in lengths]
    started = np.cumsum([float(rng.choice([0.0, rng.uniform(0, 500)])), *rng.uniform(30, 600, runs - 1)]).round(1)
    scene = Scene(machine, axes, still, rows, [float(x) for x in started], s)
    if min(moves(one, scene)[0] for one in axes) < 0.3:
        raise AgainError  # what the log shows of it is a standstill
    return scene


def healthy(rng: np.random.Generator, weight: float) -> Axis:
    """A stiff cascade with everything fed forward."""
    kp = float(rng.uniform(150, 400))
    return Axis(
        mass=float(np.exp(rng.uniform(np.log(0.004), np.log(0.12)))), kp=kp, wv=kp * float(rng.uniform(2.5, 5)),
        reset_s=float(rng.uniform(0.01, 0.04)), presliding=float(np.exp(rng.uniform(np.log(1e-3), np.log(3e-2)))),
        spring=float(rng.choice([5e3, 2e4, 4e4])), weight=weight,
    )  # fmt: skip


def moves(one: Driven, scene: Scene) -> tuple[float, float]:
    """Rms of speed and acceleration over all rows of the log."""
    speeds, changes = [], []
    for command, times in zip(one.commands, scene.rows, strict=True):
        speed = np.gradient(command, motion.STEP_S) if command is not None else np.zeros(2)
        speeds.append(sensors.at(times, speed))
        changes.append(sensors.at(times, np.gradient(speed, motion.STEP_S)))
    return laws.rms(np.concatenate(speeds)), laws.rms(np.concatenate(changes))


def put_lag(one: Driven, seconds: float) -> dict:
    """A lag by the loop's gain where that is of the size of loops, else by the feed-forward."""
    if seconds > 1e-3:
        one.axis = one.axis.but(kp=1 / seconds, vff=0.0, wv=max(one.axis.wv, 3 / seconds), reset_s=np.inf)
    else:
        one.axis = one.axis.but(vff=1 - seconds * one.axis.kp)
    return {"time_constant_ms": 1e3 * seconds}


def put_swing(one: Driven, w: float, damping: float, lag: bool = False) -> dict:
    """A loop of P and P with the set-point's speed fed forward, or (lag) not."""
    one.axis = one.axis.but(kp=w / (2 * damping), wv=2 * damping * w, aff=0.0, vff=0.0 if lag else 1.0, reset_s=np.inf)
    return {"period_ms": 2e3 * np.pi / w, "damping": damping}


def put_friction(one: Driven, scene: Scene, ratio: float, rng: np.random.Generator) -> dict:
    """Coulomb friction with some viscosity."""
    parts = [bristles(c, one.axis.presliding, 1e3) for c in one.commands if c is not None]
    share = laws.rms(np.concatenate(parts)) * np.sqrt(len(parts) / len(one.commands))
    force = ratio * scene.s.whole_N / max(share, 0.1)
    speed, _ = moves(one, scene)
    viscous = force / max(speed, 5) * float(rng.choice([0.0, rng.uniform(0.1, 0.7)]))
    one.axis = one.axis.but(
        coulomb=force, viscous=viscous, asymmetry=viscous * float(rng.choice([0.0, rng.uniform(-0.1, 0.1)])),
        friction_ff=0.0 if rng.random() < 0.2 else float(rng.uniform(0.95, 1.0)),
    )  # fmt: skip
    out = {"force_N": force, "presliding_mm": one.axis.presliding}
    if viscous:
        out |= {"viscous_Ns_per_mm": viscous, "asymmetry_Ns_per_mm": one.axis.asymmetry}
    return out


def put_push(one: Driven, scene: Scene, ratio: float, rng: np.random.Generator) -> dict:
    """A force on the carriage for a while of one run."""
    number = int(rng.choice([k for k, c in enumerate(one.commands) if c is not None]))
    times = scene.rows[number]
    width = float(rng.uniform(0.1, 0.4)) * (times[-1] - times[0])
    t0 = float(rng.uniform(times[0] + 0.05 * width, times[-1] - 1.05 * width))
    share = np.sqrt(np.count_nonzero((times >= t0) & (times < t0 + width)) / sum(map(len, scene.rows)))
    one.push = Push(number, t0, t0 + width, ratio * scene.s.whole_N / share * float(rng.choice([-1, 1])))
    common = scene.started[number]
    where = {
        "run": f"run-{number + 1}",
        "t0_s": t0,
        "t1_s": t0 + width,
        "from_s": common + t0,
        "to_s": common + t0 + width,
    }
    return where | {"force_N": one.push.force_N}


def size(rng: np.random.Generator, high: float = 12) -> float:
    """Of a cause over the noise: 3.1 to 12, or as large as machines have it."""
    return float(rng.uniform(3.1, 12) if rng.random() < 0.45 else np.exp(rng.uniform(np.log(12), np.log(high))))


def put_one(effect: str, one: Driven, scene: Scene, rng: np.random.Generator, ratio: float) -> dict:
    """An effect of the library on an axis, in the contract's parameters; the ratio is aimed at."""
    speed, change = moves(one, scene)
    want = ratio * scene.s.whole_mm
    if effect == "friction":
        return put_friction(one, scene, ratio, rng)
    if effect == "disturbance":
        return put_push(one, scene, ratio, rng)
    if effect == "servo_lag":
        seconds = want / speed
        if not 2e-5 < seconds < 0.02:
            raise AgainError
        return put_lag(one, seconds)
    w = float(np.sqrt(change / want))
    if not 35 < w < 900:
        raise AgainError
    return put_swing(one, w, float(rng.uniform(0.25, 1.0)))


def causes(kind: str, turn: int, scene: Scene, rng: np.random.Generator) -> list[dict]:
    """Puts the causes of the library that the kind asks for; entries without sizes."""
    out: list[dict] = []

    def add(effect: str, one: Driven, ratio: float) -> None:
        parameters = put_one(effect, one, scene, rng, ratio)
        out.append({"effect": effect, "target": one.name, "parameters": parameters, "strange": False})

    axes = scene.axes
    if kind == "pair":
        first, second = PAIRS[turn % len(PAIRS)]
        one = axes[int(rng.integers(len(axes)))]
        rest = [a for a in axes if a is not one]
        other = one if not rest or (first != second and rng.random() < 0.4) else rest[int(rng.integers(len(rest)))]
        if (first, second) == ("servo_lag", "servo_overshoot") and other is one:
            w, damping = float(rng.uniform(60, 250)), float(rng.uniform(0.3, 0.8))
            swing = put_swing(one, w, damping, lag=True)
            out.append(
                {"effect": "servo_lag", "target": one.name, "parameters": {"time_constant_ms": 2e3 * damping / w}}
            )
            out.append({"effect": "servo_overshoot", "target": one.name, "parameters": swing})
            return [entry | {"strange": False} for entry in out]
        if (
            second == "emps"
        ):  # P and P without feed-forward, as on the axis of the benchmark; the friction moves it, too
            w, damping = float(rng.uniform(90, 200)), float(rng.uniform(0.3, 0.6))
            swing = put_swing(one, w, damping, lag=True)
            out.append(
                {"effect": "servo_lag", "target": one.name, "parameters": {"time_constant_ms": 2e3 * damping / w}}
            )
            out.append({"effect": "servo_overshoot", "target": one.name, "parameters": swing})
            add("friction", one, size(rng, 60))
            one.axis = one.axis.but(friction_ff=0.0)
            return [entry | {"strange": False} for entry in out]
        if first == second and other is one:
            raise AgainError
        add(first, one, size(rng, 60))
        add(second, other, size(rng, 60))
        return out
    if kind in ("single", "imperfect"):
        effect, *common = SIMPLE[turn % len(SIMPLE)]
        one = axes[int(rng.integers(len(axes)))]
        if common and len(axes) > 1:
            speed = max(moves(a, scene)[0] for a in axes)
            seconds = size(rng, 800) * scene.s.whole_mm / speed
            if not 2e-5 < seconds < 0.02:
                raise AgainError
            for a in axes:
                put_lag(a, seconds)
            parameters = {"time_constant_ms": 1e3 * seconds}
            return [{"effect": effect, "target": None, "parameters": parameters, "strange": False}]
        most = 800 if effect.startswith("servo") else 150
        add(effect, one, size(rng, most if kind == "single" else 40))
        return out
    if kind == "unknown" and rng.random() < 0.3:  # a cause beside it, on another axis or in another channel
        rest = axes[1:]
        if rest:
            effect = str(rng.choice(["servo_lag", "friction"] if rest[0].forced else ["servo_lag"]))
            add(effect, rest[0], size(rng, 30))
    return out


def small(scene: Scene, taken: set, rng: np.random.Generator) -> list[dict]:
    """Small errors of every part without a large one."""
    out = []
    for one in scene.axes:
        speed, change = moves(one, scene)
        if not any(e in ("servo_lag", "servo_overshoot") and t in (one.name, None) for e, t in taken):
            seconds = float(rng.uniform(0.04, 0.18)) * scene.s.whole_mm / speed
            gap = float(rng.uniform(0.02, 0.1)) * scene.s.whole_mm * one.axis.kp * one.axis.wv / change
            one.axis = one.axis.but(vff=1 - seconds * one.axis.kp, aff=1 - min(gap, 0.5))
            out.append({"effect": "servo_lag", "target": one.name, "parameters": {"time_constant_ms": 1e3 * seconds}})
        if one.forced and ("friction", one.name) not in taken:
            force = float(rng.uniform(0.04, 0.2)) * scene.s.whole_N
            one.axis = one.axis.but(coulomb=force, viscous=0.1 * force / max(speed, 5))
            out.append({"effect": "friction", "target": one.name, "parameters": {"force_N": force}})
    return out


def bare(entry: dict, one: Driven) -> list[Moved | None]:
    """The motion of the axis without that cause."""
    axis = one.axis
    if entry["effect"] == "friction":
        return one.run(axis.but(coulomb=0.0, viscous=0.0, asymmetry=0.0))
    if entry["effect"] == "disturbance":
        return one.run(push=False)
    if entry["effect"] == "servo_lag":
        return one.run(axis.but(vff=1.0))
    return one.run(axis.but(aff=1.0))


def weigh(entries: list[dict], scene: Scene, moved: dict[str, list]) -> None:
    """Fills in the effect of every cause on the channel that shows it best."""
    for entry in entries:
        channel = "force" if entry["effect"] in ("friction", "disturbance") else "encoder"
        ratio = 0.0
        for one in scene.axes:
            if entry["target"] in (one.name, None):
                ratio = max(ratio, scene.difference(one, moved[one.name], bare(entry, one), channel))
        unit = scene.s.whole_N if channel == "force" else 1e3 * scene.s.whole_mm
        entry |= {"ratio": ratio, "channel": channel, "size": ratio * unit, "unit": "N" if channel == "force" else "um"}
        entry["um"] = ratio * unit if channel == "encoder" else 0.0
        if ratio < 3:
            raise AgainError


def beside(fault: unmodelled.Fault, one: Driven, scene: Scene) -> list[dict]:
    """Library effects that a fault really has in it: the mean lag of an uneven loop, the friction that sticks and slips."""
    if fault.name in ("one_way_gain", "wandering_delay"):
        seconds = fault.size if fault.name == "wandering_delay" else (1 + 1 / (1 + fault.size)) / 240
        ratio = seconds * moves(one, scene)[0] / scene.s.whole_mm
        effect, channel = "servo_lag", "encoder"
    elif fault.name == "stick_slip" and one.forced:
        ratio, effect, channel = fault.size / scene.s.whole_N, "friction", "force"
    else:
        return []
    um = ratio * 1e3 * scene.s.whole_mm if channel == "encoder" else 0.0
    entry = {"effect": effect, "target": one.name, "parameters": {}, "strange": False, "ratio": ratio}
    return [entry | {"channel": channel, "um": um}]


MAY = {
    "friction_patch": ["friction"], "brake_drag": ["friction"], "fading_friction": ["friction"], "square_drag": ["friction"],
    "lopsided_ripple": ["friction"], "belt": ["servo_overshoot", "servo_lag"], "square_ff": ["servo_overshoot"],
    "saturation": ["servo_overshoot", "servo_lag"], "position_gain": ["servo_lag"], "double_speed_ff": ["servo_lag"],
    "rate_limit": ["servo_lag"], "stick_slip": ["friction", "servo_lag", "servo_overshoot"],
    "wandering_delay": ["servo_lag"], "one_way_gain": ["servo_lag"], "cross_talk": ["servo_overshoot"],
}  # fmt: skip


def put_fault(name: str, scene: Scene, rng: np.random.Generator) -> dict:
    """A fault on the first axis, of 4 to 10 (or far more) times the noise, that leaves at least 1.3 of it."""
    one = scene.axes[0]
    fault = unmodelled.draw(name, rng)
    channel = fault.channel
    if name == "cross_talk" and not any(
        o is not None and c is not None for o, c in zip(one.others, one.commands, strict=True)
    ):
        raise AgainError
    want = float(rng.uniform(4, 10)) if rng.random() < 0.7 else float(rng.uniform(10, 40))
    clean = one.run()
    if name == "one_way_gain":
        clean = one.run(one.axis.but(kp=unmodelled.EVEN_KP, vff=0.0))
    for _ in range(7):
        one.fault = fault
        moved = one.run()
        got = scene.difference(one, moved, clean, channel)
        if not np.isfinite(got) or got < 1e-6:
            raise AgainError
        if 0.8 < got / want < 1.25:
            break
        fault = fault.scaled(
            float(np.clip(want / got, 0.02, 50)) ** (0.7 if name in ("saturation", "rate_limit", "belt") else 1)
        )
    wide = max(np.abs(m.motor - c).max() for m, c in zip(moved, one.commands, strict=True) if m is not None)
    if got < 3 or wide > TRIPS_MM:
        raise AgainError
    left = rests(one, scene, moved)
    best = "force" if one.forced and left["force"] > left["encoder"] else "encoder"
    if one.forced:  # the channel that shows it best may be the other one
        both = {each: scene.difference(one, moved, clean, each) for each in ("encoder", "force")}
        channel = max(both, key=both.get) if name not in ("one_way_gain",) else channel
        got = both[channel]
    if left[best] < 1.3:
        raise AgainError
    return {
        "effect": name, "target": one.name, "parameters": {"size": fault.size, **fault.constants}, "strange": True,
        "ratio": got, "channel": channel, "left_ratio": left[best], "left_channel": best, "left": left,
        "stage": "drive" if fault.channel == "force" else "control", "um": got * 1e3 * scene.s.whole_mm if channel == "encoder" else 0.0,
    }  # fmt: skip


def rests(one: Driven, scene: Scene, moved: list[Moved | None]) -> dict[str, float]:
    """Residual of an axis after a fit of the whole library, over the noise, by channel; mass is no error."""
    some = [(c, m) for c, m in zip(one.commands, moved, strict=True) if c is not None]
    rows = scene.indices(one)
    share = np.sqrt(sum(map(len, rows)) / sum(map(len, scene.rows)))
    commands, errors = [c for c, _ in some], [m.motor - c for c, m in some]
    out = {"encoder": laws.control_span_left(commands, errors, rows) / scene.s.whole_mm * share}
    out["encoder_with_sense"] = laws.control_span_left(commands, errors, rows, sense=True) / scene.s.whole_mm * share
    if one.forced:
        motors, forces = [m.motor for _, m in some], [m.force for _, m in some]
        out["force"] = laws.force_left(motors, forces, rows) / scene.s.whole_N * share
        out["force_mass_from_rows"] = laws.force_left(motors, forces, rows, coarse=True) / scene.s.whole_N * share
    else:
        out["force"] = 0.0
    return out


def honest(entries: list[dict], scene: Scene, moved: dict[str, list]) -> dict:
    """Sets of control effects that explain each axis, and the residual of clean signals after the library's causes."""
    out: dict = {"axes": {}, "worst": 0.0, "worst_from_rows": 0.0}
    for one in scene.axes:
        if one.fault:
            continue
        some = [(c, m) for c, m in zip(one.commands, moved[one.name], strict=True) if c is not None]
        rows = scene.indices(one)
        share = np.sqrt(sum(map(len, rows)) / sum(map(len, scene.rows)))
        commands, errors = [c for c, _ in some], [m.motor - c for c, m in some]
        true = tuple(
            sorted(e["effect"] for e in entries if e["target"] in (one.name, None) and e["effect"].startswith("servo"))
        )

        def left(effects: tuple[str, ...], c=commands, e=errors, r=rows, s=share) -> float:
            return laws.control_left(effects, c, e, r) / scene.s.whole_mm * s

        here: dict = {"encoder": left(true)}
        if true:
            here["sets"] = {"+".join(effects): left(effects) for effects in laws.CONTROL if effects != true}
        motors, forces = [m.motor for _, m in some], [m.force for _, m in some]
        if one.forced:
            if one.push:
                number = [k for k, c in enumerate(one.commands) if c is not None].index(one.push.run)
                forces[number] = forces[number] + pushed(one.push, len(forces[number]))
            rubbed = any((e["effect"], e["target"]) == ("friction", one.name) for e in entries)
            here["force"] = laws.force_left(motors, forces, rows, friction=rubbed) / scene.s.whole_N * share
            here["force_mass_from_rows"] = (
                laws.force_left(motors, forces, rows, coarse=True, friction=rubbed) / scene.s.whole_N * share
            )
            change = np.concatenate(
                [np.gradient(np.gradient(m, 1e-3), 1e-3)[r] for m, r in zip(motors, rows, strict=True)]
            )
            here["mass_ratio"] = one.axis.mass * laws.rms(change) / scene.s.whole_N * share
        out["axes"][one.name] = here
        out["worst"] = max(out["worst"], here["encoder"], here.get("force", 0.0))
        out["worst_from_rows"] = max(out["worst_from_rows"], here["encoder"], here.get("force_mass_from_rows", 0.0))
    return out


def allowed(
    kind: str, entries: list[dict], scene: Scene, rest: dict, stated: bool
) -> tuple[list[str], list[list[dict]]]:
    """Honest verdicts, and sets of causes that do the same within noise."""
    pairs = [{"effect": e["effect"], "target": e["target"]} for e in entries if not e["strange"]]
    sets = [pairs] if pairs else []
    if len(scene.axes) == 1:
        for k, one in enumerate(pairs):
            if one["effect"].startswith("servo"):
                sets.append([*pairs[:k], one | {"target": None}, *pairs[k + 1 :]])
    elif any(p["target"] is None for p in pairs):
        for p in [p for p in pairs if p["target"] is None]:
            sets.append([p | {"target": a.name} for a in scene.axes] + [q for q in pairs if q is not p])
    for name, here in rest["axes"].items():
        for words, left in here.get("sets", {}).items():
            if left < TOLD and left < here["encoder"] + 0.15:
                rest_of = [p for p in pairs if not (p["effect"].startswith("servo") and p["target"] in (name, None))]
                other = rest_of + [{"effect": e, "target": name} for e in words.split("+")]
                fewer = len(other) <= len(pairs)
                if fewer and other not in sets:
                    sets.append(other)
    if kind == "unknown":
        return ["unknown"], sets
    verdicts = ["none"] if not pairs else ["identified"]
    different = {frozenset(p["effect"] for p in one) for one in sets}
    if len(different) > 1:
        verdicts.append("ambiguous")
    drifting = scene.s.drift_N / np.sqrt(12) > 0.25 * scene.s.force_N and not stated and scene.axes[0].forced
    if rest["worst"] > TOLD or rest["worst_from_rows"] > TOLD or drifting:
        verdicts.append("unknown")
    return verdicts, sets


def make(seed: int, out: Path, only: str | None = None) -> None:
    """Writes experiment e-<seed> and its truth; redraws impossible experiments in a fixed order."""
    for attempt in range(60):
        try:
            return attempt_one(seed, attempt, out, only)
        except AgainError:
            continue
    raise RuntimeError(f"seed {seed} gives no experiment")


def attempt_one(seed: int, attempt: int, out: Path, only: str | None) -> None:
    """One try."""
    rng = np.random.default_rng([seed, attempt, 20011])
    kind, turn = only or KINDS[seed % len(KINDS)], seed // len(KINDS)
    need_force, need_axes = False, 1
    fault = FAULTS[turn % len(FAULTS)]
    if kind in ("single", "imperfect"):
        need_force = SIMPLE[turn % len(SIMPLE)][0] in ("friction", "disturbance")
        need_axes = 2 if len(SIMPLE[turn % len(SIMPLE)]) > 1 else 1
    elif kind == "pair":
        pair = PAIRS[turn % len(PAIRS)]
        need_force, need_axes = bool({"friction", "disturbance", "emps"} & set(pair)), 2 if pair[0] == pair[1] else 1
    elif kind == "unknown":
        need_force, need_axes = fault in unmodelled.FORCED, 2 if fault == "cross_talk" else 1
    count = max(need_axes, int(rng.choice([1, 2, 3], p=[0.45, 0.35, 0.2])))
    forced = need_force or rng.random() < 0.75
    scene = draw_scene(rng, count, forced)
    entries = causes(kind, turn, scene, rng)
    little: list[dict] = []
    if kind in ("null", "imperfect"):
        little = small(scene, {(e["effect"], e["target"]) for e in entries}, rng)
    moved = {one.name: one.run() for one in scene.axes}
    weigh(entries, scene, moved)
    if kind == "unknown":
        entries.append(put_fault(fault, scene, rng))
        entries += beside(scene.axes[0].fault, scene.axes[0], scene)
        moved[scene.axes[0].name] = scene.axes[0].run()
    rest = honest(entries, scene, moved)
    if not all(np.isfinite(m.motor).all() for some in moved.values() for m in some if m):
        raise AgainError
    if kind == "null" and (rest["worst"] > QUIET or rest["worst_from_rows"] > 0.6):
        raise AgainError
    emps = kind == "pair" and "emps" in PAIRS[turn % len(PAIRS)]
    if (
        kind != "unknown"
        and not emps
        and attempt < 15
        and max(rest["worst"], rest["worst_from_rows"]) > TOLD
        and seed % 7
    ):
        raise AgainError  # most have a rest that nobody can see
    if rest["worst"] > (1 if kind == "unknown" else 60 if emps else 5):
        raise AgainError
    write_all(seed, kind, scene, entries, little, moved, rest, rng, out)


def write_all(seed, kind, scene, entries, little, moved, rest, rng, out) -> None:
    """Logs, experiment and, last, the truth."""
    s, forced = scene.s, scene.axes[0].forced
    folder = out / f"e-{seed}"
    folder.mkdir(parents=True, exist_ok=True)
    offsets = rng.random() < 0.3
    listed, outliers, counts, reset = [], [], [], "zero" in s.messes
    shown = forced and len(scene.axes) > 1 and kind == "null" and rng.random() < 0.4  # the force of one axis only
    for number, times in enumerate(scene.rows):
        begin = times[0] if reset else 0.0
        columns: dict[str, Array] = {"t_s": times - begin}
        n, cmd, act, force = len(times), {}, {}, {}
        for one in sorted(scene.axes, key=lambda a: a.name):
            command, did = one.commands[number], moved[one.name][number]
            c = sensors.at(times, command) + one.place if command is not None else np.full(n, one.place)
            m = sensors.at(times, did.motor) + one.place if did else np.full(n, one.place)
            f = sensors.at(times, did.force) if did else np.full(n, one.axis.weight)
            m = m + (float(rng.normal(0, 3e-4)) if offsets else 0.0)
            cmd[one.name] = sensors.rounded(c, s.command_mm)
            act[one.name] = sensors.rounded(m + s.encoder_mm * sensors.white(n, s, rng), s.resolution_mm)
            drift = s.drift_N * np.linspace(-0.5, 0.5, n) * float(rng.choice([-1, 1]))
            force[one.name] = f + s.force_N * sensors.white(n, s, rng) + drift
        for name in sorted(scene.still):
            middle, _, weight = MACHINES[scene.machine][name]
            cmd[name] = np.full(n, middle)
            act[name] = sensors.rounded(middle + s.encoder_mm * sensors.white(n, s, rng), s.resolution_mm)
            force[name] = weight + s.force_N * sensors.white(n, s, rng)
        for name in sorted(cmd):
            columns[f"cmd_{name}_mm"] = cmd[name]
        for name in sorted(act):
            columns[f"act_{name}_mm"] = act[name]
        if forced:
            for name in sorted(force):
                if not shown or name == scene.axes[0].name:
                    columns[f"act_{name}_N"] = force[name]
        bad = sensors.write(folder / f"log-{number + 1}.csv", columns, s, rng)
        outliers += [{"run": f"run-{number + 1}", "row": row} for row in bad]
        counts.append(n)
        started = round(float(scene.started[number] + begin), 4)
        listed.append(
            {"name": f"run-{number + 1}", "log": f"log-{number + 1}.csv", "cutting": False, "started_s": started}
        )
        if reset:
            for entry in entries:
                if entry["parameters"].get("run") == f"run-{number + 1}":
                    entry["parameters"] |= {k: entry["parameters"][k] - begin for k in ("t0_s", "t1_s")}
    machine = ROOT / "config" / f"{scene.machine}.yaml"
    experiment: dict = {"config": [str(machine)], "runs": listed}
    if len(listed) > 2 and rng.random() < 0.3:
        experiment["holdout"] = [str(rng.choice([each["name"] for each in listed]))]
    stated = rng.random() < 0.3
    if stated:
        experiment["sd"] = {"encoder_mm": round(float(np.hypot(s.whole_mm, 3e-4 if offsets else 0)), 7)}
        if forced:
            experiment["sd"]["force_N"] = round(s.whole_N, 4)
    (folder / "experiment.yaml").write_text(yaml.safe_dump(experiment, sort_keys=False))
    verdicts, sets = allowed(kind, entries, scene, rest, stated)
    answer = {
        "seed": seed,
        "kind": kind,
        "machine": scene.machine,
        "channels": "encoders and forces" if forced else "encoders",
        "mess": list(s.messes),
        "noise_um": 1e3 * s.whole_mm,
        "noise_N": s.whole_N if forced else None,
        "small_um": 1e3 * s.whole_mm * max((a["encoder"] for a in rest["axes"].values()), default=0.0) if little else 0.0,
        "causes": entries,
        "small": little,
        "allowed_verdicts": verdicts,
        "allowed_sets": sets,
        "may_be_named": [[e, c["target"]] for c in entries if c["strange"] for e in MAY.get(c["effect"], [])],
        "rest": rest,
        "outliers": outliers,
        "sensors": {
            "rate_hz": s.rate_hz, "encoder_um": 1e3 * s.encoder_mm, "resolution_um": 1e3 * s.resolution_mm,
            "force_N": s.force_N, "drift_N": s.drift_N, "sd_stated": stated, "rows": counts, "run_offsets": offsets,
            "moving": [a.name for a in scene.axes], "still": scene.still,
        },
        "axes": {
            a.name: {
                "mass_kg": 1e3 * a.axis.mass, "kp_per_s": a.axis.kp, "speed_gain_per_s": a.axis.wv, "vff": a.axis.vff,
                "aff": a.axis.aff, "friction_ff": a.axis.friction_ff, "weight_N": a.axis.weight,
            }
            for a in scene.axes
        },
    }  # fmt: skip
    sealed = out / "truth" / f"e-{seed}.json"
    sealed.parent.mkdir(parents=True, exist_ok=True)
    begun = sealed.with_suffix(".part")
    begun.write_text(json.dumps(answer, indent=1) + "\n")
    os.replace(begun, sealed)
