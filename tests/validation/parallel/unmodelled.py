"""Faults that no effect of the library describes; each is linear in its size (mm, N or a share of the force)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import lfilter

from tests.validation.parallel.machine import Machine
from tests.validation.parallel.motion import STEP, Track

STAGES = {
    "drag_squared": "control", "loop_ringing": "control", "screw_chirp": "drive", "coupling_ratchet": "drive",
    "guide_waviness": "structure", "loose_foot": "structure", "bed_bending": "structure",
    "grain_direction": "process", "built_up_edge": "process", "vice_slip": "workpiece", "sight_ripple": "sensor",
    "coolant_cycle": "tool",
}  # fmt: skip


@dataclass
class Strange:
    """A fault: name, the drive it sits at, its size and its own constants."""

    name: str
    drive: int
    constants: dict
    size: float = 1.0

    def scaled(self, size: float) -> Strange:
        """The same fault in another size."""
        return replace(self, size=size)

    def loose(self, machine: Machine, load: np.ndarray) -> np.ndarray:
        """Shift of the carriages (n, c): a foot with clearance gives way as soon as its load has a sign."""
        out = np.zeros_like(load)
        out[:, self.drive] = -self.size * np.tanh(load[:, self.drive] / self.constants["load_N"])
        return out

    def at(self, machine: Machine, run: Track) -> dict:
        """Deviations by the fault at 1 kHz: control, carriage (n, c), side (n, c, 3), force, tip (n, 3)."""
        key = (self.name, self.drive, repr(self.constants))
        if run.cache.get("key") != key:
            run.cache.update(key=key, unit=self._unit(machine, run))
        return {name: values * self.size for name, values in run.cache["unit"].items()}

    def _unit(self, machine: Machine, run: Track) -> dict:
        k, c = self.constants, self.drive
        place = run.rho[:, c]
        speed = np.gradient(place, STEP)
        one = np.zeros_like(run.rho)
        tip = np.zeros_like(run.tip)
        if self.name == "drag_squared":  # following error with the square of the speed
            one[:, c] = -speed * np.abs(speed) / 400.0
            return {"control": one}
        if self.name == "loop_ringing":  # a weakly damped mode of the loop, excited by acceleration
            w, damping = 2 * np.pi * k["frequency_Hz"], k["damping"]
            radius, angle = np.exp(-damping * w * STEP), w * np.sqrt(1 - damping**2) * STEP
            acceleration = np.gradient(speed, STEP)
            ring = lfilter([0, radius * np.sin(angle)], [1, -2 * radius * np.cos(angle), radius**2], acceleration)
            one[:, c] = ring / 2e4
            return {"control": one}
        if self.name == "screw_chirp":  # an axial error whose period shrinks along the screw
            x = place - machine.home[c]
            one[:, c] = np.sin(2 * np.pi * (x / k["period_mm"] + x**2 / k["chirp_mm2"]) + k["phase_rad"])
            return {"carriage": one}
        if self.name == "coupling_ratchet":  # slips a little at every second reversal, never back
            way = np.sign(np.where(np.abs(speed) > 0.2, speed, 0))
            moving = np.flatnonzero(way)
            turns = moving[1:][(way[moving[1:]] < 0) & (way[moving[:-1]] > 0)]
            one[turns, c] = 1.0
            return {"carriage": np.cumsum(one, 0) / 4}
        if self.name == "guide_waviness":  # the carriage wanders across its guide
            side = np.zeros((*run.rho.shape, 3))
            across = np.roll(machine.axis[c], 1 + int(k["which"]))
            wave = np.sin(2 * np.pi * place / k["period_mm"] + k["phase_rad"])
            side[:, c] = wave[:, None] * across
            return {"side": side}
        if self.name == "loose_foot":
            return {}
        if self.name == "bed_bending":  # the bed hollows: height with the square of the distance from its middle
            away = (run.tip[:, 0] - k["middle_x_mm"]) ** 2 * k["share"]
            away = away + (run.tip[:, 1] - k["middle_y_mm"]) ** 2 * (1 - k["share"])
            tip[:, 2] = away / 900.0
            return {"tip": tip}
        if self.name == "grain_direction":  # the material has a grain: the force depends on the direction of the feed
            angle = np.arctan2(run.along[:, 1], run.along[:, 0])
            return {"force": run.force * np.cos(2 * (angle - k["grain_rad"]))[:, None]}
        if self.name == "built_up_edge":  # grows, breaks off, grows
            spent = run.minutes * 60
            saw = (spent / k["period_s"] + k["phase"]) % 1.0
            return {"force": run.force * (saw**1.5 - 0.4)[:, None]}
        if self.name == "vice_slip":  # the work slips once and stays there
            slipped = run.started_s + run.t > k["at_s"]
            tip[slipped] = [np.cos(k["angle_rad"]), np.sin(k["angle_rad"]), 0.2]
            return {"tip": tip}
        if self.name == "sight_ripple":  # the instrument's range has a periodic error along its line of sight
            sight = run.tip - np.array([k["x_mm"], k["y_mm"], k["z_mm"]])
            reach = np.linalg.norm(sight, axis=1)
            wave = np.sin(2 * np.pi * reach / k["period_mm"] + k["phase_rad"])
            return {"tip": sight / reach[:, None] * wave[:, None]}
        if self.name == "coolant_cycle":  # the spindle breathes with its cooler
            clock = run.started_s + run.t
            tip[:, 2] = np.sin(2 * np.pi * clock / k["period_s"] + k["phase_rad"])
            return {"tip": tip}
        raise ValueError(self.name)


def draw(rng: np.random.Generator, chains: int, starts: list[tuple[float, float]], seen: bool) -> Strange:
    """A fault of unit size; starts: (start, end) of the runs in s; seen: encoders and set-points are both logged."""
    names = [name for name, stage in STAGES.items() if seen or stage != "control"]
    name = str(rng.choice(names))
    phase = float(rng.uniform(0, 2 * np.pi))
    which = int(rng.integers(1, len(starts) - 1)) if len(starts) > 2 else 0
    begin, end = starts[which]
    angle, far = rng.uniform(0, 2 * np.pi), rng.uniform(300, 900)
    constants = {
        "drag_squared": {},
        "loop_ringing": {"frequency_Hz": rng.uniform(3, 8), "damping": rng.uniform(0.02, 0.06)},
        "screw_chirp": {"period_mm": rng.uniform(14, 30), "chirp_mm2": rng.uniform(1500, 4000), "phase_rad": phase},
        "coupling_ratchet": {},
        "guide_waviness": {"period_mm": rng.uniform(11, 38), "phase_rad": phase, "which": rng.integers(0, 2)},
        "loose_foot": {"load_N": rng.uniform(5, 40)},
        "bed_bending": {"middle_x_mm": rng.uniform(-15, 15), "middle_y_mm": rng.uniform(-15, 15),
                        "share": rng.uniform(0, 1)},
        "grain_direction": {"grain_rad": rng.uniform(0, np.pi)},
        "built_up_edge": {"period_s": rng.uniform(1.5, 5), "phase": rng.uniform(0, 1)},
        "vice_slip": {"at_s": begin + rng.uniform(0.25, 0.75) * (end - begin), "angle_rad": phase},
        "sight_ripple": {"x_mm": far * np.cos(angle), "y_mm": far * np.sin(angle), "z_mm": rng.uniform(50, 300),
                         "period_mm": rng.uniform(9, 32), "phase_rad": phase},
        "coolant_cycle": {"period_s": rng.uniform(1.7, 9), "phase_rad": phase},
    }[name]  # fmt: skip
    return Strange(name, int(rng.integers(0, chains)), {key: float(value) for key, value in constants.items()})
