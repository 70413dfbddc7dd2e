"""How far apart two foreseen logs are, less what no model gets right."""

import numpy as np

from camcomp.ground.datatypes import Floats


def seen_apart(signals: Floats, left: Floats, hidden: float, large: float) -> float:
    """Chi-square of white rows left (w,) beyond what no model gets right of signals (w, 2), however many rows there are.

    hidden, in units of the noise: what nobody believes of signals `large` times as large.
    """
    own = np.max(signals**2, axis=1) / large**2
    return max(float((left**2).sum()) - hidden**2 * (len(left) + float(own.sum())), 0.0)
