"""Small forces on a machine that its causes have made soft: friction that every healthy guide has bends a screw that is six
times as soft as stated six times as far.
"""

from collections.abc import Sequence

import numpy as np

from camcomp.diagnosis.fit.columns import Columns
from camcomp.ground.datatypes import Floats
from camcomp.model.effect import Cause
from camcomp.model.signal_path import pushes, stages_of


def bent_farther(columns: Columns, members: Sequence[int], causes: Sequence[Cause]) -> Floats:
    """How many times as far as at nominal the forces of other candidates bend the machine that the causes make: (k,) >= 1."""
    out = np.ones(len(columns.names))
    for i, cause in zip(members, causes, strict=True):
        p = columns.candidates[i].parameters[0]
        if not p.log or "structure" not in stages_of(cause.effect):
            continue
        for j, each in enumerate(columns.candidates):
            loads = pushes(each.effect) and not any(shape.placed for shape in each.shapes)
            if j not in members and loads and (each.target in (cause.target, None) or cause.target is None):
                own = columns.of(j)
                out[own] = np.maximum(out[own], p.nominal / cause.values[p.name])
    return out
