"""A machine whose exact solutions are replaced by interpolation between them, for programs that are corrected as a whole."""

from __future__ import annotations

from copy import copy
from typing import Any

import numpy as np

from camcomp.compensation.long.field import Field, TileFiles, Tiles
from camcomp.compensation.long.kernel import BASIC, follow, same_points
from camcomp.compensation.program.compensate import Compensated, compensate
from camcomp.compensation.program.result import BOUND_UM, Interpolation
from camcomp.gcode.program import Program
from camcomp.ground.datatypes import Bools, Floats, Ints
from camcomp.ground.records import dataclass, replace
from camcomp.ground.vectors import largest
from camcomp.model.job import Job
from camcomp.model.statics.machine import Machine
from camcomp.model.statics.solve import FREE, TARGET, State, inverse, solve
from camcomp.model.statics.target import Correction, correct

MOST_STEPS, STEP_MM = 20, 1e-5  # the slopes of a cube are those of its centre: every step leaves a tenth
LEAST_MOTIONS = 2000  # from which new cubes pay
MOST_CHECKED = 1000  # points that are solved exactly as a proof
COARSE_MM = 1e-3  # from a command: farther ones are not taken for its first order


class InterpolatedMachine:
    """Solutions of a machine with three actuators. Points n, actuators m; machine frame, mm, N, rad."""

    def __init__(self, machine: Machine, middle: Floats) -> None:
        """Take a machine; middle (3,) mm is the origin of the program."""
        self.machine, self._middle = machine, middle
        self._field: Field | None = None
        self._exact = 0
        self._aimed: tuple[Floats, Floats, Floats, Floats, Ints] | None = None  # the latest targets, forces and answers
        self._tiles: Tiles | None = None  # from which
        self._nominal: tuple[Floats, Floats, Ints] | None = None  # the latest tips, their set-points and tiles

    def solve(self, mode: int, near: Floats, force: Floats, rho: Floats | None, *, tips_only: bool = False) -> State:
        """Solved points (n,) as `solve` has them, in FREE or TARGET; where no cube is good enough, solved exactly.

        tips_only: drive and tilt may be zero in FREE.
        """
        known, n, m = self._known(force), len(near), len(self.machine.actuators)
        tip = commanded = near
        if mode == TARGET and tips_only:
            answer, nominal, tile = known.look(near, force)
            own, self._aimed, self._tiles = nominal, (near, force, answer, nominal, tile), known.tiles
        elif rho is not None:
            nominal, tile = self._nominals(near, force)
            own, commanded = rho, _tips(known, rho, near, nominal, tile)
            answer, _, within = known.look(commanded, force, every=False)
            tile = np.minimum(tile, within)
        else:
            answer, nominal, tile = known.look(near, force)
            own = nominal
        if mode == TARGET:
            commanded, own = near + answer[:, :3], nominal if tips_only else nominal + answer[:, 9 + m :]
        else:
            tip = commanded + answer[:, 3:6]
            if tips_only:
                answer = np.zeros((n, 9 + m))
            else:
                answer, _, inside = known.look(tip, force)
                tile = np.minimum(tile, inside)
        held = np.broadcast_to(self.machine.nominal.held_rotation, (n, 3, 3))
        out = State(
            tip=tip, rotation=held, tilt=answer[:, 6:9], commanded=near if mode != TARGET else commanded, rho=own,
            rho_nominal=nominal, drive=answer[:, 9 : 9 + m], force=force, status=np.zeros(n, np.int64),
            passes=np.zeros(n, np.int64), x=np.zeros((0, 0, 0)), F=np.zeros((0, 0, 6)), commanded_rotation=held,
            wrench=np.zeros((n, 6)),
        )  # fmt: skip
        if len(lost := np.flatnonzero(tile < 0)):
            self._exact += len(lost)
            exact = solve(self.machine, mode, near[lost], force=force[lost], rho=None if rho is None else rho[lost])
            out = out.with_rows(lost, exact)
        return out

    def near(self, target: Floats, force: Floats, ends: Bools) -> Near:
        """Response around targets (n, 3) under forces (n, 3); at the `ends` (n,) with drives, tilt and set-points."""
        known, m = self._known(force), len(self.machine.actuators)
        at, between = np.flatnonzero(ends), np.flatnonzero(~ends)
        answer, (tile, status) = np.empty((len(target), BASIC)), np.zeros((2, len(target)), np.int64)
        known.widen(force)
        found, nominal, tile[at] = self._looked(known, target.take(at, axis=0), force.take(at, axis=0))
        answer[at], rest = found[:, :BASIC], found[:, BASIC:]
        middle = target.take(between, axis=0), force.take(between, axis=0)
        answer[between], _, tile[between] = known.look(*middle, every=False)
        if len(lost := np.flatnonzero(tile < 0)):
            self._exact += len(lost)
            aimed, free = (solve(self.machine, mode, target[lost], force=force[lost]) for mode in (TARGET, FREE))
            answer[lost] = np.concatenate((aimed.commanded, free.tip), axis=1) - np.tile(target[lost], 2)
            status[lost] = np.where(aimed.status != 0, aimed.status, free.status)
            own = np.flatnonzero(ends[lost])
            row = np.searchsorted(at, lost[own])
            change = aimed.rho - aimed.rho_nominal
            rest[row] = np.concatenate((aimed.tilt, aimed.drive, change), axis=1)[own]
            nominal[row] = aimed.rho_nominal[own]
        parts = np.split(rest, (3, 3 + m), axis=1)
        return Near(
            answers=self, target=target, force=force, tiles=known.tiles, tile=tile, status=status, correction=answer[:, :3], unloaded=answer[:, 3:],
            ends=at, tilt=parts[0], drive=parts[1], change=parts[2], nominal=nominal,
        )  # fmt: skip

    def _looked(self, known: Field, target: Floats, force: Floats) -> tuple[Floats, Floats, Ints]:
        """All answers at targets (n, 3) as `look` has them: those that were aimed at last are known."""
        if self._aimed is None or not len(self._aimed[0]) or known.tiles is not self._tiles:
            return known.look(target, force)
        tips, loads, answers, set_points, tiles = self._aimed
        at = np.empty(len(target), np.int64)
        same_points(tips, loads, target, force, at)
        fresh = np.flatnonzero(at < 0)
        answer, nominal, tile = answers.take(at, axis=0), set_points.take(at, axis=0), tiles[at]
        answer[fresh], nominal[fresh], tile[fresh] = known.look(target[fresh], force[fresh])
        return answer, nominal, tile

    def set_points(self, tip: Floats, force: Floats) -> Floats:
        """Set-points (n, m) of commanded tips (n, 3); force (n, 3): that acts there."""
        out, tile = self._nominals(tip, force)
        lost = np.flatnonzero(tile < 0)
        if len(lost):
            out = out.copy()
            out[lost] = inverse(self.machine, tip[lost])
        return out

    def _nominals(self, tip: Floats, force: Floats) -> tuple[Floats, Ints]:
        """Set-points (n, m) of tips (n, 3), and tiles (n,); once for each array of tips."""
        if self._nominal is None or self._nominal[0] is not tip:
            _, out, tile = self._known(force).look(tip, None)
            self._nominal = tip, out, tile
        return self._nominal[1:]

    def _known(self, force: Floats) -> Field:
        if self._field is None:
            self._field = Field(self.machine, force, self._middle, TileFiles(self.machine))
        return self._field

    def proof(self, target: Floats, force: Floats) -> tuple[Interpolation | None, int]:
        """Differences of a sample of targets (n, 3) under forces (n, 3) to their exact solutions, and the most iterations.

        None and 0: nothing was asked. Keeps the tiles if they are good enough.
        """
        known = self._field
        if known is None or not len(target):
            return None, 0
        chosen = np.sort(
            np.random.default_rng(len(target)).permutation(len(target))[:MOST_CHECKED]
        )  # neighbours: fewer passes
        p, f = target[chosen], force[chosen]
        aimed, exact = self.solve(TARGET, p, f, None), correct(self.machine, p, f)
        told = np.where(exact.status[:, None] == 0, exact.commanded, p)
        free = self.solve(FREE, told, f, None)  # which has to lead back to the targets
        gaps = (aimed.commanded - exact.commanded, free.tip - p, (aimed.rho - exact.rho) * known.reach)
        worst = max(1e3 * float(np.abs(each).max()) for each in gaps)
        known.keep(sound=worst <= BOUND_UM)
        found = Interpolation.model_construct(
            bound_um=BOUND_UM, checked=len(p), worst_um=worst if np.isfinite(worst) else float("inf"),
            worst_drive_force=float(np.nan_to_num(np.abs(free.drive - exact.drive), nan=np.inf).max()),
            tiles=int(known.used.sum()),
            exact_solutions=int(known.tiles.solved[known.used].sum()) + len(p) + self._exact,
        )  # fmt: skip
        return found, int(exact.iterations.max(initial=0))


@dataclass(frozen=True, eq=False, kw_only=True)
class Near:
    """Response of a machine around n targets, at e ends also of its drives; machine frame, mm, N, rad."""

    answers: InterpolatedMachine
    target: Floats  # (n, 3)
    force: Floats  # (n, 3)
    tiles: Tiles
    tile: Ints  # (n,) negative: solved by itself
    status: Ints  # (n,)
    correction: Floats  # (n, 3) commanded tip minus target that leads the loaded tip to the target
    unloaded: Floats  # (n, 3) loaded tip minus target when the target itself is commanded
    ends: Ints  # (e,) which of the targets
    tilt: Floats  # (e, 3) when the loaded tip is at the target, as drive (e, m)
    drive: Floats
    change: Floats  # (e, m) of the set-points by the correction
    nominal: Floats  # (e, m) set-points of the target

    def response(self, commanded: Floats) -> tuple[Floats, Correction]:
        """Loaded tips (n, 3) of commanded tips (n, 3), and states (e,) of the machine at the ends.

        Both to first order about the commanded tips that lead to the targets, where those are near.
        """
        off, at = commanded - self.target - self.correction, self.ends
        tips, rho, drive = off.copy(), np.zeros(self.nominal.shape), self.drive
        follow(self.tiles.slope, self.tile, off, tips)
        follow(self.tiles.rates, self.tile.take(at), off.take(at, axis=0), rho)
        tips += self.target
        rho += self.nominal + self.change
        far = np.zeros(len(off), np.bool_)
        if not max(off.max(initial=0.0), -off.min(initial=0.0)) <= COARSE_MM:
            far = largest(off) > COARSE_MM
            tips[far] = self.answers.solve(FREE, commanded[far], self.force[far], None, tips_only=True).tip
        alone = np.flatnonzero((far | (self.tile < 0)).take(at))
        told = commanded.take(at, axis=0)
        if len(alone):
            found = self.answers.solve(FREE, told[alone], self.force[at[alone]], None)
            rho[alone], drive = found.rho, drive.copy()
            drive[alone] = found.drive
        return tips, self._as_state(told, rho, drive)

    def programmed(self) -> Correction:
        """States (e,) at the ends when the targets are commanded, without drives and tilt."""
        return self._as_state(self.target.take(self.ends, axis=0), self.nominal, np.full(self.nominal.shape, np.nan))

    def _as_state(self, commanded: Floats, rho: Floats, drive: Floats) -> Correction:
        held = np.broadcast_to(self.answers.machine.nominal.held_rotation, (len(rho), 3, 3))
        return Correction(
            commanded=commanded, rho_nominal=self.nominal, rho=rho, drive=drive, tilt=self.tilt,
            status=self.status[self.ends], iterations=np.zeros(len(rho), np.int64), rotation=held,
        )  # fmt: skip


def compensate_whole(program: Program, job: Job, *, method: str, **settings: Any) -> Compensated:
    """`compensate` for a whole program: long ones with effects, on machines with three actuators, by interpolation."""
    able = method == "newton" and len(job.real_machine.actuators) == 3 and not job.config.uncertain
    if not (able and job.causes and len(program.path) >= LEAST_MOTIONS):
        return compensate(program, job, method=method, **settings)
    job = with_answers(job)
    found = compensate(program, job, method=method, **settings)
    at = job.frame.to_machine(found.rows.target), job.frame.vectors(found.rows.force)
    interpolated, iterations = job.real_machine.answers.proof(*at)
    return replace(found, interpolated=interpolated, iterations=max(found.iterations, iterations))


def with_answers(job: Job) -> Job:
    """The job with a machine that answers by interpolation."""
    machine = job.real_machine
    other = copy(job)  # with what it has built so far
    vars(other).pop("correctable", None)  # whose machine answers exactly
    vars(other)["real_machine"] = replace(machine, answers=InterpolatedMachine(machine, job.frame.origin))
    return other


def _tips(known: Field, rho: Floats, near: Floats, nominal: Floats, tile: Ints) -> Floats:
    """Tips (n, 3) whose set-points are rho (n, m), from tips `near` with set-points `nominal`: Newton's method."""
    rates, out = np.linalg.inv(known.tiles.rates).take(np.maximum(tile, 0), axis=0), near
    for _ in range(MOST_STEPS):
        step = np.einsum("nij,nj->ni", rates, rho - nominal)
        out = out + step
        if not np.abs(step).max(initial=0.0) > STEP_MM:
            break
        nominal = known.look(out, None)[1]
    return out
