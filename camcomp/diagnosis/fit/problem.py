"""The state of one diagnosis: columns, white rows, and re-fits of sets of causes through the twin."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from camcomp.diagnosis.fit.bench import Bench, cause_of, step_of
from camcomp.diagnosis.fit.cause_sets import CausePrior, Fitted, Scale
from camcomp.diagnosis.fit.columns import Columns, moved_tip, shape_default
from camcomp.diagnosis.fit.floor import NoiseFloor, roundings
from camcomp.diagnosis.fit.grid_parameters import longest, reach
from camcomp.diagnosis.fit.noise import inflation
from camcomp.diagnosis.fit.patterns import KINDS, Dictionary
from camcomp.diagnosis.model.classes import INDISTINGUISHABLE
from camcomp.diagnosis.model.discrepancy import ROWS_OF_PROCESS
from camcomp.diagnosis.model.evidence import Members
from camcomp.diagnosis.model.noise import MINOR
from camcomp.diagnosis.statistics.by_channel import ByChannel
from camcomp.diagnosis.statistics.evidence import Prior, estimate, gram
from camcomp.diagnosis.statistics.noise_model import Noise
from camcomp.diagnosis.statistics.normal_equations import NormalEquations, sum_grams
from camcomp.diagnosis.statistics.probability import EQUAL_LOG_ODDS
from camcomp.ground.datatypes import Bools, Floats, Ints
from camcomp.ground.errors import PhysicsError
from camcomp.model.effect import Cause, Parameter
from camcomp.model.motion.twin import Reading
from camcomp.model.signal_path import pushes, stages_of

SETTLED = 0.05  # chi-square that one more pass may cost
FARTHER = 10  # further passes for shapes that are on their way from where they were scanned
HALVED = 6  # times that a step is halved which no machine can take
STRAIGHT = 0.3  # chi-square that the bend of the model may cost before it is followed


@dataclass(eq=False, kw_only=True)
class Problem:
    """Everything that stays the same while sets of causes are tried."""

    bench: Bench
    columns: Columns
    dictionary: Dictionary
    times: list[Floats]
    residuals: list[Floats]
    floor: NoiseFloor
    noise: Noise
    outliers: list[Bools]  # per run (n, c), before thinning
    white: list[ByChannel]  # per run (w, k)
    white_patterns: list[ByChannel]  # per run (w, p)
    white_residual: list[Floats]
    shapes: dict[int, dict[str, float]]
    candidates: CausePrior
    _followed: set[int] = field(default_factory=set, init=False, repr=False)
    _last: tuple[tuple[object, ...], list[Reading]] | None = field(default=None, init=False, repr=False)

    @cached_property
    def doubt(self) -> list[Floats]:
        """Standard deviation (n, c) of every row of every run beyond the noise of its channel."""
        return inflation(self.bench)

    @cached_property
    def rounding(self) -> Floats:
        """Standard deviation (c,) of every channel's rounding."""
        return roundings(self.bench)

    @cached_property
    def tip_gram(self) -> Floats:
        """Products (k, k) of the tip motion of all columns but those of laws, mean over the rows of all runs, mm2."""
        out = np.zeros((self.columns.blocks[0].width,) * 2)
        for k, (block, own) in enumerate(zip(self.columns.blocks, self.residuals, strict=True)):
            for first in range(0, len(own), ROWS_OF_PROCESS):
                rows = slice(first, first + ROWS_OF_PROCESS)
                moved = moved_tip(self.bench, k, block.dense(rows), rows).reshape(-1, len(out))
                out += moved.T @ moved
        return out / max(sum(map(len, self.residuals)), 1)

    def size_um(self, index: Sequence[int], theta: Floats) -> float:
        """How far (rms over the rows) some columns with coordinates theta (d,) move the tip."""
        return 1e3 * float(np.sqrt(np.maximum(theta @ self.tip_gram[np.ix_(index, index)] @ theta, 0.0)))

    def moved_um(self, f: Fitted, members: Members | None = None) -> float:
        """How far (rms over the rows) the members of a fit, or some of them, move the tip by themselves."""
        own = self.member_columns(f.members if members is None else members)
        index = self.member_columns(f.members)
        return self.size_um(own, f.theta[[index.index(c) for c in own]])

    def small_members(self, f: Fitted) -> Members:
        """The members that move the tip by at most MINOR floors."""
        return tuple(i for i in f.members if self.moved_um(f, (i,)) <= MINOR * self.floor.tip_um)

    def channels_of(self, kind: str) -> slice:
        """The channels of a kind (patterns.KINDS)."""
        return self.bench.parts[kind]

    def kind_of(self, channel: int) -> str:
        """The kind (patterns.KINDS) of a channel."""
        return next(kind for kind in KINDS if channel < self.channels_of(kind).stop)

    @property
    def prior(self) -> Prior:
        """Prior of the columns."""
        return self.columns.prior

    @cached_property
    def base_grams(self) -> tuple[NormalEquations, ...]:
        """Per run, at nominal."""
        return tuple(gram(D, r) for D, r in zip(self.white, self.white_residual, strict=True))

    def causes(self, members: Members, theta: Floats, shapes: Mapping[int, Mapping[str, float]]) -> list[Cause]:
        """Causes at coordinates theta (d,)."""
        out, at = [], 0
        for i in members:
            candidate = self.columns.candidates[i]
            values = {p.name: float(theta[at + j]) * p.scale for j, p in enumerate(candidate.parameters)}
            at += len(candidate.parameters)
            out.append(cause_of(candidate, {**shapes.get(i, self.shapes.get(i, shape_default(candidate))), **values}))
        return out

    def member_columns(self, members: Members) -> list[int]:
        """Columns of a set in the order of theta."""
        return [c for i in members for c in self.candidates.columns[i]]

    def refit(self, members: Members, theta: Floats | None = None) -> Fitted:
        """Gauss-Newton through the twin from theta, or from the linear answer, under the laws that explain most."""
        best = self._refit(members, theta, {})
        if best.grams is self.base_grams:
            return best  # so small that no law of its turning can be seen
        for i in members:
            if i in self.small_members(best):
                continue  # it will not be named, whatever its law
            for p, values in self._laws_of(i):
                for value in values:
                    if value == best.extra.get(i, {}).get(p.name, p.nominal):
                        continue
                    laws = {m: {q.name: best.extra[m][q.name] for q, _ in self._laws_of(m)} for m in best.extra}
                    laws[i] = {**laws.get(i, {}), p.name: value}
                    other = self._refit(members, best.theta, laws)
                    if other.log_evidence > best.log_evidence + EQUAL_LOG_ODDS:
                        best = other
                if p.scan:  # once per candidate: other sets begin with what was found
                    self.shapes[i] = {**self.shapes[i], p.name: best.extra[i][p.name]}
                    self._followed.add(i)
        return best

    def _laws_of(self, i: int) -> list[tuple[Parameter, Sequence[float]]]:
        """Shapes of a candidate that are tried one by one at the effect's size, with their values.

        Laws of an effect, and shapes that show at its size alone: at nominal all dampings of a loop do the same.
        """
        candidate = self.columns.candidates[i]
        laws: list[tuple[Parameter, Sequence[float]]] = [(p, p.either) for p in candidate.switches]
        if i in self._followed or candidate.of_drive_alone or hasattr(candidate.effect, "first_guess"):
            return laws
        return [*laws, *((p, p.scan) for p in candidate.shapes)]

    def _refit(
        self, members: Members, theta: Floats | None, laws: Mapping[int, Mapping[str, float]], passes: int = 5
    ) -> Fitted:
        """The same under given laws: values of switches by candidate."""
        shapes = {i: {**self.shapes[i], **laws.get(i, {})} for i in members if i in self.shapes}
        index = self.member_columns(members)
        grams = self.base_grams
        if theta is None:
            theta = estimate(sum_grams(grams), self.prior, index)[0][index]
        theta = self._bounded(members, theta)
        white = [W[:, index] for W in self.white]
        left = list(self.white_residual)
        bent = False
        passes += 1 if shapes else 0
        far, most = False, passes + FARTHER if members else 0
        for step in range(most):
            if step >= passes and not far:
                break
            theta, readings = self._readings(members, theta, shapes)
            now = [self.noise.rows(k, self.bench.difference(k, r)[:, :, None])[:, 0] for k, r in enumerate(readings)]
            bend = self._bend(now, index, theta)
            if step == 0 and not shapes and bend < STRAIGHT:
                theta = self._bounded(members, estimate(sum_grams(grams), self.prior, index)[0][index])
                break
            bent = bent or (step == 0 and bend > INDISTINGUISHABLE)
            moved = self._columns_at(members, theta, shapes, readings, bent)
            white = [self._stacked(k, [m[k] for m in moved], index) for k in range(len(self.bench.runs))]
            left = [r + W @ theta for r, W in zip(now, white, strict=True)]
            grams = self._grams_at(index, white, left)
            mean, covariance = estimate(sum_grams(grams), self.prior, index)
            after = self._bounded(members, mean[index])
            change, theta = after - theta, after
            size = float(change @ np.linalg.solve(covariance + 1e-18 * np.eye(len(index)), change))
            if self.shapes_of(members) and (step < passes - 1 or (far and step < most - 1)):
                size, far = self._move_shapes(
                    members=members, theta=theta, shapes=shapes, left=left, white=white, mean=mean
                )
            else:
                far = False
            if step > 0 and size < SETTLED:
                break
        farther = bent_farther(self.columns, members, self.causes(members, theta, shapes))
        if len(pushed := np.flatnonzero(farther > 1.0)):
            both = [np.column_stack([own, self._pushed(k, farther)]) for k, own in enumerate(white)]
            grams = self._grams_at([*index, *pushed], both, left)
        scale = Scale(sum_grams(grams), self.prior, self.candidates)
        theta = self._bounded(members, estimate(sum_grams(grams), self.prior, index)[0][index])
        return Fitted(
            members=members, theta=theta, log_evidence=scale(members), grams=grams,
            extra=shapes, white=tuple(white), residual=tuple(left), farther=farther,
        )  # fmt: skip

    def white_at(self, f: Fitted) -> list[ByChannel]:
        """White columns (w, k) per run as they are at a fit."""
        index = self.member_columns(f.members)
        white = [W.exchanged(index, own) for W, own in zip(self.white, f.white, strict=True)]
        pushed = np.flatnonzero(f.farther > 1.0)
        return [W.exchanged(pushed, self._pushed(k, f.farther)) for k, W in enumerate(white)]

    def _pushed(self, k: int, farther: Floats) -> Floats:
        """White columns (w, p) of run k that bend the machine farther (k,) than at nominal: the tip moves more, the force is the same."""
        pushed = np.flatnonzero(farther > 1.0)
        out: Floats = self.white[k][:, pushed]
        tip = np.isfinite(self.noise.inflate[k][:, :3]) & np.isfinite(self.noise.sigma[k, :3])
        out[: int(tip.sum())] *= farther[pushed]
        return out

    def _readings(
        self, members: Members, theta: Floats, shapes: Mapping[int, Mapping[str, float]]
    ) -> tuple[Floats, list[Reading]]:
        """Readings of all runs, and the coordinates that they are of: halved as often as no machine stands at what was asked for."""
        for _ in range(HALVED):
            try:
                return theta, self._read(self.causes(members, theta, shapes))
            except PhysicsError:
                theta = 0.5 * theta
        return theta, self._read(self.causes(members, theta, shapes))

    def _read(self, causes: Sequence[Cause]) -> list[Reading]:
        """Readings of all runs; the same causes twice, one after the other, are read once."""
        key = tuple((each.name, each.target, tuple(sorted(each.values.items()))) for each in causes)
        if self._last is None or self._last[0] != key:
            self._last = key, [self.bench.read(k, causes) for k in range(len(self.bench.runs))]
        return self._last[1]

    def determined_without(self, f: Fitted, k: int, members: Members | None = None) -> tuple[Floats, Floats]:
        """The coordinates of the members, or of some of them by themselves, fitted without run k, about the fit to all runs, and their
        standard deviations.
        """
        members = f.members if members is None else members
        index = self.member_columns(members)
        mean, covariance = estimate(f.without(k) if len(f.grams) > 1 else f.data, self.prior, index)
        return self._bounded(members, mean[index]), np.sqrt(np.diag(covariance))

    def _stacked(self, k: int, moved: Sequence[Floats | None], index: Sequence[int]) -> Floats:
        """White columns (w, d) of run k: those that were worked out anew, and the nominal ones of the others."""
        W: Floats = self.white[k][:, index]
        new = [j for j, m in enumerate(moved) if m is not None]
        if new:
            W[:, new] = self.noise.rows(k, np.stack([m for m in moved if m is not None], axis=2))
        return W

    def _grams_at(
        self, index: Sequence[int], white: Sequence[Floats], left: Sequence[Floats]
    ) -> tuple[NormalEquations, ...]:
        """Normal equations per run, with the columns `index` replaced by white (w, d) and the residual by `left`
        (w,).
        """
        out = []
        for k, (own, r) in enumerate(zip(white, left, strict=True)):
            W = self.white[k]
            A, d = self.base_grams[k].A.copy(), own.shape[1]
            both = np.column_stack([own, r])
            products = W.T @ both
            products[index] = own.T @ both
            cross, b = products[:, :d], products[:, d].copy()
            A[:, index], A[index, :] = cross, cross.T
            out.append(NormalEquations(A, b, float(r @ r), len(r)))
        return tuple(out)

    def _bend(self, now: Sequence[Floats], index: Sequence[int], theta: Floats) -> float:
        """Chi-square by which the columns at nominal miss the white residuals at theta."""
        return sum(
            float(np.sum((r - nominal + W[:, index] @ theta) ** 2))
            for r, nominal, W in zip(now, self.white_residual, self.white, strict=True)
        )

    def _bounded(self, members: Members, theta: Floats) -> Floats:
        parameters = [p for i in members for p in self.columns.candidates[i].parameters]
        out = theta.copy()
        for j, p in enumerate(parameters):
            out[j] = p.coordinate(p.value(float(theta[j]) * p.scale)) / p.scale
            # an amplitude of exactly nominal has no shape to fit
            if p.sign > 0 and out[j] <= 0.0:
                out[j] = 1e-3 * p.tolerance / p.scale
        return out

    def _columns_at(
        self, members: Members, theta: Floats, shapes: Mapping[int, Mapping[str, float]], readings: Sequence[Reading],
        bent: bool,
    ) -> list[Sequence[Floats | None]]:  # fmt: skip
        """Columns of the members' parameters at theta, per run (n, c).

        None where the nominal column will do: changed structures cost most and bend least.
        """
        out: list[Sequence[Floats | None]] = []
        at = 0
        for i in members:
            candidate = self.columns.candidates[i]
            for j, p in enumerate(candidate.parameters):
                if "structure" in stages_of(candidate.effect) and not bent:
                    out.append([None] * len(readings))
                    continue
                step, here = step_of(p), float(theta[at + j]) * p.scale
                if p.coordinate(p.value(here + step)) < here + 0.5 * step:
                    step = -step
                changed = theta.copy()
                changed[at + j] += step / p.scale
                out.append(self._slope(self.causes(members, changed, shapes), readings, step / p.scale))
            at += len(candidate.parameters)
        return out

    def _slope(self, causes: Sequence[Cause], readings: Sequence[Reading], step: float) -> list[Floats]:
        """Change of the channels per unit, per run (n, c), from readings to those with other causes."""
        return [self.bench.change(k, self.bench.read(k, causes), each) / step for k, each in enumerate(readings)]

    def shape_columns(self, members: Members, theta: Floats, shapes: Mapping[int, Mapping[str, float]]) -> list[Floats]:
        """White columns (w, s) per run of the members' shapes, in their own units."""
        readings = self._read(self.causes(members, theta, shapes))
        moved = []
        for i, p in self.shapes_of(members):
            step = 1e-4 * shapes[i][p.name]
            changed = {**shapes, i: {**shapes[i], p.name: shapes[i][p.name] + step}}
            moved.append(self._slope(self.causes(members, theta, changed), readings, step))
        return [self.noise.rows(k, np.stack([m[k] for m in moved], axis=2)) for k in range(len(readings))]

    def shapes_of(self, members: Members) -> list[tuple[int, Parameter]]:
        """(candidate, shape) of a set in order; instants are not refined."""
        return [(i, p) for i in members for p in self.columns.candidates[i].shapes if not p.placed]

    def passing(self, i: int) -> bool:
        """Whether a candidate acts for a while only, so that other runs do not determine it."""
        return any(p.placed for p in self.columns.candidates[i].shapes)

    def row_cells(self, k: int) -> tuple[Ints, Ints]:
        """Channel and row (w,) of every white row of run k."""
        channel, row = np.nonzero((np.isfinite(self.noise.inflate[k]) & np.isfinite(self.noise.sigma[k])).T)
        return channel, row

    def row_places(self, k: int) -> Floats:
        """Where in the time of run k each white row (w,) lies, 0 to 1."""
        t = self.times[k]
        return np.asarray((t - t[0]) / max(float(t[-1] - t[0]), 1e-12))[self.row_cells(k)[1]]

    def _move_shapes(
        self, members: Members, theta: Floats, shapes: dict[int, dict[str, float]], left: Sequence[Floats],
        white: Sequence[Floats], mean: Floats,
    ) -> tuple[float, bool]:  # fmt: skip
        """One Gauss-Newton step of the scanned shapes at their best amplitudes, within reach of the scan.

        By how much chi-square it moves the model, and whether it would go further; shapes that the data do not ask to move stay.
        """
        names, index = self.shapes_of(members), self.member_columns(members)
        others = mean.copy()
        others[index] = 0.0
        D = self.shape_columns(members, theta, shapes)
        A = np.concatenate([np.concatenate([W, d], axis=1) for W, d in zip(white, D, strict=True)])
        rest = np.concatenate([r - W @ others for r, W in zip(left, self.white, strict=True)])
        rest = rest - A[:, : len(index)] @ theta
        size = np.linalg.norm(A, axis=0) + 1e-12
        step = np.linalg.lstsq(A / size, rest, rcond=1e-8)[0] / size
        most = np.array([reach(p, shapes[i][p.name]) * shapes[i][p.name] for i, p in names])
        whole = float(np.min(most / np.maximum(np.abs(step[len(index) :]), 1e-300)))
        step *= min(1.0, whole)
        moves = float(np.sum((A @ step) ** 2))
        if moves > SETTLED:
            for (i, p), s in zip(names, step[len(index) :], strict=True):
                high = longest(self.bench, self.columns.candidates[i], p)
                shapes[i][p.name] = float(np.clip(shapes[i][p.name] + s, p.low, max(high, p.low)))
        return moves, whole < 1.0 and moves > INDISTINGUISHABLE


def bent_farther(columns: Columns, members: Sequence[int], causes: Sequence[Cause]) -> Floats:
    """How many times as far as at nominal the forces of other candidates bend the machine that the causes make: (k,) >= 1.

    Friction that every healthy guide has bends a screw that is six times as soft as stated six times as far.
    """
    out = np.ones(len(columns.names))
    for i, cause in zip(members, causes, strict=True):
        p = columns.candidates[i].parameters[0]
        if not p.log or "structure" not in stages_of(cause.effect):
            continue
        for j, each in enumerate(columns.candidates):
            loads = pushes(each.effect) and not any(shape.placed for shape in each.shapes)
            if j not in members and loads and (each.target in (cause.target, None) or cause.target is None):
                own = columns.of(j)
                out[own] = np.maximum(out[own], p.nominal / cause.values[p.name])
    return out
