"""How probable is a set of causes before any log is read?"""

import numpy as np

from camcomp.diagnosis.fit.columns import Columns
from camcomp.diagnosis.fit.intervals_in_time import log_intervals
from camcomp.diagnosis.statistics.cause_sets import CausePrior


def cause_prior(columns: Columns) -> CausePrior:
    """Prior weights: every effect weighs the same; within an effect one value for all weighs half, or all targets the same.

    Scanned values of a shape are equally likely, and so are the intervals of what acts for a while.
    """
    candidates = columns.candidates  # what follows outlives these columns, which are large
    names = sorted({a.name for a in candidates})
    weight = []
    for a in candidates:
        same = [b for b in candidates if b.name == a.name]
        common = any(b.target is None for b in same)
        share = (
            1.0 / len(same) if not common or len(same) == 1 else (0.5 if a.target is None else 0.5 / (len(same) - 1))
        )
        sought = float(sum(np.log(len(p.scan)) for p in a.shapes if not p.placed))
        sought += log_intervals(len(columns.blocks)) if any(p.placed for p in a.shapes) else 0.0
        weight.append(np.log(share / len(names)) - sought)

    def exclusive(i: int, j: int) -> bool:
        a, b = candidates[i], candidates[j]
        return a.name == b.name and (a.target is None or b.target is None)

    kinds = [tuple(i for i, a in enumerate(candidates) if a.name == name and a.target is not None) for name in names]
    return CausePrior(
        tuple(tuple(columns.of(i)) for i in range(len(candidates))), np.array(weight), exclusive, tuple(kinds)
    )
