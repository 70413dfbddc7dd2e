"""A milling machine whose tip is commanded by LinuxCNC: what every sensor of it would read, with anything wrong with it.

Shared with the model it judges: the geometry, springs and force triple of the machine file, and the names, signs and places of
effects in the contract.  Not shared: the motion (recorded from LinuxCNC, not planned here), the kinematics, the static solver (a
minimum of the potential energy over finite rotations, tests.validation.plants.energy), the servo, the friction, the warming (tests.validation.recorded.
drives, in time, 1 kHz), the way the cutting force follows the motion, and all sensors.

From set-point to reading, each step with its sign:
    set-point   inverse kinematics of the perfect machine at the tip that LinuxCNC commands
    encoder     the servo's answer to it
    nut         encoder behind the play
    carriage    nut + pitch error (from home) + cyclic error + offset + growth x (T - 20), minus friction / spring
    force       on the tool, along the velocity that the encoders show and, where chips matter, by its size; on while the line being executed is a feed move that
                does not plunge, in a run that cuts; kept at standstill; e_t is the feed's own direction, on ramps too
    tip         minimum of the energy there; + deflection x lateral force
    workpiece   Rz(-rotation) (tip - origin - shift), squareness added in the program frame
    clock       a row stamped t holds the tip of t - offset
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from weakref import WeakKeyDictionary

import numpy as np

from tests.validation.plants.drives import play
from tests.validation.recorded import added_faults, drives, unmodelled
from tests.validation.recorded.faults import Faults
from tests.validation.recorded.machines import Machine
from tests.validation.recordings.recording import Recording

JUMP_S = 0.010  # to both sides of a jump of the force
JUMP = 0.1  # of the force, that is one
SLOWEST = 0.2  # mm/s, below which the direction of motion stays what it was
STRIBECK_MM_PER_S = 1.0


@dataclass(frozen=True)
class Character:
    """Properties of a machine without faults."""

    speed_loop: float = 0.15  # time constant of the speed loop over that of the position loop
    presliding_mm: float = 0.008
    stribeck: float = 0.08
    rise_K: tuple[float, float] = (3.0, 5.0)
    slow_s: tuple[float, float] = (240.0, 1800.0)
    play_start: tuple[float, ...] = (0.0,) * 6  # of every drive within its play, -1 to 1
    ripple: float = 0.0  # amplitude of the force at the teeth over its mean
    followed: float = 0.02  # share of the ripple that the heavy structure follows
    teeth_hertz: float = 266.7


@dataclass(frozen=True)
class Run:
    """A recording executed once; started_s on the common clock, cut_before_min of the tool."""

    recording: Recording
    cutting: bool
    started_s: float
    cut_before_min: float = 0.0

    @property
    def cuts(self) -> np.ndarray:
        """Whether the line being executed cuts (n,), per millisecond."""
        return cutting_lines(self.recording)[np.clip(self.recording.line, 0, None)] & self.cutting

    @property
    def steady(self) -> np.ndarray:
        """Whether no cutting force jumps near a millisecond (n,): there a tenth of a millisecond moves the tip by its all."""
        way = directions(self.recording.tip) * self.cuts[:, None]
        k, reach = np.arange(len(way)), round(JUMP_S / drives.STEP_S)
        turned = way[np.minimum(k + reach, k[-1])] - way[np.maximum(k - reach, 0)]
        return np.linalg.norm(turned, axis=1) < JUMP

    @property
    def last_s(self) -> float:
        """Duration of the recording."""
        return float(self.recording.t[-1])


@dataclass
class State:
    """Readings without sensor errors at times t (n,) of the control; m actuators."""

    t: np.ndarray
    common: np.ndarray  # (n,) s
    commanded: np.ndarray  # (n, 3) tip, program frame
    line: np.ndarray  # (n,)
    cuts: np.ndarray  # (n,) bool
    cut_min: np.ndarray  # (n,) minutes the tool has cut
    setpoint: np.ndarray  # (n, m)
    encoder: np.ndarray  # (n, m)
    force: np.ndarray  # (n, 3) on the tool, machine frame
    temperature: np.ndarray  # (n,) deg C
    steady: np.ndarray  # (n,) bool, away from jumps of the cutting force
    middle: np.ndarray  # (m,) set-points at the program's origin
    reach: float  # mm at the tip per unit of an actuator, about
    dragged: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    load: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))  # (n, m) what the structure exerts on the drives
    drive: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))  # (n, m)
    tip: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))  # (n, 3) program frame


def cutting_lines(recording: Recording) -> np.ndarray:
    """Whether source line k is a feed move across the tool axis (lines + 1,), from the words of the plain programs here."""
    out, motion = [False], 0
    for text in recording.program.splitlines():
        words = re.findall(r"([A-Z])(-?[\d.]+)", text)
        for letter, digits in words:
            if letter == "G" and digits in ("0", "1", "2", "3"):
                motion = int(digits)
        out.append(motion > 0 and any(letter in "XY" for letter, _ in words))
    return np.array(out)


def directions(tip: np.ndarray) -> np.ndarray:
    """Unit directions of motion (n, 3) on the grid of 1 ms; at standstill the last one, before the first motion the first."""
    reach = 1
    ahead, behind = np.minimum(np.arange(len(tip)) + reach, len(tip) - 1), np.maximum(np.arange(len(tip)) - reach, 0)
    way = tip[ahead] - tip[behind]
    length = np.linalg.norm(way, axis=1)
    moving = length > SLOWEST * drives.STEP_S * (ahead - behind)
    last = np.maximum.accumulate(np.where(moving, np.arange(len(tip)), -1))
    last = np.where(last < 0, np.argmax(moving), last)
    return way[last] / length[last, None]


def speeds(tip: np.ndarray) -> np.ndarray:
    """Speeds (n,) mm/s on the grid of 1 ms."""
    return np.linalg.norm(np.gradient(tip, drives.STEP_S, axis=0), axis=1)


def _dragged(tip: np.ndarray, reach: float = 6.0) -> np.ndarray:
    """Where joints that hold back leave the platform behind its path (n, 3), at most 1: play over reach mm, rounded."""
    axes = [play(np.ascontiguousarray(tip[:, i]), reach, 0.0) - tip[:, i] for i in range(3)]
    return np.tanh(np.stack(axes, 1) / (0.4 * reach))


_SETPOINTS: WeakKeyDictionary[Recording, dict[str, np.ndarray]] = WeakKeyDictionary()


def _setpoints(machine: Machine, recording: Recording) -> np.ndarray:
    """Actuators (n, m) of a recording, calculated once per machine; recordings of two sets may share a name."""
    of_machines = _SETPOINTS.setdefault(recording, {})
    if machine.name not in of_machines:
        of_machines[machine.name] = machine.inverse(recording.tip + machine.origin)
    return of_machines[machine.name]


class Motion:
    """A run's set-points, encoders and forces on the grid of 1 ms."""

    def __init__(self, machine: Machine, run: Run, faults: Faults, character: Character) -> None:
        self.machine, self.run, self.faults, self.character = machine, run, faults, character
        record, names = run.recording, machine.actuators
        self.setpoint = c = _setpoints(machine, record)
        lag = faults.sum("servo_lag", "time_constant_ms", names)
        self.encoder = np.stack([drives.servo(c[:, i], lag[i], character.speed_loop) for i in range(len(names))], 1)
        for each in faults:
            if each.effect in unmodelled.STRANGE and each.target in names:
                i = names.index(each.target)
                self.encoder[:, i] += unmodelled.at_encoder(each, i, c)
            elif each.effect in added_faults.KNOWN_AS:
                for i in each.aimed(names):
                    self.encoder[:, i] += added_faults.at_encoder(each, i, c)
        width = faults.sum("backlash", "width_mm", names)
        columns = [
            play(np.ascontiguousarray(self.encoder[:, i]), width[i], character.play_start[i]) for i in range(len(names))
        ]
        self.nut = np.stack(columns, 1)
        late = not np.array_equal(self.encoder, c)
        driven = machine.direct(self.encoder) - machine.origin if late else record.tip
        self.along = directions(driven)
        self.triple = machine.triple(speeds(driven))
        self.cuts = run.cuts
        self.cut_min = run.cut_before_min + np.cumsum(self.cuts) * drives.STEP_S / 60
        self.dragged = _dragged(record.tip)

    def at(self, values: np.ndarray, t: np.ndarray) -> np.ndarray:
        """Values (grid, k) at times t (n,), straight between the milliseconds."""
        grid = self.run.recording.t
        return np.stack([np.interp(t, grid, values[:, i]) for i in range(values.shape[1])], 1)

    def force(self, t: np.ndarray, share: float) -> np.ndarray:
        """Force on the tool (n, 3) N at times t; share: of the ripple that is seen."""
        k = np.clip(np.floor(t / drives.STEP_S + 1e-6).astype(int), 0, len(self.cuts) - 1)
        # a force that is held for a millisecond is half of one late, and turns that much too late
        along = self.at(self.along, t)
        along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12)
        right = np.cross(along, [0.0, 0.0, 1.0])
        right /= np.maximum(np.linalg.norm(right, axis=1), 1e-12)[:, None]
        fr, ft, fz = self.triple[k].T[:, :, None]
        factor = self.faults.product("cutting_force", "factor", (None,))[0]
        worn = 1 + self.faults.sum("tool_wear", "growth_per_min", (None,))[0] * self.cut_min[k]
        turn = 2 * np.pi * self.character.teeth_hertz * (t + self.run.started_s)
        size = factor * worn * (1 + share * self.character.ripple * np.sin(turn)) * self.cuts[k]
        return size[:, None] * (fr * right + ft * along + fz * [0.0, 0.0, 1.0])

    def state(self, t: np.ndarray) -> State:
        """All readings at times t but the clock's error."""
        machine, faults, run, character = self.machine, self.faults, self.run, self.character
        names = machine.actuators
        k = np.clip(np.floor(t / drives.STEP_S + 1e-6).astype(int), 0, len(self.cuts) - 1)
        common = run.started_s + t
        warm = drives.warmth(common, character.rise_K, character.slow_s)
        s = State(
            t, common, self.at(run.recording.tip, t), run.recording.line[k], self.cuts[k], self.cut_min[k],
            self.at(self.setpoint, t), self.at(self.encoder, t), self.force(t, 1.0), 20.0 + warm, run.steady[k],
            machine.inverse(machine.origin[None])[0], machine.reach, self.dragged[k],
        )  # fmt: skip
        nut = self.at(self.nut, t)
        recent = [each for each in faults if each.effect in added_faults.KNOWN_AS]
        carriage = nut + faults.sum("screw_pitch", "error_ppm", names) * 1e-6 * (nut - machine.home)
        for each in faults.of("screw_cyclic"):
            i, value = names.index(each.target), each.parameters
            turn = 2 * np.pi * nut[:, i] / value["pitch_mm"] + value["phase_rad"]
            carriage[:, i] += value["amplitude_mm"] * np.sin(turn)
        for each in recent:
            for i in each.aimed(names):
                carriage[:, i] += added_faults.at_carriage(each, nut[:, i], machine.home, warm)
        carriage += faults.sum("joint_offset", "offset_rad" if machine.rotary else "offset_mm", names)
        carriage += faults.sum("thermal_growth", "growth_mm_per_K", names) * warm[:, None]
        force = self.force(t, character.followed)
        odd = [each for each in faults if each.effect in unmodelled.STRANGE]
        rubs = faults.sum("friction", "force_N", names)
        s.load = np.zeros_like(nut)
        if np.any(rubs > 0) or any(each.effect in ("hardening", "crosstalk") for each in odd):
            s.load = -machine.settle(faults, carriage, force)[1]
        for each in odd:
            if each.target in names:
                i = names.index(each.target)
                carriage[:, i] += unmodelled.at_carriage(each, i, s)
        friction = np.zeros_like(nut)
        spring = machine.drive_N_per_mm * faults.product("drive_stiffness", "factor", names)
        for i in np.flatnonzero(rubs > 0):
            beside = np.interp(run.recording.t, t, carriage[:, i] - nut[:, i] + s.load[:, i] / spring[i])
            held = drives.bristles(
                self.nut[:, i] + beside,
                rubs[i],
                character.presliding_mm,
                spring[i],
                character.stribeck,
                STRIBECK_MM_PER_S,
            )
            friction[:, i] = np.interp(t, run.recording.t, held)
        for each in recent:
            for i in each.aimed(names):
                friction[:, i] -= added_faults.push(each, common)
        tip, drive = machine.settle(faults, carriage - friction / spring, force)
        s.drive = drive + friction
        soft = faults.sum("tool_deflection", "compliance_mm_per_N", (None,))[0]
        tip = tip + soft * force * [1.0, 1.0, 0.0] - machine.origin
        s.tip = self._on_workpiece(tip)
        for each in odd:
            s.tip = s.tip + unmodelled.at_tip(each, s)
        return s

    def _on_workpiece(self, tip: np.ndarray) -> np.ndarray:
        for each in self.faults.of("workpiece_frame"):
            value = each.parameters
            angle = np.deg2rad(value["rotation_deg"])
            c, d = np.cos(angle), np.sin(angle)
            tip = tip - [value["shift_x_mm"], value["shift_y_mm"], value["shift_z_mm"]]
            tip = tip @ np.array([[c, d, 0], [-d, c, 0], [0, 0, 1]]).T
        for each in self.faults.of("squareness"):
            first, second = ("xyz".index(letter) for letter in each.target or "xy")
            tip = tip.copy()
            tip[:, first] += 1e-3 * each.parameters["angle_mrad"] * tip[:, second]
        return tip


def observe(machine: Machine, run: Run, faults: Faults, character: Character, t: np.ndarray) -> State:
    """The run's readings at times t (n,), the clock's error included."""
    motion = Motion(machine, run, faults, character)
    state = motion.state(t)
    late = faults.sum("time_sync", "offset_s", (None,))[0]
    if late != 0.0:
        state.tip = motion.state(np.clip(t - late, 0.0, run.last_s)).tip
    return state
