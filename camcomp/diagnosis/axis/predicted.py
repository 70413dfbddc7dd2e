"""Encoders, second encoders and drive forces of a log of axes as the one signal path predicts them, with the effects of the machine file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from camcomp.diagnosis.axis.at_tip import lever_mm
from camcomp.diagnosis.fit.measured import Measured
from camcomp.diagnosis.model.noise import REPEATABILITY_MM
from camcomp.ground.datatypes import Bools, Floats
from camcomp.model import signal_path
from camcomp.model.effect import Cause, Motion
from camcomp.model.hysteresis import direction
from camcomp.model.motion.between_rows import between_rows
from camcomp.model.seams import Seams
from camcomp.model.statics.arm import arm_of
from camcomp.model.statics.description import Robot
from camcomp.model.statics.hanging import hang, tool_wrench


def predict_encoders(robot: Robot, causes: Sequence[Cause], log: Measured, started_s: float) -> Floats:
    """Encoder minus set-point (n, m) that the controller makes of the logged set-points; 0 where none are logged.

    NaN as long as it depends on how the axes moved before the log began: there predictions from a settled loop, from rest,
    and from rest where the first encoder stands differ by more than REPEATABILITY_MM.
    """
    servo = signal_path.acting(causes, "control")
    if not servo:
        return np.zeros_like(log.setpoint)
    motion = between_rows(_motion(robot, log, _filled(log.time, log.setpoint, robot), started_s))
    late = signal_path.controlled(servo, motion.names, motion) - motion.encoder
    levers = np.array([lever_mm(a.revolute) for a in robot.actuators])
    unsure = depends_on_start(servo, motion, _filled(log.time, log.encoder, robot)[:1], levers)
    every = (len(motion.time) - 1) // max(len(log.time) - 1, 1) or 1
    return np.where(np.isfinite(log.setpoint), np.where(unsure, np.nan, late)[::every], 0.0)


def depends_on_start(servo: Sequence[Cause], motion: Motion, start: Floats, levers: Floats) -> Bools:
    """Rows (n, m) whose predicted encoders depend on how the axes moved before the log began.

    start (1, m): first encoders; levers (m,): way in mm per unit of a coordinate.
    """
    late = signal_path.controlled(servo, motion.names, motion)
    others = [signal_path.controlled(servo, motion.names, replace(motion, seams=None)) - late]
    loops = [cause for cause in servo if "law" not in cause.values]
    if loops and len(motion.time) > 1:
        settled = signal_path.controlled(loops, motion.names, motion)
        others.append(signal_path.controlled(loops, motion.names, _begun(motion, start))[1:] - settled)
    return np.asarray(np.any([np.abs(each) > REPEATABILITY_MM / levers for each in others], axis=0))


def _begun(motion: Motion, start: Floats) -> Motion:
    """The motion with a row before it, at which the axes stand at positions (1, m)."""

    def held(values: Floats) -> Floats:
        return np.concatenate([values[:1], values])

    step = motion.time[1] - motion.time[0]
    time, common = (np.concatenate([each[:1] - step, each]) for each in (motion.time, motion.common))
    return replace(
        motion, time=time, common=common, cut_min=held(motion.cut_min), encoder=np.concatenate([start, motion.encoder]),
        speed=held(motion.speed), direction=held(motion.direction), seams=None,
        temperature=None if motion.temperature is None else held(motion.temperature),
    )  # fmt: skip


def predict_drives(robot: Robot, causes: Sequence[Cause], log: Measured, started_s: float) -> Floats:
    """Drive forces or torques (n, m), N or N mm: of effects of the drives, and against the force of a dynamometer on an arm."""
    drives = [cause for cause in signal_path.acting(causes, "drive") if signal_path.pushes(cause.effect)]
    encoder = _filled(log.time, log.encoder, robot)
    out = np.zeros_like(log.encoder)
    if log.has("dyno") and arm_of(robot) is not None:
        wrench = tool_wrench(robot, encoder, log.force())
        out += hang(robot, encoder, wrench).drive - hang(robot, encoder).drive
    if not drives:
        return out
    motion = _motion(robot, log, encoder, started_s)
    _, guided = signal_path.driven(drives, motion.names, motion)
    effort = signal_path.drive_forces(drives, motion.names, guided)
    return out if effort is None else out + effort


def predict_loads(robot: Robot, causes: Sequence[Cause], log: Measured, started_s: float) -> Floats:
    """Second encoder minus the one of the motor (n, m), mm or rad, that effects of the drives make; springs are left out."""
    drives = signal_path.acting(causes, "drive")
    if not drives or not log.has("load"):
        return np.zeros_like(log.load)
    motion = _motion(robot, log, _filled(log.time, log.encoder, robot), started_s)
    if arm_of(robot) is not None:
        motion = replace(motion, held=lambda: hang(robot, motion.encoder).drive)
    return signal_path.driven(drives, motion.names, motion)[0]


def _filled(time: Floats, values: Floats, robot: Robot) -> Floats:
    """Positions (n, m) with empty cells filled from their neighbours in time; an axis that is not logged stands at home."""
    out = np.empty_like(values)
    for j, (own, actuator) in enumerate(zip(values.T, robot.actuators, strict=True)):
        known = np.isfinite(own)
        out[:, j] = np.interp(time, time[known], own[known]) if known.any() else actuator.home
    return out


def _motion(robot: Robot, log: Measured, position: Floats, started_s: float) -> Motion:
    """A motion whose encoders are the positions (n, m); the recording may begin while the axes move."""
    time, n = log.time, len(log.time)
    ordered = n > 1 and bool((np.diff(time) > 0.0).all())
    speed = np.gradient(position, time, axis=0) if ordered else np.zeros_like(position)
    warm = np.isfinite(log.temperature)
    heat = np.interp(time, time[warm], log.temperature[warm]) if warm.any() else None
    seams = (
        Seams(np.zeros(1, int), np.full(1, np.inf), (position[1:2] - position[:1]) / (time[1] - time[0]))
        if ordered
        else None
    )
    plain = Motion(
        time=time,
        common=started_s + time,
        cut_min=np.zeros(n),
        temperature=heat,
        encoder=position,
        speed=speed,
        direction=direction(position),
        home=np.array([a.home for a in robot.actuators]),
        stiffness=signal_path.springs(robot),
        ordered=ordered,
        names=tuple(a.name for a in robot.actuators),
    )
    return replace(plain, seams=seams)
