"""Whether a log can be what its run says: right program, units, axes and order. What cannot is refused with the reason."""

from collections.abc import Callable
from functools import partial
from itertools import permutations

import numpy as np
from scipy.spatial import KDTree

from camcomp.diagnosis.fit.measured import Measured
from camcomp.ground.datatypes import Floats
from camcomp.ground.errors import ConfigError, Location

FAR_MM = 5.0  # no machine of the kind is wrong by so much; a log of another program or unit is
FAR_RAD = 0.1
ASIDE_MM = 1.0  # no control leaves its path by so much for half of the time
LEAST_AGREEMENT = 0.7  # of the moving rows go the way of the program
LEAST_ROWS = 10  # of a run that executes a program; fewer say nothing about their own noise
_LENGTH_UNITS = {1e-3: "m", 25.4: "mm where inches are due", 1.0 / 25.4: "inches", 1e3: "um"}
_TURNS = {180.0 / np.pi: "degrees"}
_TIMES = {1e3: "ms", 1e6: "us", 1.0 / 60.0: "minutes"}
_FORCES = {1e-3: "kN", 1e3: "mN"}
SAME_TIME = (0.7, 1.4)  # times a program that a log takes, whose clock counts in another unit
SAME_FORCE = (0.1, 10.0)  # times the modelled force: whatever is wrong with it, a unit is a thousand
_HOT_C = 150.0
_STRONG_N = 20.0


def check_rows(name: str, measured: Measured) -> None:
    """Raise CC404 when nothing is measured, CC405 when time does not run forward, CC407 for temperatures in kelvin."""
    if not any(measured.has(each) for each in ("tip", "encoder", "drive", "dyno")):
        message = "the log measures nothing: no tip, encoder, drive force or dynamometer column holds a number"
        raise ConfigError("CC404", message, at=Location(name, 1, 1))
    back = np.flatnonzero(np.diff(measured.time) <= 0)
    if len(back):
        row = int(back[0])
        message = f"t_s goes from {measured.time[row]:g} to {measured.time[row + 1]:g}"
        raise ConfigError("CC405", message, at=Location(name, row + 3, 1))
    if measured.has("temperature") and np.nanmedian(measured.temperature) > _HOT_C:
        message = f"temp_C is about {np.nanmedian(measured.temperature):.0f}: it looks as if logged in kelvin"
        raise ConfigError("CC407", message, at=Location(name, 1, 1))


def check_length(name: str, run: str, measured: Measured, due_s: float) -> None:
    """Raise CC409 when a run has too few rows, CC407 when its time is in another unit; due_s: length of the program."""
    rows = len(measured.time)
    if rows < LEAST_ROWS:
        message = f"run '{run}': the log has {rows} row{'s' if rows > 1 else ''}, {LEAST_ROWS} are the least"
        raise ConfigError("CC409", message, at=Location(name, rows + 1, 1))
    took = float(measured.time[-1] - measured.time[0])
    for factor, unit in _TIMES.items():
        if due_s > 0.0 and SAME_TIME[0] < took / (factor * due_s) < SAME_TIME[1]:
            message = (
                f"run '{run}': the log takes {took:g} s and the program {due_s:.3g} s: t_s looks as if logged in {unit}"
            )
            raise ConfigError("CC407", message, at=Location(name, 1, 1))


def check_forces(name: str, run: str, measured: Measured, force: Floats) -> None:
    """Raise CC407 when forces are a thousand times off what the model says; force (n, 3) N: modelled, on the tool."""
    due = float(np.sqrt((force**2).sum(axis=1).mean()))
    if due < _STRONG_N:
        return
    for what, found in (("drive forces", measured.drive), ("dynamometer forces", measured.dyno)):
        rows = np.isfinite(found).all(axis=1)
        size = float(np.sqrt((found[rows] ** 2).sum(axis=1).mean())) if rows.any() else due
        for factor, unit in _FORCES.items():
            if SAME_FORCE[0] < size / (factor * due) < SAME_FORCE[1]:
                raise ConfigError(
                    "CC407", f"run '{run}': the {what} look as if logged in {unit}", at=Location(name, 1, 1)
                )


def check_followed(name: str, run: str, distance: Floats, agreement: float, aside_mm: float = ASIDE_MM) -> None:
    """Raise CC406 where the motion does not lie along the program: distance (n,) mm from it; share of rows that go its way."""
    off = float(np.median(distance))
    if off > aside_mm or agreement < LEAST_AGREEMENT:
        way = f"{off:.3g} mm beside the program" if off > aside_mm else "against the way of the program"
        raise ConfigError("CC406", f"run '{run}': the motion runs {way}", at=Location(name, 1, 1))


def check_places(name: str, run: str, measured: Measured, rho: Floats, tip: Floats, rotary: bool = False) -> None:
    """Raise CC407 (units), CC408 (axes), CC406 (another program) where tip or encoders are far from where they were due.

    tip (n, 3) mm, rho (n, m): where tip and actuators should have been; rotary: all actuators are hinges.
    """
    far = FAR_RAD if rotary else FAR_MM
    for what, found, due, most in (
        ("tip looks", measured.tip, tip, FAR_MM),
        ("encoders look", measured.encoder, rho, far),
    ):
        rows = np.isfinite(found).all(axis=1)
        if rows.any():
            _check(name, run, what, found[rows], partial(_distance, due=due[rows]), most, rotary and most == FAR_RAD)


def check_told(name: str, run: str, what: str, told: Floats, program: Floats, rotary: bool = False) -> None:
    """Like `check_places` for the motion itself: told (n, m) against the actuators program (s, m) along the program."""
    tree = KDTree(program)

    def distance(found: Floats) -> float:
        return float(np.median(tree.query(found)[0]))

    _check(name, run, f"{what}s look", told, distance, FAR_RAD if rotary else FAR_MM, rotary)


def check_on_program(name: str, run: str, tip: Floats, program: Floats) -> None:
    """Like `check_places` where the tip is the motion: tip (n, 3) against points program (s, 3) along the program."""
    tree = KDTree(program)

    def distance(found: Floats) -> float:
        return float(np.median(tree.query(found)[0]))

    _check(name, run, "tip looks", tip, distance, FAR_MM, False)


def _check(
    name: str, run: str, what: str, found: Floats, distance: Callable[[Floats], float], far: float, rotary: bool
) -> None:
    off = distance(found)
    if off < far:
        return
    at = Location(name, 1, 1)
    for factor, unit in (_TURNS if rotary else _LENGTH_UNITS).items():
        if distance(found / factor) < far:
            raise ConfigError("CC407", f"run '{run}': the {what} as if logged in {unit}", at=at)
    m = found.shape[1]
    for order in permutations(range(m)):
        for sign in np.ndindex(*(2,) * m) if m <= 3 else ((0,) * m,):
            if distance(found[:, order] * (1 - 2 * np.array(sign))) < far:
                message = f"run '{run}': the {what} right when axes are swapped or reversed"
                raise ConfigError("CC408", message, at=at)
    unit = "rad" if rotary else "mm"
    message = f"run '{run}': {what.split()[0]} {off:.3g} {unit} from where the program goes"
    raise ConfigError("CC406", message, at=at)


def _distance(found: Floats, *, due: Floats) -> float:
    return float(np.median(np.linalg.norm(found - due, axis=1)))
