"""Effects that no library of causes lists.  Each hooks in where it acts: encoder, carriage or tip.

Every effect takes a dict of values; "size" scales it linearly and 1.0 is a fair size (some 10 to 30 micrometres at the
tip).  `axis` picks an actuator or a machine axis.  `seed` fixes what is random in it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from tests.validation.plants.machine import Run, State

# name -> (where the gap truly lives, what it truly depends on: prefixes of covariates that a report may name)
NAMES: dict[str, tuple[str, tuple[str, ...]]] = {
    "guide_straightness": ("structure", ("position", "direction")),
    "floor_vibration": ("sensor", ("time",)),
    "stick_slip": ("drive", ("time", "velocity", "reversal", "position")),
    "force_crosstalk": ("structure", ("force", "direction")),
    "viscous_windup": ("drive", ("velocity", "direction")),
    "soft_spot": ("drive", ("force", "position", "direction")),
    "spindle_growth": ("tool", ("time", "temperature")),
    "tracker_refraction": ("sensor", ("time", "temperature")),
    "joint_hysteresis": ("structure", ("reversal", "direction", "velocity", "position")),
    "spindle_runout": ("tool", ("velocity", "force", "direction")),
    "corner_ringing": ("control", ("acceleration", "time", "velocity", "reversal")),
    "creep": ("structure", ("time", "force", "temperature")),
    "clamp_slip": ("workpiece", ("time",)),
}


def at_encoder(name: str, value: dict, t: np.ndarray, run: Run, setpoint: np.ndarray) -> np.ndarray:
    """Change of the encoders (n, 3) mm on the fine time grid."""
    out = np.zeros_like(setpoint)
    if name == "corner_ringing":  # every stop rings one axis, in proportion to the speed that was lost there
        i, w = value["axis"], 2 * np.pi * value.get("hertz", 6.0)
        ends = run.timeline.begin[1:]
        for end, speed in zip(ends, run.timeline.peak, strict=True):
            u = t - end
            ring = np.exp(-np.clip(u, 0, None) * 5.0) * np.sin(w * np.clip(u, 0, None)) * (u > 0)
            out[:, i] += 2.0e-3 * value["size"] * speed * ring
    return out


def at_carriage(name: str, value: dict, s: State) -> None:
    """Changes the motor side of the drive springs in place."""
    if name == "stick_slip":  # bursts that ring out, at random moments of the run
        rng, i = np.random.default_rng(value["seed"] + int(s.common[0])), value["axis"]
        for start in rng.uniform(s.t[0], s.t[-1], 7):
            u = np.clip(s.t - start, 0, None)
            s.carriage[:, i] += 0.04 * value["size"] * np.exp(-u / 0.35) * np.sin(2 * np.pi * 1.9 * u)
    elif (
        name == "viscous_windup"
    ):  # thick grease: the carriage lags in proportion to speed, the drive pulls accordingly
        i = value["axis"]
        s.carriage[:, i] -= 1e-3 * value["size"] * s.velocity[:, i]
    elif name == "soft_spot":  # the drive spring is softer near one place of the screw
        i = value["axis"]
        here = np.exp(-(((s.setpoint[:, i] - np.median(s.setpoint[:, i]) - value["at_mm"]) / 7.0) ** 2))
        along = s.force[:, i]
        s.carriage[:, i] += 2.5e-4 * value["size"] * here * along
    elif name == "force_crosstalk":  # the load on one guide moves the carriage of the next
        i = value["axis"]
        s.carriage[:, i] += 1.5e-4 * value["size"] * s.force[:, (i + 1) % 3]


def at_tip(name: str, value: dict, s: State) -> None:
    """Changes the measured tip in place (program frame)."""
    size, axis = value["size"], value.get("axis", 0)
    if name == "guide_straightness":  # a bump of the guide lifts the tip sideways where the tip passes it
        across = s.programmed[:, (axis + 1) % 2 if axis < 2 else 0]
        s.tip[:, axis] += 0.05 * size * np.exp(-(((across - value["at_mm"]) / 6.0) ** 2))
    elif name == "floor_vibration":  # a press next door
        s.tip[:, axis] += 0.03 * size * np.sin(2 * np.pi * value["hertz"] * s.common + 0.4)
    elif name == "spindle_growth":  # while cutting the spindle warms and pushes the tool down
        s.tip[:, 2] -= 0.05 * size * (1 - np.exp(-s.common / 900.0)) * (1 + 0.3 * np.sin(s.common / 137.0))
    elif name == "tracker_refraction":  # air that warms bends the beam: slow wander in two axes
        wander = np.sin(s.common / 71.0 + value["phase"]) + 0.6 * np.sin(s.common / 23.7 + 2 * value["phase"])
        s.tip[:, axis] += 0.02 * size * wander
    elif name == "joint_hysteresis":  # ball joints hold back the platform until it has moved far enough
        path = np.cumsum(np.linalg.norm(np.diff(s.programmed, axis=0, prepend=s.programmed[:1]), axis=1))
        held = np.zeros(3)
        last = s.programmed[0]
        for k in range(len(path)):
            move = s.programmed[k] - last
            held = held + (move - held * np.linalg.norm(move)) / 9.0
            s.tip[k] -= 0.03 * size * held * [1.0, 0.4, 0.0]
            last = s.programmed[k]
    elif name == "spindle_runout":  # an unbalanced spindle throws the tool outward, more so at speed
        right = np.cross(s.along, [0.0, 0.0, 1.0])
        s.tip += (0.02 * size * (s.speed / 10.0) ** 2 / (1 + (s.speed / 20.0) ** 2))[:, None] * right
    elif name == "creep":  # the structure gives way slowly while it is loaded
        s.tip[:, axis] -= 0.04 * size * np.log1p(s.common / 60.0) * (0.5 + 0.5 * s.cuts)
    elif name == "clamp_slip":  # one knock in the middle of a run, and it stays
        after = s.common >= value["when_s"]
        s.tip[after] += 0.04 * size * np.array([0.7, -0.6, 0.2])
