"""What the drive force of an axis is made of: moving mass, friction, pushes that last for a while, and what nobody states."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.stats import t as student

from camcomp.diagnosis.axis.block_least_squares import (
    Series,
    fit,
    gain,
    log10_chance,
    solve,
    telling,
    withheld,
)
from camcomp.diagnosis.axis.channels import (
    KNOWN,
    LEAST_Z,
    Column,
    around,
    close,
    constant,
    either_way,
    holds,
    inertia,
    probability_of,
    series_of,
    speed,
    table_of,
    turning,
    value_of,
)
from camcomp.diagnosis.axis.findings import AxisChannel, AxisFindings, AxisRun
from camcomp.diagnosis.axis.gate import MINOR
from camcomp.diagnosis.axis.law import LEAST_SHARE
from camcomp.diagnosis.axis.noise_floor import rows_floor
from camcomp.diagnosis.axis.push import QUARTERS, Window, find_window, seen_elsewhere
from camcomp.diagnosis.axis.terms import (
    AxisTravel,
    Turning,
    ripple,
    strangers,
)
from camcomp.diagnosis.result.types import (
    Estimate,
    FoundCause,
)
from camcomp.diagnosis.statistics.probability import probability_of_chance, stated
from camcomp.ground.datatypes import Floats

LEAST_RIPPLE = 0.02  # share of the leftover's energy
PASSES = 2  # of the fit of a push and of all else
LEFT = 0.2  # of what was beyond the floor: more than that beside pushes, and they are a part of something else
MOST_PUSHES = 2  # of an axis: what comes more often is no mishap


def force_of(
    found: AxisFindings,
    runs: list[AxisRun],
    moves: list[AxisTravel],
    train: list[int],
    test: list[int],
    without: set[str],
) -> AxisFindings:
    """What was found on the axis, with its drive force; what pushed it for a while goes first.

    Other stretches tell nothing of a push: the rows that it lasts for have to follow it, and little of what was left may be
    left beside it.
    """
    rows = [r.moved() for r in runs]
    runs = [r.of(on) for r, on in zip(runs, rows, strict=True)]
    moves = [m.of(on) for m, on in zip(moves, rows, strict=True)]
    forces, raw = [r.force for r in runs], series_of(moves, [r.force for r in runs], train)
    plain = now = kept = _forced(found, runs, moves, forces, train, test, without)
    pushes, named = list[Window](), list[Window]()
    for _ in range(0 if "disturbance" in without else MOST_PUSHES):
        channel = now.force
        assert channel is not None
        if channel.gate is not None and channel.gate.word == "at" and not now.ripple:
            break
        window = find_window(channel.left, [m.time for m in channel.moves], channel.floor)
        if window is None or not seen_elsewhere(window, channel.moves):
            break
        pushes = [*pushes, window]
        for _ in range(PASSES):  # what friction looks like is known when the push is gone
            pushes = _sizes(pushes, raw, now.force)
            shifted = [_without(pushes, i, forces[k]) for i, k in enumerate(train)]
            now = _forced(found, runs, moves, _put(forces, train, shifted), train, test, without)
        if _beyond(now) < LEFT * _beyond(plain):
            kept, named = now, pushes
    channel = kept.force
    if named and channel is not None:
        for each in named:
            kept.causes.append(_push_cause(found.name, runs[train[each.run]], each, channel, raw))
            channel.steps.append(("disturbance", float(np.sqrt(np.mean(channel.last)))))
        channel.data = raw
        if not test:  # what was there before holds the pushes, too
            channel.first = withheld(raw, table_of(moves)(train, constant))
    return kept


def _beyond(found: AxisFindings) -> float:
    """Mean square of what is left of the drive force beyond its floor."""
    channel = found.force
    return 0.0 if channel is None else max(float(np.mean(channel.last)) - channel.floor**2, 0.0)


def _forced(
    found: AxisFindings, runs: list[AxisRun], moves: list[AxisTravel], forces: list[Floats], train: list[int], test: list[int],
    without: set[str],
) -> AxisFindings:  # fmt: skip
    """The same for given forces (n,) per run."""
    found = replace(found, causes=[*found.causes], unknown_in=[*found.unknown_in], details={**found.details})
    data, table = series_of(moves, forces, train), table_of(moves)
    length = turning(data, lambda d: table(train, constant, inertia, speed, either_way, lambda m: m.reversal(d)))

    def turn(m: AxisTravel) -> Floats:
        return m.reversal(length)

    columns: list[Column] = [constant, inertia]
    before = withheld(data, table(train, *columns))
    floor = found.stated.force_N or rows_floor([runs[k].force for k in train])
    first = withheld(data, table(train, constant))
    channel = AxisChannel(data, train, first, before, floor=floor, stated=found.stated.force_N is not None)
    channel.all_names = [r.name for r in runs]
    last, named = before, []
    if "friction" not in without:
        after = withheld(data, table(train, constant, inertia, turn, speed))
        moving = telling(data, table(train, turn, *columns), 0, MINOR * floor)
        g = gain(before, after, moving)
        if holds(g):
            columns, last = [constant, inertia, turn, speed], after
            lopsided = withheld(data, table(train, *columns, either_way))
            more = gain(last, lopsided, moving)
            if holds(more):
                columns, last = [*columns, either_way], lopsided
            own = [*columns]

            def turned(how: Turning) -> Floats:
                return table(train, *(m if m is not turn else (lambda m: m.reversal(how)) for m in own))

            lengths = around(data, turned, length.distance) if length.speed is None else [length.distance]
            tables = [*(turned(Turning(d)) for d in lengths if length.speed is None), table(train, *columns)]
            found.causes.append(_friction(found, data, tables, length, lengths, probability_of(g), before, last))
            found.details["force"]["asymmetry_z"] = round(more.z, 2)
            named.append("friction")
    _refused(found, data, table, train, columns, last, length, floor)
    close(found, channel, named, last, data, table, columns, test, forces, moves)
    found.force = channel
    line = ripple([moves[k] for k in train], channel.left)
    if line is not None and line.share > LEAST_RIPPLE and line.amplitude**2 / 2.0 > (MINOR * floor) ** 2:
        found.ripple = line
        waves = [lambda m, w=wave: w(2.0 * np.pi * m.position / line.period) for wave in (np.sin, np.cos)]
        g = gain(last, withheld(data, table(train, *columns, *waves)))
        found.unknown_chance = min(found.unknown_chance, log10_chance(g, line.tried))
    return found


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
            "force_N": value_of(-window.shift, spread),
            "from_s": value_of(begin, step),
            "to_s": value_of(end, step),
        },
    )


def _friction(
    found: AxisFindings,
    data: Series,
    tables: Sequence[Floats],
    length: Turning,
    lengths: Sequence[float],
    probability: float,
    before: Floats,
    last: Floats,
) -> FoundCause:
    """Tables (n, k): the columns, last, and before them those with the ways, over `lengths`, of turning round as well."""
    c, C = fit(data, tables[-1])
    beside = [np.abs(solve(A, data.y) - c) for A in tables]
    spread = np.maximum(1.96 * np.sqrt(np.diag(C)), np.max(beside, axis=0))
    fast = max(float(np.sqrt(np.mean(tables[-1][:, 3] ** 2))), 1e-12)
    law = KNOWN * (abs(float(c[2])) + fast * abs(float(c[3])))  # N
    spread[2:] += law / np.array([1.0, *(fast for _ in c[3:])])
    parameters = {
        "force_N": value_of(c[2], spread[2]),
        "viscous_Ns_per_mm": value_of(c[3], spread[3]),
        "presliding_mm": Estimate(value=length.distance, ci95=(min(lengths), max(lengths))),
    }
    if len(c) > 4:
        parameters["asymmetry_Ns_per_mm"] = value_of(c[4], spread[4])
    found.details["force"] = {"mass_kg": value_of(c[1], spread[1]), "constant_N": value_of(c[0], spread[0])}
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
