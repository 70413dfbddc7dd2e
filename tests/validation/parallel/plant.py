"""The whole plant: deviations by the contract's names in, what sensors would see without noise out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tests.validation.parallel import motion, structure
from tests.validation.parallel.machine import Machine
from tests.validation.parallel.motion import STEP, Track

# (effect, per actuator): everything of the contract that makes sense on a machine with sliding drives and closed chains
LIBRARY = {
    "servo_lag": True, "backlash": True, "friction": True, "joint_offset": True, "screw_pitch": True,
    "screw_cyclic": True, "thermal_growth": True, "drive_stiffness": True, "link_stiffness": False,
    "chain_error": True, "link_length": True, "gravity": False, "cutting_force": False, "tool_length": False,
    "tool_deflection": False, "tool_wear": False, "workpiece_frame": False, "time_sync": False,
}  # fmt: skip
COMMON = ("servo_lag", "thermal_growth")  # may have one value for all actuators


@dataclass(frozen=True)
class Deviation:
    """An effect with the contract's parameters; target: an actuator, or None."""

    effect: str
    target: str | None
    parameters: dict


@dataclass
class Seen:
    """All rows of all runs in one: tip (n, 3), motors (n, c), drive forces (n, c), force on the tool (n, 3)."""

    tip: np.ndarray
    motor: np.ndarray
    drive: np.ndarray
    force: np.ndarray


def at_rows(values: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Values (n, ...) at 1 kHz, linear between, at times s."""
    place = np.clip(times / STEP, 0, len(values) - 1.001)
    low = place.astype(int)
    part = (place - low).reshape(-1, *[1] * (values.ndim - 1))
    return values[low] * (1 - part) + values[low + 1] * part


def simulate(machine: Machine, tracks: list[Track], rows: list[np.ndarray], deviations: list[Deviation],
             strange=None, scatter: np.ndarray | None = None, drives: bool = False) -> Seen:  # fmt: skip
    """States of the plant at the times `rows` (s, per track); strange: a fault of `strange.py`; scatter: (2, c)."""
    chains = len(machine.drives)
    springs = structure.nominal(chains)
    if scatter is not None:
        springs.foot, springs.bar = scatter[0].copy(), scatter[1].copy()
    by_drive: list[list[Deviation]] = [[] for _ in range(chains)]
    whole: dict[str, dict] = {}
    for one in deviations:
        if LIBRARY[one.effect]:
            for c in range(chains):
                if one.target in (None, machine.drives[c]):
                    by_drive[c].append(one)
        else:
            whole[one.effect] = one.parameters
    value = {name: next(iter(parameters.values())) for name, parameters in whole.items()}
    springs.foot *= value.get("link_stiffness", 1.0)
    springs.bar *= value.get("link_stiffness", 1.0)
    springs.weight = value.get("gravity", 0.0)
    springs.tool = value.get("tool_length", 0.0)
    for c, own in enumerate(by_drive):
        for one in own:
            p = one.parameters
            if one.effect == "drive_stiffness":
                springs.drive[c] *= p["factor"]
            elif one.effect == "chain_error":
                springs.roll[c] += np.radians(p["roll_deg"])
            elif one.effect == "link_length":
                springs.longer[c] += p["length_mm"]
    offset = value.get("time_sync", 0.0)
    parts = []
    for run, times in zip(tracks, rows, strict=True):
        motor, carriage, rub = np.empty_like(run.rho), np.empty_like(run.rho), np.zeros_like(run.rho)
        hooks = strange.at(machine, run) if strange else {}
        for c, own in enumerate(by_drive):
            drive_k = machine.drive_stiffness[c] * springs.drive[c]
            motor[:, c] = run.rho[:, c]
            for one in own:
                if one.effect == "servo_lag":
                    motor[:, c] -= motion.following_error(run.rho[:, c], one.parameters["time_constant_ms"] * 1e-3)
            if "control" in hooks:
                motor[:, c] += hooks["control"][:, c]
            at = motor[:, c]
            carriage[:, c] = at
            for one in own:
                p = one.parameters
                if one.effect == "backlash":
                    carriage[:, c] += motion.play(at, p["width_mm"], motion.WIDTHS)
                elif one.effect == "friction":
                    rub[:, c] += motion.lugre(at, p["force_N"], p["presliding_mm"], motion.STRIBECK,
                                              motion.STRIBECK_SPEED)  # fmt: skip
                elif one.effect == "joint_offset":
                    carriage[:, c] += p["offset_mm"]
                elif one.effect == "screw_pitch":
                    carriage[:, c] += p["error_ppm"] * 1e-6 * (at - machine.home[c])
                elif one.effect == "screw_cyclic":
                    carriage[:, c] += p["amplitude_mm"] * np.sin(2 * np.pi * at / p["pitch_mm"] + p["phase_rad"])
                elif one.effect == "thermal_growth":
                    carriage[:, c] += p["growth_mm_per_K"] * (run.temperature - 20)
            carriage[:, c] -= rub[:, c] / drive_k
        if "carriage" in hooks:
            carriage += hooks["carriage"]
        factor = value.get("cutting_force", 1.0) * (1 + value.get("tool_wear", 0.0) * run.minutes)
        force = run.force * factor[:, None] if isinstance(factor, np.ndarray) else run.force * factor
        if "force" in hooks:
            force = force + hooks["force"]
        side = hooks.get("side", np.zeros((len(run.t), chains, 3)))
        extra = hooks.get("tip", np.zeros((len(run.t), 3)))
        parts.append((run, times, motor, carriage, rub, force, side, extra))

    def gather(moved: float) -> Seen:
        near = [np.clip(np.rint((p[1] + moved) / STEP).astype(int), 0, len(p[0].t) - 1) for p in parts]
        tip = np.concatenate([at_rows(p[0].tip, p[1] + moved) for p in parts])
        rho = np.concatenate([at_rows(p[3], p[1] + moved) for p in parts])
        force = np.concatenate([p[5][i] for p, i in zip(parts, near, strict=True)])
        side = np.concatenate([p[6][i] for p, i in zip(parts, near, strict=True)])
        rub = np.concatenate([p[4][i] for p, i in zip(parts, near, strict=True)])
        if strange and strange.name == "loose_foot":
            _, load, _ = structure.equilibrium(machine, tip, rho, force, springs, side)
            rho = rho + strange.loose(machine, load)
        out, drive, _ = structure.equilibrium(machine, tip, rho, force, springs, side)
        lateral = force * [1, 1, 0]
        out = out + value.get("tool_deflection", 0.0) * lateral
        out = out + np.concatenate([at_rows(p[7], p[1] + moved) for p in parts])
        motor = np.concatenate([at_rows(p[2], p[1]) for p in parts])
        return Seen(out, motor, drive + rub, force)

    seen = gather(offset)
    if drives and abs(offset) > 2e-4:
        still = gather(0.0)
        seen.drive, seen.force = still.drive, still.force
    if "workpiece_frame" in whole:
        p = whole["workpiece_frame"]
        a = np.radians(p["rotation_deg"])
        spin = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
        # The work lies shifted and turned; what is measured is the tip as seen from it.
        seen.tip = (seen.tip - [p["shift_x_mm"], p["shift_y_mm"], p["shift_z_mm"]]) @ spin
    return seen
