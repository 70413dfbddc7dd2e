"""Error table of a drive over its travel from all its effects, for controllers with screw compensation."""

from __future__ import annotations

import numpy as np

from camcomp.ground.datatypes import Floats
from camcomp.ground.errors import ConfigError
from camcomp.model import signal_path
from camcomp.model.effect import Motion
from camcomp.model.error_table.table import ErrorTable
from camcomp.model.job import Job

_RUN_IN_MM = 5.0  # more than any play
MOST_ROWS = 10_000


def screw_map(job: Job, actuator: str, start: float, end: float, step: float) -> ErrorTable:
    """Carriage minus encoder of a slide along its travel, forward and in reverse, at standstill, unloaded.

    Raises:
        ConfigError: CC205, the actuator is no slide of the machine, or the travel has no rows.
    """
    machine = job.real_machine
    names = machine.actuators
    if actuator not in names or machine.robot.actuators[names.index(actuator)].revolute:
        raise ConfigError("CC205", f"there is no slide '{actuator}'", hint=f"actuators: {', '.join(names)}")
    if not (step > 0.0 and end > start and (end - start) / step <= MOST_ROWS):
        raise ConfigError("CC205", f"{start:g} to {end:g} mm by {step:g} mm is no travel of 2 to {MOST_ROWS} rows")
    rows = np.unique(np.append(np.arange(start, end, step), end))
    j = names.index(actuator)
    there = np.concatenate([[start - _RUN_IN_MM], rows, [end + _RUN_IN_MM]])
    error = _errors(job, j, np.concatenate([there, there[::-1]]))
    k = len(there)
    return ErrorTable(rows, error[1 : k - 1], error[k + 1 : 2 * k - 1][::-1])


def _errors(job: Job, j: int, way: Floats) -> Floats:
    """Carriage minus encoder (n,) of slide j at the ends of slow moves between positions (n,), the others at home."""
    machine = job.real_machine
    n = len(way)
    encoder = np.tile(machine.home, (n, 1)).astype(float)
    encoder[:, j] = way
    direction = np.sign(np.diff(encoder, axis=0, append=encoder[-1:]))
    turn = n // 2
    direction[:turn, j], direction[turn:, j] = 1.0, -1.0
    warm, still = job.config.process.temperature_C, np.zeros(n)
    heat = None if warm is None else np.full(n, warm)
    springs = signal_path.springs(machine.robot)
    motion = Motion(
        time=still,
        common=still,
        cut_min=still,
        temperature=heat,
        encoder=encoder,
        speed=0.0 * encoder,
        direction=direction,
        home=machine.home,
        stiffness=springs,
    )
    return np.asarray(signal_path.driven(job.causes, machine.actuators, motion)[0][:, j])
