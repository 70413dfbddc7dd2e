"""Motion of a run from its log: set-points, else encoders, else the tip itself, aligned with the program."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache, partial

import numpy as np
from scipy.spatial import KDTree

from camcomp.diagnosis.experiment.log_checks import (
    ASIDE_MM,
    check_followed,
    check_forces,
    check_lines,
    check_on_program,
    check_places,
    places,
)
from camcomp.diagnosis.experiment.logged import Logged
from camcomp.diagnosis.fit.labels import STEP_S
from camcomp.diagnosis.fit.measured import Measured
from camcomp.diagnosis.fit.outliers import FAR_MM
from camcomp.diagnosis.fit.starts import STANDING_MM_PER_S, STOOD_MM
from camcomp.diagnosis.model.noise import IN_A_ROW, REPEATABILITY_MM
from camcomp.gcode.program import Program
from camcomp.ground import path_geometry, shelf
from camcomp.ground.datatypes import RAPID, Bools, Floats, Path
from camcomp.ground.errors import PhysicsError
from camcomp.model.cutting.track import JOIN_ANGLE, Conditions, Track, lay_track
from camcomp.model.effect import Cause
from camcomp.model.motion.alignment import LOST_MM, Aligned, align, way_from_lines
from camcomp.model.motion.driven_path import MAX_CUT_DISTANCE_MM, Forces, cutting_forces
from camcomp.model.motion.run_path import RunPath
from camcomp.model.motion.twin import Twin
from camcomp.model.statics.arm import ARM_LENGTH
from camcomp.model.trajectory.segments import merged

SAMPLE_MM = 2.0  # distance of points of the program for comparisons
STILL_S = 0.1  # duration from which a standstill at the end of a line may be idle time
MOST_PASSES = 8  # of the alignment with a deflected tip


@dataclass(frozen=True, eq=False, kw_only=True)
class DrivenRun:
    """Run path of a log.

    by: channel of the motion ("setpoint", "encoder", "tip"); unsure (n,): rows with an unknown commanded position, whose tip
    is no evidence; guessed (n, m): actuators with an unknown commanded position; turn (n, 3, 3): rotation from program axes
    to directions along and across the path, if the tip is the motion.
    """

    run_path: RunPath
    by: str
    unsure: Bools
    guessed: Bools
    turn: Floats | None
    lag: int


@dataclass(frozen=True, eq=False, kw_only=True)
class _Program:
    """A program with its loads and sampled positions: tips (s, 3) mm, program frame, and actuators (s, m).

    merged: its path with lines merged by the controller, or None; rests (n,): motions with a stop at their end.
    rotation (s, 3, 3): of the platform at the sampled positions, machine frame; None: the one that the machine holds.
    """

    track: Track
    merged: Path | None
    rests: Bools
    tips: Floats
    rho: Floats
    rotation: Floats | None

    @property
    def feed(self) -> float:
        feeds = self.track.path.feed[(self.track.path.kind != RAPID) & np.isfinite(self.track.path.feed)]
        return float(np.median(feeds)) if len(feeds) else np.nan


def drive(log: Logged, text: Program | None, conditions: Conditions) -> DrivenRun:
    """The run of a log; text: its program, or None. Raises ConfigError CC402, CC406 to CC408."""
    twin = log.twin
    program = None if text is None else _open(text, conditions, twin)
    by = _channel(log, has_program=program is not None)
    if by == "tip" and program is not None:
        return _led_by_tip(log, program)
    rho, guessed = _commanded(log, by)
    if program is not None:
        check_on_program(log, by, rho, program.rho)
    tip, turned = _forward(twin, rho, *_near(log, rho, program))
    aligned = None if program is None else _aligned(log, program, tip)
    check = partial(check_places, log, rho=rho, tip=tip)
    cut: Aligned | None = None
    try:
        if program is not None and by == "setpoint":
            cut = _behind(log, tip, turned, program)
    except PhysicsError:  # also for encoders in another unit
        check(loaded=lambda: tip)
        raise
    forces, idle = _forces_at_rows(program, aligned, cut, tip, log)
    run_path = log.path(rho, tip, forces, turned)
    if program is None:
        run_path = replace(run_path, measured_force=True)
    else:
        run_path = replace(
            run_path, feed_mm_per_min=program.feed, cut_ahead_min=_cut_ahead(program, aligned),
            told=by == "setpoint" and cut is None,
        )  # fmt: skip
    loaded = cache(lambda: twin.sense(run_path)[0])
    check(loaded=lambda: loaded().tip)
    check_forces(log, run_path.row_force, lambda: loaded().drive)
    return DrivenRun(
        run_path=run_path, by=by, unsure=np.asarray(guessed.any(axis=1)) | idle, guessed=guessed, turn=None,
        lag=0 if aligned is None else aligned.lag,
    )  # fmt: skip


def _channel(log: Logged, *, has_program: bool) -> str:
    """Channel of the motion: set-points, else encoders, else the tip along a program. Raises ConfigError CC402."""
    by = next((each for each in ("setpoint", "encoder", "tip") if log.measured.has(each)), "")
    if not by or (by == "tip" and not has_program):
        raise log.refusal("CC402", " has neither a program nor set-points: the commanded motion is unknown")
    return by


def _commanded(log: Logged, by: str) -> tuple[Floats, Bools]:
    """Actuators (n, m) of the channel `by` over time, and a mask (n, m) of those that are unknown. Raises CC404."""
    logged, time = getattr(log.measured, by), log.measured.time
    if np.isfinite(logged).sum(axis=0).min() < 2:
        raise log.refusal("CC404", f": hardly a row holds the {by} of every actuator")
    guessed = [
        _guessed(time, v, REPEATABILITY_MM / (ARM_LENGTH if hinge else 1.0))
        for v, hinge in zip(logged.T, log.revolute, strict=True)
    ]
    return log.over_time(logged), np.column_stack(guessed)


def _forces_at_rows(
    program: _Program | None, aligned: Aligned | None, cut: Aligned | None, tip: Floats, log: Logged
) -> tuple[Forces, Bools]:
    """Cutting forces at the rows, and a mask (n,) of rows at standstill that may be idle.

    cut: positions of the drives on the program, where they are behind the set-points `aligned`.
    """
    if program is None or aligned is None:
        return _measured_forces(log.measured, log.twin), np.zeros(len(tip), bool)
    forces = _program_forces(program, cut or aligned, tip, log.measured)
    idle = _idle_or_not(forces, aligned, program, tip, log.measured.time)
    # at standstill in a cut the drives may carry the cutting force or not
    return replace(forces, doubt=np.where(idle[:, None], 0.5 * np.abs(forces.force), forces.doubt)), idle


def _program_forces(
    program: _Program, aligned: Aligned, tip: Floats, measured: Measured, max_distance_mm: float = MAX_CUT_DISTANCE_MM
) -> Forces:
    """Cutting forces of the program at tips (n, 3) mm aligned with it."""
    return cutting_forces(
        track=program.track, aligned=aligned, tip=tip, time=measured.time, rests=program.rests,
        logged_line=bool(np.isfinite(measured.line).any()), max_distance_mm=max_distance_mm,
    )  # fmt: skip


def _measured_forces(measured: Measured, twin: Twin) -> Forces:
    """Cutting force of a log without program: what the dynamometer measured, none without one.

    An empty cell lies between its neighbours in time, with their difference as doubt.
    """
    force = measured.force()
    known = np.asarray(np.isfinite(measured.dyno[:, np.isfinite(measured.dyno).any(axis=0)]).all(axis=1))
    around = np.append(np.flatnonzero(known), len(known) - 1)
    after = np.searchsorted(around[:-1], np.arange(len(known)))
    apart = np.abs(force[around[after]] - force[around[np.maximum(after - 1, 0)]])
    doubt = np.where(known[:, None], 0.0, apart)
    force, doubt = force @ twin.rotation, np.abs(doubt @ twin.rotation)  # from the machine to the program frame
    return replace(Forces.none(len(known)), force=force, doubt=doubt)


def _open(program: Program, conditions: Conditions, twin: Twin) -> _Program:
    path = program.path
    track = lay_track(path, conditions)
    rests = np.fromiter((mode.exact for mode in program.modes), np.bool_, len(path)) | np.append(
        np.asarray(path.waits)[1:], True
    )
    length = path_geometry.lengths(path)
    from_known = np.concatenate([[False], path.known[:-1]])
    moves = np.flatnonzero(((path.kind != RAPID) | from_known) & (length > 0.0) & ~path.machine)
    if not len(moves):
        moves = np.flatnonzero(length > 0.0)
    count = np.maximum(np.ceil(length[moves] / SAMPLE_MM), 1.0).astype(np.int64)
    motion = np.repeat(moves, count + 1)
    u = np.concatenate([np.linspace(0.0, 1.0, c + 1) for c in count]) if len(count) else np.zeros(0)
    tips, rotation = path_geometry.points(path, motion, u), twin.platform(path, motion, u)
    rho = twin.inverse(twin.to_machine(tips), rotation)
    one = merged(path, program.modes)
    return _Program(track=track, merged=one, rests=rests, tips=tips, rho=rho, rotation=rotation)


def _forward(twin: Twin, rho: Floats, near: Floats, turned: Floats | None) -> tuple[Floats, Floats | None]:
    """Tips (n, 3), program frame, and rotations (n, 3, 3) of the platform, of actuators rho (n, m) near tips and rotations."""
    if turned is None:
        return twin.to_program(twin.forward(rho, twin.to_machine(near))), None
    tip, turned = twin.forward_pose(rho, twin.to_machine(near), turned)
    return twin.to_program(tip), turned


def _near(log: Logged, rho: Floats, program: _Program | None) -> tuple[Floats, Floats | None]:
    """Tips (n, 3), program frame, and rotations (n, 3, 3) of the platform near those of actuators rho (n, m)."""
    if program is not None:
        _, index = KDTree(program.rho).query(rho)
        return program.tips[index], None if program.rotation is None else program.rotation[index]
    known = np.asarray(np.isfinite(log.measured.tip).all(axis=1))
    if not known.any():
        raise log.refusal("CC402", " has neither a program nor measured tips: its place is not known")
    return log.over_time(log.measured.tip, known), None


def _aligned(log: Logged, program: _Program, tip: Floats, aside_mm: float = ASIDE_MM) -> Aligned:
    """Positions of the tip (n, 3) on its program, mostly within aside_mm of the path. Raises ConfigError CC406.

    An aside_mm above ASIDE_MM is for machines with large deflections, whose tip may be nearer to another pass.
    """
    path, line = program.track.path, log.measured.line
    known = np.isfinite(line) & (line > 0)
    if known.any() and not np.isin(line[known], path.line).any():
        lines = sorted({int(each) for each in line[known]})[:5]
        raise log.refusal("CC406", f": the rows are on lines that the program does not move on, e.g. {lines}")
    found = align(path, tip, line, max(aside_mm, LOST_MM))
    check_followed(log, found.distance[places(tip)], _agreement(path, found, tip), aside_mm)
    if aside_mm <= ASIDE_MM:
        check_lines(log, way_from_lines(path, found))
    return found


def _cut_ahead(program: _Program, aligned: Aligned | None) -> float:
    """Minutes of cutting in the program before the log begins, for tool wear.

    From the first row on a cut, because before it the tool may be nearest to the end of the program.
    """
    track = program.track
    if aligned is None or track.conditions.model is None:
        return 0.0
    near = aligned.distance < max(ASIDE_MM, float(np.median(aligned.distance)))  # a tool may bend by more
    cuts = np.flatnonzero(np.isin(aligned.motion, track.motion[track.cutting]) & near)
    return track.minutes_cut(int(aligned.motion[cuts[0]]), float(aligned.share[cuts[0]])) if len(cuts) else 0.0


def _behind(log: Logged, tip: Floats, turned: Floats | None, program: _Program) -> Aligned | None:
    """Positions of the drives on the program, behind set-points of tips (n, 3) mm, for the direction of the force.

    None without logged encoders, or if more than a delay separates them from the path.
    """
    if np.isfinite(log.measured.encoder).sum(axis=0).min() < 2:
        return None
    driven = _forward(log.twin, log.over_time(log.measured.encoder), tip, turned)[0]
    found = align(program.track.path, driven, log.measured.line)
    return found if float(np.median(found.distance)) < ASIDE_MM else None


def _path_length(path: Path, at: Aligned) -> Floats:
    """Path length (n,) mm from the start of the program to positions on it."""
    length = path_geometry.lengths(path)
    return np.asarray(np.concatenate([[0.0], np.cumsum(length)])[at.motion] + at.share * length[at.motion])


def _agreement(path: Path, found: Aligned, tip: Floats) -> float:
    """Share of the moving rows in the direction of the program, 1 if no row moves."""
    at = _path_length(path, found)
    step = np.linalg.norm(np.diff(tip, axis=0), axis=1)
    moving = step > STOOD_MM
    return float(np.mean(np.diff(at)[moving] > -0.5 * step[moving])) if moving.any() else 1.0


def _guessed(time: Floats, values: Floats, most: float) -> Bools:
    """Mask (n,) of empty cells whose interpolation is uncertain.

    Their neighbours are distant in time, or the change of speed there allows an error above `most`.
    """
    known = np.isfinite(values)
    out = ~known
    if known.all() or len(time) < 3:
        return out
    at, usual = time[known], float(np.median(np.diff(time)))
    speed = np.diff(values[known]) / np.diff(at)
    k = np.clip(np.searchsorted(at, time[out]), 1, len(at) - 1)
    here, before, after = k - 1, np.maximum(k - 2, 0), np.minimum(k, len(speed) - 1)
    turns = np.maximum(np.abs(speed[here] - speed[before]), np.abs(speed[after] - speed[here]))
    aside = turns * np.minimum(time[out] - at[k - 1], at[k] - time[out])
    near = (at[k] - at[k - 1] < IN_A_ROW * usual) & (time[out] >= at[0]) & (time[out] <= at[-1])
    out[out] = ~near | (aside > most)
    return out


def _idle_or_not(forces: Forces, aligned: Aligned, program: _Program, tip: Floats, time: Floats) -> Bools:
    """Mask (n,) of rows at standstill where a cutting line begins or ends, so that its execution is uncertain."""
    path = program.track.path
    ends = (
        np.min([np.linalg.norm(at[aligned.motion] - tip, axis=1) for at in (path.start, path.end)], axis=0) < STOOD_MM
    )
    step = np.linalg.norm(np.diff(tip, axis=0), axis=1)
    still = ends & np.concatenate([[False], step < STOOD_MM]) & np.concatenate([step < STOOD_MM, [True]])
    out = np.zeros(len(tip), bool)
    edge = np.flatnonzero(np.diff(np.concatenate([[0], still.astype(int), [0]])))
    for a, b in zip(edge[::2], edge[1::2], strict=True):
        if time[b - 1] - time[a] > STILL_S and forces.cutting[a:b].any():
            out[a:b] = True
    return out


def _led_by_tip(log: Logged, program: _Program) -> DrivenRun:
    """Run of a measured tip aligned with the program: its timing is free, and only its lateral deviation is evidence."""
    path, twin, measured = program.track.path, log.twin, log.measured
    known = np.asarray(np.isfinite(measured.tip).all(axis=1))
    check_on_program(log, "tip", measured.tip[known], program.tips)
    whole = log.over_time(measured.tip, known)
    bend, changed = np.zeros_like(whole), np.inf
    # a deflected tip is off its program by an unknown amount at first, and its position on arcs depends on the deflection
    for beside in (np.inf, *[MAX_CUT_DISTANCE_MM] * MOST_PASSES):
        aligned = _aligned(log, program, whole - bend, ASIDE_MM if beside < np.inf else FAR_MM)
        way, on = _driven(
            path=path, aligned=aligned, other=program.merged, tip=whole - bend, line=measured.line, known=known
        )
        tip = path_geometry.points(way, on.motion, on.share)
        forces = _program_forces(program, aligned, tip, measured, beside)
        turned = twin.platform(way, on.motion, on.share)
        run_path = log.path(twin.inverse(twin.to_machine(tip), turned), tip, forces, turned)
        loaded = twin.sense(run_path)[0].tip
        last, changed = changed, float(np.sqrt(np.mean(np.sum((loaded - tip - bend) ** 2, axis=1))))
        bend = loaded - tip
        if beside < np.inf and (changed < REPEATABILITY_MM or changed > last):
            break
    unsure = ~known | (aligned.distance > ASIDE_MM) | _idle_or_not(forces, aligned, program, tip, measured.time)
    unsure |= _from_anywhere(way, on) | _at_corners(way, on, measured.time, log.acceleration)
    later = Cause("time_sync", shelf.load("effects", "time_sync"), None, {"offset_s": -STEP_S})
    velocity = (twin.sense(run_path, [later])[0].tip - loaded) / STEP_S
    run_path = replace(run_path, feed_mm_per_min=program.feed, led=True, cut_ahead_min=_cut_ahead(program, aligned))
    guessed = np.zeros((len(tip), len(twin.actuators)), bool)
    return DrivenRun(
        run_path=run_path, by="tip", unsure=unsure, guessed=guessed, turn=_across(way, on, velocity), lag=aligned.lag
    )


def _driven(
    path: Path, aligned: Aligned, other: Path | None, tip: Floats, line: Floats, known: Bools
) -> tuple[Path, Aligned]:
    """The driven path, as programmed or with merged lines, and the positions of the tip (n, 3) on it.

    The choice is the path from which the distance of the tip varies less, for any constant deflection.
    """
    if other is None:
        return path, aligned
    found = align(other, tip, line, max(FAR_MM, LOST_MM))
    ways = [(path, aligned), (other, found)]
    off = [(tip - path_geometry.points(way, on.motion, on.share))[known] for way, on in ways]
    usual = [float(np.median(np.sum((each - np.median(each, axis=0)) ** 2, axis=1))) for each in off]
    return ways[int(usual[1] < usual[0])]


def _from_anywhere(path: Path, aligned: Aligned) -> Bools:
    """Mask (n,) of rows before the first programmed position, whose start is unknown."""
    named = np.concatenate([[False], path.known[:-1]]) if path.known.any() else np.arange(len(path)) > 0
    begins = named & ~np.concatenate([[False], named[:-1]])
    return np.asarray(~named[aligned.motion] | (begins[aligned.motion] & (aligned.share <= 0.0)))


def _at_corners(path: Path, aligned: Aligned, time: Floats, acceleration: float) -> Bools:
    """Mask (n,) of rows near blended corners of a path, within the braking distance at `acceleration`, mm/s2."""
    length = path_geometry.lengths(path)
    moves = np.flatnonzero(length > 0.0)
    ends = path_geometry.tangents(path, moves[:-1], np.ones(len(moves) - 1))
    begins = path_geometry.tangents(path, moves[1:], np.zeros(len(moves) - 1))
    turns = np.sum(ends * begins, axis=1) < np.cos(JOIN_ANGLE)
    corner = np.cumsum(length)[moves[:-1]][turns]
    at = _path_length(path, aligned)
    if not len(corner) or len(at) < 2:
        return np.zeros(len(at), bool)
    step = np.abs(np.diff(at))
    braking = (step / np.diff(time)) ** 2 / (2.0 * acceleration)
    reach = np.maximum(np.append(step + braking, 0.0), np.concatenate([[0.0], step + braking]))
    next_one = np.clip(np.searchsorted(corner, at), 0, len(corner) - 1)
    away = np.minimum(np.abs(corner[next_one] - at), np.abs(corner[np.maximum(next_one - 1, 0)] - at))
    return np.asarray(away < reach)


def _across(path: Path, aligned: Aligned, velocity: Floats) -> Floats:
    """Axes (n, 3, 3) along the velocity (n, 3) mm/s of the loaded tip and across it; at standstill along the path."""
    along = path_geometry.tangents(path, aligned.motion, aligned.share)
    speed = np.linalg.norm(velocity, axis=1, keepdims=True)
    along = np.where(speed > STANDING_MM_PER_S, velocity / np.maximum(speed, 1e-12), along)
    return axes_along(along)


def axes_along(along: Floats) -> Floats:
    """Axes (n, 3, 3) of unit directions (n, 3): along, and two across."""
    side = np.cross(along, np.eye(3)[np.argmin(np.abs(along), axis=1)])
    side /= np.maximum(np.linalg.norm(side, axis=1, keepdims=True), 1e-12)
    return np.stack([along, side, np.cross(along, side)], axis=1)
