"""Units stated by recordings, in brackets or at the end of a name, and conversion of time stamps to seconds."""

from __future__ import annotations

import re
from datetime import datetime

import numpy as np

from camcomp.ground.datatypes import Floats

SI = "SI"
_TO_LOG = {  # unit of the log: factors to it, by unit of the recording in lower case
    "mm": {"mm": 1.0, "m": 1e3, "cm": 10.0, "um": 1e-3, "µm": 1e-3, "in": 25.4, "inch": 25.4},
    "rad": {
        "rad": 1.0,
        "mrad": 1e-3,
        "urad": 1e-6,
        "µrad": 1e-6,
        "deg": np.pi / 180.0,
        "°": np.pi / 180.0,
        "degrees": np.pi / 180.0,
    },
    "s": {"s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9, "min": 60.0},
    "N": {"n": 1.0, "kn": 1e3},
    "Nmm": {"nmm": 1.0, "nm": 1e3, "n·m": 1e3, "n.m": 1e3, "n*m": 1e3, "n m": 1e3, "n mm": 1.0, "knm": 1e6},
    "C": {"c": 1.0, "°c": 1.0, "degc": 1.0},
}
_BASE = {"mm": "m", "rad": "rad", "s": "s", "N": "n", "Nmm": "nm", "C": "c"}
_BRACKETS = re.compile(r"(.+?)[\s_]*[\[(](?!\d+[\])])([^\[\]()]*)[\])]")  # position[0] states none
_CLOCK = re.compile(  # 11.10.2022 15:06:48.043, 2022-10-11T15:06:48,043Z, 15:06:48.043; 10/11/2022 is of two days
    r"(?:(?P<day>\d{1,2})\.(?P<month>\d{1,2})\.(?P<year>\d{4})[ T]+|(?P<iso>\d{4}-\d{2}-\d{2})[ T]+)?"
    r"(?P<h>[01]?\d|2[0-3]):(?P<m>[0-5]\d):(?P<s>[0-5]\d(?:[.,]\d+)?)Z?",
    re.ASCII,
)
_NANOSECONDS = re.compile(r"\d{19}", re.ASCII)  # since 1970, of this century
_AT_2000 = 946_684_800_000_000_000  # ns since 1970
_SINCE_1970 = ((1e12, 1e13, 1e-3), (1e15, 1e16, 1e-6))  # from, to, s: ms and us of this century


def unit_of(log: str) -> str:
    """Unit of a column of a log: mm for x_mm, empty for line."""
    unit = log.rpartition("_")[2]
    return unit if unit in _TO_LOG else ""


def split_unit(name: str) -> tuple[str, str]:
    """Name and unit of `x [mm]`, `x (mm)` or `x_mm`; the unit may be empty."""
    if found := _BRACKETS.fullmatch(name):
        return found[1], found[2].strip()
    base, _, unit = name.rpartition("_")
    return (base, unit) if base and is_unit(unit) else (name, "")


def is_unit(text: str) -> bool:
    """Whether a text is a unit that some column of a log may have."""
    return any(text.lower() in factors for factors in _TO_LOG.values())


def factor_to(log: str, unit: str) -> float | None:
    """Factor from a recording's unit to that of a column of a log; None for a unit of another quantity."""
    kind = unit_of(log)
    if not kind:
        return 1.0
    return _TO_LOG[kind].get(_BASE[kind] if unit == SI else unit.lower())


def seconds(stamps: Floats, factor: float | None) -> Floats | None:
    """Times (n,) in s on their own clock, NaN for missing ones; None if too few of them differ.

    factor: of their unit; None: times are s, stamps such as 20200714163904, or ms or us since 1970.
    """
    known = stamps[np.isfinite(stamps)]
    if not known.size or np.unique(known).size <= 0.5 * len(stamps):
        return None
    if factor is not None:
        return stamps * factor
    least, most = known.min(), known.max()
    for low, high, scale in _SINCE_1970:
        if low <= least and most < high:
            return stamps * scale
    if most < _SINCE_1970[0][0]:
        return stamps
    if not (1e13 <= least and most < 1e14):
        return None
    try:
        return np.array([_since_2000(each) for each in stamps])
    except ValueError:
        return None


def clock(text: str) -> float | None:
    """Seconds since 2000 of a date with its time of day or of ns since 1970, or of a time of day alone; None for other texts."""
    if _NANOSECONDS.fullmatch(text.strip()):
        return 1e-9 * (int(text) - _AT_2000)
    found = _CLOCK.fullmatch(text.strip())
    if found is None:
        return None
    day = 0.0
    try:
        if found["day"]:
            day = (
                datetime(int(found["year"]), int(found["month"]), int(found["day"])) - datetime(2000, 1, 1)
            ).total_seconds()
        elif found["iso"]:
            day = (datetime.fromisoformat(found["iso"]) - datetime(2000, 1, 1)).total_seconds()
    except ValueError:
        return None
    seconds = float(found["s"].replace(",", "."))
    return day + 3600.0 * int(found["h"]) + 60.0 * int(found["m"]) + seconds


def _since_2000(stamp: float) -> float:
    if not np.isfinite(stamp):
        return float("nan")
    return (datetime.strptime(f"{stamp:.0f}", "%Y%m%d%H%M%S") - datetime(2000, 1, 1)).total_seconds()
