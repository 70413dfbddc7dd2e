"""How a problem begins: which rows count, the noise, white columns, and where scanned shapes stand before any set is tried."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from camcomp.diagnosis.fit.bench import Bench, CandidateCause, thinned
from camcomp.diagnosis.fit.cause_sets import CausePrior
from camcomp.diagnosis.fit.columns import (
    Columns,
    build,
    candidate_columns,
    first_guess,
    healthy_size,
    shape_default,
    with_scatter,
)
from camcomp.diagnosis.fit.floor import least_noise, measure_floor
from camcomp.diagnosis.fit.grid_parameters import best_shape, quick_columns
from camcomp.diagnosis.fit.intervals_in_time import likely_interval, log_intervals, never_ending
from camcomp.diagnosis.fit.noise import instrument_noise, with_doubt
from camcomp.diagnosis.fit.outliers import outlying
from camcomp.diagnosis.fit.patterns import Dictionary, dictionary
from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.model.noise import HEALTHY, MINOR
from camcomp.diagnosis.statistics.by_channel import channel_behind_channel
from camcomp.diagnosis.statistics.evidence import estimate
from camcomp.diagnosis.statistics.folds import Folds, Split
from camcomp.diagnosis.statistics.noise_model import Noise
from camcomp.diagnosis.statistics.normal_equations import sum_grams
from camcomp.ground.datatypes import Floats


def open_problem(bench: Bench, candidates: Sequence[CandidateCause], stated_mm: float | None = None) -> Problem:
    """Columns, noise and white rows for a bench and the candidates that may be causes.

    stated_mm: whole deviation of the tip's instrument per axis, where the user states it.
    """
    outliers = outlying(bench)
    bench.without(outliers)
    floor = measure_floor(bench, stated_mm)
    times = [thinned(run.run_path.time, run.thin) for run in bench.runs]
    residuals = [bench.residual(k) for k in range(len(bench.runs))]
    noise = with_doubt(instrument_noise(bench, floor, least_noise(bench, floor), times), bench)
    guessed = {i: guess for i, each in enumerate(candidates) if (guess := first_guess(bench, each)) is not None}
    columns = build(bench, candidates, guessed, floor.tip_um)
    shapes: dict[int, dict[str, float]] = {
        i: guessed.get(i, shape_default(a)) for i, a in enumerate(candidates) if a.shapes or a.switches
    }
    problem = _whitened(
        Problem(
            bench=bench, columns=columns, dictionary=Dictionary((), (), ()), times=times, residuals=residuals,
            floor=floor, noise=noise, outliers=outliers, white=[], white_patterns=[], white_residual=[],
            shapes=shapes, candidates=cause_prior(columns),
        )
    )  # fmt: skip
    if len(columns.of_labels):
        mean = estimate(sum_grams(problem.base_grams), problem.prior, ())[0]
        problem = replace(problem, columns=with_scatter(columns, bench, mean))
    noise = _with_model_error(problem)
    problem = replace(problem, noise=noise, white=[])  # two sets of white columns at once are much memory
    problem = _whitened(problem, dictionary(bench))
    return _scanned(problem) if shapes else problem


def cause_prior(columns: Columns) -> CausePrior:
    """Prior weights: every effect weighs the same; within an effect one value for all weighs half, or all targets the same.

    Scanned values of a shape are equally likely, and so are the intervals of what acts for a while.
    """
    candidates = columns.candidates  # what follows outlives these columns, which are large
    names = sorted({a.name for a in candidates})
    weight = []
    for a in candidates:
        same = [b for b in candidates if b.name == a.name]
        common = any(b.target is None for b in same)
        share = (
            1.0 / len(same) if not common or len(same) == 1 else (0.5 if a.target is None else 0.5 / (len(same) - 1))
        )
        sought = float(sum(np.log(len(p.scan)) for p in a.shapes if not p.placed))
        sought += log_intervals(len(columns.blocks)) if any(p.placed for p in a.shapes) else 0.0
        weight.append(np.log(share / len(names)) - sought)

    def exclusive(i: int, j: int) -> bool:
        a, b = candidates[i], candidates[j]
        return a.name == b.name and (a.target is None or b.target is None)

    kinds = [tuple(i for i, a in enumerate(candidates) if a.name == name and a.target is not None) for name in names]
    return CausePrior(
        tuple(tuple(columns.of(i)) for i in range(len(candidates))), np.array(weight), exclusive, tuple(kinds)
    )


def _with_model_error(problem: Problem) -> Noise:
    """The noise with what even all effects together leave of encoders, drive forces and dynamometer: the model's own error.

    It makes these channels count less, so that what a model of forces says wrongly is not held against a cause that the
    tip shows. The tip keeps the noise of its instrument, and the floor is never touched.
    """
    free = [c for own in problem.candidates.columns for c in own]
    mean, _ = estimate(sum_grams(problem.base_grams), problem.prior, free)
    sigma = problem.noise.sigma.copy()
    for k, (W, r) in enumerate(zip(problem.white, problem.white_residual, strict=True)):
        left, at = (r - W @ mean) ** 2, 0
        for c in range(sigma.shape[1]):
            rows = int(np.isfinite(problem.noise.inflate[k][:, c]).sum()) if np.isfinite(sigma[k, c]) else 0
            if c >= 3 and rows:
                sigma[k, c] *= max(1.0, float(np.sqrt(np.mean(left[at : at + rows]))))
            at += rows
    return replace(problem.noise, sigma=sigma)


def _whitened(problem: Problem, words: Dictionary | None = None) -> Problem:
    """The problem with its columns, patterns and residuals white under its noise."""
    noise = problem.noise
    return replace(
        problem,
        dictionary=problem.dictionary if words is None else replace(words, blocks=()),  # white they are enough
        white=[noise.by_channel(k, each) for k, each in enumerate(problem.columns.blocks)],
        white_patterns=[noise.by_channel(k, each) for k, each in enumerate(words.blocks)] if words else [],
        white_residual=[noise.rows(k, each[:, :, None])[:, 0] for k, each in enumerate(problem.residuals)],
    )


def _scanned(problem: Problem) -> Problem:
    """The problem with the scanned shapes (pitches, time constants) that explain most of the residual of the other
    columns.
    """
    scanned = [i for i in problem.shapes if problem.columns.candidates[i].shapes]
    own = [c for i in scanned for c in problem.candidates.columns[i]]
    precision = np.where(problem.columns.candidate >= 0, 1.0 / 9.0, problem.prior.precision)  # three scales
    white = [W.exchanged(own, np.zeros((len(W), len(own)))) for W in problem.white]
    base = Folds(
        white=white, residual=problem.white_residual, precision=precision, constants=[], split=Split(1, 1),
        places=[problem.row_places(k) for k in range(len(problem.white))],
    )  # fmt: skip
    left = [
        r - (each @ base.mean).reshape(r.T.shape).T
        for r, each in zip(problem.residuals, problem.columns.blocks, strict=True)
    ]
    left = [_in_noise(problem, k, each[:, :, None])[:, :, 0] for k, each in enumerate(left)]
    changed: list[tuple[list[int], list[list[Floats]]]] = []
    for i in scanned:
        candidate = problem.columns.candidates[i]
        if not candidate.of_drive_alone:
            continue
        if problem.passing(i):
            always = quick_columns(problem.bench, candidate, [never_ending(candidate)])
            motions = [_in_noise(problem, k, each.dense()) for k, each in enumerate(always)]
            found = likely_interval(problem.bench, candidate, motions, left, problem.times)
            if found is None:
                continue
            best = found
        else:
            best = best_shape(problem.bench, candidate, base, problem.noise)
        problem.shapes[i] = best
        columns = candidate_columns(problem.bench, candidate, best)
        changed.append((list(problem.candidates.columns[i]), columns))
    blocks, whole = list(problem.columns.blocks), list(problem.white)
    prior = replace(problem.prior, tolerance=problem.prior.tolerance.copy(), reach=problem.prior.reach.copy())
    for index, columns in changed:
        candidate = problem.columns.candidates[problem.columns.candidate[index[0]]]
        for c, p, per_run in zip(index, candidate.parameters, columns, strict=True):
            prior.tolerance[c] = healthy_size(problem.bench, candidate, p, per_run, problem.floor.tip_um)
            prior.reach[c] = MINOR / HEALTHY * prior.tolerance[c]
        for k in range(len(blocks)):
            new = np.stack([each[k] for each in columns], axis=2)
            blocks[k] = blocks[k].exchanged(index, channel_behind_channel(new))
            whole[k] = whole[k].exchanged(index, problem.noise.rows(k, new))
    return replace(problem, columns=replace(problem.columns, blocks=tuple(blocks), prior=prior), white=whole)


def _in_noise(problem: Problem, k: int, values: Floats) -> Floats:
    """Values (n, c, p) of run k in units of the noise of their rows, 0 where a row has no value."""
    return np.asarray(np.nan_to_num(values / (problem.noise.sigma[k] * problem.noise.inflate[k])[:, :, None]))
