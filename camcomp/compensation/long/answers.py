"""A machine whose exact solutions are replaced by interpolation between them, for programs that are corrected as a whole."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import numpy as np

from camcomp.compensation.long.field import Field
from camcomp.compensation.long.proof import judge
from camcomp.compensation.long.tile_files import TileFiles
from camcomp.compensation.program.compensate import Compensated, compensate
from camcomp.compensation.program.result import Interpolation
from camcomp.gcode.program import Program
from camcomp.ground.datatypes import Floats, Ints
from camcomp.model.job import Job
from camcomp.model.statics.machine import Machine
from camcomp.model.statics.solve import FREE, TARGET, State, inverse, solve
from camcomp.model.statics.target import correct, settle

MOST_STEPS, STEP_MM = 20, 1e-6  # the slopes of a cube are those of its centre: every step leaves a tenth
LEAST_MOTIONS = 2000  # from which new cubes pay
SAMPLE = 1000  # points that are solved exactly, at most


class InterpolatedMachine:
    """Solutions of a machine with three actuators. Points n, actuators m; machine frame, mm, N, rad."""

    def __init__(self, machine: Machine, middle: Floats) -> None:
        """Take a machine; middle (3,) mm is the origin of the program."""
        self.machine, self._middle = machine, middle
        self._field: Field | None = None
        self._exact = 0
        self._nominal: tuple[Floats, Floats, Ints] | None = None  # the latest tips, their set-points and tiles

    def solve(self, mode: int, near: Floats, force: Floats, rho: Floats | None, *, tips_only: bool = False) -> State:
        """Solved points (n,) as `solve` has them, in FREE or TARGET; where no cube is good enough, solved exactly.

        tips_only: drive and tilt may be zero in FREE.
        """
        known, n, m = self._known(force), len(near), len(self.machine.actuators)
        tip = commanded = near
        if rho is not None:
            nominal, tile = self._nominals(near, force)
            own, commanded = rho, _tips(known, rho, near, nominal, tile)
            answer, _, within = known.look(commanded, force, every=False)
            tile = np.minimum(tile, within)
        else:
            answer, nominal, tile = known.look(near, force)
            own = nominal
        if mode == TARGET:
            commanded, own = near + answer[:, :3], nominal + answer[:, 9 + m :]
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
        return self._with_exact(out, np.flatnonzero(tile < 0), mode=mode, near=near, force=force, rho=rho)

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

    def _with_exact(
        self, state: State, rows: Ints, *, mode: int, near: Floats, force: Floats, rho: Floats | None
    ) -> State:
        if not len(rows):
            return state
        self._exact += len(rows)
        own = solve(self.machine, mode, near[rows], force=force[rows], rho=None if rho is None else rho[rows])
        changed = {}
        for each in fields(State):
            value = getattr(state, each.name)
            if len(value) == len(near):
                changed[each.name] = value = np.array(value)
                value[rows] = getattr(own, each.name)
        return replace(state, **changed)

    def proof(self, target: Floats, force: Floats) -> tuple[Interpolation | None, int]:
        """Differences of a sample of points (n, 3) under forces (n, 3) to their exact solutions, and the most iterations.

        None and 0: nothing was asked.
        """
        if self._field is None:
            return None, 0
        chosen = np.random.default_rng(len(target)).permutation(len(target))[:SAMPLE]
        p, f = target[chosen], force[chosen]
        aimed, free = self.solve(TARGET, p, f, None), self.solve(FREE, p, f, None)
        exact = correct(self.machine, p, f)
        tip, settled = settle(self.machine, p, f)
        gaps, drive = (aimed.commanded - exact.commanded, free.tip - tip), free.drive - settled.drive
        found = judge(self._field, gaps, aimed.rho - exact.rho, drive, 2 * len(p) + self._exact)
        return found, int(exact.iterations.max(initial=0))


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
    other = replace(job)
    machine = job.real_machine
    vars(other)["real_machine"] = replace(machine, answers=InterpolatedMachine(machine, job.frame.origin))
    vars(other)["causes"] = job.causes
    return other


def _tips(known: Field, rho: Floats, near: Floats, nominal: Floats, tile: Ints) -> Floats:
    """Tips (n, 3) whose set-points are rho (n, m), from tips `near` with set-points `nominal`: Newton's method."""
    rates, out = np.linalg.inv(known.tiles.rates)[np.maximum(tile, 0)], near
    for _ in range(MOST_STEPS):
        step = np.einsum("nij,nj->ni", rates, rho - nominal)
        out = out + step
        if not np.abs(step).max(initial=0.0) > STEP_MM:
            break
        nominal = known.look(out, None)[1]
    return out
