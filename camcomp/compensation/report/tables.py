"""Results of a compensation as CSV text and as a summary; columns as documented in the README."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from camcomp.compensation.bands.outcome import Bands, band_figures
from camcomp.compensation.program.compensate import Compensated, Trajectories
from camcomp.compensation.program.result import CycleTime, Summary, error_size, job_figures
from camcomp.compensation.program.under_control import mode_name
from camcomp.gcode.text import count_lines
from camcomp.ground.datatypes import Floats
from camcomp.ground.orientation import angles_of
from camcomp.model.control import waiting_s
from camcomp.model.job import Job

CHUNK_ROWS = 20_000
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


def band_values(bands: Bands | None, job: Job) -> list[Floats]:
    """These columns (N, 2 or 3), or none of them."""
    return [bands.columns(with_share=job.config.compensation.policy != "full")] if bands is not None else []


def values_behind(result: Compensated, job: Job) -> Floats | None:
    """The columns (N, e) after those of the actuators; None if there are none."""
    parts = band_values(result.bands, job)
    if job.config.workpiece.stock is not None:
        parts.append(result.rows.engagement)
    if result.orienting is not None and result.written.words is not None:
        form = result.orienting.form
        parts += [angles_of(form, each) for each in (result.programmed_words, result.written.words)]
    return np.column_stack(parts) if parts else None


def decimals_of(names: Sequence[str]) -> list[int]:
    """Decimals of the columns of a table."""
    return [DECIMALS_RAD if name.endswith("_rad") else DECIMALS for name in names]


def joint_csv(result: Compensated, job: Job) -> bytes:
    """One row per end point of every motion of the corrected program."""
    head, m = joint_columns(job, result.orienting is not None), len(job.machine.actuators)
    actuators = np.stack((result.nominal, result.state.rho, result.state.drive), axis=2).reshape(-1, 3 * m)
    behind = values_behind(result, job)
    values = np.column_stack(
        (
            result.s, result.t, result.rows.target, result.written.end, result.force, actuators,
            *([] if behind is None else [behind]),
        )
    )  # fmt: skip
    return _csv(head, result.lines, values)


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


def _csv(head: Sequence[str], line: np.ndarray, values: Floats) -> bytes:
    """A table whose first column is the source line. Values that do not exist stand as empty cells."""
    values = values + 0.0  # no minus zero
    decimals = decimals_of(head[1:])
    row = "%d" + "".join(f",%.{each}f" for each in decimals) + "\n"
    parts = [",".join(head) + "\n"]
    for a in range(0, len(line), CHUNK_ROWS):
        block = np.column_stack((line[a : a + CHUNK_ROWS], values[a : a + CHUNK_ROWS]))
        parts.append((row * len(block)) % tuple(block.ravel().tolist()))
    text = "".join(parts)
    for zero in sorted({f"{0.0:.{each}f}" for each in decimals}):
        text = text.replace(f"-{zero},", f"{zero},").replace(f"-{zero}\n", f"{zero}\n")
    return text.replace("nan", "").encode("ascii")


def summary(result: Compensated, job: Job) -> Summary:
    """The figures of a run: see the README for their meaning."""
    change = np.abs(result.state.rho - result.nominal)[result.rows.corrected]
    force = np.abs(result.state.drive)[result.rows.corrected]
    rotary = job.machine.revolute
    waiting = waiting_s(job.config, result.program.dwelt_s, result.program.tool_changes)
    sizes = {
        "actuator_change_max_mm": _most(change[:, ~rotary]),
        "actuator_force_max_N": _most(force[:, ~rotary]),
    }
    if rotary.any():
        sizes |= {
            "actuator_change_max_rad": _most(change[:, rotary]),
            "actuator_torque_max_Nmm": _most(force[:, rotary]),
        }
    return Summary.model_validate(
        {
            "points": len(result.rows.piece),
            "segments_in": len(result.program.path),
            "lines_in": count_lines(result.program.data),
            "lines_out": count_lines(result.written.data),
            "before": error_size(result.before),
            "after": error_size(result.after),
            **sizes,
            "iterations_max": result.iterations,
            "method": result.method,
            **job_figures(job),
            **_tilt(result),
            "joining_lines": int(result.rows.joining.sum()),
            "cycle_time_s": CycleTime(before=result.control.before_s + waiting, after=result.control.after_s + waiting),
            "control_mode": mode_name(result.control.modes),
            "control_mode_stated": result.control.stated,
            "under_control": error_size(result.control.error),
            **({} if result.bands is None else band_figures(result.bands.totals, job.config.compensation.policy)),
            **({} if result.interpolated is None else {"interpolation": result.interpolated}),
            "warnings": result.warnings,
        }
    )


def _tilt(result: Compensated) -> dict[str, float]:
    if result.tilt_after is None:
        return {"platform_tilt_max_mrad": 1e3 * _most(np.linalg.norm(result.state.tilt, axis=1)[result.rows.corrected])}
    most = 1e3 * _most(result.tilt_after)
    return {"platform_tilt_max_mrad": most, "tilt_after_mrad": most}


def _most(values: Floats) -> float:
    return float(np.nanmax(values)) if np.isfinite(values).any() else 0.0
