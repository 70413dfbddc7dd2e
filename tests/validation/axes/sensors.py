"""The log of an axis by its controller: rows, noise, resolution, and everything that goes wrong with files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

Array = np.ndarray
MESSES = ("tails", "outliers", "lost rows", "empty cells", "jitter", "middle", "duplicates", "drift", "coarse", "zero")
RATES_HZ = (100.0, 125.0, 200.0, 250.0, 500.0, 1000.0)


@dataclass(frozen=True)
class Sensors:
    """Deviations and habits of a log."""

    rate_hz: float
    encoder_mm: float  # white
    resolution_mm: float
    command_mm: float  # resolution of the set-points as logged
    force_N: float  # white
    drift_N: float  # at the end of a run, the zero of the force
    messes: tuple[str, ...]

    @property
    def whole_mm(self) -> float:
        """Deviation of encoder minus set-point."""
        return float(np.sqrt(self.encoder_mm**2 + (self.resolution_mm**2 + self.command_mm**2) / 12))

    @property
    def whole_N(self) -> float:
        """Deviation of the force, its drift included."""
        return float(np.sqrt(self.force_N**2 + self.drift_N**2 / 12))


def draw(rng: np.random.Generator, rate_hz: float) -> Sensors:
    """Sensors as they are met."""
    u, choice = rng.uniform, rng.choice
    messes = tuple(str(m) for m in rng.permutation(MESSES)[: int(choice([0, 1, 2, 3], p=[0.3, 0.35, 0.25, 0.1]))])
    encoder = float(np.exp(u(np.log(1e-4), np.log(3e-3))))
    steps = [step for step in (1e-5, 5e-5, 1e-4, 2e-4, 5e-4, 1e-3) if step <= 1.5 * encoder]
    step = float(choice(steps))
    if "coarse" in messes:
        step = max(step, float(np.round(encoder * u(2, 3.5), 5)))
    force = float(np.exp(u(np.log(0.2), np.log(10))))
    drift = force * float(u(0.5, 1.5)) if "drift" in messes else 0.0
    return Sensors(
        rate_hz, encoder, step, float(choice([1e-6, 1e-5, 1e-4])) if encoder > 2e-4 else 1e-6, force, drift, messes
    )


def rows_of(seconds: float, sensors: Sensors, rng: np.random.Generator) -> Array:
    """Times of the rows."""
    step = 1 / sensors.rate_hz
    begin = float(rng.uniform(0.1, 0.4)) * seconds if "middle" in sensors.messes else 0.0
    times = begin + np.arange(round((seconds - begin - 1e-3) / step)) * step
    if "lost rows" in sensors.messes:
        keep = np.ones(len(times), bool)
        for start in rng.integers(0, len(times), max(2, len(times) // 400)):
            keep[start : start + int(rng.integers(1, 12))] = False
        times = times[keep]
    return times


def white(n: int, sensors: Sensors, rng: np.random.Generator) -> Array:
    """Of deviation one."""
    return rng.standard_t(4, n) / np.sqrt(2) if "tails" in sensors.messes else rng.normal(size=n)


def at(times: Array, values: Array) -> Array:
    """Values per millisecond at other times."""
    return np.interp(times, np.arange(len(values)) * 1e-3, values)


def rounded(values: Array, step: float) -> Array:
    """To whole steps."""
    return np.round(values / step) * step


def write(path: Path, columns: dict[str, Array], sensors: Sensors, rng: np.random.Generator) -> list[int]:
    """The CSV; returns the rows (from 0) that were made outliers, of the file as written."""
    n, bad = len(columns["t_s"]), []
    columns = {name: values.copy() for name, values in columns.items()}
    if "outliers" in sensors.messes:
        for row in rng.choice(n, int(rng.integers(1, 6)), replace=False):
            name = str(rng.choice([c for c in columns if c.startswith("act_")]))
            unit = sensors.whole_N if name.endswith("_N") else sensors.whole_mm
            columns[name][row] += unit * float(rng.uniform(30, 400) * rng.choice([-1, 1]))
            bad.append(int(row))
    if "jitter" in sensors.messes:
        columns["t_s"] = columns["t_s"] + rng.uniform(-1, 1, n) * min(0.03 / sensors.rate_hz, 3e-5)
    order = np.arange(n)
    if "duplicates" in sensors.messes:
        order = np.sort(np.concatenate([order, rng.choice(n, max(2, n // 500), replace=False)]))
    texts = []
    for name, values in columns.items():
        digits = 3 if name.endswith("_N") else 6
        texts.append([f"{value:.{digits}f}" for value in values[order]])
        if "empty cells" in sensors.messes and name != "t_s":
            for row in np.flatnonzero(rng.random(len(order)) < 0.008):
                texts[-1][row] = ""
    lines = [",".join(columns)] + [",".join(row) for row in zip(*texts, strict=True)]
    path.write_text("\n".join(lines) + "\n")
    return sorted(int(np.searchsorted(order, row)) for row in bad)
