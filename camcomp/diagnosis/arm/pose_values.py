"""Values of ISO 9283 from the poses of an arm, where one was visited as often as the standard asks for."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from camcomp.diagnosis.arm.noise_floor import visits_of
from camcomp.diagnosis.arm.poses import Poses
from camcomp.diagnosis.result.standards import PoseValues, StandardValues
from camcomp.diagnosis.statistics.standard_values import pose_accuracy, pose_repeatability
from camcomp.ground.datatypes import Floats
from camcomp.model.statics.description import Robot

VISITS = 30  # ISO 9283:1998, table 12
NO_VISITS = "ISO 9283: no pose was visited 30 times"


def of_poses(robot: Robot, campaigns: Sequence[Poses], gaps: Sequence[Floats]) -> StandardValues:
    """What poses hold of ISO 9283; gaps (n, 3) mm to the nominal arm, by campaign."""
    found = []
    for poses, gap in zip(campaigns, gaps, strict=True):
        for rows in visits_of(robot, poses):
            visits = _apart(poses.time, rows)
            if len(visits) >= VISITS:
                joints = poses.q[rows].mean(axis=0)
                shown = [np.degrees(q) if a.revolute else q for q, a in zip(joints, robot.actuators, strict=True)]
                found.append(
                    PoseValues(
                        campaign=poses.label,
                        pose=", ".join(f"{each + 0.0:.1f}" for each in shown),
                        visits=len(visits),
                        AP_um=round(1e3 * pose_accuracy(_means(gap, visits)), 3),
                        RP_um=round(1e3 * pose_repeatability(_means(poses.tip, visits)), 3),
                    )
                )
    return StandardValues(poses=tuple(found), absent=() if found else (NO_VISITS,))


def _apart(time: Floats, rows: np.ndarray) -> list[np.ndarray]:
    """Rows of a pose by visit: those between which the arm was nowhere else are one."""
    order = np.argsort(np.argsort(time, kind="stable"), kind="stable")
    rows = rows[np.argsort(order[rows])]
    return np.split(rows, np.flatnonzero(np.diff(order[rows]) > 1) + 1)


def _means(values: Floats, visits: Sequence[np.ndarray]) -> Floats:
    return np.array([values[rows].mean(axis=0) for rows in visits])
