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
# Of recordings. Nothing saw the second one before the 56000s, the third one before the 60000s, the fourth one before the 70000s,
# the fifth one before the 74000s, the sixth one before the 76000s. Words are programs that say things in other words (inches,
# increments, canned cycles, turns): nothing for generators, which read plain ones only.
SHELVES = {
    "first": HERE,
    "second": HERE / "second",
    "third": HERE / "third",
    "fourth": HERE / "fourth",
    "fifth": HERE / "fifth",
    "sixth": HERE / "sixth",
    "slow": HERE / "slow",
    "words": HERE / "words",
}
LIMITS = (100.0, 1500.0)  # mm/s, mm/s²; of every axis and of the tip
# What was learned on one machine holds on another: slow are programs of other shelves, the sixth one has programs of its own.
LIMITS_OF = {"slow": (60.0, 800.0), "sixth": (160.0, 4000.0)}
STEP_S = 1e-3
QUANTUM_MM = 1e-5


@dataclass(frozen=True)
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


_shelf: ContextVar[str] = ContextVar("shelf", default="first")


@contextmanager
def taken_from(shelf: str) -> Iterator[None]:
    """Recordings of another shelf meanwhile."""
    before = _shelf.set(shelf)
    try:
        yield
    finally:
        _shelf.reset(before)


def folder() -> Path:
    """Where the recordings and their programs are."""
    return SHELVES[_shelf.get()]


def limits() -> tuple[float, float]:
    """Velocity mm/s and acceleration mm/s² that the control kept to."""
    return LIMITS_OF.get(_shelf.get(), LIMITS)


def names() -> list[str]:
    """Every recording of the shelf."""
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
