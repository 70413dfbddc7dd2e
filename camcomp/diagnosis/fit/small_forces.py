"""Small forces on a machine that its causes have made soft or stiff: there they push it farther, or less far, than at nominal.

Where a screw is six times as soft as stated, friction that every healthy guide has bends it six times as far: a column at
nominal has no room for that, and play would be named for it.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from camcomp.diagnosis.fit.bench import Bench, CandidateCause, cause_of, step_of
from camcomp.ground.datatypes import Floats
from camcomp.model.effect import Cause
from camcomp.model.motion.twin import Reading
from camcomp.model.signal_path import pushes, stages_of


def small_forces(candidates: Sequence[CandidateCause], members: Sequence[int]) -> tuple[int, ...]:
    """Candidates beside the members that push on springs which these change."""
    changed = [candidates[i] for i in members if "structure" in stages_of(candidates[i].effect)]
    soft = {each.target for each in changed if each.parameters[0].log}
    return tuple(
        i
        for i, each in enumerate(candidates)
        if i not in members
        and pushes(each.effect)
        and not any(p.placed for p in each.shapes)
        and (None in soft or (soft and each.target in {*soft, None}))
    )


def pushed_farther(
    bench: Bench,
    causes: Sequence[Cause],
    readings: Sequence[Reading],
    beside: Sequence[tuple[CandidateCause, Mapping[str, float]]],
) -> tuple[Floats, ...]:
    """Per run (n, c, p): columns of candidates with their shapes on the machine that the causes make, which readings are of."""
    found = []
    for candidate, shape in beside:
        for p in candidate.parameters:
            more, unit = cause_of(candidate, {**shape, p.name: step_of(p)}), step_of(p) / p.scale
            found.append([bench.change(k, bench.read(k, [*causes, more]), r) / unit for k, r in enumerate(readings)])
    return tuple(np.stack([each[k] for each in found], axis=2) for k in range(len(readings)))
