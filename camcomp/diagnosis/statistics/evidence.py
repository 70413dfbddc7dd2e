"""Columns of programs under the tolerances of healthy machines.

The white residual is r = D a + e. Columns D belong to effects, to nuisances and to what every healthy machine has. Every
one has the narrow prior of its tolerance: a machine is never exactly its model, and what is within tolerance is no finding. A
tolerance has an end, its reach: what is farther off is a cause by definition, and a set that would need it without naming
it pays for holding it back (Laplace's approximation of the normal distributions that are cut off there; the mode by active
sets, Nocedal and Wright, Numerical Optimization, 16.5).

A cause has an amplitude beside its tolerance, of one of PRIOR_WIDTHS typical sizes. These are nearly flat in the logarithm of
a size: a calibrated machine has of everything what its calibration could just not see, and of two causes that do the same
the one whose typical size is larger is no less likely for it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from camcomp.diagnosis.statistics.by_channel import ByChannel
from camcomp.diagnosis.statistics.normal_equations import AmplitudePosterior, NormalEquations
from camcomp.ground.datatypes import Floats, Ints

PRIOR_WIDTHS = (0.02, 0.1, 0.5, 2.5)
FREE = 0.01  # precision of a cause while it is fitted: within 10 scales
PASSES = 30  # of the search for columns at the end of their reach


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


def posterior(
    data: NormalEquations, prior: Prior, members: Sequence[int] = (), absent: Sequence[int] = ()
) -> AmplitudePosterior:
    """All columns of a prior but `absent`, with `members` free within 10 scales, and every other one within its tolerance."""
    precision = np.full(len(data.b), np.inf)
    precision[: len(prior.tolerance)] = prior.precision
    precision[list(members)] = FREE
    precision[list(absent)] = np.inf
    return AmplitudePosterior.of(data, precision)


def estimate(data: NormalEquations, prior: Prior, members: Sequence[int]) -> tuple[Floats, Floats]:
    """Mode (k,) of all columns and covariance (d, d) of `members`, which are free within 10 scales, the others within tolerance and
    reach.

    The covariance is that without the ends of the reaches: never too small.
    """
    at = posterior(data, prior, members)
    return within(at.mean, at.across, _reach(prior, members))[0], at.covariance(members)


def holding_back(at: AmplitudePosterior, prior: Prior, members: Sequence[int]) -> float:
    """Log evidence >= 0 that it costs a set with the columns `members`, free in place of within tolerance, to keep all others within
    reach.
    """
    index = list(members)
    own = at.across(index)
    gain = np.linalg.inv(np.diag(1.0 / (FREE - prior.precision[index])) + own[index])
    mean = at.mean - own @ (gain @ at.mean[index])
    return within(mean, lambda held: at.across(held) - own @ (gain @ own[held].T), _reach(prior, index))[1]


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
