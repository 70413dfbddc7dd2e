"""Which terms make up the drive force of an axis: moving mass, friction, disturbance forces, and unmodelled terms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.stats import t as student

from camcomp.diagnosis.axis.block_least_squares import (
    Series,
    gain,
    log10_chance,
    solved,
    telling,
    withheld,
)
from camcomp.diagnosis.axis.channels import (
    LEFT,
    Column,
    close,
    constant,
    either_way,
    helps,
    holds,
    inertia,
    not_known,
    probability_of,
    series_of,
    speed,
    table_of,
    turning,
    value_of,
    within_a_row,
)
from camcomp.diagnosis.axis.findings import AxisChannel, AxisFindings, AxisRun
from camcomp.diagnosis.axis.friction import (
    around,
    as_good,
    brakes,
    friction_of,
    second_distance,
    uncertainty_of_friction,
)
from camcomp.diagnosis.axis.gate import MINOR
from camcomp.diagnosis.axis.noise_floor import rows_floor
from camcomp.diagnosis.axis.push import QUARTERS, Window, away_from_ends, edges, find_window, seen_elsewhere, sharp
from camcomp.diagnosis.axis.terms import (
    AxisTravel,
    Turning,
    ripple,
    strangers,
)
from camcomp.diagnosis.result.types import (
    FoundCause,
)
from camcomp.diagnosis.statistics.probability import EVEN, probability_of_chance, stated
from camcomp.ground.datatypes import Floats

LEAST_RIPPLE = 0.02  # share of the leftover's energy
PASSES = 2  # of the fit of a push and of all else
MOST_PUSHES = 2  # of an axis: what comes more often is no mishap


def force_of(
    found: AxisFindings,
    runs: list[AxisRun],
    moves: list[AxisTravel],
    train: list[int],
    test: list[int],
    without: set[str],
) -> AxisFindings:
    """The findings of the axis with its drive force; disturbance forces are removed first.

    Other stretches do not predict a disturbance force: the rows of its interval have to follow it, and it has to
    explain most of their residual.
    """
    rows = [r.moved() for r in runs]
    runs = [r.of(on) for r, on in zip(runs, rows, strict=True)]
    moves = [m.of(on) for m, on in zip(moves, rows, strict=True)]
    forces, raw = [r.force for r in runs], series_of(moves, [r.force for r in runs], train)
    plain = now = kept = _forced(found, runs, moves=moves, forces=forces, train=train, test=test, without=without)
    pushes, named = list[Window](), list[Window]()
    for _ in range(0 if "disturbance" in without else MOST_PUSHES):
        channel = now.force
        assert channel is not None
        if channel.gate is not None and channel.gate.word == "at" and not now.ripple:
            break
        window = _next_push(channel, pushes, forces, moves)
        if window is None:
            break
        pushes = [*pushes, window]
        for again in range(PASSES):  # what friction looks like, and where the push ends, is known when the push is gone
            if again:
                pushes = [
                    _placed(push=each, number=i, pushes=pushes, channel=channel, forces=forces, moves=moves)
                    for i, each in enumerate(pushes)
                ]
            shifted = [_without(pushes, k, force) for k, force in enumerate(forces)]
            now = _forced(
                found, runs, moves=moves, forces=shifted, train=train, test=test, without=without,
                unsure=_edges(pushes, moves),
            )  # fmt: skip
            channel = now.force
            assert channel is not None
        if _beyond(now) < LEFT * _beyond(plain):
            kept, named = now, pushes
    channel = kept.force
    if named and channel is not None:
        for each in named:
            time = runs[each.run].time
            kept.pushed.append(
                (runs[each.run].name, float(time[each.first]), float(time[min(each.last, len(time) - 1)]))
            )
            cause = _push_cause(found.name, runs[each.run], each, channel, raw)
            if channel.gate is not None and channel.gate.word == "above":  # it may be a part of what is left
                cause = cause.model_copy(update={"probability": min(cause.probability, EVEN)})
            kept.causes.append(cause)
            channel.steps.append(("disturbance", float(np.sqrt(np.mean(channel.last)))))
        channel.data = raw
        if not test:  # what was there before holds the pushes, too
            channel.first = withheld(raw, table_of(moves)(train, constant))
    return kept


def _left_of(channel: AxisChannel) -> dict[int, Floats]:
    """Residuals of every fitted or held-out run by its number; a disturbance force belongs to one run and predicts no
    other.
    """
    return dict(zip(channel.runs, channel.left, strict=True)) | channel.held


def _window(
    channel: AxisChannel, pushes: Sequence[Window], forces: Sequence[Floats], moves: Sequence[AxisTravel]
) -> tuple[Window, Floats] | None:
    """The disturbance force that explains most of the residual of all other terms and disturbance forces, as
    `find_window` gives it.
    """
    values = {k: _without(pushes, k, forces[k]) for k in _left_of(channel)}
    ends = np.cumsum([len(m.time) for m in channel.moves])[:-1]
    beside = dict(zip(channel.runs, np.split(channel.beside, ends), strict=True))
    return find_window(values, beside, {k: moves[k].time for k in values}, channel.floor)


def _next_push(
    channel: AxisChannel, pushes: Sequence[Window], forces: Sequence[Floats], moves: Sequence[AxisTravel]
) -> Window | None:
    """One further disturbance force; None where its interval is unclear or a function of position explains it."""
    found = _window(channel, pushes, forces, moves)
    if found is None:
        return None
    window, rest = found
    return window if sharp(window, rest, moves[window.run].time) or seen_elsewhere(window, moves) else None


def _placed(
    push: Window, number: int, pushes: Sequence[Window], channel: AxisChannel, forces: Sequence[Floats],
    moves: Sequence[AxisTravel],
) -> Window:  # fmt: skip
    """A push where the others and all else, as it is known by now, have it."""
    found = _window(channel, [*pushes[:number], *pushes[number + 1 :]], forces, moves)
    if found is None or found[0].run != push.run or min(found[0].last, push.last) <= max(found[0].first, push.first):
        return push
    return found[0]


def _beyond(found: AxisFindings) -> float:
    """Mean square of the residual of the drive force beyond its floor."""
    channel = found.force
    if channel is None:
        return 0.0
    return max(float(np.mean(np.concatenate(list(_left_of(channel).values())) ** 2)) - channel.floor**2, 0.0)


def _forced(
    found: AxisFindings,
    runs: list[AxisRun],
    *,
    moves: list[AxisTravel],
    forces: list[Floats],
    train: list[int],
    test: list[int],
    without: set[str],
    unsure: Mapping[int, Floats] | None = None,
) -> AxisFindings:
    """The same for given forces (n,) per run; unsure: as in `close`."""
    found = replace(found, causes=[*found.causes], unknown_in=[*found.unknown_in], details={**found.details})
    data, table = series_of(moves, forces, train), table_of(moves)
    first = withheld(data, table(train, constant))
    floor = found.stated.force_N or rows_floor([runs[k].force for k in train])
    length = turning(data, lambda d: table(train, constant, inertia, speed, either_way, lambda m: m.reversal(d)))

    def turn(m: AxisTravel) -> Floats:
        return m.reversal(length)

    columns: list[Column] = [constant, inertia]
    beside = table(train, constant, inertia, turn, speed, either_way)
    before = withheld(data, table(train, *columns))
    channel = AxisChannel(
        data=data, runs=train, first=first, last=before, floor=floor, stated=found.stated.force_N is not None
    )
    channel.all_names, channel.beside = [r.name for r in runs], beside
    last, named = before, []
    if "friction" not in without:
        after = withheld(data, table(train, constant, inertia, turn, speed))
        moving = telling(data, table(train, turn, *columns), 0, MINOR * floor)
        g = gain(before, after, moving)
        if holds(g) and brakes(data, table(train, turn, speed, *columns)):
            columns, last = [constant, inertia, turn, speed], after
            lopsided = withheld(data, table(train, *columns, either_way))
            more = gain(last, lopsided, moving)
            if helps(more):
                columns, last = [*columns, either_way], lopsided
            shape = (
                None
                if length.speed is not None
                else second_distance(data, table, train=train, columns=columns, last=last, length=length, moving=moving)
            )
            if shape is not None:
                columns, last = [*columns, shape.column], shape.last
            own = [*columns]

            def turned(how: Turning, ks: Sequence[int] = train) -> Floats:
                return table(ks, *(m if m is not turn else (lambda m: m.reversal(how)) for m in own))

            alike = as_good(data, turned, length.distance) if length.speed is None else []
            lengths = around(alike) if alike else [length.distance]
            unsure = uncertainty_of_friction(
                data, turned, train=train, runs=[*train, *test], length=length, alike=lengths, unsure=unsure or {}
            )
            tables = [*(turned(Turning(d)) for d in lengths if alike), table(train, *columns)]
            found.causes.append(
                friction_of(
                    found,
                    data,
                    tables=tables,
                    length=length,
                    shape=shape,
                    lengths=lengths,
                    probability=probability_of(g),
                    before=before,
                    last=last,
                )
            )
            found.details["force"]["asymmetry_z"] = round(more.z, 2)
            named.append("friction")
    _refused(found, data, table=table, train=train, columns=columns, last=last, moves=moves, length=length, floor=floor)
    known = _weighed(data, table(train, *columns), [len(moves[k].time) for k in train], floor)
    close(
        found, channel, effects=named, data=known, table=table, columns=columns, test=test, values=forces,
        moves=moves, unsure=unsure,
    )  # fmt: skip
    found.force = channel
    line = ripple([moves[k] for k in train], channel.left)
    if line is not None and line.share > LEAST_RIPPLE and line.amplitude**2 / 2.0 > (MINOR * floor) ** 2:
        found.ripple = line
        waves = [lambda m, w=wave: w(2.0 * np.pi * m.position / line.period) for wave in (np.sin, np.cos)]
        g = gain(last, withheld(data, table(train, *columns, *waves)))
        found.unknown_chance = min(found.unknown_chance, log10_chance(g, line.tried))
    return found


def _force_of(push: Window, rows: int) -> Floats:
    """Force (n,) N that a disturbance adds to the rows of its run."""
    out = np.zeros(rows)
    out[push.first : push.last] = push.shift
    return out


def _edges(pushes: Sequence[Window], moves: Sequence[AxisTravel]) -> dict[int, Floats]:
    out: dict[int, Floats] = {}
    for each in pushes:
        own = edges(each, moves[each.run].time)
        out[each.run] = np.hypot(out.get(each.run, 0.0), own)
    return out


def _without(pushes: Sequence[Window], run: int, force: Floats) -> Floats:
    """Forces (n,) of a run without the pushes in it."""
    return np.asarray(
        force - sum((_force_of(each, len(force)) for each in pushes if each.run == run), np.zeros(len(force)))
    )


def _push_cause(name: str, run: AxisRun, window: Window, now: AxisChannel, raw: Series) -> FoundCause:
    left = _left_of(now)[window.run]
    rows = left[away_from_ends(window.first, window.last, run.time)[0]]
    parts = [float(np.mean(part)) for part in np.array_split(rows, QUARTERS)]
    spread = float(student.ppf(0.975, QUARTERS - 1)) * float(np.std(parts, ddof=1)) / np.sqrt(QUARTERS)
    begin, end = (_instant(run, row) for row in (window.first, window.last))
    square = window.shift**2 * (window.last - window.first) / len(raw.y)
    return FoundCause(
        effect="disturbance",
        target=name,
        probability=stated(probability_of_chance(window.chance)),
        share=round(min(square / float(np.var(raw.y)), 1.0), 4),
        parameters={
            "force_N": value_of(-window.shift, spread),
            "from_s": value_of(*begin),
            "to_s": value_of(*end),
        },
    )


def _instant(run: AxisRun, row: int) -> tuple[float, float]:
    """When something changed, s, that `row` is the first to show, and to what that is known: rows before it may be lost."""
    row = min(row, len(run.time) - 1)
    since = float(run.time[row] - run.time[max(row - 1, 0)])
    step = float(np.median(np.diff(run.time)))
    return run.started + float(run.time[row]) - 0.5 * max(since - step, 0.0), 0.5 * max(since - step, 0.0) + 2.0 * step


def _weighed(data: Series, A: Floats, rows: Sequence[int], floor: float) -> Series:
    """The series with rows that count for less where the second of the columns A (n, k), inertia, is not known to the floor.

    Where an axis speeds up within a few rows its force is one of any time within a row: the mass is known from elsewhere.
    rows: of every run.
    """
    own = np.split(A[:, 1] * solved(data, A)[1], np.cumsum(rows)[:-1])
    return replace(data, weight=floor / np.hypot(floor, np.concatenate([within_a_row(each) for each in own])))


def _refused(
    found: AxisFindings,
    data: Series,
    *,
    table: Any,
    train: list[int],
    columns: list[Any],
    last: Floats,
    moves: list[AxisTravel],
    length: Turning,
    floor: float,
) -> None:
    """Unmodelled terms, tried on withheld blocks; accepted ones are part of the unknown.

    They have to help also where rows with uncertain inertia and friction have less weight, and jointly with all terms
    of friction.
    """
    if speed in columns and either_way not in columns:
        columns = [*columns, either_way]
        last = withheld(data, table(train, *columns))
    A = table(train, *columns)
    own = A[:, 1:] @ solved(data, A)[1:]
    ends = np.cumsum([len(moves[k].time) for k in train])[:-1]
    sure = replace(
        data, weight=floor / np.hypot(floor, np.concatenate([not_known(each) for each in np.split(own, ends)]))
    )
    known = withheld(sure, A)
    tried = {}
    terms = strangers(AxisTravel(*(np.zeros(2) for _ in range(4))), Turning(1.0))
    for name, (kind, _) in terms.items():
        column = lambda m, name=name: strangers(m, length)[name][1]
        B = table(train, *columns, column)
        g = gain(last, withheld(data, B))
        tried[name] = {"z": round(g.z, 2), "gain": round(g.log_ratio, 4)}
        if not holds(g):
            continue
        weighed = gain(known, withheld(sure, B))
        share = 1.0 - float(np.exp(-2.0 * weighed.log_ratio))
        if holds(weighed) and share * np.mean(known) > (MINOR * floor) ** 2:
            found.unknown_chance = min(found.unknown_chance, log10_chance(g, len(terms)))
            found.unknown_in.append((f"{kind}:{found.name}", 1.0 - float(np.exp(-2.0 * g.log_ratio))))
    found.details.setdefault("force", {})["tried"] = tried
