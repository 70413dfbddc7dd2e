"""Simulated log of a program: readings of the twin, row by row."""

import numpy as np

from camcomp.ground import progress
from camcomp.ground.csv_table import refuse_long
from camcomp.ground.datatypes import Floats, Ints, Path
from camcomp.ground.errors import ProgramError
from camcomp.ground.records import dataclass, replace
from camcomp.model.cutting.engaged import Engaged
from camcomp.model.cutting.spindle import cut_without_spindle, spindle_warning
from camcomp.model.cutting.track import lay_track
from camcomp.model.finite import not_finite
from camcomp.model.job import Job
from camcomp.model.motion.log_columns import log_columns
from camcomp.model.motion.run_path import path_of_program
from camcomp.model.motion.timeline import schedule
from camcomp.model.motion.twin import Reading, twin_of

PROGRESS_ROWS = 1000  # rows between two progress messages


@dataclass(frozen=True, eq=False, kw_only=True)
class Simulated:
    """n rows: time (n,) s, source line (n,), readings of the sensors, set-points (n, m)."""

    time: Floats
    line: Ints
    reading: Reading
    setpoint: Floats
    actuators: tuple[str, ...]
    rotary: tuple[bool, ...]
    warnings: list[str]


def simulate(
    job: Job, path: Path, step_s: float, *, cutting: bool = True, started_s: float = 0.0, engaged: Engaged | None = None
) -> Simulated:
    """Simulate a log with a row every step_s seconds from the first feed move to the end of the last, inclusive.

    Speed is trapezoidal along every motion and zero at its ends; rapids are not logged. engaged: engagement along the path,
    if it has been computed before.

    Raises:
        ProgramError: CC420, the program has no feed move.
        ConfigError: CC425, too many rows.
        PhysicsError: a pose of the machine is impossible.
    """
    twin = twin_of(job)
    timeline = schedule(path, job.config.control.acceleration_mm_per_s2)
    if not len(timeline.index):
        raise ProgramError("CC420", "the program has no feed move")
    refuse_long(timeline.end / step_s, "the log")
    time = np.arange(0.0, timeline.end, step_s)
    if timeline.end - time[-1] > 1e-9:
        time = np.append(time, timeline.end)
    conditions = job.conditions if cutting else replace(job.conditions, model=None)
    warm = job.config.process.temperature_C
    track = lay_track(path, conditions, engaged if cutting else None)
    progress.done(0.1)
    run_path = path_of_program(
        twin, "simulation", timeline, track, time, started=started_s,
        temperature=None if warm is None else np.full(len(time), warm),
    )  # fmt: skip
    with progress.part(0.3, 0.7, points=True):
        _, solved = twin.sense(run_path)
    slopes = twin.slopes(run_path, (), solved)
    with progress.part(0.8, 1.0):
        reading, _ = twin.sense(run_path, solved=solved, slopes=slopes)
    motion, _ = timeline.locate(time)
    line = path.line[timeline.index[motion]]
    rows = np.concatenate([run_path.row_rho, reading.tip, reading.encoder, reading.drive, reading.dyno], axis=1)
    bad = ~np.isfinite(rows).all(axis=1)
    if bad.any():
        raise not_finite(job.config, f"what the machine does in program line {line[int(np.argmax(bad))]}")
    rotary = tuple(each.revolute for each in twin.robot.actuators)
    return Simulated(
        time=time,
        line=line,
        reading=reading,
        setpoint=run_path.row_rho,
        actuators=twin.actuators,
        rotary=rotary,
        warnings=spindle_warning(cut_without_spindle(track)),
    )


def log_table(run: Simulated) -> str:
    """The log as CSV text, with the columns of controller, encoders, drives, dynamometer and tracker."""
    r = run.reading
    table = np.concatenate([r.tip, run.setpoint, r.encoder, r.drive, r.dyno], axis=1)
    rows = [",".join(log_columns(run.actuators, run.rotary).simulated)]
    for k, (t, line, values) in enumerate(zip(run.time, run.line, table, strict=True)):
        if k % PROGRESS_ROWS == 0:
            progress.done(k / len(table))
        cells = ",".join(f"{value:.6f}".replace("-0.000000", "0.000000") for value in values)
        rows.append(f"{t:.6f},{int(line)},{cells}")
    return "\n".join(rows) + "\n"
