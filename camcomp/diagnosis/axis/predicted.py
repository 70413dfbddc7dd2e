"""Runs of axes without the effects of the machine file, as the one signal path predicts them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from camcomp.diagnosis.axis.findings import ROWS, AxisRun
from camcomp.diagnosis.axis.surroundings import AxisSurroundings
from camcomp.diagnosis.fit.measured import Measured
from camcomp.ground.datatypes import Floats
from camcomp.model import signal_path
from camcomp.model.effect import Cause
from camcomp.model.statics.arm import arm_of
from camcomp.model.statics.hanging import hang, tool_wrench


def without_effects(
    around: AxisSurroundings, name: str, run: AxisRun, causes: Sequence[Cause], log: Measured
) -> AxisRun:
    """A run minus effects of the machine file and, on an arm, minus the torque against a dynamometer.

    Rows are left out as long as the following error depends on how the axis moved before the log began. log: of the run.
    """
    if len(run.time) < ROWS or not (causes or log.has("dyno")):
        return run
    axis = replace(around.driven(name, run), temperature=_interpolated(log, run))
    force = run.force - axis.channel("force", causes)
    if log.has("dyno") and around.robot is not None and arm_of(around.robot) is not None:
        q, rows = around.coordinates(run.name, run.time), run.numbers - 1
        wrench = tool_wrench(around.robot, q, log.force()[rows])
        against = hang(around.robot, q, wrench).drive - hang(around.robot, q).drive
        force = force - against[:, around.index(name)] / axis.lever
    run = replace(run, force=force, load=None if run.load is None else run.load - axis.channel("behind", causes))
    servo = signal_path.acting(causes, "control")
    if not servo or not np.isfinite(run.setpoint).all():
        return run
    late = axis.channel("following", servo)
    return replace(run, expected=-late, stated=servo).of(axis.known(servo)) if late.any() else run


def _interpolated(log: Measured, run: AxisRun) -> Floats | None:
    """Temperatures (n,) at the rows of a run; None where none is logged."""
    warm = np.isfinite(log.temperature)
    return np.interp(run.time, log.time[warm], log.temperature[warm]) if warm.any() else None
