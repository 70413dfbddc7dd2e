"""Whether the log of axes can be what its columns say: what cannot is refused before anything is fitted."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

import numpy as np

from camcomp.diagnosis.axis.findings import ROWS, AxisRun
from camcomp.diagnosis.axis.motion import LATEST_S
from camcomp.diagnosis.axis.noise_floor import rows_floor
from camcomp.diagnosis.axis.terms import WIDE, AxisTravel, solve, travel
from camcomp.diagnosis.model.readings import Reading, refuse_as_read
from camcomp.ground.datatypes import Floats
from camcomp.ground.errors import ConfigError, Location

HEAVIEST_KG = 2e4  # of what one drive moves
MIDDLE = (0.02, 0.98)  # quantiles between which values are looked at
TRAVELS = 100.0  # deviations of a row that an axis which moves goes at least
_FACTORS = {1e3: "m", 25.4: "inches", 180.0 / np.pi: "degrees where radians are due"}


def check_axes(log: str, runs: Mapping[str, AxisRun], cutting: bool = False) -> None:
    """Raise ConfigError CC407 (units) or CC408 (columns exchanged or reversed) for one log's axes by name.

    cutting: a cutting force that the log may not hold acts on the drives, and their forces say nothing of units.
    """
    for name, run in runs.items():
        both = np.isfinite(run.setpoint) & np.isfinite(run.encoder)
        if both.sum() < ROWS or not _moves(run.setpoint[both], run.encoder[both]):
            continue
        off = _spread(run.setpoint[both] - run.encoder[both])
        if off > 0.5 * _spread(run.setpoint[both]):
            refuse_as_read(log, off, _readings(name, runs))
        _check_size(log, name, run, cutting)


def _moves(setpoint: Floats, encoder: Floats) -> bool:
    """Whether the travel of set-points or encoder is large against noise; otherwise units and columns cannot be
    checked.
    """
    return bool(max(_spread(setpoint), _spread(encoder)) > TRAVELS * rows_floor([encoder]) > 0.0)


def _spread(values: Floats) -> float:
    """Range of values (n,) between the quantiles of MIDDLE, without outliers."""
    return float(np.ptp(np.quantile(values, MIDDLE)))


def _refused(rule: str, log: str, text: str) -> ConfigError:
    return ConfigError(rule, text, at=Location(log, 1, 1))


def _readings(name: str, runs: Mapping[str, AxisRun]) -> Iterator[Reading]:
    """Other ways to read set-points and encoder of an axis, with the gap that remains."""
    run = runs[name]
    known = np.isfinite(run.setpoint)
    setpoint, time = run.setpoint[known], run.time[known]

    def gap(other: AxisRun, encoder: float = 1.0, asked: float = 1.0) -> Callable[[], float]:
        there = np.isfinite(other.encoder)  # rows that one axis has lost another one has
        moved = np.interp(time, other.time[there], other.encoder[there])
        return lambda: _spread(asked * setpoint - encoder * moved)

    yield (
        "CC408",
        f"set-points and encoder of {name} run in opposite directions: one of them is reversed",
        gap(run, -1.0),
    )
    for factor, unit in _FACTORS.items():
        yield "CC407", f"the encoder of {name} looks as if logged in {unit}", gap(run, factor)
        yield "CC407", f"the set-points of {name} look as if logged in {unit}", gap(run, 1.0, factor)
    for other, each in runs.items():
        if other != name and np.isfinite(each.encoder).sum() >= ROWS:
            yield "CC408", f"the set-points of {name} fit the encoder of {other}: columns are exchanged", gap(each)


def _check_size(log: str, name: str, run: AxisRun, cutting: bool) -> None:
    known = np.isfinite(run.encoder)
    if known.sum() <= 2 * WIDE[-1]:
        return
    at = travel(run.time[known], run.encoder[known], WIDE[-1])
    A = np.stack([np.ones_like(at.time), 1e-3 * at.acceleration, at.speed, np.sign(at.speed)], axis=1)
    gap = (run.setpoint - run.encoder)[known]
    if np.isfinite(gap).all() and solve(A, gap)[2] > LATEST_S:
        raise _refused("CC407", log, f"{name} follows more than {LATEST_S:g} s late: t_s looks as if logged in ms")
    mass = 0.0 if cutting else _moved_kg(at, run.force[known])
    if mass > HEAVIEST_KG:
        what = (
            f"the positions of {name} look as if logged in m"
            if mass < 1e3 * HEAVIEST_KG
            else "t_s looks as if logged in ms"
        )
        raise _refused("CC407", log, f"the drive force of {name} would move {mass:.3g} kg: {what}")


def _moved_kg(at: AxisTravel, force: Floats) -> float:
    """The mass that drive forces (n,) N move, kg; 0 where the rows do not separate inertia from a force over position.

    On a circle at one speed acceleration is a multiple of position, and so is the cutting force.
    """
    if not np.isfinite(force).all() or not np.ptp(at.acceleration) > 0.0:
        return 0.0
    others = np.stack([np.ones_like(at.time), at.position, at.speed, np.sign(at.speed)], axis=1)
    own = 1e-3 * at.acceleration
    whole = float(np.var(own)) * len(own)
    own, force = (each - others @ solve(others, each) for each in (own - own.mean(), force - force.mean()))
    known = float(own @ own) > 0.5 * whole
    explains = float(own @ force) > np.sqrt(0.5 * float(own @ own) * float(force @ force))
    return float(own @ force / (own @ own)) if known and explains else 0.0
