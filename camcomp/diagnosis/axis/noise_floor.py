"""How far a channel of an axis scatters by itself, which rows are no measurement at all, and how many rows with a memory count as one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.signal import lfilter
from scipy.stats import median_abs_deviation, norm

from camcomp.diagnosis.model.discrepancy import gains_at_scales
from camcomp.diagnosis.model.noise import FAR_OFF, IN_A_ROW, REPEATABILITY_MM
from camcomp.ground.datatypes import Floats

STAYING = 0.1  # of the rows that do not move, from which on steps are a resolution
FAST_S = 0.005  # between rows: within two of them no drive goes out and comes back, however little
LEAST_SPIKE_MM = 0.1  # the same between rows that are further apart: none goes so far
QUIET = 0.1  # of the rows, which even busy moves leave without a corner


def rows_floor(channels: Sequence[Floats]) -> float:
    """Deviation of one row, from fourth differences of every run's channel (n,); never less than its resolution says.

    By the median, so that steps at reversals and rows far out do not count; of the fourth order, so that motion does not. By
    the mean where the resolution is coarser.
    """
    noise = []
    for y in channels:
        steps = np.abs(np.diff(y))
        quantum = float(np.min(steps[steps > 1e-9 * max(float(np.ptp(y)), 1e-300)], initial=np.inf))
        often = np.mean(steps < 0.5 * quantum) > STAYING  # rows that stay on a value: it is a resolution
        fourth = np.diff(y, 4) / np.sqrt(70.0) if len(y) > 5 else np.zeros(1)
        scatter = float(median_abs_deviation(fourth, scale="normal"))
        if often and np.isfinite(quantum):  # rows that stay on a value and seldom leave it have a median of nothing
            flicker = float(np.sqrt(np.mean(np.clip(fourth, -quantum, quantum) ** 2)))
            scatter = max(scatter, quantum / np.sqrt(12.0), flicker if scatter < quantum else 0.0)
        noise.append(scatter)
    return float(np.sqrt(np.mean(np.square(noise)))) if noise else 0.0


def spikes(y: Floats, least: float) -> np.ndarray:
    """Mask (n,) of rows above or below both neighbourhoods by more than FAR_OFF deviations, `least`, and any usual step.

    A row's deviation is that of its neighbours, and at least the resolution, by which a standing axis flickers.
    """
    rows = np.flatnonzero(np.isfinite(y))
    out = np.zeros(len(y), bool)
    if len(rows) < 4 * IN_A_ROW:
        return out
    known = y[rows]
    padded = np.concatenate([known[:1].repeat(IN_A_ROW), known, known[-1:].repeat(IN_A_ROW)])
    median = np.median(np.lib.stride_tricks.sliding_window_view(padded, IN_A_ROW), axis=1)
    before, behind = median[: len(known)], median[IN_A_ROW + 1 :]
    over = np.maximum(known - np.maximum(before, behind), np.minimum(before, behind) - known)
    off = known - 0.5 * (before + behind)
    step = 3.0 * float(np.quantile(np.abs(np.diff(known)), 0.95))
    scatter = max(float(median_abs_deviation(off, scale="normal")), rows_floor([known]))
    out[rows] = over > max(FAR_OFF * scatter, least, step)
    return out


def following_floor(pairs: Sequence[tuple[Floats, Floats]]) -> float:
    """Deviation of one row of following errors, from set-points and encoders (n,) of runs, with the repeatability.

    A resolution may show in the encoder or the set-points alone.
    """
    asked, moved = ([pair[i] for pair in pairs] for i in (0, 1))
    apart = np.hypot(rows_floor(moved), rows_floor(asked))
    own = rows_floor([x - y for x, y in pairs])
    return float(np.hypot(max(own, float(apart)), REPEATABILITY_MM))


def _of_steady_acceleration(x: float) -> float:
    """What a loop makes, within a row, of an acceleration that goes on, over its lateness squared; x: rows' distance in time over it."""
    return float(0.5 * (x - 2.0 + (x + 2.0) * np.exp(-x)))


def by_acceleration_between_rows(time: Floats, late_s: float) -> float:
    """Following error (s2) per acceleration that goes on, by the motion of set-points between rows at times (n,) s."""
    if late_s <= 0.0 or len(time) < 2:
        return 0.0
    x = float(np.median(np.diff(time))) / late_s
    return late_s**2 * _of_steady_acceleration(x) / float(-np.expm1(-x))


def between_rows(time: Floats, setpoint: Floats, late_s: float) -> Floats:
    """Uncertainty (n, 2) mm of a following error by the motion of set-points between two rows, from the rows on either side.

    A loop of first order that follows `late_s` behind remembers, dt later, e^-x (x = dt / late_s) of how far its set-points
    were off the straight line between rows. A constant acceleration a is off by a s (dt - s) / 2 within a row, of which the loop
    makes a late_s^2 (x - 2 + (x + 2) e^-x) / 2. The column of accelerations takes its mean; its change from row to row is left,
    as far as the set-points' own scatter does not show the same.
    """
    if late_s <= 0.0 or len(time) < 5:
        return np.zeros((len(time), 2))
    x = float(np.median(np.diff(time))) / late_s
    share = _of_steady_acceleration(x) / x**2
    quiet = float(np.quantile(np.abs(np.diff(setpoint, 4)), QUIET)) / float(norm.isf(0.5 - 0.5 * QUIET)) / np.sqrt(70.0)
    change = np.diff(setpoint, 3)
    change = np.sign(change) * np.maximum(np.abs(change) - 3.0 * np.sqrt(20.0) * quiet, 0.0)
    rows = np.stack([np.pad(change, (1, 2), "edge"), np.pad(change, (2, 1), "edge")], axis=1)  # on either side of a row
    return np.asarray(lfilter([share], [1.0, -np.exp(-x)], rows, axis=0))


def log_gain(left: Floats, columns: Floats, more: Floats, floor: float) -> float:
    """Log Bayes factor of further columns (n, q) for residuals (n,) to which columns (n, k) were fitted."""
    X = left_of_fit(columns, more)
    X = X / (np.sqrt(np.mean(X**2, axis=0)) + 1e-300)
    sd = noise_after_fit(X, left, floor)
    return float(gains_at_scales(X.T @ X, X.T @ left / sd)[0].max())


def noise_after_fit(columns: Floats, values: Floats, floor: float) -> float:
    """Standard deviation of a row that counts as one of its own, from what columns (n, k) leave of values (n,)."""
    return noise_of(left_of_fit(columns, values), floor)


def left_of_fit(columns: Floats, values: Floats) -> Floats:
    """What columns (n, k) leave of values (n,) or (n, m)."""
    A = columns / (np.sqrt(np.mean(columns**2, axis=0)) + 1e-300)
    return np.asarray(values - A @ np.linalg.lstsq(A, values, rcond=1e-9)[0])


def noise_of(left: Floats, floor: float) -> float:
    """Standard deviation of a row of residuals (n,) that counts as one of its own."""
    return max(float(np.sqrt(np.mean(left**2) * rows_together(left))), floor)


def rows_together(left: Floats) -> float:
    """Rows that count as one: the integral of the autocorrelation of residuals (n,) up to its first zero, both ways."""
    centred = left - left.mean()
    n = len(centred)
    power = np.abs(np.fft.rfft(centred, 2 * n)) ** 2
    rho = np.fft.irfft(power)[:n]
    rho = rho / max(float(rho[0]), 1e-300)
    ends = np.flatnonzero(rho <= 0.0)
    return float(1.0 + 2.0 * rho[1 : ends[0] if len(ends) else n].sum())
