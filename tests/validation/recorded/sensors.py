"""Errors of the instruments: noise, drift, rounding, lost rows, and the columns that a control chose to log."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.signal import lfilter

from tests.validation.recorded.machines import Machine
from tests.validation.recorded.plant import State

OUTLIER_MM = 30.0
BURST = (3, 8)  # rows
AXES = ("x", "y", "z")
# columns of a log by name; "line" is left out of those that have none
CHANNELS: dict[str, tuple[str, ...]] = {
    "full": ("line", "tip", "cmd", "act", "drive", "dyno", "temp"),
    "no-forces": ("line", "tip", "cmd", "act"),
    "no-encoders": ("line", "tip", "cmd"),
    "no-setpoints": ("line", "tip", "act", "drive"),
    "no-line": ("tip", "cmd", "act", "drive"),
    "tip": ("line", "tip"),
}


@dataclass(frozen=True)
class Sensors:
    """Sizes of the errors of the instruments, one standard deviation per axis unless said otherwise.

    The tip's deviation is divided, by variance, into white noise, slow noise (memory slow_s) and drift over the run.
    """

    tip_mm: float = 0.003
    slow: float = 0.06
    drift: float = 0.02
    slow_s: float = 1.0
    encoder_step_mm: float = 0.0005
    encoder_mm: float = 0.0
    drive_N: float = 1.5
    dyno_N: float = 2.0
    temperature_K: float = 0.05
    lost_rows: float = 0.003
    lost_tips: float = 0.003
    jitter_s: float = 1e-5  # of the stamps
    line_rows: int = 0  # by which the column line lags; leads if negative
    tails: bool = False  # white noise by Student's t with 3 degrees of freedom, of the same deviation
    outliers: float = 0.0  # share of rows whose tip is OUTLIER_MM off, alone and in bursts
    tip_step_mm: float = 0.0  # to which tips are rounded
    clock_ppm: float = 0.0  # by which the stamps run fast

    @property
    def rms_mm(self) -> float:
        """3-D rms of the tip's deviation."""
        return self.tip_mm * 3**0.5


def tip_noise(sensors: Sensors, t: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Deviation of the measured tip (n, 3), mm."""
    step = float(np.median(np.diff(t)))
    keep = np.exp(-step / sensors.slow_s)
    kicks = rng.normal(size=(len(t), 3)) * np.sqrt(1 - keep**2)
    kicks[0] /= np.sqrt(1 - keep**2)
    slow = lfilter([1.0], [1.0, -keep], kicks, axis=0)
    u = (t - t[0]) / max(float(t[-1] - t[0]), step) * 2 - 1
    drift = (
        u[:, None] * rng.normal(size=3) * 3**0.5 + (1.5 * u[:, None] ** 2 - 0.5) * rng.normal(size=3) * 5**0.5
    ) / 2**0.5
    white = rng.standard_t(3, (len(t), 3)) / 3**0.5 if sensors.tails else rng.normal(size=(len(t), 3))
    shares = np.sqrt([1 - sensors.slow - sensors.drift, sensors.slow, sensors.drift])
    return sensors.tip_mm * (shares[0] * white + shares[1] * slow + shares[2] * drift)


def beam_breaks(n: int, share: float, rng: np.random.Generator) -> np.ndarray:
    """Which of n rows are outliers (n,): about that share, one half alone, one half in bursts."""
    out = np.zeros(n, bool)
    if share > 0:
        out[rng.uniform(size=n) < share / 2] = True
        for first in np.flatnonzero(rng.uniform(size=n) < share / sum(BURST)):
            out[first : first + int(rng.integers(*BURST, endpoint=True))] = True
    return out


@dataclass
class Log:
    """names; values (rows, columns), NaN is an empty cell; formats; outliers: rows, counted from 0."""

    names: list[str]
    values: np.ndarray
    formats: list[str]
    outliers: list[int]


def table(state: State, sensors: Sensors, channels: str, machine: Machine, rng: np.random.Generator) -> Log:
    """The log of a run."""
    n, m = state.setpoint.shape
    encoder = state.encoder + rng.normal(0, 1, (n, m)) * sensors.encoder_mm / machine.reach
    step = sensors.encoder_step_mm / machine.reach
    if step > 0:
        encoder = np.round(encoder / step) * step
    tip = state.tip + tip_noise(sensors, state.t, rng)
    off = beam_breaks(n, sensors.outliers, rng)
    way = rng.normal(size=(n, 3))
    tip[off] += OUTLIER_MM * (way / np.linalg.norm(way, axis=1)[:, None])[off]
    if sensors.tip_step_mm > 0:
        tip = np.round(tip / sensors.tip_step_mm) * sensors.tip_step_mm
    tip[rng.uniform(size=n) < sensors.lost_tips] = np.nan
    line = state.line[np.clip(np.arange(n) - sensors.line_rows, 0, n - 1)]
    stamps = np.maximum.accumulate(state.t * (1 + 1e-6 * sensors.clock_ppm) + rng.normal(0, sensors.jitter_s, n))
    drive = state.drive + rng.normal(0, sensors.drive_N * machine.reach, (n, m))
    unit, load, fine, coarse = ("rad", "Nmm", "%.9f", "%.8f") if machine.rotary else ("mm", "N", "%.5f", "%.4f")
    parts = {
        "line": (["line"], line[:, None].astype(float), "%d"),
        "tip": ([f"{a}_mm" for a in AXES], tip, "%.4f"),
        "cmd": ([f"cmd_{a}_{unit}" for a in machine.actuators], state.setpoint, fine),
        "act": ([f"act_{a}_{unit}" for a in machine.actuators], encoder, coarse),
        "drive": ([f"act_{a}_{load}" for a in machine.actuators], drive, "%.1f"),
        "dyno": ([f"f{a}_N" for a in AXES], state.force + rng.normal(0, sensors.dyno_N, (n, 3)), "%.1f"),
        "temp": (["temp_C"], (state.temperature + rng.normal(0, sensors.temperature_K, n))[:, None], "%.2f"),
    }
    names, values, formats = ["t_s"], [stamps[:, None]], ["%.5f"]
    for key in CHANNELS[channels]:
        names += parts[key][0]
        values.append(parts[key][1])
        formats += [parts[key][2]] * len(parts[key][0])
    kept = rng.uniform(size=n) >= sensors.lost_rows
    return Log(names, np.concatenate(values, 1)[kept], formats, np.flatnonzero(off[kept]).tolist())


def write_log(path: Path, log: Log) -> None:
    """CSV with empty cells where a value is missing."""
    rows = [",".join("" if np.isnan(v) else f % v for f, v in zip(log.formats, row, strict=True)) for row in log.values]
    path.write_text("\n".join([",".join(log.names), *rows]) + "\n")
