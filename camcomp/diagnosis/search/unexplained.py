"""How far is the tip of withheld runs from the model with these causes, beyond the noise floor?

Every kind of channel is converted to micrometres at the tip: an encoder by the kinematics, a drive force by the spring
that it loads, a dynamometer by the compliance. Blocks of rows average fast noise; the permitted drift of the
instruments is subtracted. Causes are fitted to the other runs; minor effects and differences between runs and clampings
are fitted too, within their tolerances.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import log_ndtr, ndtri

from camcomp.diagnosis.fit.bench import thinned
from camcomp.diagnosis.fit.cause_sets import Fitted
from camcomp.diagnosis.fit.floor import row_scatter, swings
from camcomp.diagnosis.fit.outliers import TINY
from camcomp.diagnosis.fit.patterns import KINDS
from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.statistics.evidence import estimate
from camcomp.diagnosis.statistics.noise_model import BLOCK
from camcomp.diagnosis.statistics.probability import SURELY
from camcomp.ground.datatypes import Bools, Floats

SURE_Z = 5.0  # standard deviations of chance


@dataclass(frozen=True)
class Unexplained:
    """One kind of channel. excess_um: rms at the tip beyond the floor; z: in standard deviations of its chance."""

    kind: str
    excess_um: float
    z: float

    @property
    def log10_chance(self) -> float:
        """Of as much from noise alone."""
        return float(log_ndtr(-self.z) / np.log(10.0))


def unexplained(problem: Problem, f: Fitted) -> dict[str, Unexplained]:
    """Per kind of channel that was measured."""
    left = [_left(problem, f, k) for k in range(len(problem.bench.runs))]
    out = {}
    for kind in KINDS:
        on = problem.channels_of(kind)
        ways = [thinned(problem.bench.at_tip(k)[:, :, on], run.thin) for k, run in enumerate(problem.bench.runs)]
        at_tip = [moved(way, r[:, on]) for way, r in zip(ways, left, strict=True)]
        if any(np.isfinite(a).any() for a in at_tip):
            swinging = _swinging(problem, on, left) if kind in ("tip", "encoder") else (0.0, 0.0)
            out[kind] = unexplained_of(problem, kind, at_tip, swinging)
    return out


def moved(way: Floats, left: Floats) -> Floats:
    """Motion (n, 3) of the tip, mm, by channels (n, c) that move it by way (n, 3, c); those that a run lacks are left out.

    A run may know the way across its path alone, or have some of the encoders.
    """
    known = np.isfinite(left).any(axis=0)
    if not known.any():
        return np.full((len(left), 3), np.nan)
    return np.asarray(np.einsum("nij,nj->ni", way[:, :, known], left[:, known]))


def _swinging(problem: Problem, on: slice, left: Sequence[Floats]) -> tuple[float, float]:
    """Mean square at the tip, mm2, of what swings too fast for blocks of rows in channels (n, c) of every run, and its chance.

    An instrument is steady: what shakes it at times only is motion.
    """
    bench, found = problem.bench, []
    for k, values in enumerate(left):
        each = zip(values[:, on].T, problem.doubt[k][:, on].T, problem.rounding[on], strict=True)
        found.append(
            bench.tip_sizes[k, on] ** 2 @ [swings(x, problem.times[k], doubt, step) for x, doubt, step in each]
        )
    square, noise = np.average(found, axis=0, weights=[len(values) for values in left])
    return float(square), float(noise * np.sqrt(2.0 / sum(map(len, left))))


def _left(problem: Problem, f: Fitted, k: int) -> Floats:
    """Channels (n, c) of run k that the causes, fitted to the other runs, and the usual small errors leave.

    A cause that the other runs do not determine (they are all in the air, and it bends the tool) has its value of all runs.
    """
    bench = problem.bench
    theta = f.theta
    if len(bench.runs) > 1:
        widths = [len(problem.candidates.columns[i]) for i in f.members]
        passing = np.repeat([problem.passing(i) for i in f.members], widths).astype(bool)
        without, doubt = problem.determined_without(f, k)
        theta = np.where(passing | undetermined(theta, doubt, widths), theta, without)
    left = bench.difference(k, bench.read(k, problem.causes(f.members, theta, f.extra)))
    index = problem.member_columns(f.members)
    usual = estimate(f.data, problem.prior, index)[0]
    usual[index] = 0.0
    tip, others = ((problem.columns.blocks[k] @ each).reshape(left.shape[1], -1) for each in (usual * f.farther, usual))
    return np.asarray(left - np.concatenate([tip[:3], others[3:]]).T)


def undetermined(theta: Floats, doubt: Floats, widths: Sequence[int]) -> Bools:
    """Mask (d,) of coordinates theta whose 95 % interval holds zero, given their deviations doubt (d,); a cause of `widths`
    coordinates is masked as a whole.
    """
    faint, ends = ndtri(SURELY) * doubt > np.abs(theta), np.cumsum(widths)
    each = [bool(faint[end - width : end].all()) for end, width in zip(ends, widths, strict=True)]
    return np.repeat(each, widths).astype(bool)


def unexplained_of(
    problem: Problem, kind: str, at_tip: Sequence[Floats], swinging: tuple[float, float] = (0.0, 0.0)
) -> Unexplained:
    """Excess residual of one kind of channel, from residuals (n, 3) of every run, mm at the tip, and the mean square of what
    swings faster with the deviation of its chance, mm2.
    """
    slow = problem.floor.slow_mm if kind == "tip" else 0.0
    excess: list[Floats] = []
    chance: list[Floats] = []
    weight: list[Floats] = []
    for k, values in enumerate(at_tip):
        t = problem.times[k]
        inflate = problem.noise.inflate[k][:, problem.channels_of(kind)]
        if kind != "tip":  # each channel moves the tip along its own way: the worst of them counts
            inflate = np.repeat(np.nanmax(np.nan_to_num(inflate, nan=1.0), axis=1)[:, None], 3, axis=1)
        values = np.where(inflate < 3.0, values, np.nan)
        noise = np.array([row_scatter(x, t) for x in values.T])
        noise = np.where(np.isfinite(noise), noise, 0.0)
        if kind == "encoder":  # what shakes more than the instrument of the tip is motion
            noise = np.minimum(noise, problem.floor.axis_mm)
        seen = np.isfinite(values)
        # rows of which less is known than their noise says (a force that turns between rows) err together
        count, total, more = (
            np.add.reduceat(np.where(seen, each, 0.0), np.arange(0, len(values), BLOCK))
            for each in (1.0, values, inflate**2 - 1.0)
        )
        enough, count = count >= BLOCK // 2, np.maximum(count, 1.0)
        usual = noise**2 / count + slow**2
        allowed = usual + noise**2 * more / count
        excess.append(np.where(enough, (total / count) ** 2 - allowed, 0.0))
        chance.append(np.where(enough, allowed, 0.0))
        weight.append(np.where(enough, (usual + TINY) ** 2 / (allowed + TINY) ** 2, 0.0))
    e, v, w = (np.concatenate(each) for each in (excess, chance, weight))
    whole = np.maximum(w.sum(axis=0), 1.0)
    mean = float((np.sum(w * e, axis=0) / whole).sum()) + swinging[0]
    doubt = float(np.sqrt(2.0 * np.sum(np.sum((w * v) ** 2, axis=0) / whole**2) + swinging[1] ** 2)) + TINY
    return Unexplained(kind, 1e3 * float(np.sqrt(max(mean, 0.0))), mean / doubt)


def worst(left: Mapping[str, Unexplained]) -> Unexplained:
    """The kind that leaves most."""
    return max(left.values(), key=lambda each: each.excess_um)
