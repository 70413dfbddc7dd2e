"""Response of the whole machine to commanded tips: controller, drives, loaded structure, tool, workpiece.

Without effects in the config this is the loaded equilibrium alone. With effects the same hooks act in the same order as
in the twin, on a sequence of points in the order of travel; their correction is found by seed eq. (5) on top of the
exact solution of the structure. Effects of sensors change no part and do not act.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from typing import Any

import numpy as np

from camcomp.ground.datatypes import Bools, Floats
from camcomp.ground.records import replace
from camcomp.ground.vectors import largest
from camcomp.model import signal_path
from camcomp.model.effect import Load, Motion
from camcomp.model.finite import not_finite
from camcomp.model.hysteresis import ways
from camcomp.model.job import Job
from camcomp.model.motion.travel import (
    STILL_MM,
    WORDS,
    Travel,
    ahead_of_loops,
    lead,
    motion_of,
    set_point_rates,
    set_points,
    tips_per_set_point,
    without_inverted_loops,
)
from camcomp.model.statics.lengths import LENGTH_STEP_MM, lengthened
from camcomp.model.statics.machine import Machine, build_machine
from camcomp.model.statics.masses import MassLoads, has_moved_mass, mass_loads, mass_loads_around
from camcomp.model.statics.rotation import exp_rotation
from camcomp.model.statics.solve import FREE, State, inverse, solve, with_rows
from camcomp.model.statics.target import Correction, correct, settle

SETTLED_MM = 2e-5  # residual at which the correction of effects ends
MAX_AIM_STEPS = 50  # reversing friction in a soft drive reduces the residual by only a tenth per step
FARTHER = 2.0  # times the squared residual before: growth beyond which steps are halved
AROUND_S = 0.03  # half width of the difference for the acceleration: 0.6 mm at 20 mm/s
AHEAD_MM = 2.0  # more than any play
SURELY = 1.5  # times the play: farthest position of an encoder that is checked for a flank
LEAST_MM = 2e-4  # smallest reversal after which a drive is moved through its play
GOES_ALONG = 1e-2  # weight of the others
RATE_STEP = 1e-2  # mm at POSE_SCALE
POSE_SCALE = np.array([1.0, 1.0, 1.0, 1e3, 1e3, 1e3])  # mm per mm, mm per rad of a platform: 1 urad counts as 1 nm
HINGE_MM = 1e3  # mm per rad of a hinge, where limits in mm apply to it: an arm of 1 m


class LatestSolutions:
    """Solutions of the same points in one step after the other: only points whose inputs changed are solved again."""

    def __init__(self) -> None:
        self._known: dict[str, tuple[dict[str, Floats | None], Any]] = {}

    def of(self, name: str, solved: Callable[..., Any], **inputs: Floats | None) -> Any:
        """solved(**inputs), an array or a State of n points; name: of what is asked."""
        if name in self._known:
            before, known = self._known[name]
            pairs = [(each, before[key]) for key, each in inputs.items() if each is not None]
            changed = np.logical_or.reduce([(a != b).reshape(len(a), -1).any(axis=1) for a, b in pairs])
            rows = np.flatnonzero(changed)
            if not len(rows):
                return known
            if len(rows) < len(changed):
                own = solved(**{key: None if each is None else each[rows] for key, each in inputs.items()})
                known = known.with_rows(rows, own) if isinstance(known, State) else with_rows(known, rows, own)
                self._known[name] = inputs, known
                return known
        self._known[name] = inputs, solved(**inputs)
        return self._known[name][1]


def respond(
    job: Job, commanded: Floats, travel: Travel, nominal_of: Floats | None = None, *, before: Floats | None = None,
    rho: Floats | None = None, tips_only: bool = False, latest: LatestSolutions | None = None,
) -> tuple[Floats, Correction]:  # fmt: skip
    """Loaded tips (n, 3) of commanded tips (n, 3), both in the program frame, and the states of the machine.

    nominal_of (n, 3): tips whose inverse kinematics go into rho_nominal of the states; the commanded ones by default.
    before (3,): commanded tip before the first one; the memory of drives depends on it.
    rho (n, m): set-points of the actuators; those that the control computes from the commanded tips by default.
    tips_only: drive and tilt of the states are not used. latest: solutions of a step before, at nearly the same points.
    """
    if before is not None and job.causes and len(commanded):
        rows = np.concatenate(([0], np.arange(len(commanded))))
        other = None if nominal_of is None else nominal_of[rows]
        if rho is not None:
            begin = inverse(job.real_machine, job.frame.to_machine(before[None]))
            rho = np.concatenate((begin, rho))
        tip, found = respond(
            job, np.concatenate((before[None], commanded)), travel.take(rows), other, rho=rho, tips_only=tips_only,
            latest=latest,
        )  # fmt: skip
        return tip[1:], found.take(slice(1, None))
    told = job.frame.to_machine(commanded)
    aim = None if nominal_of is None else job.frame.to_machine(nominal_of)
    if not job.causes:
        loaded, settled = settle(
            job.real_machine, told, travel.force, None, aim, rotation=travel.rotation, tips_only=tips_only
        )
        return _finite(job, job.frame.to_program(loaded), settled)
    latest = latest or LatestSolutions()
    told_points = partial(set_points, job)
    nominal = latest.of("set-points", told_points, told=told, force=travel.force, rotation=travel.rotation)
    setpoint = nominal if rho is None else rho
    motion = motion_of(job, setpoint, travel)
    loading = cache(partial(signal_path.loaded, job.causes, motion, travel.force))
    if aim is not None:
        nominal = latest.of("nominal", told_points, told=aim, force=travel.force, rotation=travel.rotation)
    masses = cache(partial(_mass_loads, job, nominal, travel)) if has_moved_mass(job.real_machine.robot) else None
    held = cache(partial(_held, job, told, motion, travel, latest=latest))
    motion = replace(motion, names=job.real_machine.actuators, held=held, told=lambda: commanded, masses=masses)
    error, guided = signal_path.driven(job.causes, job.real_machine.actuators, motion)
    effort = signal_path.drive_forces(job.causes, job.real_machine.actuators, guided)
    load = loading()
    carriage = motion.encoder + error
    state = latest.of(
        "tips", partial(solve, job.real_machine, FREE, tips_only=tips_only), near=told, aim_rotation=travel.rotation,
        force=load.force, wrench=load.wrench, rho=carriage,
    )  # fmt: skip
    drive = state.drive if effort is None else state.drive + effort
    grown = signal_path.grown(job.causes, job.real_machine.actuators, motion)
    tip = state.tip + _lengthening(job, told, grown, travel.rotation)
    tip = signal_path.led(job.causes, tip, motion, job.real_machine.nominal, job.frame.origin)
    tip = job.frame.to_program(signal_path.posed(job.causes, tip, load, motion))
    tip = signal_path.placed(job.causes, signal_path.clamped(job.causes, tip), load, motion)
    state = replace(state, commanded=told, rho=setpoint, rho_nominal=nominal, drive=drive)
    return _finite(job, tip, Correction.of(state, state.passes))


def _held(job: Job, told: Floats, motion: Motion, travel: Travel, latest: LatestSolutions | None = None) -> Floats:
    """Drive forces (n, m) under load for carriages at their encoders, near the tips `told` (n, 3), machine frame."""
    load = signal_path.loaded(job.causes, motion, travel.force)
    where: State = (latest or LatestSolutions()).of(
        "held", partial(solve, job.real_machine, FREE, check=False), near=told, aim_rotation=travel.rotation,
        force=load.force, wrench=load.wrench, rho=motion.encoder,
    )  # fmt: skip
    return np.nan_to_num(where.drive)


def _mass_loads(job: Job, rho: Floats, travel: Travel) -> MassLoads:
    """Loads of the masses at set-points rho (n, m); zero at points out of reach.

    Drives accelerate masses along smooth parts of the path only, because a program does not state the deceleration at
    corners and stops.
    """
    robot, around = job.real_machine.robot, travel.around
    loads = mass_loads(robot, np.nan_to_num(rho))
    if around is not None:
        tips = (job.frame.to_machine(each) for each in around)
        near = [inverse(job.real_machine, each, travel.rotation) for each in tips]
        known = np.isfinite(rho).all(axis=1) & np.isfinite(near).all(axis=(0, 2))
        moved = mass_loads_around(robot, rho[known], [each[known] for each in near], AROUND_S)
        loads.drive[known] = moved.drive
    return loads


def _lengthening(job: Job, told: Floats, grown: Floats | None, rotation: Floats | None) -> Floats:
    """Displacement (n, 3) mm of commanded tips (n, 3), machine frame, by links that are longer by `grown` (n, m) mm.

    rotation (n, 3, 3): commanded orientations.
    """
    out = np.zeros_like(told)
    if grown is None:
        return out
    machine, none = job.real_machine, np.zeros_like(told)
    aim = told, rotation
    rho = inverse(machine, *aim)
    here = _turned(machine, *aim, force=none, rho=rho).tip
    for j in np.flatnonzero(grown.any(axis=0)):
        longer = build_machine(lengthened(machine.robot, machine.actuators[j], LENGTH_STEP_MM), machine.nominal)
        way = _turned(longer, *aim, force=none, rho=rho).tip - here
        out += way / LENGTH_STEP_MM * grown[:, j, None]
    return out


def _turned(machine: Machine, told: Floats, rotation: Floats | None, **given: Any) -> State:
    return solve(machine, FREE, told, aim_rotation=rotation, check=False, **given)


def _finite(job: Job, tip: Floats, state: Correction) -> tuple[Floats, Correction]:
    """Return both unchanged. Raises PhysicsError CC306 for a solved point that is not finite."""
    known = [np.isfinite(largest(each)) for each in (tip, state.drive, state.rho)]
    bad = ~np.logical_and.reduce(known) & (state.status == 0)
    if bad.any():
        x, y, z = state.commanded[int(np.argmax(bad))]
        raise not_finite(job.config, f"the loaded tip at X{x:.4f} Y{y:.4f} Z{z:.4f} (machine frame, mm)")
    return tip, state


def aim_at(job: Job, target: Floats, travel: Travel, method: str, *, tips_only: bool = False) -> Correction:
    """Commands that bring the loaded tips to the targets (n, 3); `commanded` of the result is in the program frame.

    tips_only: only `commanded` and `status` of the result are used.
    """
    found = without_drives(job, target, travel, method, tips_only=tips_only and not job.causes)
    commanded = job.frame.to_program(found.commanded)
    if job.causes and method != "linear":
        loops, job = without_inverted_loops(job.correctable, words=True)
        commanded = commanded + _through_play(job, found, travel)
        share, least, near = 1.0, np.inf, commanded
        rings = bool(signal_path.acting(job.causes, "control"))
        near_target = target if has_moved_mass(job.real_machine.robot) else None  # masses move with the target
        latest = LatestSolutions()  # a drive that stands in its play takes all steps, and most points only a few
        for _ in range(MAX_AIM_STEPS):
            tip, state = respond(job, commanded, travel, near_target, tips_only=True, latest=latest)
            left = target - tip
            size = float(np.nansum(left**2))
            if rings and size > FARTHER * least:  # an oscillating loop overshoots
                share, commanded, least = 0.5 * share, near, np.inf
                continue
            if size < least:
                least, near = size, commanded
            # in an oscillating loop no point is left alone, since each moves those after it
            moved = np.isfinite(left) & (rings | (largest(left) > STILL_MM))[:, None]
            commanded = commanded + share * np.where(moved, left, 0.0)
            found = replace(found, status=np.where(found.status == 0, state.status, found.status))
            if not np.abs(left).max(initial=0.0) > SETTLED_MM:
                break
        commanded = ahead_of_loops(job, loops, commanded, travel, found.status == 0)
    return replace(found, commanded=commanded)


def aim_pose(
    job: Job, commanded: Floats, target: Floats, travel: Travel, on: Bools, *, before: Floats | None = None
) -> Correction:
    """Set-points that bring loaded tips to targets (n, 3), program frame, and the platform to its held orientation.

    For machines with six actuators. commanded (n, 3): tips of the written program, whose inverse kinematics are the
    set-points of all points outside the mask `on` (n,). Signal path and memory of drives as for words.
    """
    told = job.frame.to_machine(commanded)
    exact = without_drives(job, target, travel, pose=True)
    rho = inverse(job.real_machine, told)
    on = on & (exact.status == 0)
    rho[on] = exact.rho[on]
    if not job.causes:
        drive = np.where(on[:, None], exact.drive, np.nan)
        return replace(exact, rho=rho, drive=drive)
    loops, aimed = without_inverted_loops(job.correctable, words=False)
    if on.any():
        rho[on] -= _lost_motion(aimed, exact.rho[on], exact.drive[on], travel.take(np.flatnonzero(on)))
    rates = np.nan_to_num(_rates(job, job.frame.to_machine(target)))
    share, least, near = 1.0, np.inf, rho
    rings = bool(signal_path.acting(aimed.causes, "control"))
    for _ in range(MAX_AIM_STEPS):
        tip, state = respond(aimed, commanded, travel, target, before=before, rho=rho)
        left = np.column_stack((job.frame.vectors(target - tip), -state.tilt))
        left = np.where(on[:, None] & np.isfinite(left), left, 0.0)
        size = float((left * POSE_SCALE).ravel() @ (left * POSE_SCALE).ravel())
        if rings and size > FARTHER * least:
            share, rho, least = 0.5 * share, near, np.inf
            continue
        if size < least:
            least, near = size, rho
        if not np.abs(left * POSE_SCALE).max(initial=0.0) > SETTLED_MM:
            break
        rho = rho + share * np.einsum("nij,nj->ni", rates, left)
    if aimed is not job:
        rho = np.where(on[:, None], lead(aimed, loops, state.rho, travel), state.rho)
        state = respond(job, commanded, travel, target, before=before, rho=rho)[1]
    return state


def _rates(job: Job, tip: Floats) -> Floats:
    """Derivatives (n, m, 6) of the set-points by tip, mm, and by rotation of the platform about it, rad; machine axes."""
    machine = job.real_machine
    held = machine.nominal.held_rotation
    out = []
    for axis in np.eye(3):
        out.append([inverse(machine, tip + s * RATE_STEP * axis) for s in (1, -1)])
    for axis in np.eye(3):
        turned = [exp_rotation(s * RATE_STEP / POSE_SCALE[3] * axis) @ held for s in (1, -1)]
        out.append([inverse(machine, tip, R) for R in turned])
    steps = 2.0 * RATE_STEP / POSE_SCALE
    return np.stack([(a - b) / step for (a, b), step in zip(out, steps, strict=True)], axis=2)


def acting_force(job: Job, rho: Floats, travel: Travel, at: Bools) -> Floats:
    """Force (n, 3) N on the tool at set-points rho (n, m), machine frame, with the effects on the force, at some points."""
    if not signal_path.acting(job.causes, "process"):
        return travel.force[at]
    travel = travel.take(at)
    return signal_path.loaded(job.causes, motion_of(job, rho, travel), travel.force).force


def without_drives(
    job: Job, target: Floats, travel: Travel, method: str = "newton", *, pose: bool = False, tips_only: bool = False
) -> Correction:
    """Commands, machine frame, that bring the loaded tips to the targets (n, 3) for drives without errors.

    pose: also the platform to the orientation of the travel; `rotation` of the result is then the commanded one.
    tips_only: only the commanded tips and the status of the result are used.
    `rho` of the result is the required position of the carriages, whatever the errors of the drives.
    """
    load = Load(travel.force, np.zeros((len(target), 6)))
    if job.causes:
        told = job.frame.to_machine(target)
        nominal = set_points(job, told, travel.force, travel.rotation)
        load = signal_path.loaded(job.causes, motion_of(job, nominal, travel), travel.force)
    aim = job.frame.to_machine(target)
    return correct(
        job.real_machine, aim, load.force, load.wrench, method, pose=pose, rotation=travel.rotation, tips_only=tips_only
    )


def _through_play(job: Job, found: Correction, travel: Travel) -> Floats:
    """Displacement (n, 3) mm of the commanded tips that moves every drive through its play where its carriage reverses.

    Eq. (5) alone would pass the play in steps of the residual.
    """
    solved = np.flatnonzero(found.status == 0)
    travel = travel.take(solved)
    lag = _lost_motion(job, found.rho[solved], found.drive[solved], travel)
    out = np.zeros((len(found.status), 3))
    if lag.any():
        out[solved] = _tip_way(job, found.commanded[solved], -lag, travel)
    return out


def _lost_motion(job: Job, carriage: Floats, drive: Floats, travel: Travel) -> Floats:
    """Lost motion (n, m), carriage minus encoder, for carriages (n, m) that pass through their play at once.

    drive (n, m): drive forces there.
    """
    length = way_per_unit(job)
    sense = ways(carriage * length, LEAST_MM)
    motion = replace(motion_of(job, carriage + AHEAD_MM / length * sense, travel), held=lambda: drive)
    lag = _by_memory(job, motion)
    lag[sense == 0.0] = 0.0
    return lag


def _by_memory(job: Job, motion: Motion) -> Floats:
    """Carriage minus encoder (n, m) of a motion minus that of poses with the same loads."""
    still = replace(motion, ordered=False, direction=np.zeros_like(motion.encoder))
    return _drive_errors(job, motion) - _drive_errors(job, still)


def behind_encoders(job: Job, commanded: Floats, travel: Travel) -> tuple[Floats, Floats]:
    """Encoders (n, m) of commanded tips (n, 3), program frame, and carriage minus encoder (n, m) by the memory of drives."""
    told = job.frame.to_machine(commanded)
    motion = motion_of(job, inverse(job.real_machine, told, travel.rotation), travel)
    motion = replace(motion, held=cache(partial(_held, job, told, motion, travel)))
    return motion.encoder, _by_memory(job, motion)


def _tip_way(job: Job, tip: Floats, by: Floats, travel: Travel) -> Floats:
    """Displacement (n, 3) mm of the tip, program frame, that moves the actuators by `by` (n, m), to first order.

    With more actuators than X, Y, Z can move independently, the others move along.
    """
    slopes = set_point_rates(job, tip, travel)
    if by.shape[1] > WORDS:
        slopes = np.where((by != 0.0)[:, :, None], slopes, GOES_ALONG * slopes)
    way = np.einsum("nkm,nm->nk", tips_per_set_point(slopes), by)
    out: Floats = way @ job.frame.rotation
    return out


def way_per_unit(job: Job) -> Floats:
    """Travel (m,) in mm per unit of the actuators: 1 for slides, HINGE_MM for hinges."""
    return np.where(job.real_machine.revolute, HINGE_MM, 1.0)


def plays(job: Job, found: Correction, travel: Travel) -> Bools:
    """Mask (m,) of actuators with lost motion: play, or wind-up against friction."""
    motion = _found_motion(job, found, travel)
    return _differ(job, replace(motion, ordered=False), motion)


def winds_up(job: Job, found: Correction, travel: Travel) -> Bools:
    """Mask (m,) of actuators whose drive winds up against friction over some travel of the carriage."""
    poses = replace(_found_motion(job, found, travel), ordered=False)
    return _differ(job, poses, replace(poses, direction=-poses.direction))


def gives_way(job: Job) -> bool:
    """Whether loads can push carriages from one flank of their play to the other."""
    if not job.causes:
        return False
    home = job.real_machine.home[None]
    nothing = Travel(force=np.zeros((1, 3)), time=np.zeros(1), cut_min=np.zeros(1), stop=np.zeros(1, np.bool_))
    return bool(_on_flanks(job, motion_of(job, home, nothing), np.full_like(home, np.finfo(float).max)).any())


def load_flanks(job: Job, found: Correction, travel: Travel) -> tuple[Floats, Bools]:
    """Carriage minus encoder (n, m) on the flanks to which loads push carriages, 0 where none does, and a mask (n,) of stable rows.

    A row is unstable where the load at the encoder, a play away from the carriage, holds the carriage on another flank. With
    friction behind the play the encoder may lie on either side of the carriage, by the play and by the wind-up.
    """
    motion = motion_of(job, found.rho, travel)
    flank = _on_flanks(job, motion, found.drive)
    half = _on_flanks(job, motion, np.full_like(found.drive, np.finfo(float).max))
    poses = [replace(motion, ordered=False, direction=np.full_like(flank, each)) for each in (0.0, 1.0)]
    wound = _drive_errors(job, poses[1]) - _drive_errors(job, poses[0])
    rubs = wound.any() or half[flank == 0.0].any()
    lost = [s * half + t * wound for s in (1.0, -1.0) for t in (1.0, -1.0)] if rubs else [flank]
    stable = np.ones(len(flank), np.bool_)
    for each in lost:
        ahead = replace(motion, encoder=found.rho - SURELY * each)
        held = _held(job, found.commanded, ahead, travel)
        stable &= (_on_flanks(job, ahead, held) == flank).all(axis=1)
    return flank, stable


def _on_flanks(job: Job, motion: Motion, drive: Floats) -> Floats:
    poses = replace(motion, ordered=False)
    return _drive_errors(job, replace(poses, held=lambda: drive)) - _drive_errors(job, poses)


def _found_motion(job: Job, found: Correction, travel: Travel) -> Motion:
    """Motion of the carriages of a solution, with their drive forces."""
    return replace(motion_of(job, found.rho, travel), held=lambda: found.drive)


def _drive_errors(job: Job, motion: Motion) -> Floats:
    """Carriage minus encoder (n, m)."""
    return signal_path.driven(job.causes, job.real_machine.actuators, motion)[0]


def _differ(job: Job, one: Motion, other: Motion) -> Bools:
    """Mask (m,) of actuators whose carriage error differs between two motions."""
    return np.asarray((_drive_errors(job, one) != _drive_errors(job, other)).any(axis=0))
