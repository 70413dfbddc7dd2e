"""Rows of all runs as laws see them: covariates at the tip and at the drives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from camcomp.diagnosis.fit.bench import Bench
from camcomp.model.effect import Load
from camcomp.model.law.covariates import DriveRows, TipRows
from camcomp.model.statics.description import Robot

Rows = TipRows | DriveRows


def load_names(robot: Robot, j: int) -> tuple[str, ...]:
    """The covariates that are loads of drives, where actuator j is meant: its own first, then those of the others that a formula
    can name.
    """
    units = [(each.name, "Nmm" if each.revolute else "N") for each in robot.actuators]
    own = f"load_{units[j][1]}"
    return (
        own,
        *(f"load_{name}_{unit}" for k, (name, unit) in enumerate(units) if k != j and f"load_{name}".isidentifier()),
    )


def tip_rows(bench: Bench) -> list[TipRows]:
    """Per run."""
    readings = bench.nominal
    return [TipRows(r.tip, Load(r.dyno, np.zeros((len(r.tip), 6))), r.motion) for r in readings]


def drive_rows(bench: Bench, j: int, *, setpoints: bool) -> list[DriveRows]:
    """Per run, of actuator j; setpoints: what the control was told instead of where the encoder was."""
    others = () if setpoints else load_names(bench.twin.robot, j)
    out = []
    for run, reading in zip(bench.runs, bench.nominal, strict=True):
        motion = reading.motion
        if setpoints:
            motion = replace(motion, encoder=run.run_path.row_rho)
        elif run.by == "setpoint" and run.measured.has("encoder"):
            seen = run.measured.encoder
            motion = replace(motion, encoder=np.where(np.isfinite(seen), seen, motion.encoder))
        out.append(DriveRows(motion, j, others))
    return out
