"""How the loaded tip moves with uncertain inputs, anywhere on a program: solved at some points, interpolated at many.

For machines without effects, whose tip depends on the commanded tip and the force alone. The moves are smooth and
need a hundredth of their size, so low polynomials do where corrections need tiles.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from camcomp.compensation.bands.scatter import TipMoves
from camcomp.ground.datatypes import Bools, Floats, Ints
from camcomp.ground.errors import PhysicsError
from camcomp.ground.records import replace
from camcomp.model.drawn import UncertainJob, uncertain_jobs
from camcomp.model.job import Job
from camcomp.model.statics.machine import Machine
from camcomp.model.statics.solve import FREE, solve

DEGREES = (2, 3, 4)  # in position, tried in this order
TESTS = 40  # points that are not used in the fit
SURPLUS = 1.5  # points per term
ACCURATE = 0.01  # of the root mean square of the moves, at the test points
ENDURED = 0.05  # at the highest degree; worse: every point is solved
MOST_LEVERAGE = 1.5  # of a point that is interpolated; the points of the fit have 1 at most
LONE = 0.02  # of the points may be solved by themselves before the fit is made anew
FEW = 0.005  # of the points may be left to that by a new fit
EXTENSIONS, EXTENSION = 6, 40  # times that a fit learns so many more points where it has no answer
TRIAL_FORCE_N = 1.0  # to find the compliance, beside a hundredth of the largest force


class TipField:
    """Moves of the tip with the inputs that concern the machine, and its compliance for those that concern the force."""

    def __init__(self, job: Job) -> None:
        self._job, self.inputs = job, uncertain_jobs(job)
        self._machine = replace(job.real_machine, answers=None)  # exact: differences of its tips are looked at
        self._moves = 6 * len(self.inputs)  # columns of slopes and bends
        self._on_force = any(each.moves_force for each in self.inputs)
        self._fit: _Fit | None = None
        self._known, self._values = np.zeros((0, 6)), np.zeros((0, 0))  # what fits rest on

    def moves(self, commanded: Floats, force: Floats, changes: Sequence[Sequence[Floats]]) -> TipMoves:
        """Moves at commanded tips (n, 3), program frame, under forces (n, 3) N, machine frame.

        changes: of the force, by the sides of every input, each (n, 3) N; none for inputs that leave it as it is.
        """
        moves, compliance = self.at(commanded, force)
        for j, (each, sides) in enumerate(zip(self.inputs, changes, strict=True)):
            if sides:
                slope, bend = of_sides(each, np.zeros_like(commanded), sides)
                moves.slope[:, :, j] += np.einsum("nij,nj->ni", compliance, slope)
                moves.bend[:, :, j] += np.einsum("nij,nj->ni", compliance, bend)
        return moves

    def at(self, commanded: Floats, force: Floats) -> tuple[TipMoves, Floats]:
        """Moves at commanded tips (n, 3), program frame, under forces (n, 3) N, machine frame, and compliances (n, 3, 3).

        The moves are those of the machine under the same force, zero for inputs that change the force alone. Raises
        PhysicsError CC301 where an input's deviation leaves the machine without a solution.
        """
        points = np.concatenate((commanded, force), axis=1)
        if len(points) <= _samples(DEGREES[0]):
            return self._split(self._exact(points))
        found = None if self._fit is None else self._interpolated(self._fit, points, check=True)
        if found is None:
            self._fit = self._fitted(points)
            found = self._exact(points) if self._fit is None else self._interpolated(self._fit, points, check=False)
        assert found is not None
        return self._split(found)

    def _interpolated(self, fit: _Fit, points: Floats, *, check: bool) -> Floats | None:
        """Values at points, solved outside the support of the fit. check: None where the fit is too inaccurate here."""
        terms = fit.terms(points)
        lone = np.flatnonzero(~fit.supports(terms))
        if check:
            some = np.random.default_rng(0).choice(len(points), TESTS // 2, replace=False)
            few = len(lone) <= LONE * len(points)
            if not few or fit.misses(points[some], self._exact(points[some]), self._moves) > 2.0 * ACCURATE:
                return None
        values = terms @ fit.coefficients
        if len(lone):
            values[lone] = self._exact(points[lone])
        return values

    def _fitted(self, points: Floats) -> _Fit | None:
        """Polynomials through exact solutions at some of the points, the extreme ones among them, and at those of earlier fits."""
        random = np.random.default_rng(0)
        order = random.permutation(len(points))
        tests, order = points[order[:TESTS]], order[TESTS:]
        judged = self._exact(tests)
        self._learn(points[np.unique(np.concatenate((points.argmin(axis=0), points.argmax(axis=0))))])
        for degree in DEGREES:
            count = _samples(degree) - TESTS - len(self._known)
            if count > len(order):
                return None
            self._learn(points[order[: max(count, 0)]])
            order = order[max(count, 0) :]
            fit = self._supporting(points, degree, random)
            if fit.misses(tests, judged, self._moves) <= (ACCURATE if degree < DEGREES[-1] else ENDURED):
                return fit
        return None

    def _supporting(self, points: Floats, degree: int, random: np.random.Generator) -> _Fit:
        """Fit the known solutions, after solving more points outside the support of the fit."""
        for left in range(EXTENSIONS, -1, -1):
            fit = _Fit(self._known, self._values, degree, np.concatenate((self._known, points)))
            lone = np.flatnonzero(~fit.supports(fit.terms(points)))
            if not left or len(lone) <= FEW * len(points):
                break
            self._learn(points[random.choice(lone, min(len(lone), EXTENSION), replace=False)])
        return fit

    def _learn(self, points: Floats) -> None:
        if not len(points):
            return
        values = self._exact(points)
        self._values = np.concatenate((self._values, values)) if len(self._known) else values
        self._known = np.concatenate((self._known, points))

    def _exact(self, points: Floats) -> Floats:
        """Slopes, bends and, where forces are uncertain, compliances (n, 6 k + 9), solved one by one."""
        told, force = self._job.frame.to_machine(points[:, :3]), points[:, 3:]
        n = len(points)
        base = self._tips(self._machine, told, force, "")
        slope, bend = np.zeros((2, n, 3, len(self.inputs)))
        for j, each in enumerate(self.inputs):
            if not each.moves_machine:
                continue
            tips = [self._tips(one.real_machine, told, force, each.source.name) for one in each.sides]
            tips = [one.on_the_workpiece(tip) for one, tip in zip(each.sides, tips, strict=True)]
            slope[:, :, j], bend[:, :, j] = of_sides(each, base, tips)
        parts = [slope.reshape(n, -1), bend.reshape(n, -1)]
        if self._on_force:
            push = TRIAL_FORCE_N + 0.01 * float(np.abs(force).max(initial=0.0))
            columns = [
                (self._tips(self._machine, told, force + push * axis, "")
                 - self._tips(self._machine, told, force - push * axis, "")) / (2.0 * push)
                for axis in np.eye(3)
            ]  # fmt: skip
            parts.append(np.stack(columns, axis=2).reshape(n, 9))
        return np.concatenate(parts, axis=1)

    def _tips(self, machine: Machine, told: Floats, force: Floats, name: str) -> Floats:
        """Loaded tips (n, 3), program frame."""
        state = solve(machine, FREE, told, force=force, check=False)
        if state.status.any():
            raise unsolved(self._job, name)
        return self._job.frame.to_program(state.tip)

    def _split(self, values: Floats) -> tuple[TipMoves, Floats]:
        n, k = len(values), len(self.inputs)
        slope, bend, rest = np.split(values, [3 * k, 6 * k], axis=1)
        compliance = rest.reshape(n, 3, 3) if self._on_force else np.zeros((n, 3, 3))
        return TipMoves(slope.reshape(n, 3, k), bend.reshape(n, 3, k)), compliance


@lru_cache(maxsize=2)
def tip_field_of(job: Job) -> TipField:
    """The field of a job; all parts of one program share its solutions."""
    return TipField(job)


def of_sides(each: UncertainJob, base: Floats, tips: Sequence[Floats]) -> tuple[Floats, Floats]:
    """Slope and bend (n, 3) from tips at the stated values and at the allowed sides of an input."""
    if len(tips) == 2:
        return 0.5 * (tips[0] - tips[1]), tips[0] + tips[1] - 2.0 * base
    sign = 1.0 if each.above is not None else -1.0
    return sign * (tips[0] - base), np.zeros_like(base)


def unsolved(job: Job, name: str) -> PhysicsError:
    """Error CC301: the machine at one deviation of an input has no solution."""
    at = next((each.at for each in job.config.spreads if name in (each.name, each.group)), None)
    text = (
        f"one deviation of '{name}' off its value the machine cannot be solved"
        if name
        else "the machine cannot be solved"
    )
    return PhysicsError("CC301", text, at=at, hint="a smaller sd, if that is what is known")


def _samples(degree: int) -> int:
    return int(SURPLUS * len(_exponents(degree))) + TESTS


def _exponents(degree: int) -> Ints:
    """Exponents (t, 6) of position and force: forces act almost linearly."""
    out = [
        (i, j, k, *f)
        for i in range(degree + 1)
        for j in range(degree + 1 - i)
        for k in range(degree + 1 - i - j)
        for f in [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    ]
    squares = [(2, 0, 0), (0, 2, 0), (0, 0, 2), (1, 1, 0), (1, 0, 1), (0, 1, 1)]
    out += [(*p, *f) for p in [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)] for f in squares]
    return np.array(out, np.int64)


class _Fit:
    """Polynomials in position and force, each scaled to [-1, 1] over the program."""

    def __init__(self, points: Floats, values: Floats, degree: int, everywhere: Floats) -> None:
        low, high = everywhere.min(axis=0), everywhere.max(axis=0)
        self.middle, self.half = 0.5 * (low + high), np.maximum(0.5 * (high - low), 1e-9)
        self.exponents = _exponents(degree)
        u, size, v = np.linalg.svd(self.terms(points), full_matrices=False)
        # Directions that the points do not determine have a large leverage.
        inverse = 1.0 / np.maximum(size, 1e-6 * size[0])
        solved = np.where(size > 1e-6 * size[0], inverse, 0.0)
        self.coefficients: Floats = v.T @ (solved[:, None] * (u.T @ values))  # (t, q)
        self.spread = v.T * inverse  # (t, t) turns terms into vectors whose square is the leverage of the point

    def terms(self, points: Floats) -> Floats:
        """Terms (n, t) at points (n, 6)."""
        x = (points - self.middle) / self.half
        powers = np.stack([np.ones_like(x), *np.cumprod(np.repeat(x[None], DEGREES[-1], axis=0), axis=0)])
        out = powers[self.exponents[:, 0], :, 0]
        for axis in range(1, 6):
            out = out * powers[self.exponents[:, axis], :, axis]
        return np.ascontiguousarray(out.T)

    def supports(self, terms: Floats) -> Bools:
        """Whether points (n,) lie where the fit is held by points of its own."""
        out: Bools = np.square(terms @ self.spread).sum(axis=1) <= MOST_LEVERAGE
        return out

    def misses(self, points: Floats, values: Floats, moves: int) -> float:
        """Largest root mean square error of a column, relative to the largest column of its kind.

        Only of points that the fit supports. moves: the first columns, which are slopes and bends; the others are compliances.
        """
        terms = self.terms(points)
        held = self.supports(terms)
        if not held.any():
            return np.inf
        missed = np.sqrt(((terms[held] @ self.coefficients - values[held]) ** 2).mean(axis=0))
        size = np.sqrt((values**2).mean(axis=0))
        out = 0.0
        for part in (slice(0, moves), slice(moves, None)):
            if (most := float(size[part].max(initial=0.0))) > 0.0:
                out = max(out, float(missed[part].max()) / most)
        return out
