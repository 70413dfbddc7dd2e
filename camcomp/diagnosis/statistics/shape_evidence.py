"""What evidence loses because shapes (pitches, time constants) were sought: a best value among many is no evidence."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

COMMON_LOG = float(np.log(1.5))  # by which shapes of one origin differ: drives that warm up together


@dataclass(frozen=True)
class SoughtShape:
    """A shape at its best value: the logarithm of that, what rows tell of it, and the range of logarithms searched.

    information: inverse variance of the logarithm, 0 where it is unknown.
    """

    log: float
    information: float
    span: float


def shape_log_evidence(groups: Iterable[Sequence[int]], sought: Mapping[int, Sequence[SoughtShape]]) -> float:
    """Log of the ratio of the likelihood averaged over all shapes to that at the best shapes, at most 0.

    Laplace's approximation with a uniform prior of every logarithm in its range. groups: candidates of one origin,
    whose shapes are normal about a common value with deviation COMMON_LOG.
    """
    out = 0.0
    for group in groups:
        for alike in zip(*(sought[i] for i in group if i in sought), strict=True):
            log, told = np.array([each.log for each in alike]), np.array([each.information for each in alike])
            spread = 1.0 + COMMON_LOG**2 * told
            weight = told / spread  # of a logarithm about the common one
            about = float(np.sum(weight * log) / max(np.sum(weight), 1e-300))
            out -= 0.5 * float(np.sum(np.log(spread) + weight * (log - about) ** 2))
            out -= 0.5 * float(np.log1p(alike[0].span ** 2 / (2.0 * np.pi) * np.sum(weight)))
    return out
