"""Whether the log of axes can be what its columns say: what cannot is refused before anything is fitted."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from camcomp.diagnosis.axis.findings import ROWS, AxisRun
from camcomp.diagnosis.axis.noise_floor import rows_floor
from camcomp.diagnosis.axis.terms import WIDE, AxisTravel, solve, travel
from camcomp.ground.datatypes import Floats
from camcomp.ground.errors import ConfigError, Location

HEAVIEST_KG = 2e4  # of what one drive moves
SLOWEST_S = 0.5  # of a loop that still follows its set-points
LARGE, BETTER = (
    0.5,
    0.2,
)  # of the travel: a gap that is no lag; of the gap: what another encoder leaves that is the right one
MIDDLE = (0.02, 0.98)  # quantiles between which values are looked at
TRAVELS = 100.0  # deviations of a row that an axis which moves goes at least
NEAR = 0.1  # of a factor between set-points and encoder
_FACTORS = {1e3: "m", 1e-3: "um", 25.4: "inches", 180.0 / np.pi: "degrees where radians are due"}


def check_axes(log: str, runs: Mapping[str, AxisRun], cutting: bool = False) -> None:
    """Raise ConfigError CC407 (units) or CC408 (columns exchanged or reversed) for one log's axes by name.

    cutting: a cutting force that the log may not hold acts on the drives, and their forces say nothing of units.
    """
    for name, run in runs.items():
        both = np.isfinite(run.setpoint) & np.isfinite(run.encoder)
        if both.sum() < ROWS or not _moves(run.setpoint[both], run.encoder[both]):
            continue
        _check_factor(log, name, run.setpoint[both], run.encoder[both])
        _check_order(log, name, runs)
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


def _check_factor(log: str, name: str, setpoint: Floats, encoder: Floats) -> None:
    slope = float(np.cov(setpoint, encoder)[0, 1] / np.var(encoder, ddof=1))
    if abs(slope + 1.0) < NEAR:
        raise _refused(
            "CC408", log, f"set-points and encoder of {name} run in opposite directions: one of them is reversed"
        )
    for factor, unit in _FACTORS.items():
        for ratio, what in ((factor, "encoder"), (1.0 / factor, "set-points")):
            if abs(slope / ratio - 1.0) < NEAR:
                verb = "looks" if what == "encoder" else "look"
                raise _refused("CC407", log, f"the {what} of {name} {verb} as if logged in {unit}")


def _check_order(log: str, name: str, runs: Mapping[str, AxisRun]) -> None:
    run = runs[name]
    known = np.isfinite(run.setpoint)

    def off(other: AxisRun) -> float:
        there = np.isfinite(other.encoder)  # rows that one axis has lost another one has
        gap = run.setpoint[known] - np.interp(run.time[known], other.time[there], other.encoder[there])
        return _spread(gap)

    own = off(run)
    if own <= LARGE * _spread(run.setpoint[known]):
        return
    for other, each in runs.items():
        if other != name and np.isfinite(each.encoder).sum() >= ROWS and off(each) < BETTER * own:
            raise _refused("CC408", log, f"the set-points of {name} fit the encoder of {other}: columns are exchanged")


def _check_size(log: str, name: str, run: AxisRun, cutting: bool) -> None:
    known = np.isfinite(run.encoder)
    if known.sum() <= 2 * WIDE[-1]:
        return
    at = travel(run.time[known], run.encoder[known], WIDE[-1])
    A = np.stack([np.ones_like(at.time), 1e-3 * at.acceleration, at.speed, np.sign(at.speed)], axis=1)
    gap = (run.setpoint - run.encoder)[known]
    if np.isfinite(gap).all() and solve(A, gap)[2] > SLOWEST_S:
        raise _refused("CC407", log, f"{name} follows more than {SLOWEST_S:g} s late: t_s looks as if logged in ms")
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
