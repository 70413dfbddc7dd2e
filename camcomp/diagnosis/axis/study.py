"""Why single axes follow their set-points late and push harder than they should: logs of the control, without any tip.

Following error = lag x speed + (inertia in the loop) x acceleration + friction's reversal + constant.
Drive force     = mass x acceleration + friction + constant + what nobody states.
Inertia and constants belong to every axis and are no causes. Every further term has to prove itself on stretches of time
that it was not fitted on, and what is left there is held against the floor: stated, or the scatter from row to row.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from camcomp.diagnosis.axis import answer
from camcomp.diagnosis.axis.at_tip import TipMotion
from camcomp.diagnosis.axis.block_least_squares import WHOLE_RUNS, log10_chance, solve
from camcomp.diagnosis.axis.channels import LEFT
from camcomp.diagnosis.axis.drive_force import force_of
from camcomp.diagnosis.axis.drivers import dependences
from camcomp.diagnosis.axis.findings import ROWS, AxisChannel, AxisDeviation, AxisFindings, AxisRun
from camcomp.diagnosis.axis.following import follow, scatter_of, share_lag
from camcomp.diagnosis.axis.gate import AxisGate
from camcomp.diagnosis.axis.joint import AxisSurroundings, JointRows, study_channel
from camcomp.diagnosis.axis.law import axis_law
from camcomp.diagnosis.axis.motion import encoder_width, lateness, motion_of
from camcomp.diagnosis.axis.next_moves import next_moves
from camcomp.diagnosis.axis.noise_floor import REPEATABILITY_MM, rows_floor
from camcomp.diagnosis.axis.own_unit import in_own_unit
from camcomp.diagnosis.axis.terms import AxisTravel, travel
from camcomp.diagnosis.result.floor_rule import within_floor
from camcomp.diagnosis.result.standards import StandardValues
from camcomp.diagnosis.result.types import (
    UNKNOWN,
    DiagnosisResult,
    Floor,
    NamedCause,
    Outlier,
)
from camcomp.ground import progress
from camcomp.model.statics.description import Robot

NO_TIPS = "ISO 230-2: the tip was not measured"


def study(
    axes: Mapping[str, Sequence[AxisRun]],
    *,
    holdout: Sequence[str] = (),
    without: Sequence[str] = (),
    stated: AxisDeviation | None = None,
    robot: Robot | None = None,
) -> DiagnosisResult:
    """Result for logs of axes by name. holdout: runs that are judged and never fitted; robot: carries errors to the tip.

    Raises ValueError where no run of any axis has enough rows.
    """
    return studied(axes, holdout=holdout, without=without, stated=stated, robot=robot)[0]


def studied(
    axes: Mapping[str, Sequence[AxisRun]],
    *,
    holdout: Sequence[str] = (),
    without: Sequence[str] = (),
    stated: AxisDeviation | None = None,
    robot: Robot | None = None,
) -> tuple[DiagnosisResult, list[AxisFindings]]:
    """The result of `study`, with the findings of all axes."""
    outliers: set[tuple[str, int]] = set()
    found, cleaned = [], {}
    names = sorted({r.name for runs in axes.values() for r in runs})
    held = [n for n in names if n in holdout] if holdout else names if len(names) >= WHOLE_RUNS else []
    again = 0 if len(held) == 1 and holdout else len(held)  # fits that leave out one run each
    for name, runs in axes.items():
        clean = [r.without_spikes() for r in runs]
        outliers |= {(r.name, int(row)) for r, rows in clean for row in rows}
        cleaned[name] = [r.on_ticks().away_from_gaps() for r, _ in clean]
    around = AxisSurroundings(robot, cleaned)
    for name, own in progress.steps(cleaned.items(), len(axes) * (1 + again)):
        found.append(
            _axis(
                name=name,
                runs=own,
                holdout=set(holdout),
                without=set(without),
                stated=stated or AxisDeviation(),
                around=around,
            )
        )
    found = [a for a in found if a.channels]
    if not found:
        raise ValueError(
            "no axis has 50 rows or more of set-points with encoders, nor a slide of encoders with drive forces"
        )
    for a in found:
        _nothing_below_the_floor(a)
    share_lag(found)
    tip = TipMotion(robot, cleaned)
    whole = sum(len(a.channels) for a in found)  # every channel weighs alike
    causes = [
        in_own_unit(c.model_copy(update={"share": round(c.share / whole, 4)}), a) for a in found for c in a.causes
    ]
    causes.sort(key=lambda c: (-c.probability, -c.share))
    known = tuple(NamedCause(effect=c.effect, target=c.target) for c in causes)
    verdict = _verdict(found)
    if verdict == "unknown" or (verdict == "ambiguous" and not causes):
        causes += [answer.unknown(a, whole) for a in found if a.strange or verdict == "ambiguous"]
    gap = answer.gap(found, tip)
    with progress.part(1.0 / (1 + again), 1.0):
        judged = _judged(around, held, set(without), stated or AxisDeviation()) if again else [found] if held else []
    every = [c for a in found for c in a.channels]
    result = DiagnosisResult(
        verdict=verdict, gap=gap, where=answer.where(found, causes), causes=tuple(causes),
        alternatives=(known, (*known, NamedCause(effect=UNKNOWN, target=None))) if verdict == "ambiguous" else (),
        shrinkage=answer.shrinkage(judged, held, tip) if judged else None,
        next_experiment=next_moves(found, cleaned, verdict),
        floor=Floor(um=gap.noise_floor_um, source="stated" if all(c.stated for c in every) else "rows"),
        outliers=tuple(Outlier(run=run, row=row) for run, row in sorted(outliers)),
        axis_laws=tuple(law for a in found for law in a.laws),
        axes_in_detail={a.name: a.details for a in found}, standards=StandardValues(absent=(NO_TIPS,)),
    )  # fmt: skip
    positions = [c for a in found if a.strange for c in (a.following, a.behind) if c is not None]
    in_forces = all(c.gate is None or c.gate.word == "at" for c in positions)
    return within_floor(result, in_forces=in_forces), found


def _nothing_below_the_floor(axis: AxisFindings) -> None:
    """Drops causes and unknowns of a following error that is at its floor: there is no gap that they would explain."""
    following = axis.following
    if following is None or following.gate is None:
        return
    rows = np.concatenate([values for _, values in following.whole])
    if float(np.std(rows)) > following.floor:
        return
    axis.causes = [c for c in axis.causes if not c.effect.startswith(("servo_", "speed_limit"))]
    following.gate = AxisGate("at", 0.0, ())
    if axis.laws:  # the machine file has none of them, and nothing of the gap is claimed
        axis.laws, following.held = [], following.held_whole
        following.left = np.split(following.data.y, np.cumsum([len(each) for each in following.left])[:-1])
    if axis.force is None and axis.behind is None:
        axis.unknown_in, axis.law = [], None


def _verdict(found: Sequence[AxisFindings]) -> Any:
    """The verdict; `ambiguous` where too few rows show the residual to be at the floor."""
    if any(a.strange for a in found):
        return "unknown"
    if any(c.gate is None or c.gate.word != "at" for a in found for c in a.channels):
        return "ambiguous"
    return "identified" if any(a.causes for a in found) else "none"


def _axis(
    name: str, runs: list[AxisRun], holdout: set[str], without: set[str], stated: AxisDeviation,
    around: AxisSurroundings,
) -> AxisFindings:  # fmt: skip
    hinge = any(r.revolute for r in runs)
    stated = stated.of(hinge)
    found = AxisFindings(name=name, stated=stated, revolute=hinge)
    usable = [r for r in runs if np.isfinite(r.encoder).sum() >= ROWS]
    if not usable:
        return found
    train = [k for k, r in enumerate(usable) if r.name not in holdout]
    test = [k for k, r in enumerate(usable) if r.name in holdout]
    found.wide = encoder_width(usable, train)
    found = (_hinge if hinge else _slide)(found, usable, train, test, without=without, around=around)
    if any(usable[k].load is not None for k in train):
        found = _second_encoder(found=found, usable=usable, train=train, test=test, without=without, around=around)
    _name_rest(found, usable, {} if hinge else {n: own for n, own in around.axes.items() if n != name})
    if found.strange:
        follows = found.following
        asked = [(usable[k], m) for k, m in zip(follows.runs, follows.moves, strict=True)] if follows else []
        told = [travel(r.time, r.setpoint, found.wide).of(np.isin(r.time, m.time)) for r, m in asked]
        found.law = None if hinge else axis_law(name, found.force, found.following, told)
    return found


def _slide(
    found: AxisFindings, usable: list[AxisRun], train: list[int], test: list[int], without: set[str],
    around: AxisSurroundings,
) -> AxisFindings:  # fmt: skip
    """Following error and drive force of a slide."""
    name, stated, wide = found.name, found.stated, found.wide
    gaps = [r.gap for r in usable]
    followed = bool(train) and all(np.isfinite(gaps[k]).all() for k in train)
    forced = bool(train) and all(np.isfinite(usable[k].force).all() for k in train)
    late = lateness(usable, gaps, train) if followed else None
    pushed = list[tuple[str, float, float]]()
    for again in (False, True):  # what pushed an axis shows in what its loop makes of it
        found = AxisFindings(name=name, stated=stated, wide=wide)
        if followed:
            runs, moves, values = motion_of(found, [r.unpushed(pushed) for r in usable], gaps, train, late)
            found = follow(found, runs, moves, values, train=train, test=test, without=without)
            rows = JointRows(
                channel="following", runs=usable, moves=moves, values=values, train=train, test=test, floor=0.0,
                stated=False,
            )  # fmt: skip
            found = _limited(found, rows, around, without)
        if forced:
            runs, moves, _ = motion_of(
                found=found, runs=usable, values=[r.force for r in usable], train=train, late=late, led=found.led
            )
            found = force_of(found=found, runs=runs, moves=moves, train=train, test=test, without=without)
        if again or not (followed and found.pushed):
            break
        pushed = found.pushed
    for channel, values in ((found.following, gaps), (found.force, [r.force for r in usable])):
        if channel is not None:
            channel.whole = [(usable[k].time, values[k]) for k in channel.runs]
    return found


def _limited(found: AxisFindings, rows: JointRows, around: AxisSurroundings, without: set[str]) -> AxisFindings:
    """The findings with a largest speed of the drive in place of other causes, where it explains nearly the whole gap.

    Any cause explains a part of an unknown effect: one with a large residual may be no more than that.
    """
    follows = found.following
    if follows is None or follows.gate is None or follows.gate.word == "at" or "speed_limit" in without:
        return found
    plain = AxisFindings(name=found.name, stated=found.stated, wide=found.wide, carried=found.carried)
    rows = replace(rows, floor=follows.floor, stated=follows.stated)
    limited, channel = study_channel(plain, rows, around, without)
    if not any(c.effect == "speed_limit" for c in limited.causes) or np.mean(channel.last) >= np.mean(follows.last):
        return found
    beyond = [float(np.mean(each)) - channel.floor**2 for each in (channel.first, channel.last)]
    if beyond[1] > LEFT * beyond[0]:
        return found
    limited.following = channel
    return limited


def _hinge(
    found: AxisFindings, usable: list[AxisRun], train: list[int], test: list[int], without: set[str],
    around: AxisSurroundings,
) -> AxisFindings:  # fmt: skip
    """Following error and drive torque of a hinge."""
    stated, gaps = found.stated, [r.gap for r in usable]
    late = None
    if train and all(np.isfinite(gaps[k]).all() for k in train):
        late = lateness(usable, gaps, train)
        runs, moves, values = motion_of(found, usable, gaps, train, late)
        floor = stated.encoder_mm or float(np.hypot(scatter_of([runs[k] for k in train]), REPEATABILITY_MM))
        rows = JointRows(
            channel="following", runs=usable, moves=moves, values=values, train=train, test=test, floor=floor,
            stated=stated.encoder_mm is not None,
        )  # fmt: skip
        found, found.following = study_channel(found, rows, around, without)
        found.following.whole = [(usable[k].time, gaps[k]) for k in found.following.runs]
    if train and all(np.isfinite(usable[k].force).all() for k in train):
        forces = [r.force for r in usable]
        runs, moves, values = motion_of(found, usable, forces, train, late)
        floor = stated.force_N or rows_floor([runs[k].force for k in train])
        rows = JointRows(
            channel="force", runs=usable, moves=moves, values=values, train=train, test=test, floor=floor,
            stated=stated.force_N is not None,
        )  # fmt: skip
        found, found.force = study_channel(found, rows, around, without)
        found.force.whole = [(usable[k].time, forces[k]) for k in found.force.runs]
    return found


def _second_encoder(
    found: AxisFindings, usable: list[AxisRun], train: list[int], test: list[int], without: set[str],
    around: AxisSurroundings,
) -> AxisFindings:  # fmt: skip
    """Second encoder behind the gear against the encoder of the motor."""
    every = [k for k, r in enumerate(usable) if r.load is not None]
    runs = [usable[k] for k in every]
    values = [np.asarray(r.load) - r.encoder for r in runs]
    moves = [travel(r.time, r.encoder, found.wide) for r in runs]
    own = [(r, rows_floor([r.encoder, np.asarray(r.load)])) for r in runs]
    floor = found.stated.encoder_mm or float(np.hypot(np.sqrt(2.0) * max(each for _, each in own), REPEATABILITY_MM))
    rows = JointRows(
        channel="behind", runs=runs, moves=moves, values=values, train=[every.index(k) for k in train if k in every],
        test=[every.index(k) for k in test if k in every], floor=floor, stated=found.stated.encoder_mm is not None,
    )  # fmt: skip
    more, channel = study_channel(found, rows, around, without)
    if float(np.std(np.concatenate([own for _, own in channel.whole]))) > floor:
        found = more
    else:  # there is no gap that causes would explain
        channel.gate = AxisGate("at", 0.0, ())
    found.behind = channel
    return found


def _judged(
    around: AxisSurroundings, held: Sequence[str], without: set[str], stated: AxisDeviation
) -> list[list[AxisFindings]]:
    """Every axis with each of the runs held out in turn: chosen and fitted without it."""
    every = [
        [
            _axis(name=name, runs=list(runs), holdout={one}, without=without, stated=stated, around=around)
            for name, runs in progress.steps(around.axes.items(), len(around.axes))
        ]
        for one in progress.steps(held, len(held))
    ]
    for found in every:
        for a in found:
            _nothing_below_the_floor(a)
    return every


def _name_rest(found: AxisFindings, runs: Sequence[AxisRun], others: Mapping[str, Sequence[AxisRun]]) -> None:
    """Name covariates of residuals above the floor that lack one; a lag that differs by direction without such friction
    is a covariate.
    """
    if found.one_way and not any("asymmetry_Ns_per_mm" in c.parameters for c in found.causes):
        found.unknown_in.append((f"velocity:{found.name}", 1.0 - float(np.exp(-2.0 * found.one_way.log_ratio))))
        found.unknown_chance = min(found.unknown_chance, log10_chance(found.one_way))
    if found.unknown_in:
        return
    for channel in found.channels:
        if channel.gate is not None and channel.gate.word == "above":
            stretches = sum(each.share for each in channel.gate.intervals)
            if found.ripple:  # it may be a small part of what comes and goes
                if _of_time(channel, found.ripple.period):
                    found.unknown_in.append((f"time:{found.name}", stretches))
                continue
            names = [runs[k].name for k in channel.runs]
            beside = {other: _moves(theirs, names, found.wide) for other, theirs in others.items()}
            beside = {other: moves for other, moves in beside.items() if len(moves) == len(names)}
            each = (channel.data, channel.columns, channel.moves, beside, channel.floor)
            for kind, share, chance in dependences(*each):
                found.unknown_in.append((kind if ":" in kind else f"{kind}:{found.name}", share))
                found.unknown_chance = min(found.unknown_chance, chance)
            if not found.unknown_in and channel.gate.intervals:
                found.unknown_in.append((f"time:{found.name}", stretches))


def _of_time(channel: AxisChannel, period: float) -> bool:
    """Whether waves of a period mm over the position fail to explain most of the residual inside the gate's
    intervals.
    """
    x = np.concatenate([m.position for m in channel.moves])
    A = np.stack([wave(2.0 * np.pi * x / period) for wave in (np.ones_like, np.sin, np.cos)], axis=1)
    left = np.concatenate(channel.left)
    rest = left - A @ solve(A, left)
    run = np.repeat(np.arange(len(channel.moves)), [len(m.time) for m in channel.moves])
    time = np.concatenate([m.time for m in channel.moves])
    on = np.zeros(len(left), bool)
    for each in channel.gate.intervals if channel.gate is not None else ():
        on |= (run == each.run) & (time >= each.t0) & (time <= each.t1)
    return bool(np.sum(rest[on] ** 2) > 0.5 * np.sum(left[on] ** 2)) if on.any() else False


def _moves(runs: Sequence[AxisRun], names: Sequence[str], wide: int) -> list[AxisTravel]:
    """How an axis moved in the runs of those names that have it."""
    named = {r.name: r for r in runs if len(r.time) >= ROWS}
    ways = [
        (named[n], named[n].setpoint if np.isfinite(named[n].setpoint).all() else named[n].encoder)
        for n in names
        if n in named
    ]
    return [travel(r.time, way, wide) for r, way in ways if np.isfinite(way).all()]
