"""Reader of a MATLAB file of one axis in the form of the EMPS benchmark."""

from __future__ import annotations

import numpy as np

from camcomp.diagnosis.recordings.mat_file import read_mat
from camcomp.diagnosis.recordings.run_log import Actuators, Recording, Wishes, csv_of
from camcomp.diagnosis.recordings.sampled import reading
from camcomp.ground.bounds import LARGEST_NUMBER
from camcomp.ground.errors import ConfigError, Location
from camcomp.model.motion.log_columns import TIME, log_columns


def read_axis(
    data: bytes, file: str, name: str, actuators: Actuators, actuator: str | None, wishes: Wishes
) -> Recording:
    """Time t s, reference qg m, position qm m, drive signal vir, gtau N per unit of it, of an actuator or the first.

    Raises ConfigError CC423 for missing variables.
    """
    at = Location(file, 1, 1)
    if wishes.columns:
        raise ConfigError("CC423", "variables of a MATLAB file cannot be named by --column", at=at)
    with reading(file, "a MATLAB file"):
        found = read_mat(data)
    missing = [key for key in ("t", "qg", "qm") if key not in found]
    if missing:
        there = ", ".join(found) or "nothing"
        raise ConfigError("CC423", f"no variable {', '.join(missing)}; there is {there}", at=at)
    if len({len(found[key]) for key in ("t", "qg", "qm", *(["vir"] if "vir" in found else []))}) > 1 or not len(
        found["t"]
    ):
        raise ConfigError("CC423", "t, qg, qm and vir are not of one length", at=at)
    if not all((np.abs(found[key]) < LARGEST_NUMBER).all() for key in ("t", "qg", "qm")):
        raise ConfigError("CC423", "t, qg or qm holds what is no time or place", at=at)
    target = actuator or next(iter(actuators))
    if target not in actuators:
        raise ConfigError("CC423", f"the machine has no actuator '{target}'", at=at)
    named = log_columns([target], [False])
    values = {
        TIME: found["t"] - found["t"][0],
        named.setpoint[0]: 1e3 * found["qg"],
        named.encoder[0]: 1e3 * found["qm"],
    }
    if "vir" in found and found.get("gtau", np.zeros(0)).size:
        values[named.drive[0]] = found["vir"] * float(found["gtau"][0])
    unused = sorted(set(found) - {"t", "qg", "qm", "vir", "gtau"})
    notes = [f"variables dropped: {', '.join(unused)}"] if unused else []
    total = len(values[TIME])
    if wishes.rows is not None and wishes.rows < total:
        values = {key: each[: wishes.rows] for key, each in values.items()}
        notes.append(f"the first {wishes.rows} of {total} rows (--rows), {total - wishes.rows} dropped")
    return Recording(name, csv_of(values), len(values[TIME]), tuple(notes))
