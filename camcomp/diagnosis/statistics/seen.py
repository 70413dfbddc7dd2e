"""How far apart are two predicted logs, beyond the error of any model?"""

import numpy as np

from camcomp.ground.datatypes import Floats


def seen_apart(signals: Floats, left: Floats, hidden: float, large: float) -> float:
    """Chi-square of white rows `left` (w,) beyond the model error of signals (w, 2), for any number of rows.

    hidden: model error, in units of the noise, of signals `large` times the noise.
    """
    own = np.max(signals**2, axis=1) / large**2
    return max(float((left**2).sum()) - hidden**2 * (len(left) + float(own.sum())), 0.0)
