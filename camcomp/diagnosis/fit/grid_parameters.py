"""Shapes that nothing shows while an effect is absent (pitches, time constants): tried one by one against a leftover."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from camcomp.diagnosis.fit.bench import Bench, CandidateCause, cause_of, thinned
from camcomp.diagnosis.fit.columns import Columns, shape_default
from camcomp.diagnosis.statistics.by_channel import ByChannel
from camcomp.diagnosis.statistics.cause_sets import total
from camcomp.diagnosis.statistics.evidence import PRIOR_WIDTHS, Gram
from camcomp.ground.datatypes import Floats, Ints
from camcomp.model import signal_path
from camcomp.model.effect import Parameter
from camcomp.model.motion.loaded_structure import applied

_FINER = 17  # values between the neighbours of the best
_AT_ONCE = 4  # values of a shape whose columns are made white together


@dataclass(frozen=True, eq=False)
class Beside:
    """A leftover with other columns softly fitted and taken out, and what they take of further columns.

    A column that is tried against the leftover has to lose the same: a warm-up less its mean is another curve than a warm-up.
    """

    rest: list[Floats]  # white, per run
    white: Sequence[ByChannel]
    others: Ints
    half: Floats  # (o, o): its square is the inverse of the others' products

    def taken(self, columns: Sequence[Floats]) -> Floats:
        """What of white columns (w, d) per run lies in the others: (o, d), in coordinates whose products are those of columns."""
        return np.asarray(
            self.half @ sum((W.T @ C for W, C in zip(self.white, columns, strict=True)), np.zeros(1))[self.others]
        )


def beside(
    grams: Sequence[Gram], white: Sequence[ByChannel], residual: Sequence[Floats], columns: Columns, others: Ints
) -> Beside:
    """White residual per run with the columns `others` softly fitted and taken out."""
    data = total(grams)
    precision = np.where(columns.candidate >= 0, 1.0 / 9.0, columns.prior.precision(1.0))[others]
    M = data.A[np.ix_(others, others)] + np.diag(precision)
    size = 1.0 / np.sqrt(np.diag(M))
    L = np.linalg.cholesky(size[:, None] * M * size + 1e-12 * np.eye(len(size)))
    half = np.linalg.solve(L, np.diag(size))
    a = np.zeros(len(data.b))
    a[others] = half.T @ (half @ data.b[others])
    return Beside([r - W @ a for r, W in zip(residual, white, strict=True)], white, others, half)


def best_shape(
    bench: Bench, candidate: CandidateCause, left: Beside, whitened: Callable[[int, Floats], Floats]
) -> dict[str, float] | None:
    """The scanned shape whose columns explain most of what is left; None where the effect is not scanned."""
    p = candidate.shapes[0]
    values = np.asarray(p.scan)
    gains = _gains(bench, candidate, [{**shape_default(candidate), p.name: float(v)} for v in values], left, whitened)
    if gains is None:
        return None
    best = int(np.argmax(gains))
    # between its neighbours the gain has one peak, and a large effect off its peak leaves what looks like noise
    near = np.geomspace(values[max(best - 1, 0)], values[min(best + 1, len(values) - 1)], _FINER)
    finer = _gains(bench, candidate, [{**shape_default(candidate), p.name: float(v)} for v in near], left, whitened)
    value = near[int(np.argmax(finer))] if finer is not None and finer.max() > gains[best] else values[best]
    return {**shape_default(candidate), p.name: float(value)}


def _gains(
    bench: Bench, candidate: CandidateCause, shapes: Sequence[Mapping[str, float]], left: Beside,
    whitened: Callable[[int, Floats], Floats],
) -> Floats | None:  # fmt: skip
    """Chi-square (v,) that an effect explains with each of v shapes, its size within its usual one; None where it is not scanned.

    Where rows do not tell a shape (an early stretch of a warm-up is straight, however long that takes), usual sizes do.
    """
    gains = []
    for i in range(0, len(shapes), _AT_ONCE):  # all together they are as large as all other columns
        each = [quick_columns(bench, candidate, shape) for shape in shapes[i : i + _AT_ONCE]]
        columns = [column for of_shape in each if of_shape is not None for column in of_shape]
        if not columns:
            return None
        v, own = len(each), len(candidate.parameters)
        white = [
            whitened(k, np.stack([c[k] for c in columns], axis=2)).reshape(len(r), -1) for k, r in enumerate(left.rest)
        ]
        lost = left.taken(white).reshape(-1, v, own).transpose(1, 2, 0)
        h, G = np.zeros((v, own)), np.tile((1.0 / PRIOR_WIDTHS[-1] ** 2) * np.eye(own), (v, 1, 1))
        G = G - lost @ lost.transpose(0, 2, 1)
        for W, r in zip(white, left.rest, strict=True):
            by_shape = np.ascontiguousarray(W.reshape(len(r), v, own).transpose(1, 2, 0))
            h, G = h + by_shape @ r, G + by_shape @ by_shape.transpose(0, 2, 1)
        gains.append(np.einsum("vp,vp->v", h, np.linalg.solve(G, h[:, :, None])[:, :, 0]))
    return np.concatenate(gains)


def settled_interval(
    bench: Bench, candidate: CandidateCause, shape: Mapping[str, float], left: Beside,
    whitened: Callable[[int, Floats], Floats],
) -> dict[str, float]:  # fmt: skip
    """The interval near one that was found whose columns explain most when they lose to the others what the leftover has lost.

    What begins where a drive turns is halfway a play: the leftover beside all plays shows less of it there.
    """
    paths = [run.run_path for run in bench.runs]
    best, (start, end) = dict(shape), [each.name for each in candidate.shapes]
    run = next((p for p in paths if p.started <= 0.5 * (best[start] + best[end]) <= p.started + p.time[-1]), paths[0])
    row, step, most = float(np.median(np.diff(run.time))), 4, -np.inf
    while step:
        near = [best, *({**best, which: best[which] + sign * step * row} for which in (start, end) for sign in (-1, 1))]
        near = [each for each in near if each[end] - each[start] > 2 * row]
        gains = _gains(bench, candidate, near, left, whitened) if near else None
        if gains is None:
            return best
        if gains.max() > most and gains.argmax() > 0:
            most, best = float(gains.max()), near[int(gains.argmax())]
        else:
            step //= 2
    return best


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
                tip = applied(bench.row_slopes(k), moved)
                tip, m = thinned(bench.turned(k, tip), run.thin), len(bench.actuators)
                values = np.zeros((len(tip), 6 + 2 * m))
                values[:, :3] = tip
                if effort is not None:
                    values[:, 3 + m : 3 + 2 * m] = thinned(effort, run.thin)
                per_run.append(values)
            out.append(per_run)
        return out
    return None
