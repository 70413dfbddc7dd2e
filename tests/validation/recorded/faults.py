"""Faults of a machine, by the names of the contract's library, and how their sizes are drawn."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from tests.validation.recorded.machines import Machine

Target = str | None


@dataclass(frozen=True)
class Fault:
    """One thing that is wrong.  target None: no actuator of its own, or the same on all."""

    effect: str
    target: Target
    parameters: dict[str, float] = field(hash=False)

    def aimed(self, actuators: tuple[str, ...]) -> list[int]:
        """Indices of the actuators that have it."""
        return [i for i, each in enumerate(actuators) if self.target in (None, each)]


class Faults(tuple[Fault, ...]):
    """Everything that is wrong at once; sizes of the same kind add up, factors multiply."""

    def of(self, effect: str) -> list[Fault]:
        """Those of one kind."""
        return [each for each in self if each.effect == effect]

    def sum(self, effect: str, parameter: str, targets: tuple[Target, ...]) -> np.ndarray:
        """Sizes (targets,)."""
        out = np.zeros(len(targets))
        for each in self.of(effect):
            out += each.parameters[parameter] * np.array([each.target in (None, t) for t in targets])
        return out

    def product(self, effect: str, parameter: str, targets: tuple[Target, ...]) -> np.ndarray:
        """Factors (targets,)."""
        out = np.ones(len(targets))
        for each in self.of(effect):
            out *= np.where([each.target in (None, t) for t in targets], each.parameters[parameter], 1.0)
        return out


@dataclass(frozen=True)
class Kind:
    """One effect of the library: the parameter that is its size, that of a fair one, the largest, whether it has a sign.

    factor: the parameter is 1 / (1 + size).  own, common: whether actuators have it each, and whether all may share one.
    """

    parameter: str
    fair: float
    most: float
    signed: bool = False
    factor: bool = False
    own: bool = False
    common: bool = True


LIBRARY: dict[str, Kind] = {
    "servo_lag": Kind("time_constant_ms", 1.0, 40.0, own=True),
    "backlash": Kind("width_mm", 0.01, 0.3, own=True, common=False),
    "friction": Kind("force_N", 50.0, 1500.0, own=True, common=False),
    "joint_offset": Kind("offset_mm", 0.01, 2.0, signed=True, own=True, common=False),
    "screw_pitch": Kind("error_ppm", 50.0, 5000.0, signed=True, own=True, common=False),
    "screw_cyclic": Kind("amplitude_mm", 0.01, 0.2, own=True, common=False),
    "thermal_growth": Kind("growth_mm_per_K", 0.002, 0.05, signed=True, own=True),
    "drive_stiffness": Kind("factor", 0.3, 8.0, signed=True, factor=True, own=True, common=False),
    "link_stiffness": Kind("factor", 0.05, 8.0, signed=True, factor=True),
    "chain_error": Kind("roll_deg", 0.02, 5.0, signed=True, own=True, common=False),
    "link_length": Kind("length_mm", 0.01, 2.0, signed=True, own=True, common=False),
    "gravity": Kind("weight_N", 10.0, 500.0),
    "cutting_force": Kind("factor", 0.03, 2.0, signed=True, factor=True),
    "tool_length": Kind("length_mm", 0.01, 5.0, signed=True),
    "tool_deflection": Kind("compliance_mm_per_N", 5e-5, 5e-3),
    "tool_wear": Kind("growth_per_min", 0.05, 5.0),
    "workpiece_frame": Kind("shift_mm", 0.01, 3.0),
    "time_sync": Kind("offset_s", 1e-3, 0.1, signed=True),
    "squareness": Kind("angle_mrad", 0.2, 10.0, signed=True, own=True, common=False),
}
PLANES = ("xy", "xz", "yz")


def targets(effect: str, actuators: tuple[str, ...]) -> list[Target]:
    """Targets that an effect may have."""
    kind = LIBRARY[effect]
    own = PLANES if effect == "squareness" else actuators
    return ([None] if kind.common else []) + (list(own) if kind.own else [])


def every(machine: Machine) -> list[tuple[str, Target]]:
    """All (effect, target) of the library that apply to a machine."""
    applied = [effect for effect in LIBRARY if effect not in machine.without]
    both = [(effect, target) for effect in applied for target in targets(effect, machine.actuators)]
    return [each for each in both if each not in machine.unseen]


def sized(effect: str, target: Target, size: float, seed: int, reach: float | None = None) -> Fault:
    """The fault of that size (a share for factors); its other parameters are drawn from the seed.

    reach: of rotary joints, mm per rad, whose offset is given in rad.
    """
    rng, kind = np.random.default_rng([seed, 3]), LIBRARY[effect]
    if effect == "screw_cyclic":
        more = {"pitch_mm": float(rng.choice([4.0, 5.0, 8.0, 10.0])), "phase_rad": float(rng.uniform(-np.pi, np.pi))}
        return Fault(effect, target, {kind.parameter: size, **more})
    if effect == "workpiece_frame":
        way = rng.normal(size=3)
        x, y, z = size * way / np.linalg.norm(way)
        turn = size * float(rng.uniform(-2.0, 2.0))
        return Fault(effect, target, {"shift_x_mm": x, "shift_y_mm": y, "shift_z_mm": z, "rotation_deg": turn})
    if effect == "joint_offset" and reach is not None:
        return Fault(effect, target, {"offset_rad": size / reach})
    return Fault(effect, target, {kind.parameter: 1 / (1 + size) if kind.factor else size})


def sign(effect: str, seed: int) -> float:
    """The sign that its size is given."""
    signed = effect in LIBRARY and LIBRARY[effect].signed
    return float(np.random.default_rng([seed, 4]).choice([-1.0, 1.0])) if signed else 1.0


def bounds(effect: str) -> tuple[float, float]:
    """Sizes that still make sense."""
    if effect not in LIBRARY:
        return 0.0, 100.0
    kind = LIBRARY[effect]
    return (-0.45 if kind.factor else -kind.most if kind.signed else 0.0), kind.most
