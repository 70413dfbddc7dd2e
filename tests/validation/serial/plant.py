"""The whole plant: recorded motion, control, drives, structure, cutting force, tool, workpiece, and what is off in it.

Shared with the contract: the definitions and signs of its effects, the path frame, which lines cut. Units mm, N, s, rad.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field, fields

import numpy as np

from tests.validation.recordings import recording
from tests.validation.serial import drives
from tests.validation.serial.structure import Machine, Springs, triple, turn

STILL_MM_S = 0.1
SLOW = 1.0  # mm/s below which a guide rubs a little more; a thousandth of it in rad/s


@dataclass(frozen=True)
class Line:
    """Motion of a line of a program: rapid, feed, plunge or none; feed mm/min, spindle rpm."""

    does: str
    feed: float
    rpm: float


def read_program(text: str) -> dict[int, Line]:
    """Motions of a recorded program by source line. G0 to G3 are modal; a feed along Z alone is a plunge.

    A feed in 1/min (G93) is told over the straight way: forces here are affine in the feed, so any will do for an arc.
    """
    lines, modal, feed, rpm, at, mode = {}, None, 0.0, 0.0, {}, 94
    for number, line in enumerate(text.splitlines(), 1):
        words = [(letter, float(value)) for letter, value in re.findall(r"([A-Z])([-\d.]+)", line)]
        for letter, value in words:
            if letter == "G" and value in (0, 1, 2, 3):
                modal = int(value)
            mode = int(value) if letter == "G" and value in (93, 94, 95) else mode
            feed = value if letter == "F" else feed
            rpm = value if letter == "S" else rpm
        axes = {letter: value for letter, value in words if letter in "XYZ"}
        if not axes or any(word == ("G", 4.0) for word in words):
            continue
        flat = modal in (2, 3) or any(at.get(a) != v for a, v in axes.items() if a in "XY")
        length = np.linalg.norm([value - at.get(letter, 0.0) for letter, value in axes.items()])
        mm_min = feed * {93: length, 94: 1.0, 95: rpm}[mode]
        lines[number] = Line("rapid" if modal == 0 else "feed" if flat else "plunge", mm_min, rpm)
        at |= axes
    return lines


@dataclass
class Run:
    """One program as it is run on this machine; arrays at 1 kHz."""

    name: str
    cutting: bool
    started_s: float
    program: str
    t: np.ndarray
    tip: np.ndarray
    line: np.ndarray
    kind: np.ndarray
    q: np.ndarray
    fed: np.ndarray  # a feed line, plunges among them
    cuts: np.ndarray  # a feed line that is no plunge, of a run that cuts
    triple: np.ndarray  # (n, 3) Fr, Ft, Fz at the programmed feed
    rub: np.ndarray  # (n, 3) the same without feed, where edges only rub
    feed: np.ndarray  # mm/s as programmed
    rows: np.ndarray = field(default_factory=lambda: np.zeros(0))
    cut_before_s: float = 0.0


def make_run(machine: Machine, name: str, cutting: bool, started_s: float) -> Run:
    """A recording on this machine."""
    seen = recording.load(name)
    lines = read_program(seen.program)
    fed, cuts = np.zeros(len(seen.t), bool), np.zeros(len(seen.t), bool)
    forces, rub, feed = np.zeros((len(seen.t), 3)), np.zeros((len(seen.t), 3)), np.ones(len(seen.t))
    for number, line in lines.items():
        rows = seen.line == number
        fed |= rows & (line.does != "rapid")
        if line.does == "feed":
            feed[rows] = line.feed / 60
            if cutting:
                cuts |= rows
                forces[rows] = triple(machine, line.feed, line.rpm)
                rub[rows] = triple(machine, 0.0, line.rpm)
    q = machine.inverse(seen.tip)
    return Run(
        name, cutting, started_s, seen.program, seen.t, seen.tip, seen.line, seen.kind, q, fed, cuts, forces, rub, feed
    )


@dataclass
class Off:
    """Everything that may be off, in the contract's parameters (per actuator where it says so). Zero or one: nothing."""

    servo_lag: np.ndarray  # s
    backlash: np.ndarray
    friction: np.ndarray
    presliding: np.ndarray
    joint_offset: np.ndarray
    screw_pitch: np.ndarray  # ppm
    cyclic: np.ndarray  # (a, 3) amplitude, pitch, phase
    thermal: np.ndarray  # mm per K
    drive_stiffness: np.ndarray
    link_stiffness: float = 1.0
    gravity: float = 0.0
    cutting_force: float = 1.0
    tool_length: float = 0.0
    tool_deflection: float = 0.0
    tool_wear: float = 0.0  # per minute
    frame: np.ndarray = field(default_factory=lambda: np.zeros(4))  # mm, mm, mm, deg
    time_sync: float = 0.0
    squareness: np.ndarray = field(default_factory=lambda: np.zeros(3))  # mrad: xy, xz, yz
    disturbance: list[tuple[int, int, float, float, float]] = field(
        default_factory=list
    )  # run, actuator, t0, t1, shift
    ripple: tuple[float, float, float] = (0.0, 1.0, 0.0)  # share of the force, Hz, share of it that bends the machine
    strange: dict = field(default_factory=dict)

    @staticmethod
    def nothing(machine: Machine) -> Off:
        """A plant as its model says."""
        n = len(machine.names)
        zero = [np.zeros(n) for _ in range(8)]
        zero[3] += 1.0
        return Off(*zero[:6], np.tile([0.0, 1.0, 0.0], (n, 1)), zero[6], np.ones(n))

    def copy(self) -> Off:
        """A plant to be changed on its own."""
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        return Off(**{k: v.copy() if hasattr(v, "copy") else v for k, v in values.items()})


def apply(machine: Machine, off: Off, effect: str, target: str | None, parameters: dict) -> Off:
    """The plant with one effect of the contract more, in the contract's parameters."""
    off, u = off.copy(), "rad" if machine.rotary else "mm"
    here = slice(None) if target is None else machine.names.index(target) if target in machine.names else target
    p = parameters
    if effect == "servo_lag":
        off.servo_lag[here] = p["time_constant_ms"] * 1e-3
    elif effect == "backlash":
        off.backlash[here] = p[f"width_{u}"]
    elif effect == "friction":
        off.friction[here] = p["force_Nmm" if machine.rotary else "force_N"]
        off.presliding[here] = p[f"presliding_{u}"]
    elif effect == "joint_offset":
        off.joint_offset[here] = p[f"offset_{u}"]
    elif effect == "screw_pitch":
        off.screw_pitch[here] = p["error_ppm"]
    elif effect == "screw_cyclic":
        off.cyclic[here] = [p["amplitude_mm"], p["pitch_mm"], p["phase_rad"]]
    elif effect == "thermal_growth":
        off.thermal[here] = p["growth_mm_per_K"]
    elif effect == "drive_stiffness":
        off.drive_stiffness[here] = p["factor"]
    elif effect == "link_stiffness":
        off.link_stiffness = p["factor"]
    elif effect == "cutting_force":
        off.cutting_force = p["factor"]
    elif effect == "gravity":
        off.gravity = p["weight_N"]
    elif effect == "tool_length":
        off.tool_length = p["length_mm"]
    elif effect == "tool_deflection":
        off.tool_deflection = p["compliance_mm_per_N"]
    elif effect == "tool_wear":
        off.tool_wear = p["growth_per_min"]
    elif effect == "workpiece_frame":
        off.frame = np.array([p["shift_x_mm"], p["shift_y_mm"], p["shift_z_mm"], p["rotation_deg"]])
    elif effect == "time_sync":
        off.time_sync = p["offset_s"]
    elif effect == "squareness":
        off.squareness[["xy", "xz", "yz"].index(target)] = p["angle_mrad"]
    elif effect == "disturbance":
        off.disturbance = [
            *off.disturbance,
            (p["run_index"], machine.names.index(target), p["t0_s"], p["t1_s"], p[f"shift_{u}"]),
        ]
    else:
        raise KeyError(effect)
    return off


@dataclass
class Warmth:
    """Temperature of the drives: two time constants, 20 degC when the common clock starts."""

    rise_K: float
    seconds: float

    def at(self, common_s: np.ndarray) -> np.ndarray:
        """degC."""
        return 20 + self.rise_K * (
            1 - 0.85 * np.exp(-common_s / self.seconds) - 0.15 * np.exp(-common_s * 5 / self.seconds)
        )


@dataclass
class Rows:
    """States of one run at some times."""

    tip: np.ndarray  # program frame, at the times of the tip measurement
    motor: np.ndarray
    command: np.ndarray
    drive: np.ndarray
    force: np.ndarray  # on the tool, machine frame


class Plant:
    """Runs of one machine in one clamping."""

    def __init__(self, machine: Machine, runs: list[Run], warmth: Warmth):
        self.machine, self.runs, self.warmth = machine, runs, warmth
        self._motors: dict = {}
        cut = 0.0
        for run in runs:
            run.cut_before_s = cut
            cut += drives.STEP_S * np.count_nonzero(run.cuts & (speed(run.tip) > STILL_MM_S))

    def motors(self, number: int, off: Off) -> tuple[np.ndarray, np.ndarray]:
        """Encoders (n, a) of a run and the tip's velocity (n, 3) that belongs to them."""
        key = (number, off.servo_lag.tobytes(), repr(off.strange) if off.strange.get("stage") == "control" else "")
        if key not in self._motors:
            run = self.runs[number]
            if not off.servo_lag.any() and not key[2]:
                motor, tip = run.q, run.tip
            else:
                motor = np.column_stack([drives.servo(q, lag) for q, lag in zip(run.q.T, off.servo_lag, strict=True)])
                if key[2]:
                    motor = motor + strange_control(off.strange, run)
                tip = self.rigid(motor) if self.machine.rotary else motor
            if len(self._motors) > 40:
                self._motors.clear()
            self._motors[key] = motor, central(tip)
        return self._motors[key]

    def rigid(self, q: np.ndarray) -> np.ndarray:
        """Tip (n, 3) in the machine frame of the unloaded, rigid chain."""
        r, p, driven = np.eye(3), np.zeros((len(q), 3)), 0
        for step in self.machine.steps:
            if step[0] == "fixed":
                p, r = p + r @ step[2], r @ step[1]
            elif step[0] == "drive":
                if step[2]:
                    r = r @ turn(step[1], q[:, driven])
                else:
                    p = p + (r @ step[1]) * q[:, driven, None]
                driven += 1
        return p - r @ self.machine.tool

    def force(self, number: int, velocity: np.ndarray, off: Off, ripple: float = 0.0) -> np.ndarray:
        """Cutting force (n, 3) on the tool at 1 kHz, machine frame (which has the program's directions here)."""
        run = self.runs[number]
        out = np.zeros((len(run.t), 3))
        if not run.cuts.any():
            return out
        size = np.linalg.norm(velocity, axis=1)
        flat = np.hypot(velocity[:, 0], velocity[:, 1])
        good = run.cuts & (flat > STILL_MM_S) & (flat > 0.2 * size)
        feed = velocity[held(good, run.cuts)] * [1, 1, 0]  # across the tool, as the nominal machine has it on ramps
        feed = feed / np.linalg.norm(feed, axis=1, keepdims=True)
        right = np.column_stack([feed[:, 1], -feed[:, 0], np.zeros(len(feed))])  # e_t x e_z
        # chips are as thick as the tool is fast across its axis: on ramps, and in an override, too
        share = (flat / run.feed)[run.cuts, None]
        at = (run.rub[run.cuts] + (run.triple - run.rub)[run.cuts] * share) * off.cutting_force
        moving = run.cuts & (size > STILL_MM_S)
        minutes = (run.cut_before_s + drives.STEP_S * np.cumsum(moving)) / 60
        at = at * (1 + off.tool_wear * minutes[run.cuts])[:, None]
        if off.strange.get("stage") == "process":
            at = strange_process(off.strange, run, at, feed, size[run.cuts])
        if ripple:
            at = at * (1 + ripple * np.sin(2 * np.pi * off.ripple[1] * (run.t[run.cuts] + run.started_s)))[:, None]
        out[run.cuts] = at[:, :1] * right + at[:, 1:2] * feed
        out[run.cuts, 2] += at[:, 2]
        return out

    def carriages(self, number: int, motor: np.ndarray, off: Off) -> tuple[np.ndarray, np.ndarray]:
        """Carriages without their spring (n, a), and the forces of their guides on them, at 1 kHz."""
        run, machine = self.runs[number], self.machine
        slow = SLOW * (1e-3 if machine.rotary else 1)
        warm = self.warmth.at(run.started_s + run.t) - 20
        out, rub = motor + off.joint_offset, np.zeros(motor.shape)
        for a in range(motor.shape[1]):
            axis = np.ascontiguousarray(motor[:, a])
            if off.backlash[a] > 0:
                out[:, a] += drives.play(axis, off.backlash[a])
            if off.friction[a] > 0:
                rub[:, a] = -off.friction[a] * drives.bristles(axis, off.presliding[a], slow)
            amplitude, pitch, phase = off.cyclic[a]
            if amplitude:
                out[:, a] += amplitude * np.sin(2 * np.pi * axis / pitch + phase)
        out += off.screw_pitch * 1e-6 * (motor - machine.home) + warm[:, None] * off.thermal
        for at, a, t0, t1, shift in off.disturbance:
            if at == number:
                out[:, a] += shift * ((run.t >= t0) & (run.t < t1))
        if off.strange.get("stage") == "drive":
            out += strange_drive(off.strange, run, motor)
        return out, rub

    def rows(self, number: int, off: Off, at: np.ndarray, drive_too: bool = False) -> Rows:
        """One run at times (n,) of the controller's clock; the tip was measured time_sync earlier than that."""
        run, machine = self.runs[number], self.machine
        motor, velocity = self.motors(number, off)
        carriage, rub = self.carriages(number, motor, off)
        bend = self.force(number, velocity, off, off.ripple[0] * off.ripple[2])
        springs = Springs(off.drive_stiffness, off.link_stiffness, off.gravity, off.tool_length, off.tool_deflection)
        when = np.clip(at - off.time_sync, run.t[0], run.t[-1])
        more = 0.0
        if off.strange.get("stage") == "spring":
            _, held_by = machine.solve(pick(run.t, carriage, when), pick(run.t, bend, when), springs)
            more = strange_spring(off.strange, -held_by)
        tip, load = machine.solve(
            pick(run.t, carriage, when), pick(run.t, bend, when), springs, pick(run.t, rub, when), more
        )
        tip = tip - machine.origin
        xy, xz, yz = off.squareness * 1e-3
        tip = tip + np.column_stack([xy * tip[:, 1] + xz * tip[:, 2], yz * tip[:, 2], 0 * tip[:, 0]])
        if off.strange.get("stage") == "tip":
            tip = tip + strange_tip(off.strange, run, bend, velocity, when)
        angle = np.radians(off.frame[3])
        tip = tip - off.frame[:3]
        c, s = np.cos(angle), np.sin(angle)
        tip = np.column_stack([c * tip[:, 0] + s * tip[:, 1], c * tip[:, 1] - s * tip[:, 0], tip[:, 2]])
        force = bend
        if drive_too:
            force = self.force(number, velocity, off, off.ripple[0])
            _, load = machine.solve(
                pick(run.t, carriage, at), pick(run.t, force, at), springs, pick(run.t, rub, at), more
            )
        return Rows(tip, pick(run.t, motor, at), pick(run.t, run.q, at), load, pick(run.t, force, at))

    def tips(self, off: Off) -> np.ndarray:
        """Tips of all runs at their chosen rows, one under the other."""
        return np.concatenate([self.rows(k, off, run.rows).tip for k, run in enumerate(self.runs)])


def central(tip: np.ndarray) -> np.ndarray:
    """Velocity (n, 3) mm/s over six steps."""
    wide = np.concatenate([np.repeat(tip[:1], 3, 0), tip, np.repeat(tip[-1:], 3, 0)])
    return (wide[6:] - wide[:-6]) / (6 * drives.STEP_S)


def speed(tip: np.ndarray) -> np.ndarray:
    """Speed (n,) mm/s."""
    return np.linalg.norm(central(tip), axis=1)


def held(good: np.ndarray, within: np.ndarray) -> np.ndarray:
    """For every row within: the last good row of its stretch, else the first one."""
    number = np.arange(len(good))
    last = np.maximum.accumulate(np.where(good, number, -1))
    begins = within & ~np.concatenate([[False], within[:-1]])
    start = np.maximum.accumulate(np.where(begins, number, -1))
    following = np.minimum.accumulate(np.where(good, number, len(good))[::-1])[::-1]
    out = np.where(last >= start, last, np.minimum(following, len(good) - 1))
    return out[within]


def pick(t: np.ndarray, values: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Columns of values (n, k) between the steps of the recordings; at: times in s."""
    place = np.clip(at / drives.STEP_S, 0, len(t) - 1 - 1e-9)
    low = place.astype(int)
    share = (place - low)[:, None]
    return values[low] * (1 - share) + values[low + 1] * share


def axis_speed(run: Run, a: int) -> np.ndarray:
    """Set-point speed (n,) of one actuator."""
    return central(run.q)[:, a]


def strange_control(s: dict, run: Run) -> np.ndarray:
    """Encoder off its set-point by faults of the control, (n, a)."""
    out, a = np.zeros(run.q.shape), s["axis"]
    if s["name"] == "ringing":
        out[:, a] = s["size"] * drives.ringing(run.q[:, a], s["hertz"], s["damping"])
    else:  # square_lag: the feed-forward misses more the faster it goes
        v = axis_speed(run, a)
        out[:, a] = -s["size"] * v * np.abs(v)
    return out


def strange_drive(s: dict, run: Run, motor: np.ndarray) -> np.ndarray:
    """Carriage off its encoder by faults of a drive, (n, a)."""
    out, a = np.zeros(motor.shape), s["axis"]
    axis = np.ascontiguousarray(motor[:, a])
    if s["name"] == "one_way_cyclic":
        side = -drives.follow_play(axis, s["turn_over"]) / s["turn_over"]
        out[:, a] = s["size"] * np.sin(2 * np.pi * axis / s["pitch"] + s["phase"]) * (1 + side) / 2
    else:  # self_heating: the screw grows by its own motion and cools again
        rate = np.abs(axis_speed(run, a))
        out[:, a] = s["size"] * drives.leak(rate, s["seconds"])
    return out


def strange_spring(s: dict, load: np.ndarray) -> np.ndarray:
    """Further deflection (n, a) of a drive whose preload is lost: it gives way at once and then no more."""
    out, a = np.zeros(load.shape), s["axis"]
    out[:, a] = s["size"] * np.tanh((load[:, a] - s["middle"]) / s["scale"])
    return out


def strange_process(s: dict, run: Run, at: np.ndarray, feed: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Force triple (n, 3) along the cut of a process that is not as modelled."""
    if s["name"] == "grain":
        angle = np.arctan2(feed[:, 1], feed[:, 0])
        return at * (1 + s["size"] * np.cos(2 * (angle - s["angle"])))[:, None]
    if s["name"] == "hard_spot":
        far = np.linalg.norm(run.tip[run.cuts, :2] - s["centre"], axis=1)
        return at * (1 + s["size"] * np.exp(-((far / s["radius"]) ** 2) / 2))[:, None]
    if s["name"] == "speed_force":
        return at * (1 + s["size"] * (size / run.feed[run.cuts] - 0.5))[:, None]
    # blunt: the tool ploughs, which holds it back along the feed
    return at + np.column_stack([0 * size, -s["size"] * np.linalg.norm(at, axis=1), 0 * size])


def strange_tip(s: dict, run: Run, force: np.ndarray, velocity: np.ndarray, when: np.ndarray) -> np.ndarray:
    """Tip (n, 3) off by faults of the structure or of the metrology, at times when (n,)."""
    place = pick(run.t, run.tip, when)
    if s["name"] == "yaw_play":  # a gantry that skews one way or the other with the sense of its motion
        axis, other = s["axis"], s["other"]
        side = drives.follow_play(run.tip[:, axis], s["turn_over"]) / s["turn_over"]
        out = np.zeros(place.shape)
        out[:, axis] = s["size"] * pick(run.t, side[:, None], when)[:, 0] * (place[:, other] - s["middle"])
        return out
    if s["name"] == "slip_joint":  # a bolted joint that slips under the cutting force and stays where it slipped to
        out = np.zeros((len(run.t), 3))
        for k in range(2):
            out[:, k] = s["size"] * (force[:, k] + drives.follow_play(force[:, k], s["yield_N"]))
        return pick(run.t, out, when)
    if s["name"] == "vibration":
        wave = np.sin(2 * np.pi * s["hertz"] * (when + run.started_s) + s["phase"])
        return s["size"] * wave[:, None] * np.array(s["direction"])
    if s["name"] == "beam_cyclic":  # the light of the instrument interferes with itself
        beam = np.array(s["direction"])
        return s["size"] * np.sin(2 * np.pi * (place @ beam) / s["period"] + s["phase"])[:, None] * beam
    # tracker_twist: the instrument's stand turns and settles again in every run
    angle = s["size"] * np.sin(2 * np.pi * when / s["seconds"] + s["phase"])
    return np.column_stack([-angle * (place[:, 1] - s["y"]), angle * (place[:, 0] - s["x"]), 0 * angle])
