"""Recorded motions: where LinuxCNC commanded the tip to be at every millisecond, and which line it then executed.

The files hold whole multiples of 10 nm as second differences, which are small: 1 kHz costs some 10 kB per recording.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent
# Sets of recordings: pockets has all modes, dwells, a pause and an override; spirals, slots and rosettes other contours in
# the same modes; feed_modes inverse time, feeds per revolution, G18 and G19; fast_machine and slow_machine other limits.
# Generators draw from these. inches_and_cycles has programs in inches, increments, canned cycles and turns, which they cannot read.
SETS = ("pockets", "spirals", "slots", "rosettes", "feed_modes", "fast_machine", "slow_machine", "inches_and_cycles")
LIMITS = (100.0, 1500.0)  # mm/s, mm/s²; of every axis and of the tip
LIMITS_OF = {"slow_machine": (60.0, 800.0), "fast_machine": (160.0, 4000.0)}
STEP_S = 1e-3
QUANTUM_MM = 1e-5


@dataclass(frozen=True, eq=False)
class Recording:
    """One program as it was run: t (n,) s, tip (n, 3) mm in the program frame, line (n,), kind (n,) of motion.

    line: 1-based source line as the control reports it, 0 before the first; kind: 0 standstill, 1 rapid, 2 line, 3 arc.
    """

    name: str
    program: str
    t: np.ndarray
    tip: np.ndarray
    line: np.ndarray
    kind: np.ndarray


_chosen: ContextVar[str] = ContextVar("set", default="pockets")


@contextmanager
def taken_from(name: str) -> Iterator[None]:
    """Read the recordings of another set inside the `with` block."""
    before = _chosen.set(name)
    try:
        yield
    finally:
        _chosen.reset(before)


def folder() -> Path:
    """Where the recordings and their programs are."""
    return HERE / _chosen.get()


def limits() -> tuple[float, float]:
    """Velocity mm/s and acceleration mm/s² that the control kept to."""
    return LIMITS_OF.get(_chosen.get(), LIMITS)


def names() -> list[str]:
    """Names of the recordings of the set."""
    return sorted(path.stem for path in (folder() / "data").glob("*.npz"))


def save(name: str, values: np.ndarray) -> None:
    """Stores rows (n, 5): tip mm, line, kind of motion, a row per millisecond."""
    whole = np.round(values[:, :3] / QUANTUM_MM).astype(np.int64)
    twice = np.diff(whole, n=2, axis=0)
    assert np.abs(twice).max() < 2**15
    (folder() / "data").mkdir(exist_ok=True)
    np.savez_compressed(
        folder() / "data" / f"{name}.npz",
        start=whole[:2],
        bend=twice.astype(np.int16).T,
        line=values[:, 3].astype(np.int16),
        kind=values[:, 4].astype(np.int8),
    )


def load(name: str) -> Recording:
    """A recording by its name."""
    return _load(folder(), name)


@cache
def _load(folder: Path, name: str) -> Recording:
    with np.load(folder / "data" / f"{name}.npz") as file:
        start, bend, line, kind = (file[key] for key in ("start", "bend", "line", "kind"))
    speed = np.cumsum(np.concatenate([start[1:] - start[:1], bend.T.astype(np.int64)]), 0)
    tip = np.concatenate([start[:1], start[:1] + np.cumsum(speed, 0)]) * QUANTUM_MM
    program = (folder / "programs" / f"{name}.nc").read_text()
    return Recording(name, program, np.arange(len(tip)) * STEP_S, tip, line.astype(int), kind.astype(int))
