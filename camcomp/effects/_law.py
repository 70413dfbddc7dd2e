"""What formula and map have in common: on which channel they act, and the hooks."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from camcomp.ground.datatypes import Floats
from camcomp.model.effect import Load, Motion
from camcomp.model.law.covariates import DriveRows, TipRows
from camcomp.model.law.law import AT_DRIVES, EmpiricalLaw


def shifted(values: Floats, motion: Motion, which: Floats, law: EmpiricalLaw) -> Floats:
    """Copy of values (n, m) of actuators with the law added at its targets."""
    out = values.copy()
    for j in np.flatnonzero(which):
        out[:, j] += law.values(DriveRows(motion, int(j), followed=values if law.on == "control" else None))
    return out


def on_servo(position: Floats, motion: Motion, which: Floats, p: Mapping[str, Any]) -> Floats:
    """Set-points (n, m) in time -> encoders."""
    law = p.get("law")
    return position if law is None or law.on != "control" else shifted(position, motion, which, law)


def on_drive(error: Floats, motion: Motion, which: Floats, p: Mapping[str, Any]) -> Floats:
    """Carriage minus encoder (n, m)."""
    law = p.get("law")
    return error if law is None or law.on != "drive" else shifted(error, motion, which, law)


def on_place(tip: Floats, load: Load, motion: Motion, p: Mapping[str, Any]) -> Floats:
    """Tips (n, 3) in the program frame."""
    law = p.get("law")
    if law is None or law.on in AT_DRIVES:
        return tip
    out = tip.copy()
    out[:, law.axis] += law.values(TipRows(tip, load, motion))
    return out
