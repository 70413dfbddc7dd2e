"""Squareness of the machine's effects as a command of firmware that corrects skew itself: Marlin and Klipper.

Both send the drives to x - xy y - (xz - xy yz) z and y - yz z for a programmed (x, y, z) (Marlin, planner.h, skew();
Klipper, skew_correction.py, calc_skew). With the factors of `squareness` (rad) that is the exact inverse of the error.
"""

from __future__ import annotations

from math import sqrt

from camcomp.ground.errors import ConfigError
from camcomp.model.job import Job

CONTROLS = ("marlin", "klipper")
_SIDE_MM = 100.0  # of the test square that Klipper asks for; its factor does not depend on it


def skew_command(job: Job, control: str) -> str:
    """The command line with the squareness of all planes. Raises ConfigError CC205 where the effects have none."""
    factors = dict.fromkeys(("xy", "xz", "yz"), 0.0)
    for each in job.causes:
        if each.name == "squareness" and each.target is not None:
            factors[each.target] = 1e-3 * float(each.values["angle_mrad"])
    if not any(factors.values()):
        raise ConfigError(
            "CC205", "the effects state no squareness", hint="effects: [{effect: squareness, target: xy, ...}]"
        )
    if control == "marlin":  # it reads the factors as lengths: in G20 they would be 25.4 times as large
        return (
            "G21\nM852 "
            + " ".join(f"{letter}{factors[p]:.7f}" for letter, p in zip("IJK", factors, strict=True))
            + "\n"
        )
    planes = [f"{plane.upper()}={_diagonals(factor)}" for plane, factor in factors.items() if factor]
    return f"SET_SKEW CLEAR=1\nSET_SKEW {' '.join(planes)}\n"


def _diagonals(factor: float) -> str:
    """AC, BD and AD (mm) of a parallelogram of equal sides, from which Klipper works out the factor."""
    lean = factor / sqrt(1.0 + factor * factor)
    long, short = (_SIDE_MM * sqrt(2.0 + 2.0 * sign * lean) for sign in (1.0, -1.0))
    return f"{long:.6f},{short:.6f},{_SIDE_MM:.6f}"
