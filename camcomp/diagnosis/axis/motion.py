"""What moved an axis while a channel had its values: its encoders, or its set-points as late as they are followed."""

from __future__ import annotations

import numpy as np

from camcomp.diagnosis.axis.findings import ROWS, AxisFindings, AxisRun
from camcomp.diagnosis.axis.gate import WITHIN
from camcomp.diagnosis.axis.terms import (
    TURNS_MM_PER_S,
    WIDE,
    AxisTravel,
    solve,
    travel,
)
from camcomp.diagnosis.model.noise import REPEATABILITY_MM
from camcomp.ground.datatypes import Bools, Floats

LATEST_S = 0.5  # of a loop
ENCODER_BETTER = 0.8  # of what set-points leave of a channel: what encoders have to leave to be the motion
SAME_MISFIT = (
    1.01  # of what the best width leaves: the narrowest that leaves no more is it, for wide cubics round corners off
)
APART_S = 0.1  # between the rows that are compared: a push for a while shows at its begin and its end only
REWEIGHTED = 5  # times, for a fit by least absolute deviations


def encoder_width(runs: list[AxisRun], train: list[int], bodies: list[Floats] | None) -> int:
    """Half width of the local cubics: what a coarse or noisy encoder does to accelerations shows in the drive force.

    bodies (n, b) per run: columns of the bodies behind the axis in its drive force, None where they do not change it.
    """
    told = [k for k in train if np.isfinite(runs[k].force).all()]
    rows = [runs[k] for k in told]
    if not rows:
        return WIDE[0]
    wide = [w for w in WIDE if 2 * w + 1 < min(len(r.time) for r in rows) / 4]
    forces, behind = [r.force for r in rows], _beside(bodies, runs, told)
    least = [_misfit(rows, forces, [travel(r.time, r.encoder, w) for r in rows], behind) for w in wide]
    return WIDE[int(np.argmin([0.95 * least[0], *least[1:]]))] if least else WIDE[0]


def lateness(runs: list[AxisRun], gaps: list[Floats], train: list[int]) -> float:
    """How late (s) the axis follows its set-points, on average; below 0 where these are logged late, by half a row or more."""
    moves = [travel(runs[k].time, runs[k].setpoint) for k in train]
    A = np.concatenate([_usual(m)[runs[k].clear] for k, m in zip(train, moves, strict=True)])
    late = float(solve(A, np.concatenate([gaps[k][runs[k].clear] for k in train]))[2])
    row = max(float(np.median(np.diff(runs[k].time))) for k in train)
    return float(np.clip(late, 0.0 if late > -WITHIN * row else -LATEST_S, LATEST_S))


def motion_of(
    found: AxisFindings,
    runs: list[AxisRun],
    values: list[Floats],
    train: list[int],
    late: float | None,
    *,
    followed: list[Floats] | None = None,
    bodies: list[Floats] | None = None,
) -> tuple[list[AxisRun], list[AxisTravel], list[Floats]]:
    """What moved while a channel had its values (n,): set-points, as late as they are followed, where that explains them as well.

    followed: positions (n,) of the axis by the fit of its following error, in place of set-points. bodies (n, b) per run:
    columns of the bodies behind a joint; the force then tells the better motion, while the noise of an encoder is in its own
    following error, and would explain a part of itself. With the runs and their values, where somebody saw how fast the axis
    was, and, in runs of `train`, where it no longer matters how it moved before its log began.
    """
    encoders = [travel(r.time, r.encoder, found.wide) for r in runs]

    def kept(moves: list[AxisTravel], rows: list[Bools]) -> tuple[list[AxisRun], list[AxisTravel], list[Floats]]:
        every = zip(runs, moves, values, rows, strict=True)
        some = [(r, m, v, r.clear & on if (r.clear & on).sum() >= ROWS else r.clear) for r, m, v, on in every]
        return [r.of(on) for r, _, _, on in some], [m.of(on) for _, m, _, on in some], [v[on] for _, _, v, on in some]

    if late is None:
        return kept(encoders, [r.clear for r in runs])
    mine = [runs[k] for k in train]
    told = [values[k] for k in train]
    behind = _beside(bodies, runs, train)

    def misfit(moves: list[AxisTravel]) -> float:
        return _misfit(mine, told, [moves[k] for k in train], behind)

    def narrowest(paths: list[Floats], behind: float) -> list[AxisTravel]:
        ways = [[travel(r.time, x, wide, behind) for r, x in zip(runs, paths, strict=True)] for wide in (2, *WIDE)]
        left = [misfit(each) for each in ways]
        return next(each for each, own in zip(ways, left, strict=True) if own <= SAME_MISFIT * min(left))

    setpoints = narrowest([r.setpoint for r in runs], late)
    by_encoder = misfit(encoders) < (ENCODER_BETTER if bodies is None else 1.0) * misfit(setpoints)
    if followed is not None and not by_encoder:
        setpoints = narrowest(followed, 0.0)
    # time constants after which a late axis shows no more how it moved before its log began
    fades = [max(float(np.log(max(np.abs(r.gap).max(), 1e-300) / REPEATABILITY_MM)), 0.0) for r in runs]
    begun = [r.time >= r.time[0] + late * (fades[k] if k in train else 0.0) for k, r in enumerate(runs)]
    asked = [r.time <= r.time[-1] + min(late, 0.0) for r in runs]
    return kept(encoders if by_encoder else setpoints, [a & b for a, b in zip(begun, asked, strict=True)])


def _beside(bodies: list[Floats] | None, runs: list[AxisRun], which: list[int]) -> list[Floats]:
    """Columns (n, b) of bodies of some runs."""
    return [np.zeros((len(runs[k].time), 0)) if bodies is None else bodies[k] for k in which]


def _usual(m: AxisTravel) -> Floats:
    """Terms of every axis (n, 4): a constant, inertia, speed, and the sign of speed."""
    return np.stack([np.ones_like(m.time), 1e-3 * m.acceleration, m.speed, np.sign(m.speed)], axis=1)


def _misfit(runs: list[AxisRun], values: list[Floats], moves: list[AxisTravel], bodies: list[Floats]) -> float:
    """Mean absolute residual of a channel's changes after a fit of the changes of the usual terms, of friction that turns round
    with the speed, and of columns (n, b).

    Changes and absolute values keep a disturbance force from outweighing the corners of a motion.
    """
    changes = [
        _changes(
            r.time[r.clear],
            np.column_stack([_usual(m)[:, 1:], np.tanh(m.speed[:, None] / TURNS_MM_PER_S), b, y])[r.clear],
        )
        for r, m, y, b in zip(runs, moves, values, bodies, strict=True)
    ]
    rows = np.concatenate(changes)
    A, y = rows[:, :-1], rows[:, -1]
    left = y - A @ solve(A, y)
    for _ in range(REWEIGHTED):
        light = np.sqrt(1.0 / np.maximum(np.abs(left), 0.1 * float(np.median(np.abs(left))) + 1e-300))
        left = y - A @ solve(A * light[:, None], y * light)
    return float(np.mean(np.abs(left)))


def _changes(time: Floats, rows: Floats) -> Floats:
    """Rows (n, k) less those APART_S before them."""
    apart = min(max(round(APART_S / float(np.median(np.diff(time)))), 1), len(rows) - 1)
    return np.asarray(rows[apart:] - rows[:-apart])
