"""Faults of a drive that no effect of the contract describes. Each changes the axis, what acts on it, or both."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tests.validation.axes.motion import STEP_S, smooth
from tests.validation.axes.plant import Around, Axis

Array = np.ndarray
FORCED = ("screw_ripple", "cogging", "friction_patch", "brake_drag", "cubic_cable", "fan_hum", "fading_friction",
          "square_drag", "lopsided_ripple", "end_bumper")  # fmt: skip
LOOPED = ("inner_play", "one_way_gain", "wandering_delay", "saturation", "belt", "square_ff", "stick_slip",
          "lost_telegrams", "position_gain", "cross_talk", "double_speed_ff", "rate_limit")  # fmt: skip
EVEN_KP = 120.0  # 1/s, of the loop whose gain depends on the sense of travel


@dataclass(frozen=True)
class Most:
    """How far (mm), fast and hard an axis is moved in all runs."""

    way: float
    speed: float
    acceleration: float


@dataclass(frozen=True)
class Fault:
    """A fault of a size in its own unit, with its other constants."""

    name: str
    size: float
    constants: dict

    def scaled(self, factor: float) -> Fault:
        """The same, stronger or weaker."""
        return replace(self, size=self.size * factor)

    @property
    def channel(self) -> str:
        """Where it is seen best."""
        return "force" if self.name in FORCED else "encoder"


def draw(name: str, rng: np.random.Generator) -> Fault:
    """A fault with its constants; the size is to be scaled."""
    u = rng.uniform
    phase = float(u(0, 2 * np.pi))
    constants: dict = {
        "screw_ripple": lambda: {"pitch_mm": float(rng.choice([2.5, 5, 10])), "phase_rad": phase},
        "cogging": lambda: {
            "pitch_mm": float(rng.choice([12, 16, 30])),
            "second": float(u(0.3, 1)),
            "phase_rad": phase,
        },
        "lopsided_ripple": lambda: {"pitch_mm": float(rng.choice([5, 8, 10])), "phase_rad": phase},
        "friction_patch": lambda: {"centre": float(u(-0.5, 0.5)), "width": float(u(0.1, 0.25))},
        "brake_drag": lambda: {"fades_mm": float(u(3, 15))},
        "cubic_cable": lambda: {"middle": float(u(-0.5, 0.5))},
        "fan_hum": lambda: {"hertz": float(u(3, 24)), "phase_rad": phase},
        "fading_friction": lambda: {"seconds": float(u(3, 12))},
        "square_drag": dict,
        "end_bumper": lambda: {"from": float(u(0.3, 0.7)), "side": float(rng.choice([-1, 1]))},
        "inner_play": dict,
        "one_way_gain": dict,
        "wandering_delay": lambda: {"seconds": float(u(1.5, 5)), "phase_rad": phase, "jumps": bool(u() < 0.4)},
        "saturation": dict,
        "belt": lambda: {"hertz": float(u(14, 26)), "damping": float(u(0.01, 0.04))},
        "square_ff": dict,
        "stick_slip": lambda: {"stribeck": float(u(1.0, 2.0)), "speed_mm_per_s": float(u(1, 4))},
        "lost_telegrams": lambda: {"every_ms": int(rng.integers(40, 260)), "held_ms": int(rng.integers(2, 6))},
        "position_gain": lambda: {"middle": float(u(-0.5, 0.5))},
        "cross_talk": dict,
        "double_speed_ff": lambda: {"above": float(u(0.3, 0.6))},
        "rate_limit": dict,
    }[name]()
    first = {"inner_play": 0.004, "one_way_gain": 0.02, "wandering_delay": 3e-4, "saturation": 0.2, "belt": 0.3}
    return Fault(
        name,
        first.get(name, 1e-3 if name in ("lost_telegrams", "position_gain", "double_speed_ff") else 1.0),
        constants,
    )


def put(fault: Fault, axis: Axis, command: Array, top: Most, other: Array | None) -> tuple[Axis, Around]:
    """An axis with the fault, and what then acts on it in a run."""
    k, size, t = fault.constants, fault.size, np.arange(len(command)) * STEP_S
    reach = top.way
    speed = np.gradient(command, STEP_S)
    change = np.gradient(speed, STEP_S)

    def wave(pitch: float, turns: int = 1) -> Array:
        return np.sin(2 * np.pi * turns * command / pitch + k["phase_rad"])

    def load() -> Array:
        if fault.name == "screw_ripple":
            return wave(k["pitch_mm"])
        if fault.name == "cogging":
            return wave(k["pitch_mm"]) + k["second"] * wave(k["pitch_mm"], 2)
        if fault.name == "lopsided_ripple":  # only while it travels forwards
            return wave(k["pitch_mm"]) * smooth(1.0 * (speed > 0.1), 0.01)
        if fault.name == "cubic_cable":
            return -(((command / reach) - k["middle"]) ** 3)
        if fault.name == "fan_hum":
            return np.sin(2 * np.pi * k["hertz"] * t + k["phase_rad"])
        if fault.name == "square_drag":
            return -np.abs(speed) * speed * 1e-4
        if fault.name == "end_bumper":
            deep = np.maximum(k["side"] * command / reach - k["from"], 0)
            return -k["side"] * deep
        if fault.name == "friction_patch":
            near = np.exp(-(((command / reach - k["centre"]) / k["width"]) ** 2))
            return -near * np.tanh(speed / 0.5)
        if fault.name == "brake_drag":
            return -_since_stop(command, speed, k["fades_mm"]) * np.tanh(speed / 0.5)
        return -np.exp(-t / k["seconds"]) * np.tanh(speed / 0.5)  # fading_friction

    if fault.name in FORCED:
        return axis, Around(load=size * load())
    if fault.name == "inner_play":
        return axis.but(play=size), Around()
    if fault.name == "one_way_gain":
        return axis.but(kp=EVEN_KP, kp_back=EVEN_KP * (1 + size), vff=0.0), Around()
    if fault.name == "wandering_delay":
        wander = np.sin(2 * np.pi * t / k["seconds"] + k["phase_rad"])
        late = size * (1 + (np.sign(wander) if k["jumps"] else wander))
        return axis, Around(seen=smooth(np.interp(t - late, t, command), 0.004))
    if fault.name == "saturation":
        return axis.but(most=axis.coulomb + axis.mass * top.acceleration * max(0.05, 1 - size)), Around()
    if fault.name == "belt":
        return axis.but(
            ratio=min(size, 0.8), belt_hertz=k["hertz"], belt_damping=k["damping"], kp=40.0, wv=160.0, reset_s=0.2
        ), Around()
    if fault.name == "square_ff":
        return axis, Around(more_ff=size * np.abs(change) * change * 1e-5)
    if fault.name == "stick_slip":
        return axis.but(
            coulomb=size, stribeck=k["stribeck"], stribeck_speed=k["speed_mm_per_s"], friction_ff=0.0, kp=60.0, wv=150.0,
            reset_s=0.03,
        ), Around()  # fmt: skip
    if fault.name == "lost_telegrams":
        seen = command.copy()
        n, held = k["every_ms"], k["held_ms"]
        for start in range(n, len(seen) - held, n):
            late = seen[start : start + held] - seen[start]
            seen[start : start + held] -= late * min(1.0, size)
        return axis, Around(seen=smooth(seen, 0.002))
    if fault.name == "position_gain":
        return axis, Around(seen=command - size * (command / reach - k["middle"]) ** 2 * smooth(speed, 0.004))
    if fault.name == "cross_talk":
        pull = np.gradient(np.gradient(other, STEP_S), STEP_S) if other is not None else 0 * t
        return axis.but(wv=150.0, kp=60.0, reset_s=np.inf), Around(load=size * 1e-2 * pull)
    if fault.name == "rate_limit":  # an amplifier whose speed command is cut off
        most = top.speed * max(0.2, 1 - 0.1 * size)
        seen = command + smooth(np.cumsum(np.clip(speed, -most, most) - speed) * STEP_S, 0.004)
        return axis, Around(seen=_caught(command, seen, 0.05))
    above = k["above"] * top.speed  # double_speed_ff: feed forward is scaled wrongly in the upper range only
    return axis, Around(seen=command + size * smooth(np.sign(speed) * np.maximum(np.abs(speed) - above, 0), 0.006))


def _since_stop(command: Array, speed: Array, fades: float) -> Array:
    """One at each start after a stop, fading with the way since then."""
    out, way = np.zeros(len(command)), 1e9
    still = np.abs(speed) < 0.05
    rest = 0
    for k in range(1, len(command)):
        rest = rest + 1 if still[k] else 0
        way = 0.0 if rest > 30 else way + abs(command[k] - command[k - 1])
        out[k] = np.exp(-way / fades)
    return out


def _caught(command: Array, seen: Array, seconds: float) -> Array:
    """What lags behind catches up again."""
    behind, out, keep = seen - command, np.zeros(len(command)), np.exp(-STEP_S / seconds)
    for k in range(1, len(command)):
        out[k] = keep * out[k - 1] + behind[k] - behind[k - 1]
    return command + out
