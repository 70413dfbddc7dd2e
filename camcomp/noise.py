"""The noise of a bench's channels, measured beside everything that could be there."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from camcomp.bench import Bench, thinned
from camcomp.columns import Columns
from camcomp.datatypes import Floats
from camcomp.gap.colour import Colour, colour
from camcomp.gap.patterns import Dictionary
from camcomp.gap.whiten import Noise, fit_noise

TIMING_S = 0.0015  # how fast a real drive settles after its acceleration has stepped
PATTERN_SCALE = 30.0  # um or N: what a pattern may amount to when the noise is measured beside it


@dataclass(frozen=True, eq=False)
class Background:
    """noise of the channels; inflate (n, c) per run: by how much rows are less certain; rest (n, c): what nothing explains."""

    noise: Noise
    inflate: list[Floats]
    rest: list[Floats]

    def colour(self) -> Colour:
        """Whether the tip's noise can be that of a sensor."""
        rough = np.array([roughness(r[:, :3]) for r in self.rest])
        return colour(self.noise.sigma[:, :3], rough)


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


def measure_noise(
    bench: Bench, columns: Columns, dictionaries: Sequence[Dictionary], extra: Sequence[Floats], times: Sequence[Floats],
    residuals: Sequence[Floats], start: Noise | None = None,
) -> Background:  # fmt: skip
    """Noise beside everything that could be there: all effects, nuisances and patterns at once, softly."""
    runs = range(len(bench.runs))
    k, p = len(columns.names), sum(len(words.labels) for words in dictionaries)
    first = [roughness(residuals[r]) for r in runs]
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
    left: list[Floats] = []
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
        size: Floats = 1.0 / np.sqrt(np.diag(M))
        half: Floats = np.asarray(np.linalg.cholesky(size[:, None] * M * size + 1e-10 * np.eye(len(size))), float)
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
        noise = replace(noise, sigma=noise.sigma * _spent(A, M, size, half, k, dictionaries, residuals))
    inflate = [np.sqrt(1.0 + (extra[r] / noise.sigma[r]) ** 2) for r in runs]
    return Background(noise, inflate, left)


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
