"""Small forces on a machine that its causes have made soft: there they push it farther than at nominal.

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

SOFT = 0.5  # of a stated spring: on one that is not softer, what small forces do more is as small as they are


def small_forces(
    candidates: Sequence[CandidateCause], members: Sequence[int], causes: Sequence[Cause]
) -> tuple[int, ...]:
    """Candidates outside of the members that load springs which the members' causes make SOFT."""
    changed = [(cause, candidates[i].parameters[0]) for i, cause in zip(members, causes, strict=True)]
    soft = {
        cause.target
        for cause, p in changed
        if p.log and "structure" in stages_of(cause.effect) and cause.values[p.name] < SOFT * p.nominal
    }
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
