"""What moved an axis while a channel had its values: its encoders, or its set-points as late as they are followed."""

from __future__ import annotations

import numpy as np

from camcomp.diagnosis.axis.block_least_squares import (
    leftover,
    series,
    solve,
)
from camcomp.diagnosis.axis.findings import ROWS, AxisFindings, AxisRun, Carried
from camcomp.diagnosis.axis.noise_floor import rows_floor
from camcomp.diagnosis.axis.terms import (
    SETTLED,
    WIDE,
    AxisTravel,
    travel,
)
from camcomp.ground.datatypes import Floats

LATEST_S = 0.1  # of a loop
ENCODER_BETTER = 0.8  # of what set-points leave of a channel: what encoders have to leave to be the motion
SETPOINT_WIDE = (2, *WIDE)  # samples on either side of a local cubic through set-points


def encoder_width(runs: list[AxisRun], train: list[int]) -> int:
    """Half width of the local cubics: what a coarse or noisy encoder does to accelerations shows in the drive force."""
    rows = [r for k, r in enumerate(runs) if k in train and np.isfinite(r.force).all()]
    if not rows:
        return WIDE[0]
    wide = [w for w in WIDE if 2 * w + 1 < min(len(r.time) for r in rows) / 4]
    forces = [r.force for r in rows]
    least = [_misfit(rows, forces, [travel(r.time, r.encoder, w) for r in rows]) for w in wide]
    return WIDE[int(np.argmin([0.95 * least[0], *least[1:]]))] if least else WIDE[0]


def lateness(runs: list[AxisRun], gaps: list[Floats], train: list[int]) -> float:
    """How late (s) the axis follows its set-points, on average."""
    moves = [travel(runs[k].time, runs[k].setpoint) for k in train]
    A = np.concatenate([_usual(m) for m in moves])
    return float(np.clip(solve(A, np.concatenate([gaps[k] for k in train]))[2], 0.0, LATEST_S))


def motion_of(
    found: AxisFindings, runs: list[AxisRun], values: list[Floats], train: list[int], late: float | None
) -> tuple[list[AxisRun], list[AxisTravel], list[Floats]]:
    """What moved while a channel had its values (n,): set-points, as late as they are followed, where that explains them as well.

    The noise of an encoder is in its following error, too, and would explain a part of itself. With the runs and their values,
    from where on it no longer matters how the axis moved before its log began.
    """
    encoders = [travel(r.time, r.encoder, found.wide) for r in runs]
    if late is None:
        found.carried = Carried([rows_floor([r.encoder]) for r in runs], found.wide)
        return runs, encoders, values
    mine = [runs[k] for k in train]
    told = [values[k] for k in train]

    def misfit(moves: list[AxisTravel]) -> float:
        return _misfit(mine, told, [moves[k] for k in train])

    ways = {wide: [travel(r.time, r.setpoint, wide, late) for r in runs] for wide in SETPOINT_WIDE}
    wide = min(ways, key=lambda each: misfit(ways[each]))
    setpoints = ways[wide]
    if misfit(encoders) < ENCODER_BETTER * misfit(setpoints):
        found.carried = Carried([rows_floor([r.encoder]) for r in runs], found.wide)
        return runs, encoders, values
    found.carried = Carried([rows_floor([r.setpoint]) for r in runs], wide, late)
    rows = [r.time >= r.time[0] + SETTLED * late for r in runs]
    every = zip(runs, setpoints, values, rows, strict=True)
    kept = [(r.of(on), m.of(on), v[on]) if on.sum() >= ROWS else (r, m, v) for r, m, v, on in every]
    return [r for r, _, _ in kept], [m for _, m, _ in kept], [v for _, _, v in kept]


def _usual(m: AxisTravel) -> Floats:
    """What every axis has (n, 4): a constant, inertia, and something with the speed and its sense."""
    return np.stack([np.ones_like(m.time), 1e-3 * m.acceleration, m.speed, np.sign(m.speed)], axis=1)


def _misfit(runs: list[AxisRun], values: list[Floats], moves: list[AxisTravel]) -> float:
    """Median of what is left (of all rows) of a channel when what every axis has is fitted to a motion.

    About their middle: a push for a while shifts all that it is not there for.
    """
    data = series([r.time for r in runs], values)
    left = leftover(data, np.concatenate([_usual(m) for m in moves]))
    left = left - np.median(left)
    return float(np.median(np.abs(left)))
