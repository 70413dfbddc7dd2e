"""Whether a log can be what its run says: right program, units, axes and order. What cannot is refused with the reason."""

from itertools import permutations

import numpy as np

from camcomp.course import Course
from camcomp.datatypes import Bools, Floats
from camcomp.diagnostics import ConfigError, Location
from camcomp.gap.observation import Measured

FAR_MM = 5.0  # no machine of the kind is wrong by so much; a log of another program or unit is
_UNITS = {1e-3: "m", 25.4: "mm where inches are due", 1.0 / 25.4: "inches", 1e3: "um"}


def check_rows(name: str, measured: Measured) -> None:
    """Raise CC404 when nothing is measured, CC405 when time does not run forward."""
    if not any(measured.has(each) for each in ("tip", "encoder", "drive", "dyno")):
        message = "the log measures nothing: no tip, encoder, drive force or dynamometer column holds a number"
        raise ConfigError("CC404", message, at=Location(name, 1, 1))
    back = np.flatnonzero(np.diff(measured.time) <= 0)
    if len(back):
        row = int(back[0])
        message = f"t_s goes from {measured.time[row]:g} to {measured.time[row + 1]:g}"
        raise ConfigError("CC405", message, at=Location(name, row + 3, 1))


def check_program(name: str, run: str, measured: Measured, rows: Bools) -> None:
    """Raise CC406 when most rows carry source lines that the program does not cut."""
    known = np.isfinite(measured.line)
    if known.any() and np.mean(rows[known]) < 0.5:
        lines = sorted({int(each) for each in measured.line[known & ~rows]})[:5]
        message = f"run '{run}': most rows are on lines that the program does not move on, e.g. {lines}"
        raise ConfigError("CC406", message, at=Location(name, 1, 1))


def check_places(name: str, run: str, measured: Measured, course: Course, tip: Floats) -> None:
    """Raise CC407 (units), CC408 (axes), CC406 (another program) where tip or encoders are far from where they were due.

    tip (n, 3) mm, course.row_rho (n, m): where tip and actuators should have been.
    """
    for what, found, due in (("tip", measured.tip, tip), ("encoders", measured.encoder, course.row_rho)):
        rows = np.isfinite(found).all(axis=1)
        if not rows.any() or _distance(found[rows], due[rows]) < FAR_MM:
            continue
        found, due = found[rows], due[rows]
        at = Location(name, 1, 1)
        for factor, unit in _UNITS.items():
            if _distance(found / factor, due) < FAR_MM:
                raise ConfigError("CC407", f"run '{run}': the {what} look as if logged in {unit}", at=at)
        for order in permutations(range(due.shape[1])):
            for sign in np.ndindex(*(2,) * due.shape[1]) if due.shape[1] <= 3 else ((0,) * due.shape[1],):
                turned = found[:, order] * (1 - 2 * np.array(sign))
                if _distance(turned, due) < FAR_MM:
                    raise ConfigError("CC408", f"run '{run}': the {what} fit when axes are swapped or reversed", at=at)
        off = _distance(found, due)
        raise ConfigError("CC406", f"run '{run}': the {what} are {off:.0f} mm from where the program goes", at=at)


def _distance(found: Floats, due: Floats) -> float:
    return float(np.median(np.linalg.norm(found - due, axis=1)))
