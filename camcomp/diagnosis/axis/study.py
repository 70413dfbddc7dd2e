"""Why single axes follow their set-points late and push harder than they should: logs of the control, without any tip.

Following error = lag x speed + (inertia in the loop) x acceleration + friction's reversal + constant.
Drive force     = mass x acceleration + friction + constant + what nobody states.
Inertia and constants belong to every axis and are no causes. Every further term has to prove itself on stretches of time
that it was not fitted on, and what is left there is held against the floor: stated, or the scatter from row to row.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from camcomp.diagnosis.axis import answer
from camcomp.diagnosis.axis.channel_data import BEYOND, ChannelData, base_of
from camcomp.diagnosis.axis.findings import ROWS, AxisFindings, AxisRun
from camcomp.diagnosis.axis.joint import study_channel
from camcomp.diagnosis.axis.law import axis_law
from camcomp.diagnosis.axis.motion import encoder_width, lateness, motion_of
from camcomp.diagnosis.axis.next_moves import next_moves
from camcomp.diagnosis.axis.noise_floor import (
    between_rows,
    by_acceleration_between_rows,
    following_floor,
    rows_floor,
)
from camcomp.diagnosis.axis.surroundings import AxisSurroundings
from camcomp.diagnosis.axis.terms import WIDE, travel
from camcomp.diagnosis.model.discrepancy import with_discrepancy
from camcomp.diagnosis.model.noise import REPEATABILITY_MM, StatedDeviation, instants_apart
from camcomp.diagnosis.model.verdict import Word, decide
from camcomp.diagnosis.result.floor_rule import within_floor
from camcomp.diagnosis.result.standards import StandardValues
from camcomp.diagnosis.result.types import DiagnosisResult, Floor, Outlier, alternatives_of
from camcomp.ground import progress
from camcomp.ground.datatypes import Floats
from camcomp.model.statics.description import Robot

ASYMMETRY = frozenset(("asymmetry_Ns_per_mm", "asymmetry_Nmms_per_rad"))  # of friction
NO_TIPS = "ISO 230-2: the tip was not measured"


def studied(
    axes: Mapping[str, Sequence[AxisRun]],
    *,
    holdout: Sequence[str] = (),
    without: Sequence[str] = (),
    stated: StatedDeviation | None = None,
    robot: Robot | None = None,
) -> tuple[DiagnosisResult, list[AxisFindings]]:
    """Result for logs of axes by name, and the findings of all axes.

    holdout: runs that are judged and never fitted; robot: carries errors to the tip. Raises ValueError where no run of any
    axis has enough rows.
    """
    names = sorted({r.name for runs in axes.values() for r in runs})
    held = [n for n in names if n in holdout] if holdout else names if len(names) > 1 else []
    again = 0 if len(held) == 1 and holdout else len(held)  # fits that leave out one run each
    clean = {name: [r.without_spikes() for r in runs] for name, runs in axes.items()}
    outliers = {(r.name, int(row)) for runs in clean.values() for r, rows in runs for row in rows}
    cleaned = {name: [r.on_ticks().away_from_gaps() for r, _ in runs] for name, runs in clean.items()}
    around = AxisSurroundings(robot, cleaned)
    ask = partial(_every_axis, around=around, without=set(without), stated=stated or StatedDeviation())
    found = [a for a in ask(set(holdout), parts=1 + again) if a.channels]
    if not found:
        raise ValueError(
            "no axis has 50 rows or more of set-points with encoders, nor a slide of encoders with drive forces"
        )
    answer.share_lag(found)
    with progress.part(1.0 / (1 + again), 1.0):
        judged = [ask({one}) for one in progress.steps(held, len(held))] if again else [found] if held else []
    return _result(found, judged, held, around, outliers), found


def _result(
    found: list[AxisFindings],
    judged: Sequence[Sequence[AxisFindings]],
    held: Sequence[str],
    tip: AxisSurroundings,
    outliers: set[tuple[str, int]],
) -> DiagnosisResult:
    """The result of findings of all axes. judged: findings without each of the runs `held`. outliers: runs and rows."""
    whole = sum(len(a.channels) for a in found)  # every channel weighs alike
    causes = [c.model_copy(update={"share": round(c.share / whole, 4)}) for a in found for c in a.causes]
    causes.sort(key=lambda c: (-c.probability, -c.share))
    known = [c.named for c in causes]
    verdict = _verdict(found)
    if verdict == "unknown" or (verdict == "ambiguous" and not causes):
        causes += [answer.unknown(a, whole) for a in found if a.strange or verdict == "ambiguous"]
    gap, every = answer.gap(found, tip), [c for a in found for c in a.channels]
    result = DiagnosisResult(
        verdict=verdict, gap=gap, where=answer.where(found, causes), causes=tuple(causes),
        alternatives=alternatives_of(known) if verdict == "ambiguous" else (),
        shrinkage=answer.shrinkage(judged, held, tip) if judged else None,
        next_experiment=next_moves(found, tip.axes, verdict),
        floor=Floor(um=gap.noise_floor_um, source="stated" if all(c.stated for c in every) else "rows"),
        outliers=tuple(Outlier(run=run, row=row) for run, row in sorted(outliers)),
        axis_laws=tuple(law for a in found for law in a.laws),
        axes_in_detail={a.name: a.details for a in found}, standards=StandardValues(absent=(NO_TIPS,)),
    )  # fmt: skip
    forces = [a.force for a in found if a.strange and a.force is not None]
    return within_floor(result, in_forces=any(c.gate.above for c in forces))


def _every_axis(
    holdout: set[str], around: AxisSurroundings, without: set[str], stated: StatedDeviation, parts: int = 1
) -> list[AxisFindings]:
    """Findings of every axis without the runs held out. parts: how many such fits the progress counts."""
    steps = progress.steps(around.axes.items(), len(around.axes) * parts)
    found = [
        _axis(name=name, runs=list(runs), holdout=holdout, without=without, stated=stated, around=around)
        for name, runs in steps
    ]
    for a in found:
        if a.strange:
            p = [with_discrepancy(min(c.probability, a.imitated.get(c.effect, 1.0))) for c in a.causes]
            a.causes = [c.model_copy(update={"probability": own}) for c, own in zip(a.causes, p, strict=True)]
    return found


def _verdict(found: Sequence[AxisFindings]) -> Word:
    """The verdict; gates that are open leave residuals unconfirmed."""
    causes = [c for a in found for c in a.causes]
    return decide(
        unknown=float(any(a.strange for a in found)), best=min((c.probability for c in causes), default=1.0),
        causes=len(causes), confirmed=all(c.gate.word == "at" for a in found for c in a.channels),
    )  # fmt: skip


@dataclass(frozen=True, eq=False, kw_only=True)
class AxisTask:
    """The task of one axis: its name, usable runs, numbers of those that are fitted and of those that are judged only, effects
    left out, and what is around it.
    """

    name: str
    usable: list[AxisRun]
    train: list[int]
    test: list[int]
    without: set[str]
    around: AxisSurroundings

    @cached_property
    def bodies(self) -> list[Floats] | None:
        """Columns (n, b) of the bodies behind a joint in its torque, per run. None for a slide, and without torques."""
        if not self.train or not any(r.revolute and np.isfinite(r.force).all() for r in self.usable):
            return None
        every = [self.around.bodies(self.name, r, travel(r.time, r.encoder), WIDE[0])[0] for r in self.usable]
        base = base_of([every[k] for k in self.train])
        return [each @ base for each in every]


def _axis(
    name: str, runs: list[AxisRun], holdout: set[str], without: set[str], stated: StatedDeviation,
    around: AxisSurroundings,
) -> AxisFindings:  # fmt: skip
    hinge = any(r.revolute for r in runs)
    found = AxisFindings(name=name, stated=stated, revolute=hinge)
    usable = [r for r in runs if np.isfinite(r.encoder).sum() >= ROWS]
    if not usable:
        return found
    train = [k for k, r in enumerate(usable) if r.name not in holdout]
    test = [k for k, r in enumerate(usable) if r.name in holdout]
    task = AxisTask(name=name, usable=usable, train=train, test=test, without=without, around=around)
    found = _motor(replace(found, wide=encoder_width(usable, train, task.bodies)), task)
    if any(usable[k].load is not None for k in train):
        _study_second_encoder(found, task)
    _name_rest(found)
    if found.strange:
        asked = [(usable[r.number], r.move) for r in found.following.fitted] if found.following else []
        told = [travel(r.time, r.setpoint, found.wide).of(np.isin(r.time, m.time)) for r, m in asked]
        found.law = None if hinge else axis_law(name, found.force, found.following, told)
    return found


def _motor(blank: AxisFindings, task: AxisTask) -> AxisFindings:
    """Findings on following error and drive force; again with friction that differs between the directions, which deflects
    the loop, where the drive force shows it.
    """
    asymmetric = False
    for again in (False, True):
        found = replace(blank, causes=[], imitated={}, unknown_in=[], details={})
        late = _study_following(found, task, asymmetric)
        _study_force(found, task, late)
        asymmetric = any(ASYMMETRY.intersection(c.parameters) for c in found.causes)
        if again or found.following is None or not asymmetric:
            break
    return found


def _study_following(found: AxisFindings, task: AxisTask, asymmetric: bool) -> float | None:
    """Study the following error; returns the mean lateness of the axis in s, None without set-points."""
    every, train = task.usable, task.train
    gaps = [r.gap for r in every]
    if not train or not all(np.isfinite(gaps[k]).all() for k in train):
        return None
    late = lateness(every, gaps, train)
    runs, moves, values = motion_of(found, every, gaps, train, late)
    stated = found.stated_mm
    floor = stated or following_floor([(runs[k].setpoint, runs[k].encoder) for k in train])
    unseen = [
        between_rows(r.time, r.setpoint, late)[np.isin(r.time, m.time)] for r, m in zip(every, moves, strict=True)
    ]
    apart = instants_apart([values[k] for k in train], [moves[k].speed for k in train], floor)
    unsure = [np.hypot(np.abs(own).max(axis=1), apart * m.speed) for own, m in zip(unseen, moves, strict=True)]
    rows = ChannelData(
        channel="following", runs=every, moves=moves, values=values, train=train, test=task.test, floor=floor,
        stated=stated is not None, whole=[(r.time, r.gap) for r in every], asymmetric=asymmetric, ahead=late < 0.0,
        unsure=unsure, between=unseen, between_s2=by_acceleration_between_rows(every[train[0]].time, late),
    )  # fmt: skip
    found.following = study_channel(found, rows, task.around, task.without)
    return late


def _study_force(found: AxisFindings, task: AxisTask, late: float | None) -> None:
    """The drive force."""
    every, train = task.usable, task.train
    if not train or not all(np.isfinite(every[k].force).all() for k in train):
        return
    forces = [r.force for r in every]
    # set-points a while later are no motion of such a loop
    swings = any(c.effect == "servo_overshoot" for c in found.causes)
    followed = found.following.followed(every) if found.following and swings else None
    runs, moves, values = motion_of(found, every, forces, train, late, followed=followed, bodies=task.bodies)
    on = [run.moved() for run in runs]
    moves = [m.of(rows) for m, rows in zip(moves, on, strict=True)]
    values = [own[rows] for own, rows in zip(values, on, strict=True)]
    stated = found.stated_N
    floor = stated or rows_floor([runs[k].force for k in train])
    rows = ChannelData(
        channel="force", runs=every, moves=moves, values=values, train=train, test=task.test, floor=floor,
        stated=stated is not None, whole=[(r.time, r.force) for r in every],
        scatter=rows_floor([every[k].encoder for k in train]),
    )  # fmt: skip
    found.force = study_channel(found, rows, task.around, task.without)


def _study_second_encoder(found: AxisFindings, task: AxisTask) -> None:
    """Second encoder behind the gear against the encoder of the motor."""
    every = [k for k, r in enumerate(task.usable) if r.load is not None]
    runs = [task.usable[k] for k in every]
    train, test = ([every.index(k) for k in part if k in every] for part in (task.train, task.test))
    values = [np.asarray(r.load) - r.encoder for r in runs]
    moves = [travel(r.time, r.encoder, found.wide) for r in runs]
    own = max(rows_floor([r.encoder, np.asarray(r.load)]) for r in runs)
    stated = found.stated_mm
    floor = stated or float(np.hypot(np.sqrt(2.0) * own, REPEATABILITY_MM))
    rows = ChannelData(
        channel="behind", runs=runs, moves=moves, values=values, train=train, test=test, floor=floor,
        stated=stated is not None,
    )  # fmt: skip
    found.behind = study_channel(found, rows, task.around, task.without)


def _name_rest(found: AxisFindings) -> None:
    """What a following error depends on that no cause does; time, where residuals above the floor depend on no covariate, or on
    the position by a ripple alone.
    """
    rubs = any(c.effect == "friction" for c in found.causes)  # that deflects the loop, too
    large = found.following.unmodelled if found.following else {}
    for kind, (share, gain) in sorted(large.items(), key=lambda each: -each[1][0]):
        if not (kind == "friction" and rubs):
            found.unknown_in.append((f"{BEYOND[kind]}:{found.name}", share))
            found.unknown_chance = min(found.unknown_chance, -gain / float(np.log(10.0)))
    if found.unknown_in:
        return
    for channel in found.channels:
        if channel.gate.above:
            stretches = sum(each.share for each in channel.gate.intervals)
            beyond = 0.0 if found.ripple else max(1.0 - channel.floor**2 / max(channel.squares[1], 1e-300), 0.0)
            if stretches or beyond:
                found.unknown_in.append((f"time:{found.name}", stretches or beyond))
