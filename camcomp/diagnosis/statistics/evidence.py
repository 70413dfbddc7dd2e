"""Which causes: Gaussian evidence of sets of effects, in closed form from Gram matrices.

The white residual is r = D a + e. Columns D belong to effects, to nuisances and to what every healthy machine has.
An effect that is a cause has the wide prior of its own size (a mixture of four widths), one that is not has the narrow
prior of its tolerance: a machine is never exactly its model, and what is within tolerance is no finding. Everything
but the amplitudes of the causes is integrated out exactly. A tolerance has an end, its reach: what is farther off is a
cause by definition, and a set that would need it without naming it pays for holding it back (Laplace's approximation
of the normal distributions that are cut off there; the mode by active sets, Nocedal and Wright, Numerical
Optimization, 16.5).

Source: group selection with amplitude mixtures; the half-normal signs follow the priors that the effects state, and the
widths, equally likely, are nearly flat in the logarithm of a size, from a hundredth of the typical one to three: a calibrated
machine has of everything what its calibration could just not see, and of two causes that do the same the one whose typical
size is larger is no less likely for it. Positive parameters enter by the posterior probability of their sign.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import product
from typing import Any

import numpy as np
from scipy.linalg.lapack import dpotrf, dpotri
from scipy.special import log_ndtr, logsumexp

from camcomp.diagnosis.statistics.by_channel import ByChannel
from camcomp.diagnosis.statistics.normal_equations import NormalEquations
from camcomp.ground.datatypes import Floats, Ints

PRIOR_WIDTHS = np.array([0.02, 0.1, 0.5, 2.5])
FREE = 0.01  # precision of a cause while it is fitted: within 10 scales
PASSES = 30  # of the search for columns at the end of their reach


def log_sum(values: Sequence[float] | Floats) -> float:
    """Logarithm of the sum of the exponentials of values (n,): scipy's costs more than all else that is done with a few of them."""
    v = np.asarray(values)
    most = float(v.max())
    return most + float(np.log(np.exp(v - most).sum())) if np.isfinite(most) else most


def gram(D: Floats | ByChannel, r: Floats) -> NormalEquations:
    """From white columns D (w, k) and residual r (w,)."""
    turned: Any = D.T  # of an array or a ByChannel
    return NormalEquations(turned @ D, turned @ r, float(r @ r), len(r))


@dataclass(frozen=True, eq=False)
class Prior:
    """For every column (k,), in units of its typical size: tolerance = narrow size (inf = free nuisance), sign; reach =
    farthest that it goes without being a cause.
    """

    tolerance: Floats
    sign: Floats
    reach: Floats

    @property
    def precision(self) -> Floats:
        """Narrow precision (k,)."""
        return np.where(np.isinf(self.tolerance), 1e-12, 1.0 / np.maximum(self.tolerance, 1e-15) ** 2)


@dataclass(frozen=True, eq=False)
class Base:
    """Posterior of all columns: mean (k,), covariance (k, k) and log evidence under a prior precision (k,)."""

    mean: Floats
    covariance: Floats
    precision: Floats
    log_evidence: float


def base(data: NormalEquations, prior: Prior, members: Sequence[int] = ()) -> Base:
    """Posterior with the columns `members` free within 10 scales, and every other one within its tolerance."""
    precision = estimate_precision(prior, members)
    # scaled so that the factorisation does not mix mm with ppm
    size = 1.0 / np.sqrt(np.diag(data.A) + precision)
    scaled = size[:, None] * data.A * size + np.diag(precision * size**2)
    covariance, log_det = _inverse(scaled, size)
    mean = covariance @ data.b
    evidence = -0.5 * (data.c - float(data.b @ mean)) - 0.5 * (log_det - np.log(precision).sum()) - data.log_size
    return Base(mean, covariance, precision, evidence)


def _inverse(scaled: Floats, size: Floats) -> tuple[Floats, float]:
    """Inverse (k, k) and log determinant of a positive matrix that is `scaled` after division by size (k,) on both sides."""
    half, _ = dpotrf(scaled + 1e-13 * np.eye(len(size)), lower=1)
    triangle, _ = dpotri(half, lower=1)
    inverse = triangle + triangle.T  # above the diagonal a factor of dpotrf is clean
    inverse.flat[:: len(size) + 1] *= 0.5
    log_det = 2.0 * np.log(np.diag(half)).sum() - 2.0 * np.log(size).sum()
    return size[:, None] * inverse * size, float(log_det)


def log_bayes(at: Base, prior: Prior, sets: Sequence[Sequence[Sequence[int]]]) -> Floats:
    """Log Bayes factor (s,) of sets of causes (each the columns of every cause) against no cause.

    Sets whose causes have the same numbers of columns are worked out at once.
    """
    out = np.zeros(len(sets))
    shapes = [tuple(map(len, causes)) for causes in sets]
    for shape in {each for each in shapes if each}:
        own = [i for i, each in enumerate(shapes) if each == shape]
        index = np.array([[c for cause in sets[i] for c in cause] for i in own])
        out[own] = _log_bayes(at, prior, index, np.repeat(np.arange(len(shape)), shape))
    return out


def _log_bayes(at: Base, prior: Prior, index: Ints, cause: Ints) -> Floats:
    """The same (s,) of sets with columns index (s, d), which belong to the causes (d,)."""
    mean, narrow = at.mean[index], at.precision[index]
    inverse = np.linalg.inv(at.covariance[index[:, :, None], index[:, None]])
    h = (inverse @ mean[:, :, None])[:, :, 0]
    sizes = _widths(int(cause[-1]) + 1)
    wide = np.minimum(1.0 / sizes[:, cause] ** 2, narrow[:, None])  # a cause is at least as wide as its tolerance
    precision = inverse[:, None] + (wide - narrow[:, None])[..., None] * np.eye(len(cause))
    covariance, (sign, log_det) = np.linalg.inv(precision), np.linalg.slogdet(precision)
    variance = np.diagonal(covariance, axis1=2, axis2=3)
    proper = (sign > 0.0) & (variance > 0.0).all(axis=2)
    posterior, spread = (covariance @ h[:, None, :, None])[..., 0], np.sqrt(np.maximum(variance, 1e-300))
    fit = np.where(proper, np.sum(h[:, None] * posterior, axis=2), -np.inf)
    none = np.log(narrow).sum(axis=1) - np.linalg.slogdet(inverse)[1] + np.sum(mean * h, axis=1)
    value = 0.5 * (fit + np.log(wide).sum(axis=2) - log_det - none[:, None])
    signed = prior.sign[index][:, None] > 0
    value += np.where(signed, log_ndtr(posterior / spread) + np.log(2.0), 0.0).sum(axis=2)
    return np.asarray(logsumexp(value, axis=1) - np.log(len(sizes)), float)


@cache
def _widths(count: int) -> Floats:
    """Widths (w, count) that so many causes may have, equally likely."""
    return np.array(list(product(PRIOR_WIDTHS, repeat=count)))


def estimate(data: NormalEquations, prior: Prior, members: Sequence[int]) -> tuple[Floats, Floats]:
    """Mode (k,) and covariance (k, k) with the columns `members` free within 10 scales, the others within tolerance and reach.

    The covariance is that without the ends of the reaches: never too small.
    """
    at = base(data, prior, members)
    return within(at.mean, lambda held: at.covariance[:, held], _reach(prior, members))[0], at.covariance


def estimate_precision(prior: Prior, members: Sequence[int]) -> Floats:
    """Precision (k,) with the columns `members` free within 10 scales, the others within tolerance."""
    precision = prior.precision
    precision[list(members)] = FREE
    return precision


def freed(at: Base, members: Sequence[int]) -> Base:
    """The same with the columns `members` free within 10 scales; its log evidence stays that without them."""
    index = list(members)
    own, gain = _widened(at, index)
    precision = at.precision.copy()
    precision[index] = FREE
    return Base(at.mean - own @ (gain @ at.mean[index]), at.covariance - own @ gain @ own.T, precision, at.log_evidence)


def _widened(at: Base, index: list[int]) -> tuple[Floats, Floats]:
    """Covariance (k, d) of all columns with some, and the gain (d, d) by which freeing those changes mean and covariance."""
    own = at.covariance[:, index]
    gain = np.linalg.inv(np.diag(1.0 / (FREE - at.precision[index])) + own[index])
    return own, np.asarray(gain, float)


def holding_back(at: Base, prior: Prior, members: Sequence[int]) -> float:
    """Log evidence >= 0 that it costs a set with the columns `members` to keep all others within reach."""
    index = list(members)
    own, gain = _widened(at, index)
    mean = at.mean - own @ (gain @ at.mean[index])
    return within(mean, lambda held: at.covariance[:, held] - own @ (gain @ own[held].T), _reach(prior, index))[1]


def misfit(data: NormalEquations, prior: Prior, members: Sequence[int]) -> float:
    """Minimum chi-square with the columns `members` free and all others within tolerance, penalties included."""
    mean, _ = estimate(data, prior, members)
    precision = prior.precision
    precision[list(members)] = 0.0
    return float(data.c - 2.0 * data.b @ mean + mean @ data.A @ mean + precision @ mean**2)


def _reach(prior: Prior, members: Sequence[int]) -> Floats:
    """Reach (k,), without end for `members`."""
    out = prior.reach.copy()
    out[list(members)] = np.inf
    return out


def within(mean: Floats, columns: Callable[[Ints], Floats], reach: Floats) -> tuple[Floats, float]:
    """Mode (k,) of a normal distribution that is cut off at +-reach (k,), and by how much its log density is lower there.

    columns: those of its covariance (k, h) that are asked for.
    Columns that are too far off are held at the end of their reach, all at once; those that would go back by themselves
    are let go again.
    """
    mode, held, side = mean, np.zeros(0, np.int64), np.zeros(0)
    pull, end = side, reach * (1.0 + 1e-9)
    for _ in range(PASSES):
        beyond = np.abs(mode) > end
        beyond[held] = False
        far = np.flatnonzero(beyond)
        loose = pull * side > 0.0
        if not len(far) and not loose.any():
            break
        held = np.concatenate([held[~loose], far])
        side = np.concatenate([side[~loose], np.sign(mode[far])])
        ways = columns(held)
        unit = np.sqrt(np.diag(ways[held]))
        scaled = ways[held] / unit[:, None] / unit + 1e-12 * np.eye(len(held))
        pull = np.linalg.solve(scaled, (side * reach[held] - mean[held]) / unit) / unit
        mode = mean + ways @ pull
    cost = 0.5 * float(pull @ (side * reach[held] - mean[held])) if len(held) else 0.0
    return np.asarray(np.clip(mode, -reach, reach)), cost
