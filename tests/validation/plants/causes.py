"""Known causes for the truth machine: how each (effect, target) of the library's names changes the truth.

A cause is scaled by one amplitude in its natural unit.  Signs that nature does not have (negative play) are not drawn.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from tests.validation.plants import unmodelled
from tests.validation.plants.machine import Truth

AXES = ("x", "y", "z")


@dataclass(frozen=True)
class Kind:
    """How one effect enters: per actuator or not, whether one common value exists, unit amplitude, signs, hook."""

    per_actuator: bool
    common: bool
    unit: float
    signed: bool
    limit: float
    put: Callable[[Truth, np.ndarray, float, np.random.Generator], tuple[Truth, dict[str, float]]]


def _vector(field: str, parameter: str) -> Callable:
    def put(truth: Truth, which: np.ndarray, a: float, rng: np.random.Generator):
        return replace(truth, **{field: getattr(truth, field) + a * which}), {parameter: a}

    return put


def _scalar(field: str, parameter: str) -> Callable:
    def put(truth: Truth, which: np.ndarray, a: float, rng: np.random.Generator):
        return replace(truth, **{field: getattr(truth, field) + a}), {parameter: a}

    return put


def _softer_drive(truth: Truth, which: np.ndarray, a: float, rng: np.random.Generator):
    factor = 1 / (1 + a)
    return replace(truth, drive_factor=truth.drive_factor * np.where(which > 0, factor, 1.0)), {"factor": factor}


def _softer_links(truth: Truth, which: np.ndarray, a: float, rng: np.random.Generator):
    return replace(truth, link_factor=truth.link_factor / (1 + a)), {"factor": 1 / (1 + a)}


def _force(truth: Truth, which: np.ndarray, a: float, rng: np.random.Generator):
    return replace(truth, force_factor=truth.force_factor * (1 + a)), {"factor": 1 + a}


def _cyclic(truth: Truth, which: np.ndarray, a: float, rng: np.random.Generator):
    pitch, phase = float(rng.choice([4.0, 5.0, 6.0, 8.0, 10.0])), float(rng.uniform(-np.pi, np.pi))
    new = replace(
        truth,
        cyclic_mm=np.where(which > 0, a, truth.cyclic_mm),
        cyclic_pitch_mm=np.where(which > 0, pitch, truth.cyclic_pitch_mm),
        cyclic_phase=np.where(which > 0, phase, truth.cyclic_phase),
    )
    return new, {"amplitude_mm": a, "pitch_mm": pitch, "phase_rad": phase}


def _frame(truth: Truth, which: np.ndarray, a: float, rng: np.random.Generator):
    way = rng.normal(size=3)
    way /= np.linalg.norm(way)
    shift, turn = a * way, float(a * rng.uniform(-2.0, 2.0))
    new = replace(truth, shift_mm=truth.shift_mm + shift, rotation_deg=truth.rotation_deg + turn)
    return new, {"shift_x_mm": shift[0], "shift_y_mm": shift[1], "shift_z_mm": shift[2], "rotation_deg": turn}


KINDS: dict[str, Kind] = {
    "servo_lag": Kind(True, True, 1.0, False, 40.0, _vector("lag_ms", "time_constant_ms")),
    "backlash": Kind(True, False, 0.01, False, 0.3, _vector("play_mm", "width_mm")),
    "friction": Kind(True, False, 50.0, False, 1500.0, _vector("friction_N", "force_N")),
    "joint_offset": Kind(True, False, 0.01, True, 2.0, _vector("offset_mm", "offset_mm")),
    "screw_pitch": Kind(True, False, 50.0, True, 5000.0, _vector("pitch_ppm", "error_ppm")),
    "screw_cyclic": Kind(True, False, 0.01, False, 0.2, _cyclic),
    "thermal_growth": Kind(True, True, 0.002, True, 0.05, _vector("growth_mm_per_K", "growth_mm_per_K")),
    "drive_stiffness": Kind(True, False, 0.3, True, 8.0, _softer_drive),
    "link_stiffness": Kind(False, False, 0.05, True, 8.0, _softer_links),
    "chain_error": Kind(True, False, 0.02, True, 5.0, _vector("roll_deg", "roll_deg")),
    "link_length": Kind(True, False, 0.01, True, 2.0, _vector("longer_mm", "length_mm")),
    "gravity": Kind(False, False, 10.0, False, 500.0, _scalar("weight_N", "weight_N")),
    "cutting_force": Kind(False, False, 0.03, True, 4.0, _force),
    "tool_length": Kind(False, False, 0.01, True, 5.0, _scalar("tool_mm", "length_mm")),
    "tool_deflection": Kind(False, False, 5e-5, False, 5e-3, _scalar("deflection_mm_per_N", "compliance_mm_per_N")),
    "tool_wear": Kind(False, False, 0.05, False, 5.0, _scalar("wear_per_min", "growth_per_min")),
    "workpiece_frame": Kind(False, False, 0.01, True, 3.0, _frame),
    "time_sync": Kind(False, False, 1e-3, True, 0.1, _scalar("sync_s", "offset_s")),
}


@dataclass(frozen=True)
class Cause:
    """One thing that is wrong: a library effect with its target, or a foreign one (target: its axis)."""

    effect: str
    target: str | None
    seed: int

    @property
    def foreign(self) -> bool:
        """Whether no library has it."""
        return self.effect in unmodelled.NAMES

    def sign(self) -> float:
        """The sign its amplitude is given."""
        if self.foreign or not KINDS[self.effect].signed:
            return 1.0
        return float(np.random.default_rng(self.seed).choice([-1.0, 1.0]))

    def unit(self) -> float:
        """Amplitude of a fair size."""
        return 1.0 if self.foreign else KINDS[self.effect].unit

    def bounds(self) -> tuple[float, float]:
        """Amplitudes that still make physical sense."""
        if self.foreign:
            return 0.0, 60.0
        kind = KINDS[self.effect]
        softer = self.effect in ("drive_stiffness", "link_stiffness", "cutting_force")
        return (-0.5 if softer else -kind.limit if kind.signed else 0.0), kind.limit

    def put(self, truth: Truth, amplitude: float, span_s: tuple[float, float]) -> tuple[Truth, dict[str, float]]:
        """The truth with this cause in it, and the parameters as a library would name them.

        span_s: middle of the experiment on the common clock, for what happens at a moment.
        """
        rng = np.random.default_rng(self.seed + 1)
        if self.foreign:
            value = {
                "size": amplitude,
                "axis": AXES.index(self.target or "x"),
                "seed": self.seed,
                "hertz": float(rng.uniform(0.35, 1.7)),
                "at_mm": float(rng.uniform(-12.0, 12.0)),
                "phase": float(rng.uniform(0, 6)),
                "when_s": float(rng.uniform(*span_s)),
            }
            return replace(truth, foreign=(*truth.foreign, (self.effect, value))), {"size": amplitude}
        which = np.array([self.target in (None, a) for a in AXES], float)
        return KINDS[self.effect].put(truth, which, amplitude, rng)


def every_cause() -> list[tuple[str, str | None]]:
    """All (effect, target) pairs of the library."""
    pairs: list[tuple[str, str | None]] = []
    for name, kind in KINDS.items():
        if not kind.per_actuator or kind.common:
            pairs.append((name, None))
        if kind.per_actuator:
            pairs += [(name, a) for a in AXES]
    return pairs
