"""File of the poses to measure next: CSV with the columns of logs, or JSON in the form of joint trajectories."""

from __future__ import annotations

import json

from camcomp.diagnosis.result.types import PosesToMeasure


def pose_list(poses: PosesToMeasure, revolute: tuple[bool, ...], target: str) -> str:
    """Text of the list: JSON for a file called .json (`joint_names`, `points`: `positions` rad or m), else CSV.

    revolute: of every joint. The CSV has a row per pose: `act_<a>_rad` (`_mm`) as in logs, then the platform's position.
    """
    if target.endswith(".json"):
        si = [[v if turns else 1e-3 * v for v, turns in zip(row, revolute, strict=True)] for row in poses.positions]
        return (
            json.dumps({"joint_names": poses.joints, "points": [{"positions": each} for each in si]}, indent=1) + "\n"
        )
    names = [f"act_{a}_{'rad' if turns else 'mm'}" for a, turns in zip(poses.joints, revolute, strict=True)]
    lines = [",".join([*names, "platform_x_mm", "platform_y_mm", "platform_z_mm"])]
    for joints, place in zip(poses.positions, poses.platform_mm, strict=True):
        lines.append(",".join([*(f"{v:.6f}" for v in joints), *(f"{v:.3f}" for v in place)]))
    return "\n".join(lines) + "\n"
