"""Which columns over its motion explain a channel of an axis, which terms help withheld blocks, and is the residual at
the floor?
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from camcomp.diagnosis.axis.block_least_squares import (
    LEAST_Z,
    Gain,
    Series,
    by_block,
    leftover,
    log10_chance,
    series,
    solved,
    withheld,
)
from camcomp.diagnosis.axis.findings import AxisChannel, AxisFindings
from camcomp.diagnosis.axis.gate import judge
from camcomp.diagnosis.axis.law import LEAST_SHARE
from camcomp.diagnosis.axis.noise_floor import REPEATABILITY_MM
from camcomp.diagnosis.axis.terms import (
    TURNINGS,
    AxisTravel,
    Turning,
    noise_gains,
)
from camcomp.diagnosis.result.types import (
    Estimate,
)
from camcomp.diagnosis.statistics.probability import probability_of_chance, stated
from camcomp.ground.datatypes import Floats

STANDS = 0.01  # of its longest way in a run: in one in which it goes less an axis stands
LEFT = 0.2  # of what was beyond the floor: more than that beside causes, and they may be a part of something else
WITHIN = 0.5  # rows: force and motion of one row are not known to be of one instant to better than that
MIN_DIFFERENCE_Z = 2.0  # the same, below which two ways of turning round are alike
KNOWN = 0.01  # of the constants of a loop, and of friction: no law of them is better than that


Column = Callable[[AxisTravel], Floats]


def constant(m: AxisTravel) -> Floats:
    """Ones (n,): what a channel has by itself."""
    return np.ones_like(m.time)


def acceleration(m: AxisTravel) -> Floats:
    """mm/s2 (n,): inertia in a loop."""
    return m.acceleration


def inertia(m: AxisTravel) -> Floats:
    """m/s2 (n,): N per kg of what is moved."""
    return 1e-3 * m.acceleration


def speed(m: AxisTravel) -> Floats:
    """mm/s (n,): a lag, or viscous friction."""
    return m.speed


def either_way(m: AxisTravel) -> Floats:
    """mm/s (n,) without its sign: friction that differs between the ways."""
    return np.abs(m.speed)


def series_of(moves: list[AxisTravel], values: list[Floats], train: list[int]) -> Series:
    """Values (n,) of some runs in blocks of time."""
    way = np.array([np.ptp(moves[k].position) for k in train])
    moved = int((way > STANDS * way.max(initial=0.0)).sum())
    return series([moves[k].time for k in train], [values[k] for k in train], moved)


def table_of(moves: list[AxisTravel]) -> Callable[..., Floats]:
    """Columns (n, k) of some runs."""

    def table(ks: Sequence[int], *columns: Column) -> Floats:
        return np.concatenate([np.stack([c(moves[k]) for c in columns], axis=1) for k in ks])

    return table


def turning(data: Series, table: Any) -> Turning:
    """Shape of friction at a reversal (distance or speed), by withheld blocks; a shape below the sampling gives a
    step.
    """
    return min(TURNINGS, key=lambda how: float(np.mean(np.log(np.maximum(withheld(data, table(how)), 1e-300)))))


def holds(g: Gain) -> bool:
    """Whether a term helps withheld blocks, surely and by more than little."""
    return g.z > LEAST_Z and g.log_ratio > LEAST_SHARE


def helps(g: Gain) -> bool:
    """Whether a term that a known effect may include helps: a small significant gain suffices."""
    return g.z > MIN_DIFFERENCE_Z and g.log_ratio > LEAST_SHARE


def probability_of(g: Gain) -> float:
    """That a term is at work, by the chance that withheld blocks gain as much from one that is not."""
    return stated(probability_of_chance(log10_chance(g)))


def value_of(value: float, spread: float) -> Estimate:
    """A value with its interval of plus and minus spread."""
    low, high = (float(f"{value + sign * spread:.6g}") for sign in (-1.0, 1.0))
    return Estimate(value=float(f"{value:.6g}"), ci95=(low, high))


def close(
    found: AxisFindings,
    channel: AxisChannel,
    *,
    effects: Sequence[str],
    data: Series,
    table: Any,
    columns: list[Any],
    test: list[int],
    values: list[Floats],
    moves: list[AxisTravel],
    unsure: Mapping[int, Floats] | None = None,
) -> None:
    """Compute the residuals of the channel and judge them against the floor, on held-out runs where there are any, else
    on withheld blocks.

    unsure: uncertainty of rows (n,) by run number, in addition to that of inertia and friction.
    """
    A = table(channel.runs, *columns)
    c = solved(data, A)
    channel.columns, channel.moves = A, [moves[k] for k in channel.runs]
    if not channel.stated:
        channel.floor = float(
            np.hypot(channel.floor, _carried(found, channel, moves, dict(zip(columns, c, strict=True))))
        )
    channel.left = [np.array(values[k] - table([k], *columns) @ c, dtype=np.float64) for k in channel.runs]
    channel.last = by_block(data, leftover(data, A))
    ends = np.cumsum([len(moves[k].time) for k in channel.runs])[:-1]
    if test:
        base = solved(data, table(channel.runs, *columns[:1]))
        seen = series([moves[k].time for k in test], [values[k] for k in test])
        squares = [(seen.y - table(test, *cols) @ w) ** 2 for cols, w in ((columns[:1], base), (columns, c))]
        channel.first, channel.last = (
            np.array([s[seen.block == b].mean() for b in range(len(seen.others))]) for s in squares
        )
        channel.held = {k: values[k] - table([k], *columns) @ c for k in test}
        channel.held_whole = {k: values[k] - table([k], *columns[:1]) @ base for k in test}
        channel.held_times = {k: moves[k].time for k in test}
    # runs that are held out show what the others foretell; what those cannot explain of themselves is there as well
    every, held = [*channel.runs, *test], list(channel.held.values())
    inside, left = [*channel.left, *held], [*np.split(leftover(data, A), ends), *held]
    channel.names = [channel.all_names[k] for k in every]
    if inertia in columns:
        inside, left = (
            _beside_law(rows, every, floor=channel.floor, table=table, columns=columns, c=c, unsure=unsure or {})
            for rows in (inside, left)
        )
    offset = 0.0 if inertia in columns else 2.0 * REPEATABILITY_MM
    channel.gate = judge(inside, left, [moves[k].time for k in every], channel.floor, offset)
    found.unknown_chance = min(found.unknown_chance, channel.gate.chance)
    channel.steps += [(effect, float(np.sqrt(np.mean(channel.last)))) for effect in effects]


def not_known(own: Floats) -> Floats:
    """Uncertainty (n,) N of a force (n,) N by inertia and friction: its size, and the instant within a row."""
    return np.asarray(np.hypot(KNOWN * own, within_a_row(own)))


def within_a_row(own: Floats) -> Floats:
    """Uncertainty (n,) of values (n,) by the unknown instant within a row, at a peak of one row as well."""
    steps = np.abs(np.diff(own))
    return np.asarray(WITHIN * np.maximum(np.append(steps, 0.0), np.insert(steps, 0, 0.0)))


def _beside_law(
    rows: Sequence[Floats],
    runs: Sequence[int],
    *,
    floor: float,
    table: Any,
    columns: list[Any],
    c: Floats,
    unsure: Mapping[int, Floats],
) -> list[Floats]:
    """Residuals (n,) by run, scaled down by the uncertainty of the law of inertia and friction."""
    out = []
    for left, k in zip(rows, runs, strict=True):
        law = np.hypot(unsure.get(k, np.zeros(1)), not_known(table([k], *columns[1:]) @ c[1:]))
        out.append(left * floor / np.hypot(floor, law))
    return out


def _carried(found: AxisFindings, channel: AxisChannel, moves: list[AxisTravel], c: Mapping[Column, float]) -> float:
    """Noise of a channel by the position noise of its motion, resolution included, through speed and acceleration."""
    noise, wide, late = [found.carried.noise[k] for k in channel.runs], found.carried.wide, found.carried.late
    gains = [noise_gains(float(np.median(np.diff(moves[k].time))), wide, late) for k in channel.runs]
    push = c.get(acceleration, 0.0) + 1e-3 * c.get(inertia, 0.0)
    each = [n * np.hypot(push * g[1], c.get(speed, 0.0) * g[0]) for n, g in zip(noise, gains, strict=True)]
    return float(np.sqrt(np.mean(np.square(each))))
