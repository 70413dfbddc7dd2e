"""The mirror technique: the deviation that a test cut shows, smoothed, put in reverse on the program.

It needs no model of the machine and knows nothing beyond the cut that was measured: another part, another feed or another
clamping needs a test cut of its own. Where a path passes a place twice it takes the mean of both. Every further log is that of the program as the logs before it corrected it.
Source: reference [1] of A. Klimchik, A. Pashkevich, D. Chablat, G. Hovland (2012).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from camcomp.ground import path_geometry
from camcomp.ground.csv_table import TableRules, read_csv
from camcomp.ground.datatypes import RAPID, Floats, Path
from camcomp.ground.errors import ConfigError
from camcomp.ground.files import display_name, read_bytes
from camcomp.ground.notes import note
from camcomp.ground.records import dataclass, replace
from camcomp.ground.vectors import sizes
from camcomp.model.config.spec import ForceChoice
from camcomp.model.effect import Cause, Load, Motion
from camcomp.model.job import Job
from camcomp.model.motion.log_columns import TIME, TIP
from camcomp.model.statics.description import Weight
from camcomp.model.statics.machine import Machine

STEP_MM = 0.2  # along the program
TURN_MM = 4.0  # by which a place passed in the opposite direction counts as further away, half of it at right angles
SMOOTH_ROWS = 2.0  # of the log, standard deviation of the smoothing
LEAST_MM = 0.5
NEAR = 48  # rows that have a say
FAR = 4.0  # smoothing lengths beyond which nothing was measured
OFF_MM = 1.5  # from the program, beyond which a row is no cut of it
LEAST_ROWS = 10
LEAST_SHARE = 0.8  # of the rows in motion that have to lie on the program


@dataclass(frozen=True, eq=False)
class DeviationField:
    """Deviation (n, 3) mm of a test cut across the path, at rows (n, 3) mm of the program; smoothing length mm."""

    rows: Floats
    deviation: Floats
    smooth_mm: float

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self.rows)

    def at(self, tip: Floats) -> Floats:
        """Smoothed deviation (k, 3) mm at tips (k, 3) mm; 0 far from measured rows."""
        far, index = self._tree.query(tip, k=min(NEAR, len(self.rows)))
        weight = np.exp(-0.5 * np.minimum((far**2 - far[:, :1] ** 2) / self.smooth_mm**2, 700.0))
        found = np.einsum("kr,kri->ki", weight, self.deviation[index]) / weight.sum(axis=1, keepdims=True)
        known = far[:, 0] < FAR * self.smooth_mm
        if not known.all():
            note("mirror", "parts of the program lie where the test cut measured nothing; they stay as they are")
        return np.asarray(found * known[:, None])


@dataclass(frozen=True, eq=False)
class MirroredJob(Job):
    """The perfect machine, with what test cuts have shown as all that is wrong with it."""

    fields: tuple[DeviationField, ...] = ()

    @cached_property
    def causes(self) -> tuple[Cause, ...]:
        """One: the measured deviation."""
        return (Cause("mirror", _Mirror, None, {"fields": self.fields}),)

    @cached_property
    def real_machine(self) -> Machine:
        """Rigid, weightless machine: the measured deviation already contains the deflection."""
        nominal = self._robots[1]
        light = nominal.edit(Weight, lambda each: replace(each, force=np.zeros(3)))
        return self._build(light, nominal)


def mirrored(job: Job, path: Path, logs: Sequence[str]) -> MirroredJob:
    """The job that turns test cuts of `path` round. Raises ConfigError CC400 to CC406, FileError."""
    process = job.config.process.model_copy(update={"force": ForceChoice(model="none")})
    config = job.config.model_copy(update={"process": process, "effects": []})
    return MirroredJob(config, tuple(deviations(path, each) for each in logs))


def deviations(path: Path, log: str) -> DeviationField:
    """Deviations of a test cut from its program, by its log. Raises ConfigError CC400 to CC406, FileError."""
    time, tip = _measured(log)
    velocity = np.gradient(tip, time, axis=0)
    speed = sizes(velocity)
    direction = velocity / np.maximum(speed, 1e-9)[:, None]
    places, tangents, cuts = _sampled(path)
    _, nearest = cKDTree(_keys(places, tangents)).query(_keys(tip, direction))
    off = tip - places[nearest]
    off -= np.sum(off * tangents[nearest], axis=1, keepdims=True) * tangents[nearest]
    cutting = cuts[nearest] & (speed > 0.05 * np.median(speed))
    usable = cutting & (sizes(off) < OFF_MM)
    if usable.sum() < max(LEAST_ROWS, LEAST_SHARE * cutting.sum()):
        message = f"{display_name(log)}: {usable.sum()} of {cutting.sum()} rows lie on the cuts of the program"
        raise ConfigError("CC406", message)
    apart = float(np.median(sizes(np.diff(tip[usable], axis=0))))
    return DeviationField(tip[usable] - off[usable], off[usable], max(SMOOTH_ROWS * apart, LEAST_MM))


def _measured(log: str) -> tuple[Floats, Floats]:
    """Times (n,) and tips (n, 3) of the rows of a log that have both, in the order of time."""
    table = read_csv(read_bytes(log), display_name(log), TableRules("CC400", "CC401", "CC403"))
    for name in (TIME, *TIP):
        if name not in table.header:
            raise ConfigError("CC401", f"a test cut needs the column {name}", at=table.at(-1))
    values = table.values([table.header.index(name) for name in (TIME, *TIP)])
    values = values[np.isfinite(values).all(axis=1)]
    values = values[np.unique(values[:, 0], return_index=True)[1]] if len(values) else values
    if len(values) < LEAST_ROWS:
        raise ConfigError("CC404", f"fewer than {LEAST_ROWS} rows have a time and a measured tip", at=table.at(-1))
    return values[:, 0], values[:, 1:]


def _sampled(path: Path) -> tuple[Floats, Floats, np.ndarray]:
    """Points (k, 3) every STEP_MM along a program, their tangents (k, 3), and whether the tool feeds there."""
    counts = np.maximum(np.ceil(path_geometry.lengths(path) / STEP_MM).astype(int), 1)
    motion = np.repeat(np.arange(len(path)), counts)
    first = np.repeat(np.cumsum(counts) - counts, counts)
    u = (np.arange(len(motion)) - first + 0.5) / np.repeat(counts, counts)
    known = path.known[motion] & np.isfinite(path.start[motion]).all(axis=1)
    motion, u = motion[known], u[known]
    return path_geometry.points(path, motion, u), path_geometry.tangents(path, motion, u), path.kind[motion] != RAPID


def _keys(place: Floats, direction: Floats) -> Floats:
    return np.concatenate([place, 0.5 * TURN_MM * direction], axis=1)


class _Mirror:
    """The measured deviation as an effect."""

    STAGE, TARGET, PARAMETERS, SOURCE = "structure", "machine", (), "a test cut"

    @staticmethod
    def on_place(tip: Floats, load: Load, motion: Motion, p: Mapping[str, Any]) -> Floats:
        """Tips (n, 3) in the program frame, off as they were in the test cuts."""
        return np.asarray(tip + sum(field.at(tip) for field in p["fields"]))
