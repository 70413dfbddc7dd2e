"""Which value of a shape (pitch, time constant) explains most of a residual jointly with all other columns?

The residual has no slope in a shape while its effect is absent, therefore the values of a grid are tried one by one.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from camcomp.diagnosis.fit.bench import Bench, CandidateCause, cause_of, means
from camcomp.diagnosis.fit.columns import shape_default
from camcomp.diagnosis.statistics.by_channel import AT_ONCE, ByChannel
from camcomp.diagnosis.statistics.evidence import PRIOR_WIDTHS
from camcomp.diagnosis.statistics.folds import Folds
from camcomp.diagnosis.statistics.noise_model import Noise
from camcomp.ground.datatypes import Floats
from camcomp.model import signal_path
from camcomp.model.effect import Parameter

_FINER = 17  # values between the neighbours of the best


def best_shape(bench: Bench, candidate: CandidateCause, base: Folds, noise: Noise) -> dict[str, float]:
    """The scanned shape of an effect of the drive alone whose columns explain most of the residual."""
    p = candidate.shapes[0]
    values = np.asarray(p.scan)
    values = np.sort(values[values <= max(longest(bench, candidate, p), values.min())])
    gains = _gains(bench, candidate, [{**shape_default(candidate), p.name: float(v)} for v in values], base, noise)
    best = int(np.argmax(gains))
    # between its neighbours the gain has one peak, and a large effect off its peak leaves a residual like noise
    near = np.geomspace(values[max(best - 1, 0)], values[min(best + 1, len(values) - 1)], _FINER)
    finer = _gains(bench, candidate, [{**shape_default(candidate), p.name: float(v)} for v in near], base, noise)
    value = near[int(np.argmax(finer))] if finer.max() > gains[best] else values[best]
    return {**shape_default(candidate), p.name: float(value)}


def longest(bench: Bench, candidate: CandidateCause, p: Parameter) -> float:
    """Upper bound of a shape, in its unit: of a period, the driven travel has to hold enough periods."""
    if p.turns == 0.0:
        return p.high
    which = cause_of(candidate, {}).which(bench.actuators)
    way = np.concatenate([reading.motion.encoder for reading in bench.nominal])[:, which > 0]
    return min(p.high, float(np.ptp(way, axis=0).max(initial=0.0)) / p.turns)


def _gains(
    bench: Bench, candidate: CandidateCause, shapes: Sequence[Mapping[str, float]], base: Folds,
    noise: Noise,
) -> Floats:  # fmt: skip
    """Chi-square (v,) that an effect of the drive alone explains with each of v shapes under the prior of its size.

    The prior decides where rows do not determine a shape: the first part of every warm-up is straight.
    """
    gains, own = [], len(candidate.parameters)
    count = max(AT_ONCE // (own * sum(map(len, base.residual))), 1)  # all together are as large as all other columns
    for i in range(0, len(shapes), count):
        some = shapes[i : i + count]
        white = [noise.by_channel(k, each) for k, each in enumerate(quick_columns(bench, candidate, some))]
        G, h = base.alone(white, own)
        G = G + np.eye(own) / PRIOR_WIDTHS[-1] ** 2
        gains.append(np.einsum("vp,vp->v", h, np.linalg.solve(G, h[:, :, None])[:, :, 0]))
    return np.concatenate(gains)


def reach(p: Parameter, value: float) -> float:
    """Share of its value by which a shape may move in one step: half way to the next value that was scanned."""
    gaps = np.abs(np.log(np.asarray(p.scan)[np.asarray(p.scan) > 0] / value))
    return float(np.clip(0.5 * np.sort(gaps[gaps > 1e-9])[:2].max(initial=0.0), 0.005, 0.4))


def quick_columns(bench: Bench, candidate: CandidateCause, shapes: Sequence[Mapping[str, float]]) -> list[ByChannel]:
    """Columns of an effect of the drive alone, straight from its hooks.

    Per run over its channels of n' rows each, thinned: those of every shape behind those of the one before.
    """
    causes = [cause_of(candidate, {**shape, p.name: p.scale}) for shape in shapes for p in candidate.parameters]
    every, aimed, out = np.arange(len(causes)), np.flatnonzero(causes[0].which(bench.actuators)), []
    for k, run in enumerate(bench.runs):
        motion = bench.nominal[k].motion
        n = len(motion.time)
        moved, effort = np.zeros((2, len(aimed), len(causes), n))
        for i, cause in enumerate(causes):
            error, guided = signal_path.driven([cause], bench.actuators, motion)
            moved[:, i] = error[:, aimed].T
            force = signal_path.drive_forces([cause], bench.actuators, guided)
            if force is not None:
                effort[:, i] = force[:, aimed].T
        parts = [(every[:0], np.zeros((n // run.thin, 0)))] * bench.parts["dyno"].stop
        ways = [np.ascontiguousarray(bench.turned(k, bench.row_slopes[k][:, :, j]).T) for j in aimed]
        tip = np.zeros((3, n // run.thin, len(causes)))
        for each, way in zip(moved, ways, strict=True):
            tip += means(each.T, way, run.thin)
        parts[:3] = [(every, channel) for channel in tip]
        if force is not None:
            for j, each in zip(aimed, effort, strict=True):
                parts[bench.parts["drive"].start + j] = every, means(each.T, np.ones((1, n)), run.thin)[0]
        out.append(ByChannel(len(causes), tuple(parts)))
    return out
