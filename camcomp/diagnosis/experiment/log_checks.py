"""Checks of a log against its run: program, units, axes and order of rows; contradictions are refused with the reason."""

from collections.abc import Callable
from functools import partial

import numpy as np
from scipy.spatial import KDTree

from camcomp.diagnosis.experiment.logged import Logged
from camcomp.diagnosis.fit.measured import Measured
from camcomp.diagnosis.fit.outliers import FAR_MM
from camcomp.diagnosis.model.noise import LEAST_VALUES
from camcomp.diagnosis.model.readings import Reading, column_orders, refuse_as_read, row_shifts
from camcomp.ground.datatypes import Floats, Ints
from camcomp.ground.errors import ConfigError, Location
from camcomp.model.statics.arm import ARM_LENGTH

FAR_RAD = 0.1  # FAR_MM of a hinge: error of a log of another program or unit
PLACE = 0.01  # of FAR_MM or FAR_RAD: rows within it are one position
ASIDE_MM = 1.0  # median distance from the path above that of any controller
_LENGTH_UNITS = {1e-3: "m", 25.4: "mm where inches are due", 1.0 / 25.4: "inches", 1e3: "um"}
_TURNS = {180.0 / np.pi: "degrees"}
_TIMES = {1e3: "ms", 1e6: "us", 1.0 / 60.0: "minutes"}
_FORCES = {1e-3: "kN", 1e3: "mN"}
_TORQUES = {1e-3: "N m", 1e3: "mN mm"}
SAME_TIME = (0.7, 1.4)  # ratio of durations of log and program after the change of unit
AXES = ("x", "y", "z")
LATEST_S = 0.05  # largest clock offset and largest lateness of a drive
_HOT_C = 150.0
_STRONG_N = 20.0


def check_channels(name: str, measured: Measured) -> None:
    """Raise CC404 for a log without measurements."""
    if not any(measured.has(each) for each in ("tip", "encoder", "drive", "dyno")):
        message = "the log measures nothing: no tip, encoder, drive force or dynamometer column holds a number"
        raise ConfigError("CC404", message, at=Location(name, 1, 1))


def check_rows(name: str, measured: Measured) -> None:
    """Raise CC404 for a log without measurements, CC405 for times that do not rise, CC407 for temperatures in kelvin."""
    check_channels(name, measured)
    back = np.flatnonzero(np.diff(measured.time) <= 0)
    if len(back):
        row = int(back[0])
        message = f"t_s goes from {measured.time[row]:g} to {measured.time[row + 1]:g}"
        raise ConfigError("CC405", message, at=Location(name, row + 3, 1))
    if measured.has("temperature") and np.nanmedian(measured.temperature) > _HOT_C:
        message = f"temp_C is about {np.nanmedian(measured.temperature):.0f}: it looks as if logged in kelvin"
        raise ConfigError("CC407", message, at=Location(name, 1, 1))


def check_clock(name: str, measured: Measured) -> None:
    """Raise CC405 where the time of a log starts again: rows behind a step back lie between those in front of it.

    Rows that a logger writes late fill a gap instead, so that every step back makes at most four changes between parts of
    the log in the order of time. Rows that it writes twice count once.
    """
    time = measured.time
    back = np.flatnonzero(np.diff(time) < 0.0)
    if not len(back):
        return
    part = np.concatenate([[0], np.cumsum(np.diff(time) < 0.0)])
    cells = np.column_stack([getattr(measured, each) for each in measured.__dataclass_fields__])
    once = np.unique(np.nan_to_num(cells), axis=0, return_index=True)[1]
    order = once[np.lexsort((once, time[once]))]
    if int((np.diff(part[order]) != 0).sum()) > 4 * len(back):
        row = int(back[0])
        message = f"time goes back from {time[row]:g} s to {time[row + 1]:g} s, and runs once more"
        raise ConfigError("CC405", message, at=Location(name, row + 3, 1))


def check_length(log: Logged, due_s: float) -> None:
    """Raise CC409 for a run with too few rows, CC407 for times in another unit; due_s: duration of the program."""
    rows = len(log.measured.time)
    if rows < LEAST_VALUES:
        message = f"run '{log.run}': the log has {rows} row{'s' if rows > 1 else ''}, {LEAST_VALUES} are the least"
        raise ConfigError("CC409", message, at=Location(log.file, rows + 1, 1))
    took = float(log.measured.time[-1] - log.measured.time[0])
    for factor, unit in _TIMES.items():
        if due_s > 0.0 and SAME_TIME[0] < took / (factor * due_s) < SAME_TIME[1]:
            both = f"the log takes {took:g} s and the program {due_s:.3g} s"
            raise log.refusal("CC407", f": {both}: t_s looks as if logged in {unit}")


def check_forces(log: Logged, force: Floats, drives: Callable[[], Floats]) -> None:
    """Raise CC407 for forces or torques that differ from the modelled ones by a factor of 1000, row by row.

    Args:
        log: what was measured.
        force: (n, 3) N, modelled force on the tool, machine frame.
        drives: returns (n, m) modelled drive forces, N, and torques, N mm; called only if some are logged.
    """
    measured, rotary = log.measured, log.revolute
    channels = [("dynamometer forces", measured.dyno, force, _STRONG_N, _FORCES)]
    if measured.has("drive"):
        due = drives()
        channels += [
            ("drive forces", measured.drive[:, ~rotary], due[:, ~rotary], _STRONG_N, _FORCES),
            ("drive torques", measured.drive[:, rotary], due[:, rotary], _STRONG_N * ARM_LENGTH, _TORQUES),
        ]
    for what, found, due, strong, units in channels:
        for factor, unit in units.items():
            if _is_scaled(found, due, factor, strong):
                raise log.refusal("CC407", f": the {what} look as if logged in {unit}")


def _is_scaled(found: Floats, due: Floats, factor: float, strong: float) -> bool:
    """Whether measured values (n, c) correlate with modelled ones (n, c) above `strong`, and are nearer to `factor` times these than to them.

    Unmodelled loads (weight, friction, inertia) may be far larger, but do not correlate with the modelled ones.
    """
    known = np.isfinite(found) & np.isfinite(due)
    if not known.any():
        return False
    y, x = found[known], due[known]
    size, modelled = float(np.sqrt(np.mean(y**2))), float(np.sqrt(np.mean(x**2)))
    if modelled < strong or abs(np.log(size / (factor * modelled))) > 0.5 * abs(np.log(factor)):
        return False
    return bool(np.mean(x * y) > np.sqrt(0.5) * size * modelled)  # half of the energy correlates


def check_followed(log: Logged, distance: Floats, agreement: float, aside_mm: float = ASIDE_MM) -> None:
    """Raise CC406 for a motion off the program: distance (n,) mm from it; agreement: share of rows in its direction, most are."""
    off = float(np.median(distance))
    if off > aside_mm or agreement < 0.5:
        way = f"{off:.3g} mm beside the program" if off > aside_mm else "against the way of the program"
        raise log.refusal("CC406", f": the motion runs {way}")


def check_lines(log: Logged, away: Floats) -> None:
    """Raise CC406 for line numbers of other positions: away (n,) mm of path length from the line of a row."""
    known = away[np.isfinite(away)]
    if len(known) >= LEAST_VALUES and np.median(known) > FAR_MM:
        message = (
            f": the rows are {np.median(known):.3g} mm of way from the lines that they name: the column line looks "
            "like that of another program, or like numbers N in place of lines counted from 1"
        )
        raise log.refusal("CC406", message)


def check_rows_together(log: Logged, *, what: str, found: Floats, due: Floats, other: str) -> None:
    """Raise CC412 for a channel found (n, k) that fits the expected one, due (n, k), far better when shifted by rows.

    Only for rows longer than LATEST_S, because a clock offset or a late drive could otherwise be the reason.
    """
    time = log.measured.time
    usual = float(np.median(np.diff(time))) if len(time) > 1 else 0.0

    def off(by: int) -> float:
        rows = np.arange(max(-by, 0), len(due) - max(by, 0))
        step = np.linalg.norm(due[np.minimum(rows + by + 1, len(due) - 1)] - due[rows + by], axis=1)
        apart = (found[rows] - due[rows + by])[(step > 0.0) & np.isfinite(found[rows]).all(axis=1)]
        if len(apart) < LEAST_VALUES:
            return np.inf
        return float(np.median(np.linalg.norm(apart - np.median(apart, axis=0), axis=1)))  # less the constant part

    shifts = row_shifts(f"run '{log.run}': the {what}", other)
    late = [("CC412", text, partial(off, by)) for by, text in shifts if abs(by) * usual > LATEST_S]
    refuse_as_read(log.file, off(0), late)


def check_places(log: Logged, *, rho: Floats, tip: Floats, loaded: Callable[[], Floats]) -> None:
    """Raise CC407 (units), CC408 (axes), CC406 (another program), CC412 (rows) for tip or encoders far from the expected ones.

    tip (n, 3) mm, rho (n, m): expected tips and actuators; loaded: returns the tips (n, 3) under the modelled force, called if the
    measured ones are far from the unloaded ones.
    """
    measured, told = log.measured, "set-point" if log.measured.has("setpoint") else "encoder"
    for what, found, due in (("tip looks", measured.tip, tip), ("encoders look", measured.encoder, rho)):
        rows = np.isfinite(found).all(axis=1)
        if rows.any():
            if due is tip and _distance(found[rows], due=due[rows]) >= FAR_MM:
                due = loaded()
            check_rows_together(log, what=what, found=found, due=due, other=f"the {told}s")
            _check(log, what, found[rows], partial(_distance, due=due[rows]), f"the {told}s say, in the program frame")


def check_on_program(log: Logged, what: str, found: Floats, program: Floats) -> None:
    """Like `check_places` for the motion itself, `tip` or a channel of actuators: found (n, k) against points program (s, k)."""
    tree = KDTree(program)
    far = FAR_RAD if what != "tip" and log.revolute.all() else FAR_MM

    def nearest(points: Floats) -> float:
        return float(np.median(tree.query(points[places(points, far)])[0]))

    _check(log, "tip looks" if what == "tip" else f"{what}s look", found, nearest, "the program goes")


def places(points: Floats, far: float = FAR_MM) -> Ints:
    """One row per distinct position of points (n, k), so that standstills do not count by their duration."""
    rows: Ints = np.unique(np.round(points / (PLACE * far)), axis=0, return_index=True)[1]
    return rows


def _check(log: Logged, what: str, found: Floats, distance: Callable[[Floats], float], expected: str) -> None:
    """Raise CC406 to CC408 for tips or actuators found (n, k) at a distance from where they are expected."""
    names = AXES if what.startswith("tip") else log.twin.actuators
    rotary = names is not AXES and bool(log.revolute.all())
    far, size, off = FAR_RAD if rotary else FAR_MM, "rad" if rotary else "mm", distance(found)
    if off < far:
        return
    units = _TURNS if rotary else _LENGTH_UNITS
    readings: list[Reading] = [
        ("CC407", f"run '{log.run}': the {what} as if logged in {unit}", partial(distance, found / factor))
        for factor, unit in units.items()
    ]
    readings += [
        ("CC408", f"run '{log.run}': the {what} right {text}", partial(distance, found[:, order] * sign))
        for order, sign, text in column_orders(names)
    ]
    refuse_as_read(log.file, off, readings)
    raise log.refusal("CC406", f": {what.split()[0]} {off:.3g} {size} from where {expected}")


def _distance(found: Floats, *, due: Floats) -> float:
    return float(np.median(np.linalg.norm(found - due, axis=1)))
