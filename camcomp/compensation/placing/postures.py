"""Start postures of a six-axis arm that hold the platform at its start pose: shoulder, elbow and wrist the other way round."""

from __future__ import annotations

from itertools import product

import numpy as np

from camcomp.ground.datatypes import Floats
from camcomp.model.job import Job
from camcomp.model.statics.arm import arm_of, end_pose
from camcomp.model.statics.closedform import closed_form

STATED = "stated"
_PARTS = ("shoulder", "elbow", "wrist")  # the order of the branches of the closed form


def start_postures(job: Job) -> dict[str, dict[str, float]]:
    """Start angles (deg) by posture and joint, within limits; empty for machines without the closed form of an arm."""
    arm = arm_of(job.machine.nominal)
    solver = closed_form(arm) if arm is not None else None
    if arm is None or solver is None:
        return {}
    branches = solver.all(*end_pose(arm, arm.start))
    own = np.array(list(product((0, 1), repeat=len(_PARTS))))[solver.branch]
    found = {}
    for branch, side in zip(branches, product((0, 1), repeat=len(_PARTS)), strict=True):
        parts = [part for part, a, b in zip(_PARTS, own, side, strict=True) if a != b]
        if parts and branch is not None and (angles := _within_limits(job, np.degrees(branch))) is not None:
            found[f"{' and '.join(parts)} flipped"] = dict(
                zip(job.config.robot.actuators, angles.round(9).tolist(), strict=True)
            )
    return found


def _within_limits(job: Job, angles: Floats) -> Floats | None:
    """Angles (6,) deg plus whole turns, the smallest within limits; None if a joint is out of its limits."""
    out = []
    for angle, each in zip(angles, job.config.robot.actuators.values(), strict=True):
        low, high = each.limits or (-np.pi, np.pi)
        turns = angle + 360.0 * np.arange(-2, 3)
        inside = turns[(turns >= np.degrees(low)) & (turns <= np.degrees(high))]
        if not len(inside):
            return None
        out.append(inside[np.argmin(np.abs(inside))])
    return np.array(out)
