"""The interval of the shrinkage of one more run: logarithms of the ratio of two rms are taken as normal."""

import numpy as np
from scipy.stats import t as student

from camcomp.ground.datatypes import Floats

SURELY = 0.975  # both ends of 95 %


def log_ratio(before: float, after: float) -> float:
    """Logarithm of the ratio of two rms, from their mean squares."""
    return 0.5 * float(np.log(max(after, 1e-300) / max(before, 1e-300)))


def scatter(each: Floats) -> tuple[float, int]:
    """Sum of squares about the mean of values (n,), and its degrees of freedom."""
    return float(((each - each.mean()) ** 2).sum()), len(each) - 1


def of_one_more(middle: float, square: float, freedom: float, more: float) -> tuple[float, float]:
    """95 % interval of the shrinkage (1 less the ratio) of one more. Student's t.

    middle: of the logarithms; square, freedom: what they scatter by; more: variance of one more beside that mean, in
    variances of one.
    """
    freedom = max(freedom, 1)
    half = float(student.ppf(SURELY, freedom)) * float(np.sqrt(square / freedom * more))
    return 1.0 - float(np.exp(middle + half)), 1.0 - float(np.exp(middle - half))
