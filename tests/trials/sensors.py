"""What the instruments make of a run: noise, drift, rounding, lost rows, and the columns that a control chose to log."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.signal import lfilter

from tests.trials.plant import State

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
    """Sizes of what the instruments add, one standard deviation per axis unless said otherwise.

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
    white = rng.normal(size=(len(t), 3))
    shares = np.sqrt([1 - sensors.slow - sensors.drift, sensors.slow, sensors.drift])
    return sensors.tip_mm * (shares[0] * white + shares[1] * slow + shares[2] * drift)


def table(
    state: State, sensors: Sensors, channels: str, actuators: tuple[str, ...], rng: np.random.Generator
) -> tuple[list[str], np.ndarray, list[str]]:
    """Names, values (rows, columns; NaN is an empty cell) and formats of a log."""
    n, m = state.setpoint.shape
    encoder = state.encoder + rng.normal(0, 1, (n, m)) * sensors.encoder_mm
    if sensors.encoder_step_mm > 0:
        encoder = np.round(encoder / sensors.encoder_step_mm) * sensors.encoder_step_mm
    tip = state.tip + tip_noise(sensors, state.t, rng)
    tip[rng.uniform(size=n) < sensors.lost_tips] = np.nan
    line = state.line[np.clip(np.arange(n) - sensors.line_rows, 0, n - 1)]
    stamps = np.maximum.accumulate(state.t + rng.normal(0, sensors.jitter_s, n))
    parts = {
        "line": (["line"], line[:, None].astype(float), "%d"),
        "tip": ([f"{a}_mm" for a in AXES], tip, "%.4f"),
        "cmd": ([f"cmd_{a}_mm" for a in actuators], state.setpoint, "%.5f"),
        "act": ([f"act_{a}_mm" for a in actuators], encoder, "%.4f"),
        "drive": ([f"act_{a}_N" for a in actuators], state.drive + rng.normal(0, sensors.drive_N, (n, m)), "%.1f"),
        "dyno": ([f"f{a}_N" for a in AXES], state.force + rng.normal(0, sensors.dyno_N, (n, 3)), "%.1f"),
        "temp": (["temp_C"], (state.temperature + rng.normal(0, sensors.temperature_K, n))[:, None], "%.2f"),
    }
    names, values, formats = ["t_s"], [stamps[:, None]], ["%.5f"]
    for key in CHANNELS[channels]:
        names += parts[key][0]
        values.append(parts[key][1])
        formats += [parts[key][2]] * len(parts[key][0])
    kept = rng.uniform(size=n) >= sensors.lost_rows
    return names, np.concatenate(values, 1)[kept], formats


def write_log(path: Path, names: list[str], values: np.ndarray, formats: list[str]) -> None:
    """CSV with empty cells where a value is missing."""
    rows = [",".join("" if np.isnan(v) else f % v for f, v in zip(formats, row, strict=True)) for row in values]
    path.write_text("\n".join([",".join(names), *rows]) + "\n")
