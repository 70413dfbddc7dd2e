"""Which terms may make up the following error and the drive force of one axis?"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.interpolate import Akima1DInterpolator
from scipy.signal import savgol_filter

from camcomp.diagnosis.axis.noise_floor import left_of_fit
from camcomp.ground.datatypes import Bools, Floats
from camcomp.model.hysteresis import direction, first_order
from camcomp.model.seams import Seams

STANDS_OUT = 1.6  # times the next line of a spectrum
TURNS_MM_PER_S = (0.3, 0.6, 1.5, 3.0, 6.0)  # speeds with which friction may turn round
WIDE = (5, 10, 20, 40)  # samples on either side of a local cubic


def solve(A: Floats, y: Floats) -> Floats:
    """Least squares (k,) by scaled normal equations."""
    size = np.sqrt(np.mean(A**2, axis=0)) + 1e-300
    B = A / size
    out: Floats = np.linalg.lstsq(B.T @ B, B.T @ y, rcond=1e-13)[0] / size
    return out


@dataclass(frozen=True, eq=False)
class AxisTravel:
    """Encoder of one run as a local cubic: position mm, speed mm/s, acceleration mm/s2, each (n,); time (n,) s."""

    time: Floats
    position: Floats
    speed: Floats
    acceleration: Floats
    before: Floats = field(
        default_factory=lambda: np.zeros(0)
    )  # positions ahead of the first row: friction remembers them

    def of(self, rows: Bools) -> AxisTravel:
        """Some of the rows (n,)."""
        before = np.concatenate([self.before, self.position[: int(np.argmax(rows))]])
        return AxisTravel(self.time[rows], self.position[rows], self.speed[rows], self.acceleration[rows], before)

    def reversal(self, distance: float) -> Floats:
        """Direction of travel (n,), -1 to 1, which turns round over a distance, mm."""
        way = np.concatenate([self.before, self.position])
        return direction(way[:, None], distance)[len(self.before) :, 0]


def travel(time: Floats, position: Floats, wide: int = WIDE[0], late: float | None = None) -> AxisTravel:
    """Local cubics over 2 wide + 1 samples (Savitzky, Golay 1964) of positions (n,) at times (n,) s.

    late: time constant s with which the axis follows positions that are free of noise, or, below 0, by how much it is ahead of
    them: no cubics for the position then, for they turn round before and after a stop. Rows that are lost and clocks that tremble
    are led over: cubics want even steps.
    """
    dt = float(np.median(np.diff(time)))
    even = time[0] + dt * np.arange(max(round(float(time[-1] - time[0]) / dt) + 1, 2 * wide + 1))
    ahead = -min(late or 0.0, 0.0)
    values = Akima1DInterpolator(time, position)(np.minimum(even + ahead, time[-1]))
    if late and not ahead:
        begins = Seams(np.zeros(1, np.int64), np.full(1, np.inf), np.full((1, 1), (values[1] - values[0]) / dt))
        values = first_order(values[:, None], even, late, begins)[:, 0]
    parts = [savgol_filter(values, 2 * wide + 1, 3, deriv=k, delta=dt, mode="interp") for k in range(3)]
    if np.ptp(values) == 0.0:  # at rest, to the last digit
        parts = [values, np.zeros_like(values), np.zeros_like(values)]
    if late is not None:
        parts[0] = values
    return AxisTravel(time, *(np.interp(time, even, part) for part in parts))


@dataclass(frozen=True, kw_only=True)
class Ripple:
    """A line in the residual over position: period mm, amplitude (both directions), share of the residual's energy,
    number of periods tried.
    """

    period: float
    amplitude: float
    forward: float
    backward: float
    share: float
    tried: int


def ripple(
    at: list[AxisTravel], left: list[Floats], columns: Floats, shortest: float = 0.5, longest: float = 60.0
) -> Ripple | None:
    """The strongest line over position that is significant and equal in both directions of travel, else None.

    left (n,) per run: what columns (n, k) of all runs leave, which may have taken a part of the line. Periods are scanned
    evenly in frequency, finer than the travel resolves. A line in one direction alone does not count.
    """
    x = np.concatenate([t.position for t in at])
    y = np.concatenate(left)
    v = np.concatenate([t.speed for t in at])
    way = np.concatenate([np.concatenate([[0.0], np.abs(np.diff(t.position))]) for t in at])
    moving = np.abs(v) > 1.0
    ways = [v > 1.0, v < -1.0]
    if not moving.any():
        return None
    x, y, v, way = x[moving], y[moving] - y[moving].mean(), v[moving], way[moving]
    span = float(np.ptp(x)) if len(x) else 0.0
    if span < 4.0 * shortest:
        return None
    frequency = np.arange(1.0 / min(longest, span / 4.0), 1.0 / shortest, 0.1 / span)
    lines = []
    for each in ways:
        on = each[moving]
        if not way[on].any():
            return None
        middle = np.average(y[on], weights=way[on])
        lines.append(_lines(x[on], y[on] - middle, way[on] / way[on].sum(), frequency))
    both = np.abs(lines[0]) * np.abs(lines[1])
    best = int(np.argmax(both))
    strength = np.sqrt(both)
    far = np.abs(frequency - frequency[best]) > 2.0 / span
    if not far.any() or strength[best] < STANDS_OUT * strength[far].max():
        return None
    phase = 2.0 * np.pi * frequency[best] * np.concatenate([t.position for t in at])
    waves, every = np.stack([np.sin(phase), np.cos(phase)], axis=1), np.concatenate(left)
    (forward, backward), _ = _sizes(np.column_stack([waves * on[:, None] for on in ways]), columns, every)
    (amplitude,), rest = _sizes(waves, columns, every)
    share = 1.0 - float((rest[moving] ** 2).sum() / max(float((every[moving] ** 2).sum()), 1e-300))
    return Ripple(
        period=1.0 / frequency[best], amplitude=amplitude, forward=forward, backward=backward, share=share,
        tried=len(frequency),
    )  # fmt: skip


def _sizes(waves: Floats, columns: Floats, left: Floats) -> tuple[list[float], Floats]:
    """Amplitudes (m,) of pairs of waves (n, 2 m), fitted to residuals (n,) jointly with the columns (n, k) whose fit left these,
    and the new residuals (n,).
    """
    apart = left_of_fit(columns, waves)
    c = np.linalg.lstsq(apart, left, rcond=None)[0]
    return [float(each) for each in np.hypot(c[::2], c[1::2])], left - apart @ c


def _lines(x: Floats, y: Floats, weight: Floats, frequency: Floats) -> np.ndarray:
    """Weighted Fourier sums (f,) of y (n,) at places x (n,), frequencies evenly apart; weight (n,): the way of every row."""
    turn, further = np.exp(-2j * np.pi * frequency[0] * x), np.exp(-2j * np.pi * float(np.ptp(frequency[:2])) * x)
    out, own = np.empty(len(frequency), complex), weight * y
    for k in range(len(frequency)):
        out[k] = turn @ own
        turn = turn * further
    return out
