"""Columns of the tables of a compensation, and its trajectories as CSV text."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from camcomp.compensation.program.compensate import Compensated, Trajectories
from camcomp.gcode.plain_rows import csv_rows
from camcomp.ground.datatypes import Floats, Ints
from camcomp.model.job import Job

DECIMALS = 6
DECIMALS_RAD = 9  # 2 m of reach make 2 nm of it
ORIENTATION = ["a_deg", "b_deg", "c_deg", "ac_deg", "bc_deg", "cc_deg"]  # programmed, corrected
ENGAGEMENT = ["depth_mm", "engaged_rad"]  # where a stock is known


def actuator_columns(job: Job) -> tuple[list[str], list[str], list[str]]:
    """Column names of nominal coordinates, commanded coordinates and drive forces, in actuator order."""
    nominal, commanded, force = [], [], []
    for name, rotary in zip(job.machine.actuators, job.machine.revolute, strict=True):
        length, load = ("rad", "Nmm") if rotary else ("mm", "N")
        nominal.append(f"act_{name}_nominal_{length}")
        commanded.append(f"act_{name}_{length}")
        force.append(f"act_{name}_{load}")
    return nominal, commanded, force


def joint_columns(job: Job, oriented: bool = False) -> list[str]:
    """Column names of the joint table; oriented: of a program with orientation."""
    head = ["line", "s_mm", "t_s", "x_mm", "y_mm", "z_mm", "xc_mm", "yc_mm", "zc_mm", "fx_N", "fy_N", "fz_N"]
    head += [name for trio in zip(*actuator_columns(job), strict=True) for name in trio]
    head += band_columns(job) + (ENGAGEMENT if job.config.workpiece.stock is not None else [])
    return head + (ORIENTATION if oriented else [])


def band_columns(job: Job) -> list[str]:
    """Column names of the bands; empty if every number of the config is exact."""
    if not job.config.uncertain:
        return []
    return ["band_um", "gain_um"] + (["share"] if job.config.compensation.policy != "full" else [])


def decimals_of(names: Sequence[str]) -> list[int]:
    """Decimals of the columns of a table."""
    return [DECIMALS_RAD if name.endswith("_rad") else DECIMALS for name in names]


def paths_csv(result: Compensated, trajectories: Trajectories) -> bytes:
    """The five trajectories of the tool tip, program frame: seed Fig. 4."""
    named = {
        "target": result.rows.target,
        "chain_error": trajectories.chain_error,
        "force": trajectories.force,
        "both": result.uncorrected,
        "adjusted": result.written.end,
    }
    head = ["line", "s_mm"] + [f"{name}_{axis}_mm" for name in named for axis in "xyz"]
    return _csv(head, result.lines, np.column_stack((result.s, *named.values())))


def _csv(head: Sequence[str], line: Ints, values: Floats) -> bytes:
    """A table whose first column is the source line. Values that do not exist stand as empty cells."""
    return (",".join(head) + "\n").encode() + csv_rows(line, values, np.array(decimals_of(head[1:])))
