"""Why an axis follows its set-points late: lag, loops that swing over, and friction that turns round."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from camcomp.diagnosis.axis.block_least_squares import (
    Gain,
    Series,
    fit,
    gain,
    solve,
    telling,
    withheld,
)
from camcomp.diagnosis.axis.channels import (
    KNOWN,
    LEFT,
    Column,
    acceleration,
    close,
    constant,
    either_way,
    holds,
    probability_of,
    series_of,
    speed,
    table_of,
    turning,
    value_of,
)
from camcomp.diagnosis.axis.findings import ROWS, AxisChannel, AxisFindings, AxisRun
from camcomp.diagnosis.axis.gate import MINOR
from camcomp.diagnosis.axis.noise_floor import REPEATABILITY_MM, rows_floor
from camcomp.diagnosis.axis.swing import Swing, find_swing
from camcomp.diagnosis.axis.terms import (
    AxisTravel,
    Turning,
)
from camcomp.diagnosis.result.types import (
    FoundCause,
)
from camcomp.diagnosis.statistics.probability import EVEN
from camcomp.ground.datatypes import Floats

CRITICAL = 1.0  # damping of a loop from which on it does not swing over
SAME_TIME_CONSTANT = 0.02  # of a time constant: by which those of axes may differ and be one
EQUAL = 1.05  # of what a loop with inertia leaves: what one that swings over may leave to be the simpler answer


def follow(
    found: AxisFindings, runs: list[AxisRun], moves: list[AxisTravel], gaps: list[Floats], *, train: list[int], test: list[int],
    without: set[str],
) -> AxisFindings:  # fmt: skip
    """The findings of the axis with the channel of the following error and its causes; test: held-out runs.

    Inertia in the loop is a nuisance. An oscillating loop replaces it where it explains more, or where the residual
    exceeds the floor with inertia and stays within it with the loop.
    """
    floor = found.stated.encoder_mm or float(np.hypot(scatter_of([runs[k] for k in train]), REPEATABILITY_MM))
    swung = (
        None
        if "servo_overshoot" in without
        else _swung(runs, moves, gaps=gaps, train=train, floor=floor, without=without, late=found.carried.late or 0.0)
    )
    plain = _followed(found, runs, moves=moves, gaps=gaps, train=train, test=test, without=without, floor=floor)
    if swung is None or not (swung.better or _above(plain)):
        return plain
    swings = _followed(
        found, swung.runs, moves=swung.moves, gaps=swung.gaps, train=train, test=test, without=without, floor=floor,
        swung=swung,
    )  # fmt: skip
    return swings if swung.better or not _above(swings) else plain


def _above(found: AxisFindings) -> bool:
    channel = found.following
    return channel is not None and channel.gate is not None and channel.gate.word == "above"


def _followed(
    found: AxisFindings,
    runs: list[AxisRun],
    *,
    moves: list[AxisTravel],
    gaps: list[Floats],
    train: list[int],
    test: list[int],
    without: set[str],
    floor: float,
    swung: _Swung | None = None,
) -> AxisFindings:
    """The same, with a loop that swings over or without one."""
    found = replace(found, causes=[*found.causes], details={**found.details})
    data, table = series_of(moves, gaps, train), table_of(moves)
    columns: list[Column] = [constant, acceleration] if swung is None else [constant, swung.error]
    before, last = withheld(data, table(train, constant)), withheld(data, table(train, *columns))
    channel = AxisChannel(
        data=data, runs=train, first=before, last=last, floor=floor, stated=found.stated.encoder_mm is not None
    )
    channel.all_names = [r.name for r in runs]
    named = []
    if swung is not None:
        found.led = swung.swing.led
        found.causes.append(_overshoot(found.name, swung, before, last))
        named.append("servo_overshoot")
    lag = None if "servo_lag" in without else _lag(data, table, train, columns, floor)
    if lag is not None:
        columns, last = [*columns, *lag.columns], lag.last
        A = table(train, *columns)
        c, C = fit(data, A)
        spread = 1.96e3 * np.sqrt(np.diag(C))
        spread[columns.index(speed)] += 1e3 * KNOWN * abs(float(c[columns.index(speed)]))
        value = dict(zip(columns, (value_of(1e3 * each, s) for each, s in zip(c, spread, strict=True)), strict=True))
        found.causes.append(
            FoundCause(
                effect="servo_lag",
                target=found.name,
                probability=probability_of(lag.gain),
                share=round(1.0 - float(np.mean(last) / np.mean(before)), 4),
                parameters={"time_constant_ms": value[speed]},
            )
        )
        named.append("servo_lag")
        if either_way in columns:
            one_way, late = (
                float(np.sqrt(np.mean((c * A)[:, columns.index(each)] ** 2))) for each in (either_way, speed)
            )
            if one_way > min(max(KNOWN * late, MINOR * floor), floor):
                found.one_way = lag.lopsided
        i = columns.index(acceleration) if acceleration in columns else None
        found.details["following"] = {} if i is None else {"acceleration_us2": value_of(1e6 * c[i], 1e3 * spread[i])}
        if lag.turn in columns:
            found.details["following"] |= {"reversal_um": value[lag.turn], "presliding_mm": lag.length.distance}
    close(found, channel, effects=named, data=data, table=table, columns=columns, test=test, values=gaps, moves=moves)
    found.following = channel
    taken, beyond = float(np.mean(before) - np.mean(last)), float(np.mean(last)) - floor**2
    if _above(found):
        # anything takes a part of something unknown; what leaves much of it may be no more than that, nor does a loop
        # that creeps to where it is told swing over
        much, creeps = beyond > LEFT * (taken + beyond), swung is not None and swung.swing.damping > CRITICAL
        doubtful = [effect for effect in named if much or (creeps and effect == "servo_overshoot")]
        found.causes = [
            c.model_copy(update={"probability": min(c.probability, EVEN)}) if c.effect in doubtful else c
            for c in found.causes
        ]
    return found


@dataclass(frozen=True, eq=False, kw_only=True)
class _Lag:
    """A lag fitted jointly with other columns: its columns, its residual on withheld blocks, and its gain."""

    columns: list[Column]
    last: Floats
    gain: Gain
    turn: Column
    length: Turning
    lopsided: Gain | None = None  # of a lag that differs between the ways


def _lag(
    data: Series, table: Callable[..., Floats], train: list[int], base: Sequence[Column], floor: float
) -> _Lag | None:
    """Lag of an axis, fitted jointly with reversing friction; None where it is zero or negative."""
    length = turning(data, lambda d: table(train, speed, *reversed(base), lambda m: m.reversal(d)))

    def turn(m: AxisTravel) -> Floats:
        return m.reversal(length)

    A = table(train, speed, *base)
    late = solve(A, data.y)[0]
    if late <= 0.0 or float(np.sqrt(np.mean((late * A[:, 0]) ** 2))) < MINOR * floor:
        return None
    moving = telling(data, A, 0, MINOR * floor)
    blind = withheld(data, table(train, *base, turn))
    last = withheld(data, table(train, *base, speed, turn))
    g = gain(blind, last, moving)
    if holds(g):
        lopsided = withheld(data, table(train, *base, speed, turn, either_way))
        more = gain(last, lopsided, moving)
        if holds(more):
            return _Lag(
                columns=[speed, turn, either_way], last=lopsided, gain=g, turn=turn, length=length, lopsided=more
            )
        return _Lag(columns=[speed, turn], last=last, gain=g, turn=turn, length=length)
    # at one speed a lag and a reversal are nearly the same: what needs less is it
    last = withheld(data, table(train, *base, speed))
    g = gain(withheld(data, table(train, *base)), last, moving)
    return (
        _Lag(columns=[speed], last=last, gain=g, turn=turn, length=length)
        if holds(g) and np.mean(last) <= np.mean(blind)
        else None
    )


@dataclass(frozen=True, eq=False, kw_only=True)
class _Swung:
    """An oscillating loop, and the rows that determine it: runs without their first rows, where the loop is still
    settling.
    """

    swing: Swing
    spread: tuple[float, float]
    gain: Gain
    runs: list[AxisRun]
    moves: list[AxisTravel]
    gaps: list[Floats]
    errors: list[Floats]
    better: bool = False  # than inertia in the loop

    def error(self, m: AxisTravel) -> Floats:
        """Following error (n,) mm of the loop in a run."""
        return next(error for each, error in zip(self.moves, self.errors, strict=True) if each is m)


def _swung(
    runs: list[AxisRun],
    moves: list[AxisTravel],
    *,
    gaps: list[Floats],
    train: list[int],
    floor: float,
    without: set[str],
    late: float,
) -> _Swung | None:
    """A loop that swings over, where it explains more than none does, and whether more than inertia in the loop.

    Where the axis is late as well its inertia is what its loop has anyway.
    """
    if not all(np.isfinite(r.setpoint).all() for r in runs) or max(float(np.ptp(r.setpoint)) for r in runs) == 0.0:
        return None
    size = float(np.std(np.concatenate([gaps[k] for k in train])))
    # what set-points scatter by themselves is in their following errors, and any loop would explain it
    if size < MINOR * floor or rows_floor([runs[k].setpoint for k in train]) > MINOR * size:
        return None
    own = [runs[k] for k in train], [gaps[k] for k in train], [moves[k] for k in train]
    # what looks late on average may be the loop that swings over
    swing, spread, _ = min((find_swing(*own, each) for each in dict.fromkeys((0.0, late))), key=lambda found: found[2])
    rows = [swing.settled(r) for r in runs]
    if swing.at_bounds or min(int(on.sum()) for on in rows) < ROWS:
        return None
    errors = [swing.error(r)[on] for r, on in zip(runs, rows, strict=True)]
    found = _Swung(
        swing=swing, spread=spread, gain=Gain(0.0, 0.0, 0), runs=[r.of(on) for r, on in zip(runs, rows, strict=True)],
        moves=[m.of(on) for m, on in zip(moves, rows, strict=True)],
        gaps=[g[on] for g, on in zip(gaps, rows, strict=True)], errors=errors,
    )  # fmt: skip
    data, table = series_of(found.moves, found.gaps, train), table_of(found.moves)
    plain = withheld(data, table(train, constant, acceleration))
    lag = None if "servo_lag" in without else _lag(data, table, train, [constant, acceleration], floor)
    with_it = withheld(data, table(train, constant, found.error))
    beside = None if "servo_lag" in without else _lag(data, table, train, [constant, found.error], floor)
    last = with_it if beside is None else beside.last
    less = withheld(data, table(train, constant, *(beside.columns if beside else ())))
    shown = telling(data, table(train, found.error, constant), 0, MINOR * floor)
    g = gain(less, last, shown)
    large = float(np.std(np.concatenate([errors[k] for k in train]))) > MINOR * floor
    if not large or not holds(g):
        return None
    other = plain if lag is None else lag.last
    if lag is not None and beside is not None:
        better = holds(gain(other, last, shown))
    else:  # a loop that creeps to its set-point is inertia in the loop, which every axis has
        lowest_damping = swing.damping - 1.96 * spread[1]
        better = lowest_damping < CRITICAL and float(np.mean(last)) < EQUAL * float(np.mean(other))
    return replace(found, gain=g, better=better)


def _overshoot(name: str, swung: _Swung, before: Floats, last: Floats) -> FoundCause:
    period, damping = swung.swing.period, swung.swing.damping
    return FoundCause(
        effect="servo_overshoot",
        target=name,
        probability=probability_of(swung.gain),
        share=round(1.0 - float(np.mean(last) / np.mean(before)), 4),
        parameters={
            "period_ms": value_of(1e3 * period, 1e3 * (1.96 * swung.spread[0] + KNOWN * period)),
            "damping": value_of(damping, 1.96 * swung.spread[1] + KNOWN * damping),
        },
    )


def scatter_of(runs: Sequence[AxisRun]) -> float:
    """Deviation of one row of the following error; a resolution may show in the encoder or the set-points alone."""
    apart = np.hypot(rows_floor([r.encoder for r in runs]), rows_floor([r.setpoint for r in runs]))
    return max(rows_floor([r.setpoint - r.encoder for r in runs]), float(apart))


def share_lag(found: Sequence[AxisFindings]) -> None:
    """One lag where one common value serves for all axes that move (contract, section 5)."""
    moving = [
        a for a in found if a.following is not None and any(float(np.ptp(m.position)) > 0 for m in a.following.moves)
    ]
    lags = [(a, c) for a in moving for c in a.causes if c.effect == "servo_lag"]
    if len(lags) < 2 or len(lags) < len(moving):
        return
    each = [c.parameters["time_constant_ms"] for _, c in lags]
    value, half = np.array([e.value for e in each]), np.array([0.5 * (e.ci95[1] - e.ci95[0]) for e in each])
    weight = 1.0 / np.maximum(half, 1e-12) ** 2
    common = float(weight @ value / weight.sum())
    if np.any(np.abs(value - common) > np.maximum(half, SAME_TIME_CONSTANT * abs(common))):
        return
    together = FoundCause(
        effect="servo_lag",
        target=None,
        probability=min(c.probability for _, c in lags),
        share=float(sum(c.share for _, c in lags)),
        parameters={
            "time_constant_ms": value_of(
                common, max(KNOWN * abs(common), float(weight.sum() ** -0.5), float(np.std(value)))
            )
        },
    )
    for a, c in lags:
        a.causes.remove(c)
    lags[0][0].causes.append(together)
