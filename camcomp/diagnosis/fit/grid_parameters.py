"""Shapes that nothing shows while an effect is absent (pitches, time constants): tried one by one against a leftover."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from camcomp.diagnosis.fit.bench import Bench, CandidateCause, cause_of, thinned
from camcomp.diagnosis.fit.columns import Columns, shape_default
from camcomp.diagnosis.statistics.by_channel import ByChannel
from camcomp.diagnosis.statistics.cause_sets import total
from camcomp.diagnosis.statistics.evidence import PRIOR_WIDTHS, Gram
from camcomp.ground.datatypes import Floats, Ints
from camcomp.model import signal_path
from camcomp.model.effect import Parameter

_FINER = 17  # values between the neighbours of the best
_AT_ONCE = 4  # values of a shape whose columns are made white together


def beside(
    grams: Sequence[Gram], white: Sequence[ByChannel], residual: Sequence[Floats], columns: Columns, others: Ints
) -> list[Floats]:
    """White residual per run with the columns `others` softly fitted and taken out."""
    data = total(grams)
    precision = np.where(columns.candidate >= 0, 1.0 / 9.0, columns.prior.precision(1.0))[others]
    M = data.A[np.ix_(others, others)] + np.diag(precision)
    size = 1.0 / np.sqrt(np.diag(M))
    L = np.linalg.cholesky(size[:, None] * M * size + 1e-12 * np.eye(len(size)))
    a = np.zeros(len(data.b))
    a[others] = size * np.linalg.solve(L.T, np.linalg.solve(L, size * data.b[others]))
    return [r - W @ a for r, W in zip(residual, white, strict=True)]


def best_shape(
    bench: Bench, candidate: CandidateCause, rest: Sequence[Floats], whitened: Callable[[int, Floats], Floats]
) -> dict[str, float] | None:
    """The scanned shape whose columns explain most of `rest` (white, per run); None where the effect is not scanned."""
    p = candidate.shapes[0]
    values = np.asarray(p.scan)
    gains = _gains(bench, candidate, p, values, rest, whitened)
    if gains is None:
        return None
    best = int(np.argmax(gains))
    # between its neighbours the gain has one peak, and a large effect off its peak leaves what looks like noise
    near = np.geomspace(values[max(best - 1, 0)], values[min(best + 1, len(values) - 1)], _FINER)
    finer = _gains(bench, candidate, p, near, rest, whitened)
    value = near[int(np.argmax(finer))] if finer is not None and finer.max() > gains[best] else values[best]
    return {**shape_default(candidate), p.name: float(value)}


def _gains(
    bench: Bench,
    candidate: CandidateCause,
    p: Parameter,
    values: Floats,
    rest: Sequence[Floats],
    whitened: Callable[[int, Floats], Floats],
) -> Floats | None:
    """Chi-square (v,) that an effect explains with each value of a shape, its size within its usual one; None where it is not scanned.

    Where rows do not tell a shape (an early stretch of a warm-up is straight, however long that takes), usual sizes do.
    """
    gains = []
    for i in range(0, len(values), _AT_ONCE):  # all together they are as large as all other columns
        some = values[i : i + _AT_ONCE]
        each = [quick_columns(bench, candidate, {**shape_default(candidate), p.name: float(v)}) for v in some]
        columns = [column for of_value in each if of_value is not None for column in of_value]
        if not columns:
            return None
        own = len(candidate.parameters)
        h, G = np.zeros((len(some), own)), np.tile((1.0 / PRIOR_WIDTHS[-1] ** 2) * np.eye(own), (len(some), 1, 1))
        for k, r in enumerate(rest):
            white = whitened(k, np.stack([column[k] for column in columns], axis=2)).reshape(len(r), len(some), -1)
            by_value = np.ascontiguousarray(white.transpose(1, 2, 0))
            h, G = h + by_value @ r, G + by_value @ by_value.transpose(0, 2, 1)
        gains.append(np.einsum("vp,vp->v", h, np.linalg.solve(G, h[:, :, None])[:, :, 0]))
    return np.concatenate(gains)


def reach(p: Parameter, value: float) -> float:
    """Share of its value by which a shape may move in one step: half way to the next value that was scanned."""
    gaps = np.abs(np.log(np.asarray(p.scan)[np.asarray(p.scan) > 0] / value))
    return float(np.clip(0.5 * np.sort(gaps[gaps > 1e-9])[:2].max(initial=0.0), 0.005, 0.4))


def quick_columns(bench: Bench, candidate: CandidateCause, shape: Mapping[str, float]) -> list[list[Floats]] | None:
    """Columns of an effect of the drive alone, straight from its hooks; None for any other effect."""
    if signal_path.stages_of(candidate.effect) == {"drive"}:
        out = []
        for p in candidate.parameters:
            cause = cause_of(candidate, {**shape, p.name: p.scale})
            per_run = []
            for k, run in enumerate(bench.runs):
                motion = bench.nominal[k].motion
                moved, guided = signal_path.driven([cause], bench.actuators, motion)
                effort = signal_path.drive_forces([cause], bench.actuators, guided)
                tip = np.einsum("nij,nj->ni", bench.row_slopes(k), moved)
                tip, m = thinned(bench.turned(k, tip), run.thin), len(bench.actuators)
                values = np.zeros((len(tip), 6 + 2 * m))
                values[:, :3] = tip
                if effort is not None:
                    values[:, 3 + m : 3 + 2 * m] = thinned(effort, run.thin)
                per_run.append(values)
            out.append(per_run)
        return out
    return None
