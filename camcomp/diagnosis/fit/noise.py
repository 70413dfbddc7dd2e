"""The noise of a bench's channels, measured beside everything that could be there."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from camcomp.diagnosis.fit.bench import Bench, thinned
from camcomp.diagnosis.fit.columns import Columns
from camcomp.diagnosis.fit.patterns import Dictionary
from camcomp.diagnosis.statistics.noise_model import Noise, fit_noise
from camcomp.diagnosis.statistics.sensor_noise import SMOOTH, Colour, colour
from camcomp.ground.datatypes import Floats

PASSES = 3  # fits with patterns
NOISE_GROWTH = 1.1  # growth from pass to pass that noise may have
SURE = 4.0  # standard deviations by which a pattern has to exceed chance before it is more than noise
TIMING_S = 0.0015  # how fast a real drive settles after its acceleration has stepped
UNSTEADY_S = 0.002  # more jitter than any log has
MIDDLE = 0.4549  # median of a squared standard normal number
PLAIN = 0.3  # share of the noise at rest by which jitter has to add to it at speed
FAINT_PATTERN = 0.03  # um or N: what a pattern amounts to where nothing depends on it


@dataclass(frozen=True, eq=False)
class Background:
    """noise of the channels; inflate (n, c) per run: by how much rows are less certain; rest (n, c): what nothing explains."""

    noise: Noise
    inflate: list[Floats]
    rest: list[Floats]

    def colour(self, part: slice = slice(0, 3)) -> Colour:
        """Whether the noise of some channels, the tip's by default, can be that of a sensor."""
        rough = np.array([roughness(r[:, part]) for r in self.rest])
        return colour(self.noise.sigma[:, part], rough)


def inflation(bench: Bench) -> list[Floats]:
    """Per run (n, c) >= 1: rows just after a step of the acceleration count less; NaN where no value.

    In units of the channel's own noise, which is not known yet: here the extra standard deviation in mm or N.
    """
    out = []
    unsteady = jitter(bench)
    for k, run in enumerate(bench.runs):
        observed = bench.observed(k)
        extra = np.zeros_like(observed)
        t = run.run_path.time
        if run.run_path.ordered and len(t) > 4:
            usual = float(np.median(np.diff(t)))
            window = max(1.5 * usual, 0.02)
            grid = run.run_path.grid
            push = np.gradient(np.gradient(run.run_path.grid_rho, grid, axis=0), grid, axis=0)
            steps = np.linspace(-window, 0.5 * usual, 21)
            around = [np.column_stack([np.interp(t + d, grid, v) for v in push.T]) for d in steps]
            change = np.ptp(np.stack(around), axis=0)  # (n, m)
            place = run.run_path.place(t)
            slope = np.abs(bench.twin.rotation.T @ place.of(bench.slopes[k].tip_rho))
            m = len(bench.actuators)
            extra[:, :3] = TIMING_S**2 * np.einsum("nij,nj->ni", slope, change)
            extra[:, 3 : 3 + m] = TIMING_S**2 * change
            if unsteady > 0.0:
                extra[:, :3] = np.hypot(extra[:, :3], unsteady * np.abs(_speed(bench, k)))
        extra = np.hypot(extra, _doubt(bench, k))
        extra = np.where(np.isfinite(observed), extra, np.nan)
        out.append(thinned(extra, run.thin))
    return out


def _doubt(bench: Bench, k: int) -> Floats:
    """What the channels (n, c) may be off by where the force is not known, standard deviations."""
    run = bench.runs[k]
    out = np.zeros_like(bench.observed(k))
    if run.run_path.driven is None or not run.run_path.driven.doubt.any():
        return out
    force = run.run_path.driven.doubt
    m = len(bench.actuators)
    slopes = bench.slopes[k].at(run.run_path.row_place)
    lever = bench.twin.nominal.tool
    # each axis of the force may be off by itself
    for axis in range(3):
        push = np.zeros((len(force), 3))
        push[:, axis] = force[:, axis]
        wrench = np.concatenate([push, np.cross(lever, push)], axis=1)
        tip = np.einsum("nij,nj->ni", slopes.tip_wrench, wrench) @ bench.twin.rotation
        out[:, :3] = np.hypot(out[:, :3], bench.turned(k, tip))
        out[:, 3 + m : 3 + 2 * m] = np.hypot(
            out[:, 3 + m : 3 + 2 * m], np.einsum("nij,nj->ni", slopes.drive_wrench, wrench)
        )
    out[:, 3 + 2 * m :] = force
    return np.abs(out)


def jitter(bench: Bench) -> float:
    """Standard deviation, s, of the instants at which the tip was really read, from noise that grows with the speed.

    Fourth differences leave noise alone; its size where an axis is fast is held against that where it is slow, by medians.
    0 unless it is plain to see.
    """
    found = []
    for k, run in enumerate(bench.runs):
        t = run.run_path.time
        if not run.run_path.ordered or len(t) < 60:
            continue
        speed = np.abs(_speed(bench, k))
        gap = (bench.observed(k) - bench.channels(k, bench.nominal[k]))[:, :3]
        rough = np.diff(gap, 4, axis=0) ** 2 / 70.0
        for rows, v in zip(rough.T, speed[2:-2].T, strict=True):
            present = np.isfinite(rows)
            if present.sum() < 60:
                continue
            slow, fast = np.quantile(v[present], (1.0 / 3.0, 2.0 / 3.0))
            low, high = present & (v <= slow), present & (v >= fast)
            more = float(np.median(v[high] ** 2) - np.median(v[low] ** 2))
            rest, push = float(np.median(rows[low])), float(np.median(rows[high]))
            if fast > 2.0 * slow and more > 0.0 and 0.0 < rest < (UNSTEADY_S * fast) ** 2:
                found.append(((push - rest) / MIDDLE / more, more / rest))
    if not found:
        return 0.0
    gain, reach = np.array(found).T
    order = np.argsort(gain)  # the axes that would see it best have the most to say
    at = np.searchsorted(np.cumsum(reach[order] ** 2), 0.5 * np.sum(reach**2))
    variance = min(float(gain[order][at]), UNSTEADY_S**2)
    return float(np.sqrt(variance)) if variance * MIDDLE * float(reach.max()) > PLAIN else 0.0


def _speed(bench: Bench, k: int) -> Floats:
    """Velocity (n, 3) of the modelled tip in run k, mm/s."""
    t = bench.runs[k].run_path.time
    return np.gradient(bench.channels(k, bench.nominal[k])[:, :3], t, axis=0)


def first_noise(extra: Sequence[Floats], residuals: Sequence[Floats]) -> Background:
    """White noise as rough as the residuals (n, c) per run: all there is to go by before anything is explained."""
    rough = np.array([roughness(r) for r in residuals])
    inflate = [np.sqrt(1.0 + (e / s) ** 2) for e, s in zip(extra, rough, strict=True)]
    return Background(Noise(rough, np.zeros_like(rough), np.zeros_like(rough)), inflate, list(residuals))


def measure_noise(
    bench: Bench, columns: Columns, dictionaries: Sequence[Dictionary], extra: Sequence[Floats], times: Sequence[Floats],
    residuals: Sequence[Floats],
) -> Background:  # fmt: skip
    """Noise beside everything that could be there: all effects and nuisances softly, patterns as far as they are real.

    What repeats wherever a pattern says so is no noise; what does not is, however smooth. So the noise has first claim,
    and the size of every pattern is learnt from what it explains beyond it (empirical Bayes, MacKay 1992).
    """
    runs = range(len(bench.runs))
    k = len(columns.names)
    both = [np.concatenate([columns.blocks[r], residuals[r][:, :, None]], axis=2) for r in runs]
    for r in runs:
        both[r][~np.isfinite(residuals[r])] = 0.0
    free = np.where(columns.candidate >= 0, 1.0 / 9.0, columns.prior.precision(1.0) / 9.0)
    sizes = [np.full(len(words.labels), FAINT_PATTERN) for words in dictionaries]
    kinds = [slice(words.first, words.first + words.blocks[0].shape[1]) for words in dictionaries]
    ordered = [run.run_path.ordered for run in bench.runs]
    noise = first_noise(extra, residuals).noise
    rough = noise.sigma
    inflate: list[Floats] = []
    left: list[Floats] = []
    learn = 1  # patterns are judged against noise whose colour is known
    for step in range(learn + PASSES):
        # of what is smoother than any sensor's noise, patterns have the first claim
        judged = replace(noise, sigma=np.fmin(noise.sigma, SMOOTH * rough)) if step == learn else noise
        inflate = [np.sqrt(1.0 + (extra[r] / judged.sigma[r]) ** 2) for r in runs]
        grams = [_joint(judged, words, both, inflate, times) for words in dictionaries]
        fit = _solve(grams, k, free, sizes)
        left = []
        for r in runs:
            gap = both[r][:, :, -1] - both[r][:, :, :-1] @ fit.columns
            for words, a in zip(dictionaries, fit.patterns, strict=True):
                part = slice(words.first, words.first + words.blocks[r].shape[1])
                gap[:, part] -= words.blocks[r] @ a
            left.append(np.where(np.isfinite(residuals[r]), gap, np.nan))
        before, noise = noise, fit_noise(left, inflate, list(times), ordered, kinds)
        noise = replace(noise, sigma=noise.sigma * _spent(fit, dictionaries, residuals))
        if step > 0:
            noise = _not_worse(noise, before)
        # with one run nothing has happened twice, and smooth is all that anything can be called
        if learn <= step < learn + PASSES - 1 and len(bench.runs) > 1:
            sizes = [
                _learnt(words, G, k, free, fit.patterns[d], fit.spread[d], sizes[d], step == learn)
                for d, (words, G) in enumerate(zip(dictionaries, grams, strict=True))
            ]
    inflate = [np.sqrt(1.0 + (extra[r] / noise.sigma[r]) ** 2) for r in runs]
    return Background(noise, inflate, left)


@dataclass(frozen=True, eq=False)
class _Fit:
    """Amplitudes of the columns and, kind by kind, of the patterns; their variances; how many free numbers they are."""

    columns: Floats
    patterns: list[Floats]
    spread: list[Floats]
    used: list[float]


def _joint(
    noise: Noise, words: Dictionary, both: Sequence[Floats], inflate: Sequence[Floats], times: Sequence[Floats]
) -> Floats:
    """Gram matrix of columns, patterns of one kind and residual, in this order, over the kind's white rows."""
    part = slice(words.first, words.first + words.blocks[0].shape[1])
    out = np.zeros((1, 1))
    for r, every in enumerate(both):
        block = np.concatenate([every[:, part, :-1], words.blocks[r], every[:, part, -1:]], axis=2)
        D = noise.rows(r, block, inflate[r], times[r], words.first)
        out = out + D.T @ D
    return out


def _solve(grams: Sequence[Floats], k: int, free: Floats, sizes: Sequence[Floats]) -> _Fit:
    """Columns and patterns at once; patterns of two kinds share no row."""
    p = [len(s) for s in sizes]
    M, h = np.diag(np.concatenate([free, *(1.0 / s**2 for s in sizes)])), np.zeros(k + sum(p))
    own = np.zeros(k + sum(p))
    at = k
    for G, count in zip(grams, p, strict=True):
        index = np.concatenate([np.arange(k), np.arange(at, at + count)])
        M[np.ix_(index, index)] += G[:-1, :-1]
        h[index] += G[:-1, -1]
        at += count
    own = np.concatenate([np.zeros(k), *(1.0 / s**2 for s in sizes)])
    scale = 1.0 / np.sqrt(np.diag(M))
    half = np.linalg.solve(np.linalg.cholesky(scale[:, None] * M * scale + 1e-10 * np.eye(len(scale))), np.diag(scale))
    a = half.T @ (half @ h)
    variance = np.sum(half**2, axis=0)
    ends = np.cumsum([k, *p])
    parts = [slice(int(i), int(j)) for i, j in pairwise(ends)]
    used = 1.0 - variance * own
    return _Fit(a[:k], [a[s] for s in parts], [variance[s] for s in parts], [float(used[s].sum()) for s in parts])


def _learnt(
    words: Dictionary, G: Floats, k: int, free: Floats, amplitude: Floats, variance: Floats, size: Floats, first: bool
) -> Floats:
    """Sizes (p,) of the patterns, one per covariate: from what they explain beside the columns, then from the joint fit."""
    labels = np.array(words.labels)
    out = np.full(len(labels), FAINT_PATTERN)
    if first:
        half = np.linalg.solve(np.linalg.cholesky(G[:k, :k] + np.diag(free)), G[:k, k:])
        rest = G[k:, k:] - half.T @ half
    for name in dict.fromkeys(words.labels):
        mine = np.flatnonzero(labels == name)
        if first:
            P, h = rest[np.ix_(mine, mine)], rest[mine, -1]
            scatter = max(float(np.sum(P**2)), 1e-300)
            beyond = float(h @ h - np.trace(P))
            square = beyond / scatter if beyond > SURE * np.sqrt(2.0 * scatter) else 0.0
        else:
            told = len(mine) - float(np.sum(variance[mine] / size[mine] ** 2))  # amplitudes that the data determine
            square = float(np.sum(amplitude[mine] ** 2)) / max(told, 1e-9)
        out[mine] = max(np.sqrt(square), FAINT_PATTERN)
    return out


def _not_worse(noise: Noise, before: Noise) -> Noise:
    """The noise, and the one before it where that is less: slow noise would take a lasting force for itself, pass by pass."""
    worse = noise.sigma > NOISE_GROWTH * before.sigma
    return Noise(*(np.where(worse, getattr(before, n), getattr(noise, n)) for n in ("sigma", "slow", "memory")))


def _spent(fit: _Fit, dictionaries: Sequence[Dictionary], residuals: Sequence[Floats]) -> Floats:
    """By how much (c,) the leftover of a fit is too small for the noise: patterns have followed the noise, too."""
    out = np.ones(residuals[0].shape[1])
    for words, used in zip(dictionaries, fit.used, strict=True):
        part = slice(words.first, words.first + words.blocks[0].shape[1])
        rows = sum(int(np.isfinite(r[:, part]).sum()) for r in residuals)
        out[part] = 1.0 / np.sqrt(max(1.0 - used / max(rows, 1), 0.3))
    return out


def roughness(residual: Floats) -> Floats:
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
