"""The state of one diagnosis: columns, white rows, and re-fits of sets of causes through the twin."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from camcomp.bench import Atom, Bench, cause_of, step_of, thinned
from camcomp.columns import Columns, atom_columns, build, patterns, shape_default
from camcomp.datatypes import Floats
from camcomp.gap.effect import Cause
from camcomp.gap.evidence import Gram, Prior, estimate, gram
from camcomp.gap.patterns import Dictionary
from camcomp.gap.search import Atoms, Fitted, Members, Scale, total
from camcomp.gap.whiten import Noise, fit_noise

TIMING_S = 0.0015  # how fast a real drive settles after its acceleration has stepped
STRAIGHT = 0.3  # chi-square that the bend of the model may cost before it is followed
PATTERN_SCALE = 30.0  # um or N: what a pattern may amount to when the noise is measured beside it


@dataclass(eq=False)
class Inquiry:
    """Everything that stays the same while sets of causes are tried."""

    bench: Bench
    columns: Columns
    dictionaries: list[Dictionary]
    inflate: list[Floats]
    times: list[Floats]
    residuals: list[Floats]
    noise: Noise
    white: list[Floats]  # per run (w, k)
    white_patterns: list[list[Floats]]  # per run, per kind (rows of the kind, p)
    white_residual: list[Floats]
    shapes: dict[int, dict[str, float]]
    atoms: Atoms

    @property
    def prior(self) -> Prior:
        """Prior of the columns."""
        return self.columns.prior

    @cached_property
    def base_grams(self) -> tuple[Gram, ...]:
        """Per run, at nominal."""
        return self.grams(self.white_residual, self.white)

    def grams(self, residual: Sequence[Floats], white: Sequence[Floats]) -> tuple[Gram, ...]:
        """Per run."""
        return tuple(gram(D, r) for D, r in zip(white, residual, strict=True))

    def whitened(self, k: int, values: Floats) -> Floats:
        """White rows (w, j) of channels (n, c, j) of run k."""
        return self.noise.rows(k, values, self.inflate[k], self.times[k])

    def causes(self, members: Members, theta: Floats, shapes: Mapping[int, Mapping[str, float]]) -> list[Cause]:
        """Causes at coordinates theta (d,)."""
        out, at = [], 0
        for i in members:
            atom = self.columns.atoms[i]
            values = {p.name: float(theta[at + j]) * p.scale for j, p in enumerate(atom.parameters)}
            at += len(atom.parameters)
            out.append(cause_of(atom, {**shapes.get(i, self.shapes.get(i, shape_default(atom))), **values}))
        return out

    def member_columns(self, members: Members) -> list[int]:
        """Columns of a set in the order of theta."""
        return [c for i in members for c in self.atoms.columns[i]]

    def refit(self, members: Members, theta: Floats | None = None, passes: int = 3) -> Fitted:
        """Gauss-Newton through the twin from theta, or from the linear answer."""
        shapes = {i: dict(self.shapes[i]) for i in members if i in self.shapes}
        index = self.member_columns(members)
        grams = self.base_grams
        if not members:
            scale = Scale(total(grams), self.prior, self.atoms)
            return Fitted((), np.zeros(0), np.zeros((0, 0)), scale(()), grams, {}, scale.factor(()))
        if theta is None:
            theta = estimate(total(grams), self.prior, index)[0][index]
        theta = self._bounded(members, theta)
        covariance = np.zeros((len(index), len(index)))
        white = list(self.white)
        for step in range(passes):
            causes = self.causes(members, theta, shapes)
            now = [self.bench.residual(k, causes) for k in range(len(self.bench.runs))]
            if step == 0 and not shapes and self._straight(now, index, theta):
                grams = self.base_grams
                mean, full = estimate(total(grams), self.prior, index)
                theta, covariance = self._bounded(members, mean[index]), full[np.ix_(index, index)]
                break
            moved = self._columns_at(members, theta, shapes)
            white = []
            left = []
            grams_here = []
            for k in range(len(self.bench.runs)):
                W = self.white[k].copy()
                W[:, index] = self.whitened(k, np.stack([m[k] for m in moved[: len(index)]], axis=2))
                r = self.whitened(k, now[k][:, :, None])[:, 0] + W[:, index] @ theta
                left.append(r)
                white.append(W)
                A = self.base_grams[k].A.copy()
                A[:, index] = W.T @ W[:, index]
                A[index, :] = A[:, index].T
                grams_here.append(Gram(A, W.T @ r, float(r @ r), len(r)))
            grams = tuple(grams_here)
            mean, full = estimate(total(grams), self.prior, index)
            covariance = full[np.ix_(index, index)]
            self._move_shapes(members, theta, shapes, left, white, moved[len(index) :], mean)
            after = self._bounded(members, mean[index])
            change = after - theta
            theta = after
            size = float(change @ np.linalg.solve(covariance + 1e-18 * np.eye(len(index)), change))
            if size < 0.05 and step > 0:
                break
        scale = Scale(total(grams), self.prior, self.atoms)
        factor = scale.factor(members)
        mean, full = estimate(total(grams), self.prior, index, factor)
        theta, covariance = self._bounded(members, mean[index]), full[np.ix_(index, index)]
        return Fitted(members, theta, covariance, scale(members), grams, shapes, factor)

    def _straight(self, now: Sequence[Floats], index: Sequence[int], theta: Floats) -> bool:
        """Whether the columns at nominal predict the residuals at theta to well within the noise."""
        bend = 0.0
        for k, r in enumerate(now):
            exact = self.whitened(k, r[:, :, None])[:, 0]
            bend += float(np.sum((exact - self.white_residual[k] + self.white[k][:, index] @ theta) ** 2))
        return bend < STRAIGHT

    def _bounded(self, members: Members, theta: Floats) -> Floats:
        parameters = [p for i in members for p in self.columns.atoms[i].parameters]
        out = theta.copy()
        for j, p in enumerate(parameters):
            out[j] = p.coordinate(p.value(float(theta[j]) * p.scale)) / p.scale
            # an amplitude of exactly nominal has no shape to fit
            if p.sign > 0 and out[j] <= 0.0:
                out[j] = 1e-3 * p.tolerance / p.scale
        return out

    def _columns_at(self, members: Members, theta: Floats, shapes: Mapping[int, Mapping[str, float]]) -> list[list[Floats]]:
        """Columns of the members' parameters at theta, then those of their shapes; per run (n, c)."""
        here = self.causes(members, theta, shapes)
        base = [self.bench.channels(self.bench.read(k, here)) for k in range(len(self.bench.runs))]
        out: list[list[Floats]] = []
        extra: list[list[Floats]] = []
        at = 0
        for who, i in enumerate(members):
            atom = self.columns.atoms[i]
            own = {p.name: float(theta[at + j]) * p.scale for j, p in enumerate(atom.parameters)}
            shape = dict(shapes.get(i, shape_default(atom)))
            for p in (*atom.parameters, *atom.shapes):
                if p.scan:
                    step = 1e-4 * shape[p.name]
                    changed = {**shape, **own, p.name: shape[p.name] + step}
                    unit = 1.0 / step
                else:
                    step = step_of(p)
                    if p.coordinate(p.value(own[p.name] + step)) < own[p.name] + 0.5 * step:
                        step = -step
                    changed = {**shape, **own, p.name: own[p.name] + step}
                    unit = p.scale / step
                other = [*here[:who], cause_of(atom, changed), *here[who + 1 :]]
                per_run = [
                    thinned((self.bench.channels(self.bench.read(k, other)) - base[k]) * unit, run.thin)
                    for k, run in enumerate(self.bench.runs)
                ]
                (extra if p.scan else out).append(per_run)
            at += len(atom.parameters)
        return [*out, *extra]

    def _move_shapes(
        self, members: Members, theta: Floats, shapes: dict[int, dict[str, float]], left: Sequence[Floats],
        white: Sequence[Floats], moved: Sequence[Sequence[Floats]], mean: Floats,
    ) -> None:  # fmt: skip
        """One Gauss-Newton step of the scanned shapes against what the linear fit leaves, at most 2 % (40 % of a time)."""
        if not moved:
            return
        names = [(i, p) for i in members for p in self.columns.atoms[i].shapes]
        D = [
            self.whitened(k, np.stack([m[k] for m in moved], axis=2)) for k in range(len(self.bench.runs))
        ]
        index = self.member_columns(members)
        A = np.concatenate([np.concatenate([W[:, index], d], axis=1) for W, d in zip(white, D, strict=True)])
        rest = np.concatenate([r - W @ mean + W[:, index] @ mean[index] for r, W in zip(left, white, strict=True)])
        rest = rest - A[:, : len(index)] @ theta
        size = np.linalg.norm(A, axis=0) + 1e-12
        step = np.linalg.lstsq(A / size, rest, rcond=1e-8)[0] / size
        for (i, p), s in zip(names, step[len(index) :], strict=True):
            most = 0.02 if p.unit == "mm" else 0.4
            old = shapes[i][p.name]
            shapes[i][p.name] = float(np.clip(old + np.clip(s, -most * old, most * old), p.low, p.high))


def inflation(bench: Bench) -> list[Floats]:
    """Per run (n, c) >= 1: rows just after a step of the acceleration count less; NaN where no value.

    In units of the channel's own noise, which is not known yet: here the extra standard deviation in mm or N.
    """
    out = []
    for k, run in enumerate(bench.runs):
        observed = bench.observed(k)
        extra = np.zeros_like(observed)
        t = run.course.time
        if run.course.ordered and len(t) > 4:
            usual = float(np.median(np.diff(t)))
            window = max(1.5 * usual, 0.02)
            grid = run.course.grid
            push = np.gradient(np.gradient(run.course.grid_rho, grid, axis=0), grid, axis=0)
            steps = np.linspace(-window, 0.5 * usual, 21)
            around = [np.column_stack([np.interp(t + d, grid, v) for v in push.T]) for d in steps]
            change = np.ptp(np.stack(around), axis=0)  # (n, m)
            place = run.course.place(t)
            slope = np.abs(bench.twin.rotation.T @ place.of(bench.slopes[k].tip_rho))
            m = len(bench.actuators)
            extra[:, :3] = TIMING_S**2 * np.einsum("nij,nj->ni", slope, change)
            extra[:, 3 : 3 + m] = TIMING_S**2 * change
        extra = np.where(np.isfinite(observed), extra, np.nan)
        out.append(thinned(extra, run.thin))
    return out


def open_inquiry(bench: Bench, atoms: Sequence[Atom]) -> Inquiry:
    """Columns, noise and white rows for a bench and the atoms that may be causes."""
    columns = build(bench, atoms, {})
    words = patterns(bench)
    extra = inflation(bench)
    times = [thinned(run.course.time[:, None], run.thin)[:, 0] for run in bench.runs]
    residuals = [bench.residual(k) for k in range(len(bench.runs))]
    shapes: dict[int, dict[str, float]] = {i: shape_default(a) for i, a in enumerate(atoms) if a.shapes}
    noise, inflate = measure_noise(bench, columns, words, extra, times, residuals)
    inquiry = _whiten(bench, columns, words, inflate, times, residuals, noise, shapes)
    if any(a.shapes for a in atoms):
        scan_shapes(inquiry)
        noise, inflate = measure_noise(bench, inquiry.columns, words, extra, times, residuals, noise)
        inquiry = _whiten(bench, inquiry.columns, words, inflate, times, residuals, noise, inquiry.shapes)
    return inquiry


def _whiten(bench: Bench, columns: Columns, words: list[Dictionary], inflate: list[Floats], times: list[Floats],
            residuals: list[Floats], noise: Noise, shapes: dict[int, dict[str, float]]) -> Inquiry:  # fmt: skip
    white, white_patterns, white_residual = [], [], []
    for k in range(len(bench.runs)):
        present = np.isfinite(inflate[k])
        clean = lambda block, mask=present: np.where(mask[:, :, None], block, 0.0)
        white.append(noise.rows(k, clean(columns.blocks[k]), inflate[k], times[k]))
        white_patterns.append([noise.rows(k, w.blocks[k], inflate[k], times[k], w.first) for w in words])
        white_residual.append(noise.rows(k, residuals[k][:, :, None], inflate[k], times[k])[:, 0])
    return Inquiry(bench, columns, words, inflate, times, residuals, noise, white, white_patterns, white_residual,
                   shapes, atoms_prior(columns))  # fmt: skip


def atoms_prior(columns: Columns) -> Atoms:
    """Prior weights: every effect alike; within an effect one value for all weighs half, or all targets alike."""
    names = sorted({a.name for a in columns.atoms})
    weight = []
    for a in columns.atoms:
        same = [b for b in columns.atoms if b.name == a.name]
        common = any(b.target is None for b in same)
        share = 1.0 / len(same) if not common or len(same) == 1 else (0.5 if a.target is None else 0.5 / (len(same) - 1))
        weight.append(np.log(share / len(names)))

    def exclusive(i: int, j: int) -> bool:
        a, b = columns.atoms[i], columns.atoms[j]
        return a.name == b.name and (a.target is None or b.target is None)

    return Atoms(tuple(tuple(columns.of(i)) for i in range(len(columns.atoms))), np.array(weight), exclusive)


def measure_noise(
    bench: Bench, columns: Columns, dictionaries: Sequence[Dictionary], extra: Sequence[Floats], times: Sequence[Floats],
    residuals: Sequence[Floats], start: Noise | None = None,
) -> tuple[Noise, list[Floats]]:  # fmt: skip
    """Noise beside everything that could be there: all effects, nuisances and patterns at once, softly."""
    runs = range(len(bench.runs))
    k, p = len(columns.names), sum(len(words.labels) for words in dictionaries)
    first = [_differences(residuals[r], times[r]) for r in runs]
    sigma = np.array(first)
    ordered = [run.course.ordered for run in bench.runs]
    precision = np.concatenate([
        np.where(columns.atom >= 0, 1.0 / 9.0, columns.prior.precision(1.0) / 9.0), np.full(p, 1.0 / PATTERN_SCALE**2)
    ])  # fmt: skip
    noise = start or Noise(np.zeros((sigma.shape[1], 3)), sigma, np.ones(sigma.shape[1]))
    both = [np.concatenate([columns.blocks[r], residuals[r][:, :, None]], axis=2) for r in runs]
    for r in runs:
        both[r][~np.isfinite(residuals[r])] = 0.0
    inflate: list[Floats] = []
    for _ in range(1 if start else 2):
        inflate = [np.sqrt(1.0 + (extra[r] / noise.sigma[r]) ** 2) for r in runs]
        # columns first, then patterns kind by kind, residual last; patterns of two kinds share no row
        A = np.zeros((k + p + 1, k + p + 1))
        at = k
        for words in dictionaries:
            index = np.concatenate([np.arange(k), np.arange(at, at + len(words.labels)), [k + p]])
            part = slice(words.first, words.first + words.blocks[0].shape[1])
            for r in runs:
                block = np.concatenate([both[r][:, part, :-1], words.blocks[r], both[r][:, part, -1:]], axis=2)
                D = noise.rows(r, block, inflate[r], times[r], words.first)
                A[np.ix_(index, index)] += D.T @ D
            at += len(words.labels)
        M = A[:-1, :-1] + np.diag(precision)
        size = 1.0 / np.sqrt(np.diag(M))
        half = np.linalg.cholesky(size[:, None] * M * size + 1e-10 * np.eye(len(size)))
        a = size * np.linalg.solve(half.T, np.linalg.solve(half, size * A[:-1, -1]))
        left = []
        for r in runs:
            gap = both[r][:, :, -1] - both[r][:, :, :-1] @ a[:k]
            at = k
            for words in dictionaries:
                part = slice(words.first, words.first + words.blocks[r].shape[1])
                gap[:, part] -= words.blocks[r] @ a[at : at + len(words.labels)]
                at += len(words.labels)
            left.append(np.where(np.isfinite(residuals[r]), gap, np.nan))
        noise = fit_noise(left, inflate, list(times), ordered)
        spent = _spent(A, M, size, np.asarray(half, float), k, dictionaries, residuals)
        noise = replace(noise, sigma=np.multiply(noise.sigma, spent))
    inflate = [np.sqrt(1.0 + (extra[r] / noise.sigma[r]) ** 2) for r in runs]
    return noise, inflate


def _spent(
    A: Floats, M: Floats, size: Floats, half: Floats, k: int, dictionaries: Sequence[Dictionary], residuals: Sequence[Floats]
) -> Floats:
    """By how much (c,) the leftover of a fit is too small for the noise: patterns have followed the noise, too."""
    shrink = np.linalg.solve(half, size[:, None] * A[:-1, :-1])
    used = np.einsum("ij,ij->j", np.linalg.solve(half, np.diag(size)), shrink)  # diagonal of M^-1 A
    out = np.ones(residuals[0].shape[1])
    at = k
    for words in dictionaries:
        part = slice(words.first, words.first + words.blocks[0].shape[1])
        rows = sum(int(np.isfinite(r[:, part]).sum()) for r in residuals)
        spent = float(used[at : at + len(words.labels)].sum())
        out[part] = 1.0 / np.sqrt(max(1.0 - spent / max(rows, 1), 0.3))
        at += len(words.labels)
    return out


def _differences(residual: Floats, time: Floats) -> Floats:
    """Rough noise (c,) from second differences, which smooth gaps do not enter."""
    out = np.full(residual.shape[1], np.nan)
    for j in range(residual.shape[1]):
        x = residual[np.isfinite(residual[:, j]), j]
        if len(x) > 4:
            bend = np.abs(np.diff(x, 2))
            out[j] = max(float(np.median(bend)) / 0.6745 / np.sqrt(6.0), 1e-9)
            if out[j] <= 1e-9:
                out[j] = max(float(np.sqrt(np.mean(bend**2) / 6.0)), 1e-7)
    return out


def scan_shapes(inquiry: Inquiry) -> None:
    """Chooses the scanned shapes (pitches, time constants) that explain most of what the other columns leave."""
    data = total(inquiry.grams(inquiry.white_residual, inquiry.white))
    own = [c for i in inquiry.shapes for c in inquiry.atoms.columns[i]]
    others = np.array([c for c in range(len(inquiry.columns.names)) if c not in set(own)])
    precision = np.where(inquiry.columns.atom >= 0, 1.0 / 9.0, inquiry.prior.precision(1.0))[others]
    M = data.A[np.ix_(others, others)] + np.diag(precision)
    size = 1.0 / np.sqrt(np.diag(M))
    L = np.linalg.cholesky(size[:, None] * M * size + 1e-12 * np.eye(len(size)))
    a = size * np.linalg.solve(L.T, np.linalg.solve(L, size * data.b[others]))
    rest = [r - W[:, others] @ a for r, W in zip(inquiry.white_residual, inquiry.white, strict=True)]
    changed: dict[int, list[Floats]] = {}
    y = np.concatenate(rest)
    for i in inquiry.shapes:
        atom = inquiry.columns.atoms[i]
        tried = [{**shape_default(atom), atom.shapes[0].name: value} for value in atom.shapes[0].scan]
        quick = [quick_columns(inquiry.bench, atom, shape) for shape in tried]
        if quick[0] is None:
            continue
        d = len(atom.parameters)
        white = np.concatenate([
            inquiry.whitened(k, np.stack([c[k] for q in quick if q for c in q], axis=2)) for k in range(len(inquiry.bench.runs))
        ])  # fmt: skip
        h = white.T @ y
        gains = []
        for v in range(len(tried)):
            own_columns = white[:, v * d : v * d + d]
            G = own_columns.T @ own_columns
            G += (1e-9 * np.trace(G) + 1e-12) * np.eye(d)
            gains.append(float(h[v * d : v * d + d] @ np.linalg.solve(G, h[v * d : v * d + d])))
        best = tried[int(np.argmax(gains))]
        inquiry.shapes[i] = best
        for c, per_run in zip(inquiry.atoms.columns[i], atom_columns(inquiry.bench, atom, best), strict=True):
            changed[c] = per_run
    inquiry.columns = inquiry.columns.with_blocks(changed)


def quick_columns(bench: Bench, atom: Atom, shape: Mapping[str, float]) -> list[list[Floats]] | None:
    """Columns of an effect that moves carriages only, straight from its hook; None for any other effect."""
    if hasattr(atom.effect, "on_drive") and not any(
        hasattr(atom.effect, h) for h in ("on_servo", "on_robot", "on_load", "on_pose", "on_workpiece", "on_clock")
    ):
        out = []
        for p in atom.parameters:
            cause = cause_of(atom, {**shape, p.name: p.scale})
            per_run = []
            for k, run in enumerate(bench.runs):
                motion = bench.nominal[k].motion
                moved = atom.effect.on_drive(np.zeros_like(motion.encoder), motion, cause.which(bench.actuators), cause.values)
                values = np.zeros_like(bench.observed(k))
                slope = bench.row_slopes(k)
                values[:, :3] = np.einsum("nij,nj->ni", slope, moved)
                per_run.append(thinned(values, run.thin))
            out.append(per_run)
        return out
    return None

