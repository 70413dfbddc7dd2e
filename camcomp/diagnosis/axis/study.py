"""Why single axes follow their set-points late and push harder than they should: logs of the control, without any tip.

Following error = lag x speed + (inertia in the loop) x acceleration + friction's reversal + constant.
Drive force     = mass x acceleration + friction + constant + what nobody states.
Inertia and constants belong to every axis and are no causes. Every further term has to prove itself on stretches of time
that it was not fitted on, and what is left there is held against the floor: stated, or the scatter from row to row.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

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
from camcomp.diagnosis.axis.findings import AxisChannel, AxisDeviation, AxisFindings, AxisRun
from camcomp.diagnosis.axis.gate import MINOR, dependences, judge
from camcomp.diagnosis.axis.law import LEAST_SHARE, axis_law
from camcomp.diagnosis.axis.next_moves import next_moves
from camcomp.diagnosis.axis.noise_floor import REPEATABILITY_MM, rows_floor
from camcomp.diagnosis.axis.terms import (
    PRESLIDING_GRID_MM,
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
ROWS = 50  # below which a run says nothing
NO_TIPS = "ISO 230-2: the tip was not measured"
LATEST_S = 0.1  # of a loop
ENCODER_BETTER = 0.8  # of what set-points leave of a channel: what encoders have to leave to be the motion
SETPOINT_WIDE = (2, 5, 10)  # samples on either side of a local cubic through set-points
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
        cleaned[name] = [r.away_from_gaps().from_first_move() for r, _ in clean]
        found.append(_axis(name, cleaned[name], set(holdout), set(without), stated or AxisDeviation()))
    found = [a for a in found if a.channels]
    if not found:
        raise ValueError(
            "no axis has a run with set-points and encoders, or encoders and drive forces, in 50 rows or more"
        )
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
        _following(found, usable, _motion(found, usable, gaps, train, late), gaps, train, test, without)
    if train and all(np.isfinite(usable[k].force).all() for k in train):
        forces = [r.force for r in usable]
        _force(found, usable, _motion(found, usable, forces, train, late), train, test, without)
    _name_rest(found)
    if found.strange:
        asked = [usable[k] for k in found.following.runs] if found.following else []
        told = [travel(r.time, r.setpoint, found.wide) for r in asked]
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
) -> list[AxisTravel]:
    """What moved while a channel had its values (n,): set-points, as late as they are followed, where that explains them as well.

    The noise of an encoder is in its following error, too, and would explain a part of itself.
    """
    encoders = [travel(r.time, r.encoder, found.wide) for r in runs]
    if late is None:
        return encoders
    mine = [runs[k] for k in train]
    told = [values[k] for k in train]

    def misfit(moves: list[AxisTravel]) -> float:
        return _misfit(mine, told, [moves[k] for k in train])

    every = [[travel(r.time, r.setpoint, wide, late) for r in runs] for wide in SETPOINT_WIDE]
    setpoints = min(every, key=misfit)
    found.carries = misfit(encoders) < ENCODER_BETTER * misfit(setpoints)
    return encoders if found.carries else setpoints


def _usual(m: AxisTravel) -> Floats:
    """What every axis has (n, 4): a constant, inertia, and something with the speed and its sense."""
    return np.stack([np.ones_like(m.time), 1e-3 * m.acceleration, m.speed, np.sign(m.speed)], axis=1)


def _misfit(runs: list[AxisRun], values: list[Floats], moves: list[AxisTravel]) -> float:
    """Median of what is left (of all rows) of a channel when what every axis has is fitted to a motion."""
    data = series([r.time for r in runs], values)
    return float(np.median(np.abs(leftover(data, np.concatenate([_usual(m) for m in moves])))))


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
    data = series([runs[k].time for k in train], [gaps[k] for k in train])

    def table(ks: Sequence[int], *columns: Any) -> Floats:
        return np.concatenate([np.stack([c(moves[k]) for c in columns], axis=1) for k in ks])

    one, push = (lambda m: np.ones_like(m.time)), (lambda m: m.acceleration)
    speed, both = (lambda m: m.speed), (lambda m: np.abs(m.speed))
    length = _presliding(data, lambda d: table(train, speed, push, one, lambda m: m.reversal(d)))
    turn = lambda m: m.reversal(length)
    before, last = withheld(data, table(train, one)), withheld(data, table(train, one, push))
    floor = found.stated.encoder_mm or float(np.hypot(_scatter([runs[k] for k in train]), REPEATABILITY_MM))
    channel = AxisChannel(data, train, before, last, floor=floor, stated=found.stated.encoder_mm is not None)
    channel.all_names = [r.name for r in runs]
    channel.encoder_noise = [rows_floor([r.encoder]) for r in runs]
    columns = [one, push]
    if "servo_lag" not in without:
        moving = telling(data, table(train, speed)[:, 0])
        lag = withheld(data, table(train, one, push, speed, turn))
        blind = withheld(data, table(train, one, push, turn))
        g = gain(blind, lag, moving)
        if _holds(g):
            columns, last = [one, push, speed, turn], lag
        else:  # at one speed a lag and a reversal are nearly the same: what needs less is it
            lag = withheld(data, table(train, one, push, speed))
            g = gain(last, lag, moving)
            if _holds(g) and np.mean(lag) <= np.mean(blind):
                columns, last = [one, push, speed], lag
        if last is lag:
            lopsided = withheld(data, table(train, *columns, both))
            more = gain(lag, lopsided, moving)
            if len(columns) > 3 and _holds(more):  # friction that differs between the ways
                columns, last = [*columns, both], lopsided
            c, C = fit(data, table(train, *columns))
            spread = 1.96 * float(np.sqrt(C[2, 2]))
            found.causes.append(
                FoundCause(
                    effect="servo_lag",
                    target=found.name,
                    probability=_probability(g),
                    share=round(1.0 - float(np.mean(lag) / np.mean(before)), 4),
                    parameters={"time_constant_ms": _value(1e3 * c[2], 1e3 * spread)},
                )
            )
            found.details["following"] = {"acceleration_us2": _value(1e6 * c[1], 1.96e6 * float(np.sqrt(C[1, 1])))}
            if len(c) > 3:
                found.details["following"] |= {
                    "reversal_um": _value(1e3 * c[3], 1.96e3 * float(np.sqrt(C[3, 3]))),
                    "presliding_mm": length.distance,
                }
    _close(found, channel, "servo_lag", last, data, table, columns, test, gaps, moves)
    found.following = channel


def _scatter(runs: Sequence[AxisRun]) -> float:
    """Deviation of one row of the following error; a resolution may show in the encoder or the set-points alone."""
    apart = np.hypot(rows_floor([r.encoder for r in runs]), rows_floor([r.setpoint for r in runs]))
    return max(rows_floor([r.setpoint - r.encoder for r in runs]), float(apart))


def _close(
    found: AxisFindings, channel: AxisChannel, effect: str, last: Floats, data: Series, table: Any, columns: list[Any],
    test: list[int], values: list[Floats], moves: list[AxisTravel],
) -> None:  # fmt: skip
    """Leftovers of the channel; where runs are held out, what is left there takes the place of withheld blocks."""
    A = table(channel.runs, *columns)
    c = solve(A, data.y)
    channel.columns, channel.moves = A, [moves[k] for k in channel.runs]
    if not channel.stated:
        channel.floor = float(np.hypot(channel.floor, _carried(found, channel, moves, c, effect)))
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
    channel.gate = judge(channel.left, left, times, channel.floor)
    found.unknown_chance = min(found.unknown_chance, channel.gate.chance)
    if any(each.effect == effect for each in found.causes):
        channel.steps.append((effect, float(np.sqrt(np.mean(channel.last)))))


def _carried(found: AxisFindings, channel: AxisChannel, moves: list[AxisTravel], c: Floats, effect: str) -> float:
    """What the noise of the encoder, resolution included, does to a channel by way of speed and acceleration."""
    if not found.carries:
        return 0.0
    noise = [channel.encoder_noise[k] for k in channel.runs]
    gains = [noise_gains(float(np.median(np.diff(moves[k].time))), found.wide) for k in channel.runs]
    push = c[1] * (1e-3 if effect == "friction" else 1.0) if len(c) > 1 else 0.0
    at = 3 if effect == "friction" else 2
    speed = c[at] if len(c) > at else 0.0
    return float(
        np.sqrt(np.mean([(n * np.hypot(push * g[1], speed * g[0])) ** 2 for n, g in zip(noise, gains, strict=True)]))
    )


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
) -> None:
    forces = [r.force for r in runs]
    data = series([runs[k].time for k in train], [forces[k] for k in train])

    def table(ks: Sequence[int], *columns: Any) -> Floats:
        return np.concatenate([np.stack([c(moves[k]) for c in columns], axis=1) for k in ks])

    one, push = (lambda m: np.ones_like(m.time)), (lambda m: 1e-3 * m.acceleration)
    speed, both = (lambda m: m.speed), (lambda m: np.abs(m.speed))
    length = _presliding(data, lambda d: table(train, one, push, speed, both, lambda m: m.reversal(d)))
    turn = lambda m: m.reversal(length)
    columns = [one, push]
    before = withheld(data, table(train, *columns))
    floor = found.stated.force_N or rows_floor([forces[k] for k in train])
    first = withheld(data, table(train, one))
    channel = AxisChannel(data, train, first, before, floor=floor, stated=found.stated.force_N is not None)
    channel.all_names = [r.name for r in runs]
    channel.encoder_noise = [rows_floor([r.encoder]) for r in runs]
    last = before
    if "friction" not in without:
        after = withheld(data, table(train, one, push, turn, speed))
        moving = telling(data, table(train, turn)[:, 0])
        g = gain(before, after, moving)
        if _holds(g):
            columns, last = [one, push, turn, speed], after
            lopsided = withheld(data, table(train, *columns, both))
            more = gain(last, lopsided, moving)
            if _holds(more):
                columns, last = [*columns, both], lopsided
            found.causes.append(_friction(found, data, table(train, *columns), length, _probability(g), before, last))
            found.details["force"]["asymmetry_z"] = round(more.z, 2)
    _refused(found, data, table, train, columns, last, length, floor)
    _close(found, channel, "friction", last, data, table, columns, test, forces, moves)
    found.force = channel
    line = ripple([moves[k] for k in train], channel.left)
    if line is not None and line.share > LEAST_RIPPLE and line.amplitude**2 / 2.0 > (MINOR * floor) ** 2:
        found.ripple = line
        waves = [lambda m, w=wave: w(2.0 * np.pi * m.position / line.period) for wave in (np.sin, np.cos)]
        g = gain(last, withheld(data, table(train, *columns, *waves)))
        found.unknown_chance = min(found.unknown_chance, log10_chance(g, line.tried))


def _friction(
    found: AxisFindings, data: Series, A: Floats, length: Turning, probability: float, before: Floats, last: Floats
) -> FoundCause:
    c, C = fit(data, A)
    spread = 1.96 * np.sqrt(np.diag(C))
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
