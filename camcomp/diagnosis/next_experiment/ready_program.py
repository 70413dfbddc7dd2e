"""Executable program of a proposed experiment: approach from above, spindle of the runs, travel limits, dialect."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from camcomp.diagnosis.fit.bench import Run
from camcomp.diagnosis.next_experiment.candidates import Candidate
from camcomp.gcode.detect import DEFAULT, dialect_of
from camcomp.gcode.interpret import read_program
from camcomp.gcode.text import Text
from camcomp.ground import path_geometry
from camcomp.ground.datatypes import Path
from camcomp.ground.errors import CheckFailed, PhysicsError
from camcomp.ground.files import read_bytes
from camcomp.model.config.spec import Experiment
from camcomp.model.job import Job
from camcomp.model.motion.twin import Twin

CLEAR_MM = (10.0, 5.0, 2.0)  # clearances above all motions, to try in this order
SAMPLES = 65  # points of a motion at which the travel is checked
CUTS = "WARNING: THIS PROGRAM CUTS, as the runs with cutting did: clamp stock and check the depth"


def ready_program(candidate: Candidate, runs: Sequence[Run], job: Job, twin: Twin, dialect: str = DEFAULT) -> str:
    """The candidate's NC text with retraction, approach, spindle and end. Raises CheckFailed CC608 out of the travel."""
    head, _, body = candidate.program.partition("G54\n")
    lines = body.splitlines()
    lines.remove("M2")
    x, y, z = (word[1:] for word in lines.pop(0).split()[1:])  # G0 X Y Z: where it begins
    paths = [run.program for run in runs if run.program is not None]
    feed = next(word for line in lines for word in line.split() if word[0] == "F")
    on, off = _spindle(paths)
    warning = [f"({CUTS})"] if candidate.cutting else []
    for height in _heights(candidate, paths):
        above = f"G0 Z{height:.4f}"
        moves = [above, *on, f"G0 X{x} Y{y}", f"G1 Z{z} {feed}", *lines, above, *off, "M2"]
        remarks, _, modes = head.rpartition("\n")
        program = spelt("\n".join([remarks, *warning, f"{modes}G54", *moves]) + "\n", dialect)
        if within_travel(read_program(program.encode(), name="next experiment", dialect=dialect).path, job, twin):
            return program
    raise CheckFailed("CC608", f"'{candidate.action}' leads an actuator out of its travel on the way from above")


def can_be_run(candidate: Candidate, runs: Sequence[Run], job: Job, twin: Twin) -> bool:
    """Whether ready_program succeeds for the candidate."""
    try:
        ready_program(candidate, runs, job, twin)
    except CheckFailed:
        return False
    return True


def dialect_of_runs(experiment: Experiment, job: Job) -> str:
    """Name of the dialect: of the machine file, else of the last program."""
    if job.config.control.dialect is not None:
        return job.config.control.dialect
    programs = [run.program for run in experiment.runs if run.program is not None]
    return dialect_of(Text.read(read_bytes(programs[-1]), programs[-1])).name if programs else DEFAULT


def spelt(program: str, dialect: str) -> str:
    """A proposed program, RS274, in another dialect: comments, dwell, units, decimal points in feeds."""
    if dialect == DEFAULT:
        return program
    language = dialect_of(Text.read(program.encode(), "next experiment"), dialect)
    begins, ends = language.comment
    out = []
    for line in program.splitlines():
        if line.startswith("("):
            out.append(f"{begins}{line[1:-1]}{ends}")
            continue
        words = line.split()
        if words[0] == "G4":  # in seconds: X of some, where P counts milliseconds
            words[1] = f"{'X' if 'X' in language.dwell else language.dwell[0]}{float(words[1][1:]):.1f}"
        if words[0] == "G21" and 710 in language.more:  # G71, the G21 of some controllers
            words[0] = "G71"
        if language.increments:
            words = [f"{word}." if word[0] in "FIJK" and "." not in word else word for word in words]
        out.append(" ".join(words))
    return "\n".join(out) + "\n"


def within_travel(path: Path, job: Job, twin: Twin) -> bool:
    """Whether all actuators stay within their travel along the motions with known ends."""
    known = np.flatnonzero(path.known & ~path.machine)
    u = np.linspace(0.0, 1.0, SAMPLES)
    # The start of the first known motion is unknown.
    points = [path_geometry.points(path, np.full(SAMPLES, k), u) for k in known[1:]] + [path.end[known[:1]]]
    try:
        rho = twin.inverse(twin.to_machine(np.concatenate(points)))
    except PhysicsError:
        return False
    low, high = np.array(job.machine.limits).T
    return bool(np.isfinite(rho).all() and (rho >= low).all() and (rho <= high).all())


def _heights(candidate: Candidate, paths: Sequence[Path]) -> list[float]:
    """Heights of retraction to try, mm: that of the runs' own rapids, else clearances above all motions."""
    here = read_program(candidate.program.encode(), name="candidate", dialect=DEFAULT).path.end[:, 2].max()
    been = [float(path.end[path.known & ~path.machine, 2].max()) for path in paths]
    top = max([float(here), *been])
    clear = top - float(here) >= CLEAR_MM[-1]
    return ([top] if clear else []) + [float(here if clear else top) + each for each in CLEAR_MM]


def _spindle(paths: Sequence[Path]) -> tuple[list[str], list[str]]:
    """Statements that start and stop the spindle as in the last run with a stated spindle."""
    for path in reversed(paths):
        said = np.flatnonzero(np.isfinite(path.turn) & (path.turn != 0.0) & (path.speed > 0.0))
        if len(said):
            k = int(said[-1])
            return [f"{'M3' if path.turn[k] > 0.0 else 'M4'} S{path.speed[k]:.0f}"], ["M5"]
    return [], []
