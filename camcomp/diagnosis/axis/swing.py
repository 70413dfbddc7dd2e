"""A position loop that swings past its set-points: which second-order loop the following error of an axis shows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from camcomp.diagnosis.axis.block_least_squares import fit, series, solve
from camcomp.diagnosis.axis.findings import ROWS, AxisRun
from camcomp.diagnosis.axis.terms import AxisTravel
from camcomp.ground.datatypes import Bools, Floats
from camcomp.model.hysteresis import first_order, second_order

PERIODS_S = tuple(np.geomspace(0.004, 0.25, 16))
DAMPINGS = (0.1, 0.25, 0.5, 0.8, 1.5)
LEAST_S, MOST_S = 0.001, 0.6
LEAST_DAMPING, MOST_DAMPING = 0.02, 5.0
FINE = 16  # steps of a period, at least: between rows that are further apart the set-points go on smoothly
CLOCK = 0.02  # of the time between rows, that set-points and encoders may be apart
SETTLES = 4.0  # time constants after which nothing is left of how a loop was when its log began
STEP = 1e-3  # of a logarithm, for slopes


@dataclass(frozen=True)
class Swing:
    """A loop with velocity feed-forward: natural period s, damping, and late: time constant s of a lag in series with it.

    e'' + 2 d w e' + w^2 e = the set-point's acceleration, w = 2 pi / period (as the effect `servo_overshoot` has it).
    """

    period: float
    damping: float
    late: float = 0.0

    def error(self, run: AxisRun) -> Floats:
        """Set-point minus encoder (n,) mm of a run, without the contribution of a lag behind the loop."""
        return -self._swings(run, self.late)

    def led(self, run: AxisRun) -> Floats:
        """Output (n,) mm of the loop for the set-points of a run, without a lag."""
        return np.asarray(run.setpoint + self._swings(run, 0.0))

    def _swings(self, run: AxisRun, late: float) -> Floats:
        """Loop minus set-points (n,) mm at the rows of a run, behind a lag of `late` s."""
        seen, _ = run.asked
        per = max(int(np.ceil(FINE * float(np.median(np.diff(seen))) / self.period)), 1)
        time, way = run.asked_finely(per)
        swings = second_order(way[:, None], time, self.period, self.damping)
        swings = first_order(swings, time, late) if late > 0.0 else swings
        return np.asarray(swings[::per, 0][np.searchsorted(seen, run.time)])

    @property
    def at_bounds(self) -> bool:
        """Whether it would be further out if it were allowed to be: no loop, but what looks a little like one."""
        ends = [
            (self.period, LEAST_S),
            (self.period, MOST_S),
            (self.damping, LEAST_DAMPING),
            (self.damping, MOST_DAMPING),
        ]
        return any(abs(np.log(value / end)) < STEP for value, end in ends)

    def settled(self, run: AxisRun) -> Bools:
        """Rows (n,) after the loop's response to motion before the log has decayed."""
        w, d = 2.0 * np.pi / self.period, self.damping
        slowest = w * (d if d < 1.0 else d - np.sqrt(d * d - 1.0))
        return np.asarray(run.time > run.time[0] + SETTLES / slowest)


def find_swing(
    runs: Sequence[AxisRun], gaps: Sequence[Floats], moves: Sequence[AxisTravel], late: float = 0.0
) -> tuple[Swing, tuple[float, float], float]:
    """The loop that explains following errors (n,) mm best jointly with a constant and a lag, the deviations of its
    period and damping, and the mean square residual, mm2.

    Source of the deviations: robust against correlation within a stretch, as in `block_least_squares.fit`.
    """
    grid = [Swing(period, damping, late) for period in PERIODS_S for damping in DAMPINGS]
    every = [np.ones(len(run.time), bool) for run in runs]
    start = min(grid, key=lambda each: float(np.sum(_rest(each, runs, gaps, moves, every) ** 2)))
    rows = [start.settled(run) for run in runs]
    if min(on.sum() for on in rows) < ROWS:
        rows = every

    def rest(at: Floats) -> Floats:
        return _rest(Swing(float(np.exp(at[0])), float(np.exp(at[1])), late), runs, gaps, moves, rows)

    low, high = np.log([LEAST_S, LEAST_DAMPING]), np.log([MOST_S, MOST_DAMPING])
    begin = np.log([start.period, start.damping])
    best = least_squares(rest, begin, bounds=(low, high), diff_step=STEP, max_nfev=20).x
    slopes = np.stack([(rest(best + step) - rest(best - step)) / (2 * STEP) for step in STEP * np.eye(2)], axis=1)
    times = [run.time[on] for run, on in zip(runs, rows, strict=True)]
    data = series(times, np.split(rest(best), np.cumsum([len(t) for t in times])[:-1]))
    spread = np.sqrt(np.diag(fit(data, slopes)[1]))
    period, damping = (float(x) for x in np.exp(best))
    # of a row: when set-points and encoders were taken
    apart = CLOCK * max(float(np.median(np.diff(run.time))) for run in runs) * 2.0 * np.pi / period
    deviations = period * float(np.hypot(spread[0], apart)), float(np.hypot(damping * spread[1], apart))
    return Swing(period, damping, late), deviations, float(np.mean(rest(best) ** 2))


def _rest(
    swing: Swing, runs: Sequence[AxisRun], gaps: Sequence[Floats], moves: Sequence[AxisTravel], rows: Sequence[Bools]
) -> Floats:
    """Residual of some rows after a joint fit of a loop, a constant and a lag."""
    each = zip(runs, gaps, rows, strict=True)
    y = np.concatenate([(gap - swing.error(run))[on] for run, gap, on in each])
    beside = np.concatenate(
        [np.stack([np.ones(len(on)), m.speed], axis=1)[on] for m, on in zip(moves, rows, strict=True)]
    )
    return np.asarray(y - beside @ solve(beside, y))
