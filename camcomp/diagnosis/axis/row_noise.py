"""Noise of rows with a memory: how many of them count as one, and the evidence for further columns."""

from __future__ import annotations

import numpy as np

from camcomp.diagnosis.model.discrepancy import gains_at_scales
from camcomp.ground.datatypes import Floats


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
