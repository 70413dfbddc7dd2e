"""Why single axes follow their set-points late and push harder than they should: logs of the control, without any tip.

Following error = lag x speed + (inertia in the loop) x acceleration + friction's reversal + constant.
Drive force     = mass x acceleration + friction + constant + what nobody states.
Inertia and constants belong to every axis and are no causes. Every further term has to prove itself on stretches of time
that it was not fitted on, and what is left there is held against the floor: stated, or the scatter from row to row.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.stats import t as student

from camcomp.diagnosis.axis import answer
from camcomp.diagnosis.axis.block_least_squares import (
    Gain,
    Series,
    fit,
    gain,
    leftover,
    log10_chance,
    series,
    solve,
    telling,
    withheld,
)
from camcomp.diagnosis.axis.findings import ROWS, AxisChannel, AxisDeviation, AxisFindings, AxisRun, Carried
from camcomp.diagnosis.axis.gate import MINOR, dependences, judge
from camcomp.diagnosis.axis.law import LEAST_SHARE, axis_law
from camcomp.diagnosis.axis.next_moves import next_moves
from camcomp.diagnosis.axis.noise_floor import REPEATABILITY_MM, rows_floor
from camcomp.diagnosis.axis.push import QUARTERS, Window, find_window, seen_elsewhere
from camcomp.diagnosis.axis.swing import Swing, find_swing
from camcomp.diagnosis.axis.terms import (
    PRESLIDING_GRID_MM,
    SETTLED,
    TURNINGS,
    WIDE,
    AxisTravel,
    Turning,
    noise_gains,
    ripple,
    strangers,
    travel,
)
from camcomp.diagnosis.result.standards import StandardValues
from camcomp.diagnosis.result.types import (
    UNKNOWN,
    DiagnosisResult,
    Estimate,
    Floor,
    FoundCause,
    NamedCause,
    Outlier,
)
from camcomp.diagnosis.statistics.probability import probability_of_chance, stated
from camcomp.ground import headway
from camcomp.ground.datatypes import Floats

LEAST_Z = 4.0  # mean gain over its standard error
LEAST_RIPPLE = 0.02  # share of the leftover's energy
NO_TIPS = "ISO 230-2: the tip was not measured"
LATEST_S = 0.1  # of a loop
ENCODER_BETTER = 0.8  # of what set-points leave of a channel: what encoders have to leave to be the motion
SETPOINT_WIDE = (2, *WIDE)  # samples on either side of a local cubic through set-points
PASSES = 2  # of the fit of a push and of all else
MOST_PUSHES = 2  # of an axis: what comes more often is no mishap
KNOWN = 0.01  # of a loop's constants: no law of a loop is better than that
ALIKE = 0.02  # of a time constant: by which those of axes may differ and be one
EQUAL = 1.05  # of what a loop with inertia leaves: what one that swings over may leave to be the simpler answer
WHOLE_RUNS = 4  # from which on runs are withheld as wholes


def study(
    axes: Mapping[str, Sequence[AxisRun]],
    *,
    holdout: Sequence[str] = (),
    without: Sequence[str] = (),
    stated: AxisDeviation | None = None,
) -> DiagnosisResult:
    """Result for logs of axes by name. holdout: runs that are judged and never fitted.

    Raises ValueError where no run of any axis has enough rows.
    """
    return studied(axes, holdout=holdout, without=without, stated=stated)[0]


def studied(
    axes: Mapping[str, Sequence[AxisRun]],
    *,
    holdout: Sequence[str] = (),
    without: Sequence[str] = (),
    stated: AxisDeviation | None = None,
) -> tuple[DiagnosisResult, list[AxisFindings]]:
    """As study, with what the result was drawn from."""
    outliers: set[tuple[str, int]] = set()
    found, cleaned = [], {}
    names = sorted({r.name for runs in axes.values() for r in runs})
    held = [n for n in names if n in holdout] if holdout else names if len(names) >= WHOLE_RUNS else []
    again = 0 if len(held) == 1 and holdout else len(held)  # fits that leave out one run each
    for name, runs in headway.steps(axes.items(), len(axes) * (1 + again)):
        clean = [r.without_spikes() for r in runs]
        outliers |= {(r.name, int(row)) for r, rows in clean for row in rows}
        cleaned[name] = [r.away_from_gaps() for r, _ in clean]
        found.append(_axis(name, cleaned[name], set(holdout), set(without), stated or AxisDeviation()))
    found = [a for a in found if a.channels]
    if not found:
        raise ValueError(
            "no axis has a run with set-points and encoders, or encoders and drive forces, in 50 rows or more"
        )
    _share_lag(found)
    main = [a.channels[0] for a in found]
    whole = sum(len(a.channels) for a in found)  # every channel weighs alike
    causes = [c.model_copy(update={"share": round(c.share / whole, 4)}) for a in found for c in a.causes]
    causes.sort(key=lambda c: (-c.probability, -c.share))
    known = tuple(NamedCause(effect=c.effect, target=c.target) for c in causes)
    verdict = _verdict(found)
    if verdict == "unknown" or (verdict == "ambiguous" and not causes):
        causes += [answer.unknown(a, whole) for a in found if a.strange or verdict == "ambiguous"]
    gap = answer.gap(main)
    with headway.part(1.0 / (1 + again), 1.0):
        judged = _judged(cleaned, held, set(without), stated or AxisDeviation()) if again else [main] if held else []
    every = [c for a in found for c in a.channels]
    result = DiagnosisResult(
        verdict=verdict,
        gap=gap,
        where=answer.where(found, causes),
        causes=tuple(causes),
        alternatives=(known, (*known, NamedCause(effect=UNKNOWN, target=None))) if verdict == "ambiguous" else (),
        shrinkage=answer.shrinkage(judged, held) if judged else None,
        next_experiment=next_moves(found, cleaned, verdict),
        floor=Floor(um=gap.noise_floor_um, source="stated" if all(c.stated for c in every) else "rows"),
        outliers=tuple(Outlier(run=run, row=row) for run, row in sorted(outliers)),
        axes_in_detail={a.name: a.details for a in found},
        standards=StandardValues(absent=(NO_TIPS,)),
    )
    return result, found


def _share_lag(found: Sequence[AxisFindings]) -> None:
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
    if np.any(np.abs(value - common) > np.maximum(half, ALIKE * abs(common))):
        return
    together = FoundCause(
        effect="servo_lag",
        target=None,
        probability=min(c.probability for _, c in lags),
        share=float(sum(c.share for _, c in lags)),
        parameters={
            "time_constant_ms": _value(
                common, max(KNOWN * abs(common), float(weight.sum() ** -0.5), float(np.std(value)))
            )
        },
    )
    for a, c in lags:
        a.causes.remove(c)
    lags[0][0].causes.append(together)


def _verdict(found: Sequence[AxisFindings]) -> Any:
    """The word; where the rows are too few to show that nothing is left, nothing is said to be identified."""
    if any(a.strange for a in found):
        return "unknown"
    if any(c.gate is None or c.gate.word != "at" for a in found for c in a.channels):
        return "ambiguous"
    return "identified" if any(a.causes for a in found) else "none"


def _axis(name: str, runs: list[AxisRun], holdout: set[str], without: set[str], stated: AxisDeviation) -> AxisFindings:
    found = AxisFindings(name, stated=stated)
    usable = [r for r in runs if np.isfinite(r.encoder).sum() >= ROWS]
    if not usable:
        return found
    train = [k for k, r in enumerate(usable) if r.name not in holdout]
    test = [k for k, r in enumerate(usable) if r.name in holdout]
    gaps = [r.setpoint - r.encoder for r in usable]
    found.wide = _width(usable, train)
    late = None
    if train and all(np.isfinite(gaps[k]).all() for k in train):
        late = _lateness(usable, gaps, train)
        _following(found, *_motion(found, usable, gaps, train, late), train, test, without)
    if train and all(np.isfinite(usable[k].force).all() for k in train):
        runs, moves, _ = _motion(found, usable, [r.force for r in usable], train, late)
        found = _force(found, runs, moves, train, test, without)
    _name_rest(found)
    if found.strange:
        follows = found.following
        asked = [(usable[k], m) for k, m in zip(follows.runs, follows.moves, strict=True)] if follows else []
        told = [travel(r.time, r.setpoint, found.wide).of(np.isin(r.time, m.time)) for r, m in asked]
        found.law = axis_law(name, found.force, found.following, told)
    return found


def _width(runs: list[AxisRun], train: list[int]) -> int:
    """Half width of the local cubics: what a coarse or noisy encoder does to accelerations shows in the drive force."""
    rows = [r for k, r in enumerate(runs) if k in train and np.isfinite(r.force).all()]
    if not rows:
        return WIDE[0]
    wide = [w for w in WIDE if 2 * w + 1 < min(len(r.time) for r in rows) / 4]
    forces = [r.force for r in rows]
    least = [_misfit(rows, forces, [travel(r.time, r.encoder, w) for r in rows]) for w in wide]
    return WIDE[int(np.argmin([0.95 * least[0], *least[1:]]))] if least else WIDE[0]


def _lateness(runs: list[AxisRun], gaps: list[Floats], train: list[int]) -> float:
    """How late (s) the axis follows its set-points, on average."""
    moves = [travel(runs[k].time, runs[k].setpoint) for k in train]
    A = np.concatenate([_usual(m) for m in moves])
    return float(np.clip(solve(A, np.concatenate([gaps[k] for k in train]))[2], 0.0, LATEST_S))


def _motion(
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


def _judged(
    axes: Mapping[str, Sequence[AxisRun]], held: Sequence[str], without: set[str], stated: AxisDeviation
) -> list[list[AxisChannel]]:
    """Main channels of every axis with each of the runs held out in turn: chosen and fitted without it."""
    every = [
        [_axis(name, list(runs), {one}, without, stated) for name, runs in headway.steps(axes.items(), len(axes))]
        for one in headway.steps(held, len(held))
    ]
    return [[a.channels[0] for a in found if a.channels] for found in every]


# -- following error --------------------------------------------------------------------------------------------------


def _following(
    found: AxisFindings, runs: list[AxisRun], moves: list[AxisTravel], gaps: list[Floats], train: list[int], test: list[int],
    without: set[str],
) -> None:  # fmt: skip
    floor = found.stated.encoder_mm or float(np.hypot(_scatter([runs[k] for k in train]), REPEATABILITY_MM))
    swung = (
        None
        if "servo_overshoot" in without
        else _swung(runs, moves, gaps, train, floor, without, found.carried.late or 0.0)
    )
    if swung is not None:
        runs, moves, gaps = swung.runs, swung.moves, swung.gaps
    data, table = _series(moves, gaps, train), _table(moves)
    columns: list[Column] = [_one, _push] if swung is None else [_one, swung.error]
    before, last = withheld(data, table(train, _one)), withheld(data, table(train, *columns))
    channel = AxisChannel(data, train, before, last, floor=floor, stated=found.stated.encoder_mm is not None)
    channel.all_names = [r.name for r in runs]
    named = []
    if swung is not None:
        found.causes.append(_overshoot(found.name, swung, before, last))
        named.append("servo_overshoot")
    lag = None if "servo_lag" in without else _lag(data, table, train, columns, floor)
    if lag is not None:
        columns, last = [*columns, *lag.columns], lag.last
        c, C = fit(data, table(train, *columns))
        spread = 1.96e3 * np.sqrt(np.diag(C))
        spread[columns.index(_speed)] += 1e3 * KNOWN * abs(float(c[columns.index(_speed)]))
        value = dict(zip(columns, (_value(1e3 * each, s) for each, s in zip(c, spread, strict=True)), strict=True))
        found.causes.append(
            FoundCause(
                effect="servo_lag",
                target=found.name,
                probability=_probability(lag.gain),
                share=round(1.0 - float(np.mean(last) / np.mean(before)), 4),
                parameters={"time_constant_ms": value[_speed]},
            )
        )
        named.append("servo_lag")
        i = columns.index(_push) if _push in columns else None
        found.details["following"] = {} if i is None else {"acceleration_us2": _value(1e6 * c[i], 1e3 * spread[i])}
        if lag.turn in columns:
            found.details["following"] |= {"reversal_um": value[lag.turn], "presliding_mm": lag.length.distance}
    _close(found, channel, named, last, data, table, columns, test, gaps, moves)
    found.following = channel


Column = Callable[[AxisTravel], Floats]


def _one(m: AxisTravel) -> Floats:
    return np.ones_like(m.time)


def _push(m: AxisTravel) -> Floats:
    return m.acceleration


def _inertia(m: AxisTravel) -> Floats:
    return 1e-3 * m.acceleration


def _speed(m: AxisTravel) -> Floats:
    return m.speed


def _either_way(m: AxisTravel) -> Floats:
    return np.abs(m.speed)


def _series(moves: list[AxisTravel], values: list[Floats], train: list[int]) -> Series:
    return series([moves[k].time for k in train], [values[k] for k in train])


def _table(moves: list[AxisTravel]) -> Callable[..., Floats]:
    """Columns (n, k) of some runs."""

    def table(ks: Sequence[int], *columns: Column) -> Floats:
        return np.concatenate([np.stack([c(moves[k]) for c in columns], axis=1) for k in ks])

    return table


@dataclass(frozen=True, eq=False)
class _Lag:
    """A lag beside other columns: its own columns, what they leave of withheld blocks, and what that gains."""

    columns: list[Column]
    last: Floats
    gain: Gain
    turn: Column
    length: Turning


def _lag(
    data: Series, table: Callable[..., Floats], train: list[int], base: Sequence[Column], floor: float
) -> _Lag | None:
    """Whether an axis is late, beside friction that turns round; None where it is not."""
    length = _presliding(data, lambda d: table(train, _speed, *reversed(base), lambda m: m.reversal(d)))

    def turn(m: AxisTravel) -> Floats:
        return m.reversal(length)

    moving = telling(data, table(train, _speed, *base), 0, MINOR * floor)
    blind = withheld(data, table(train, *base, turn))
    last = withheld(data, table(train, *base, _speed, turn))
    g = gain(blind, last, moving)
    if _holds(g):
        lopsided = withheld(data, table(train, *base, _speed, turn, _either_way))
        if _holds(gain(last, lopsided, moving)):  # friction that differs between the ways
            return _Lag([_speed, turn, _either_way], lopsided, g, turn, length)
        return _Lag([_speed, turn], last, g, turn, length)
    # at one speed a lag and a reversal are nearly the same: what needs less is it
    last = withheld(data, table(train, *base, _speed))
    g = gain(withheld(data, table(train, *base)), last, moving)
    return _Lag([_speed], last, g, turn, length) if _holds(g) and np.mean(last) <= np.mean(blind) else None


@dataclass(frozen=True, eq=False)
class _Swung:
    """A loop that swings over, and the rows that tell of it: runs without how their loops were before the log began."""

    swing: Swing
    spread: tuple[float, float]
    gain: Gain
    runs: list[AxisRun]
    moves: list[AxisTravel]
    gaps: list[Floats]
    errors: list[Floats]

    def error(self, m: AxisTravel) -> Floats:
        """What the loop makes of the set-points of a run."""
        return next(error for each, error in zip(self.moves, self.errors, strict=True) if each is m)


def _swung(
    runs: list[AxisRun],
    moves: list[AxisTravel],
    gaps: list[Floats],
    train: list[int],
    floor: float,
    without: set[str],
    late: float,
) -> _Swung | None:
    """A loop that swings over, where it explains more than inertia in the loop does; None where it does not.

    Where the axis is late as well its inertia is what its loop has anyway.
    """
    if not all(np.isfinite(r.setpoint).all() for r in runs) or max(float(np.ptp(r.setpoint)) for r in runs) == 0.0:
        return None
    if float(np.std(np.concatenate([gaps[k] for k in train]))) < MINOR * floor:
        return None
    swing, spread = find_swing([runs[k] for k in train], [gaps[k] for k in train], [moves[k] for k in train], late)
    rows = [swing.settled(r) for r in runs]
    if min(int(on.sum()) for on in rows) < ROWS:
        return None
    errors = [swing.error(r)[on] for r, on in zip(runs, rows, strict=True)]
    found = _Swung(
        swing,
        spread,
        Gain(0.0, 0.0, 0),
        [r.of(on) for r, on in zip(runs, rows, strict=True)],
        [m.of(on) for m, on in zip(moves, rows, strict=True)],
        [g[on] for g, on in zip(gaps, rows, strict=True)],
        errors,
    )
    data, table = _series(found.moves, found.gaps, train), _table(found.moves)
    plain = withheld(data, table(train, _one, _push))
    lag = None if "servo_lag" in without else _lag(data, table, train, [_one, _push], floor)
    with_it = withheld(data, table(train, _one, found.error))
    beside = None if "servo_lag" in without else _lag(data, table, train, [_one, found.error], floor)
    last = with_it if beside is None else beside.last
    less = withheld(data, table(train, _one, *(beside.columns if beside else ())))
    shown = telling(data, table(train, found.error, _one), 0, MINOR * floor)
    g = gain(less, last, shown)
    large = float(np.std(np.concatenate([errors[k] for k in train]))) > MINOR * floor
    if not large or not _holds(g):
        return None
    other = plain if lag is None else lag.last
    if lag is not None and beside is not None:
        better = _holds(gain(other, last, shown))
    else:
        better = float(np.mean(last)) < EQUAL * float(np.mean(other))
    return replace(found, gain=g) if better else None


def _overshoot(name: str, swung: _Swung, before: Floats, last: Floats) -> FoundCause:
    period, damping = swung.swing.period, swung.swing.damping
    return FoundCause(
        effect="servo_overshoot",
        target=name,
        probability=_probability(swung.gain),
        share=round(1.0 - float(np.mean(last) / np.mean(before)), 4),
        parameters={
            "period_ms": _value(1e3 * period, 1e3 * (1.96 * swung.spread[0] + KNOWN * period)),
            "damping": _value(damping, 1.96 * swung.spread[1] + KNOWN * damping),
        },
    )


def _scatter(runs: Sequence[AxisRun]) -> float:
    """Deviation of one row of the following error; a resolution may show in the encoder or the set-points alone."""
    apart = np.hypot(rows_floor([r.encoder for r in runs]), rows_floor([r.setpoint for r in runs]))
    return max(rows_floor([r.setpoint - r.encoder for r in runs]), float(apart))


def _close(
    found: AxisFindings, channel: AxisChannel, effects: Sequence[str], last: Floats, data: Series, table: Any, columns: list[Any],
    test: list[int], values: list[Floats], moves: list[AxisTravel],
) -> None:  # fmt: skip
    """Leftovers of the channel; where runs are held out, what is left there takes the place of withheld blocks."""
    A = table(channel.runs, *columns)
    c = solve(A, data.y)
    channel.columns, channel.moves = A, [moves[k] for k in channel.runs]
    if not channel.stated:
        channel.floor = float(
            np.hypot(channel.floor, _carried(found, channel, moves, dict(zip(columns, c, strict=True))))
        )
    channel.left = [np.array(values[k] - table([k], *columns) @ c, dtype=np.float64) for k in channel.runs]
    channel.last = last
    ends = np.cumsum([len(moves[k].time) for k in channel.runs])[:-1]
    left, times = np.split(leftover(data, A), ends), [moves[k].time for k in channel.runs]
    channel.names = [channel.all_names[k] for k in channel.runs]
    if test:
        base = solve(table(channel.runs, *columns[:1]), data.y)
        seen = series([moves[k].time for k in test], [values[k] for k in test])
        squares = [(seen.y - table(test, *cols) @ w) ** 2 for cols, w in ((columns[:1], base), (columns, c))]
        channel.first, channel.last = (
            np.array([s[seen.block == b].mean() for b in range(len(seen.others))]) for s in squares
        )
        left, times = [values[k] - table([k], *columns) @ c for k in test], [moves[k].time for k in test]
        channel.names = [channel.all_names[k] for k in test]
    channel.gate = judge(
        channel.left, left, times, channel.floor, 0.0 if _inertia in columns else 2.0 * REPEATABILITY_MM
    )
    found.unknown_chance = min(found.unknown_chance, channel.gate.chance)
    channel.steps += [(effect, float(np.sqrt(np.mean(channel.last)))) for effect in effects]


def _carried(found: AxisFindings, channel: AxisChannel, moves: list[AxisTravel], c: Mapping[Column, float]) -> float:
    """What the noise of what is taken for the motion, resolution included, does to a channel by way of speed and acceleration."""
    noise, wide, late = [found.carried.noise[k] for k in channel.runs], found.carried.wide, found.carried.late
    gains = [noise_gains(float(np.median(np.diff(moves[k].time))), wide, late) for k in channel.runs]
    push = c.get(_push, 0.0) + 1e-3 * c.get(_inertia, 0.0)
    each = [n * np.hypot(push * g[1], c.get(_speed, 0.0) * g[0]) for n, g in zip(noise, gains, strict=True)]
    return float(np.sqrt(np.mean(np.square(each))))


def _name_rest(found: AxisFindings) -> None:
    """What leftovers above the floor depend on, where nothing else says so."""
    if found.unknown_in or found.ripple:
        return
    for channel in found.channels:
        if channel.gate is not None and channel.gate.word == "above":
            for kind, share, chance in dependences(channel.data, channel.columns, channel.moves):
                found.unknown_in.append((f"{kind}:{found.name}", share))
                found.unknown_chance = min(found.unknown_chance, chance)


# -- drive force ------------------------------------------------------------------------------------------------------


def _force(
    found: AxisFindings,
    runs: list[AxisRun],
    moves: list[AxisTravel],
    train: list[int],
    test: list[int],
    without: set[str],
) -> AxisFindings:
    """What was found on the axis, with its drive force; what pushed it for a while goes first where nothing is left then.

    Other stretches tell nothing of a push: the rows that it lasts for have to follow it, and nothing may be left beside it.
    """
    rows = [r.moved() for r in runs]
    runs = [r.of(on) for r, on in zip(runs, rows, strict=True)]
    moves = [m.of(on) for m, on in zip(moves, rows, strict=True)]
    forces, pushes = [r.force for r in runs], list[Window]()
    plain, raw = _forced(found, runs, moves, forces, train, test, without), _series(moves, forces, train)
    now = plain
    for _ in range(0 if "disturbance" in without else MOST_PUSHES + 1):
        channel = now.force
        assert channel is not None
        if channel.gate is not None and channel.gate.word == "at" and not now.ripple:
            for each in pushes:
                now.causes.append(_push_cause(found.name, runs[train[each.run]], each, channel, raw))
                channel.steps.append(("disturbance", float(np.sqrt(np.mean(channel.last)))))
            channel.data, channel.first = raw, withheld(raw, _table(moves)(train, _one))
            return now
        window = find_window(channel.left, [m.time for m in channel.moves], channel.floor)
        if window is None or len(pushes) == MOST_PUSHES or not seen_elsewhere(window, channel.moves):
            break
        pushes.append(window)
        for _ in range(PASSES):  # what friction looks like is known when the push is gone
            pushes = _sizes(pushes, raw, now.force)
            shifted = [_without(pushes, i, forces[k]) for i, k in enumerate(train)]
            now = _forced(found, runs, moves, _put(forces, train, shifted), train, test, without)
    return plain


def _sizes(pushes: Sequence[Window], raw: Series, channel: AxisChannel | None) -> list[Window]:
    """Pushes with their sizes fitted together with all else that a channel has."""
    assert channel is not None
    ends = np.cumsum([0, *(len(m.time) for m in channel.moves)])
    during = np.zeros((len(raw.y), len(pushes)))
    for j, each in enumerate(pushes):
        during[ends[each.run] + each.first : ends[each.run] + each.last, j] = 1.0
    c = solve(np.concatenate([during, channel.columns], axis=1), raw.y)
    return [replace(each, shift=float(c[j])) for j, each in enumerate(pushes)]


def _without(pushes: Sequence[Window], run: int, force: Floats) -> Floats:
    """Forces (n,) of a run without the pushes in it."""
    out = force.copy()
    for each in pushes:
        if each.run == run:
            out[each.first : each.last] -= each.shift
    return out


def _put(forces: Sequence[Floats], train: Sequence[int], values: Sequence[Floats]) -> list[Floats]:
    out = list(forces)
    for k, value in zip(train, values, strict=True):
        out[k] = value
    return out


def _forced(
    found: AxisFindings, runs: list[AxisRun], moves: list[AxisTravel], forces: list[Floats], train: list[int], test: list[int],
    without: set[str],
) -> AxisFindings:  # fmt: skip
    """The same for given forces (n,) per run."""
    found = replace(found, causes=[*found.causes], unknown_in=[*found.unknown_in], details={**found.details})
    data, table = _series(moves, forces, train), _table(moves)
    length = _presliding(data, lambda d: table(train, _one, _inertia, _speed, _either_way, lambda m: m.reversal(d)))

    def turn(m: AxisTravel) -> Floats:
        return m.reversal(length)

    columns: list[Column] = [_one, _inertia]
    before = withheld(data, table(train, *columns))
    floor = found.stated.force_N or rows_floor([runs[k].force for k in train])
    first = withheld(data, table(train, _one))
    channel = AxisChannel(data, train, first, before, floor=floor, stated=found.stated.force_N is not None)
    channel.all_names = [r.name for r in runs]
    last, named = before, []
    if "friction" not in without:
        after = withheld(data, table(train, _one, _inertia, turn, _speed))
        moving = telling(data, table(train, turn, *columns), 0, MINOR * floor)
        g = gain(before, after, moving)
        if _holds(g):
            columns, last = [_one, _inertia, turn, _speed], after
            lopsided = withheld(data, table(train, *columns, _either_way))
            more = gain(last, lopsided, moving)
            if _holds(more):
                columns, last = [*columns, _either_way], lopsided
            others = [
                [m if m is not turn else (lambda m, d=d: m.reversal(Turning(d))) for m in columns]
                for d in _around(length.distance)
            ]
            tables = [table(train, *each) for each in ([*others, columns] if length.speed is None else [columns])]
            found.causes.append(_friction(found, data, tables, length, _probability(g), before, last))
            found.details["force"]["asymmetry_z"] = round(more.z, 2)
            named.append("friction")
    _refused(found, data, table, train, columns, last, length, floor)
    _close(found, channel, named, last, data, table, columns, test, forces, moves)
    found.force = channel
    line = ripple([moves[k] for k in train], channel.left)
    if line is not None and line.share > LEAST_RIPPLE and line.amplitude**2 / 2.0 > (MINOR * floor) ** 2:
        found.ripple = line
        waves = [lambda m, w=wave: w(2.0 * np.pi * m.position / line.period) for wave in (np.sin, np.cos)]
        g = gain(last, withheld(data, table(train, *columns, *waves)))
        found.unknown_chance = min(found.unknown_chance, log10_chance(g, line.tried))
    return found


def _push_cause(name: str, run: AxisRun, window: Window, now: AxisChannel, raw: Series) -> FoundCause:
    rows = now.left[window.run][window.first : window.last]
    parts = [float(np.mean(part)) for part in np.array_split(rows, QUARTERS)]
    spread = float(student.ppf(0.975, QUARTERS - 1)) * float(np.std(parts, ddof=1)) / np.sqrt(QUARTERS)
    step = 2.0 * float(np.median(np.diff(run.time)))
    begin, end = (run.started + float(run.time[min(i, len(run.time) - 1)]) for i in (window.first, window.last))
    square = window.shift**2 * (window.last - window.first) / len(raw.y)
    return FoundCause(
        effect="disturbance",
        target=name,
        probability=stated(probability_of_chance(window.chance)),
        share=round(min(square / float(np.var(raw.y)), 1.0), 4),
        parameters={
            "force_N": _value(-window.shift, spread),
            "from_s": _value(begin, step),
            "to_s": _value(end, step),
        },
    )


def _friction(
    found: AxisFindings,
    data: Series,
    tables: Sequence[Floats],
    length: Turning,
    probability: float,
    before: Floats,
    last: Floats,
) -> FoundCause:
    """Tables (n, k): the columns, last, and before them those with the ways of turning round next to the best one."""
    c, C = fit(data, tables[-1])
    beside = [np.abs(solve(A, data.y) - c) for A in tables]
    spread = np.maximum(1.96 * np.sqrt(np.diag(C)), np.max(beside, axis=0))
    parameters = {
        "force_N": _value(c[2], spread[2]),
        "viscous_Ns_per_mm": _value(c[3], spread[3]),
        "presliding_mm": Estimate(value=length.distance, ci95=_around(length.distance)),
    }
    if len(c) > 4:
        parameters["asymmetry_Ns_per_mm"] = _value(c[4], spread[4])
    found.details["force"] = {"mass_kg": _value(c[1], spread[1]), "constant_N": _value(c[0], spread[0])}
    if length.speed is not None:
        found.details["force"]["turning_mm_per_s"] = length.speed
    return FoundCause(
        effect="friction",
        target=found.name,
        probability=probability,
        share=round(1.0 - float(np.mean(last) / np.mean(before)), 4),
        parameters=parameters,
    )


def _refused(
    found: AxisFindings, data: Series, table: Any, train: list[int], columns: list[Any], last: Floats,
    length: Turning, floor: float,
) -> None:  # fmt: skip
    """Terms that nobody states, tried on withheld blocks; those that hold are part of the unknown."""
    tried = {}
    terms = strangers(AxisTravel(*(np.zeros(2) for _ in range(4))), Turning(1.0))
    for name, (kind, _) in terms.items():
        column = lambda m, name=name: strangers(m, length)[name][1]
        g = gain(last, withheld(data, table(train, *columns, column)))
        tried[name] = {"z": round(g.z, 2), "gain": round(g.log_ratio, 4)}
        share = 1.0 - float(np.exp(-2.0 * g.log_ratio))
        if g.z > LEAST_Z and g.log_ratio > LEAST_SHARE and share * np.mean(last) > (MINOR * floor) ** 2:
            found.unknown_chance = min(found.unknown_chance, log10_chance(g, len(terms)))
            found.unknown_in.append((f"{kind}:{found.name}", share))
    found.details.setdefault("force", {})["tried"] = tried


# -- common -----------------------------------------------------------------------------------------------------------


def _presliding(data: Series, table: Any) -> Turning:
    """How friction turns round, by withheld blocks; what is shorter than sampled comes out as a step."""
    return min(TURNINGS, key=lambda how: float(np.mean(np.log(np.maximum(withheld(data, table(how)), 1e-300)))))


def _around(length: float) -> tuple[float, float]:
    """Neighbours of a value of the scan: what it is known to."""
    i = PRESLIDING_GRID_MM.index(length)
    return PRESLIDING_GRID_MM[max(i - 1, 0)], PRESLIDING_GRID_MM[min(i + 1, len(PRESLIDING_GRID_MM) - 1)]


def _holds(g: Gain) -> bool:
    """Whether a term helps withheld blocks, surely and by more than little."""
    return g.z > LEAST_Z and g.log_ratio > LEAST_SHARE


def _probability(g: Gain) -> float:
    """That a term is at work, by the chance that withheld blocks gain as much from one that is not."""
    return stated(probability_of_chance(log10_chance(g)))


def _value(value: float, spread: float) -> Estimate:
    low, high = (float(f"{value + sign * spread:.6g}") for sign in (-1.0, 1.0))
    return Estimate(value=float(f"{value:.6g}"), ci95=(low, high))
