"""Which candidates are indistinguishable from a simpler one in these runs? They are removed, since each would make an
answer ambiguous.

The tilt of a carriage whose arm hardly changes resembles a slope, that is a squareness or a pitch; only paths that are
long in two directions show the difference. Computed from the model and the runs; residuals are not used.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from camcomp.diagnosis.fit.bench import Bench, CandidateCause
from camcomp.diagnosis.fit.columns import candidate_columns, shape_default
from camcomp.diagnosis.fit.grid_parameters import quick_columns
from camcomp.diagnosis.fit.intervals_in_time import never_ending
from camcomp.diagnosis.model.classes import INDISTINGUISHABLE, LARGE
from camcomp.ground.datatypes import Floats
from camcomp.model import signal_path

_FRAME = "workpiece_frame"


def without_lookalikes(bench: Bench, candidates: Sequence[CandidateCause]) -> list[CandidateCause]:
    """The candidates less those of effects with parameters by target that move the tip as another one does."""
    asked = [each for each in candidates if hasattr(each.effect, "SOUGHT")]
    if not asked or not any(run.measured.has("tip") for run in bench.runs):
        return [each for each in candidates if each not in asked]
    by_place = {"drive", "tool", "workpiece"}  # stages of what may depend on the place alone
    simple = [
        each
        for each in candidates
        if each not in asked and not each.shapes and by_place & signal_path.stages_of(each.effect)
    ]
    frame = _tips(bench, [each for each in simple if each.name == _FRAME])
    others = [_tips(bench, [each]) for each in simple if each.name != _FRAME]
    kept: list[CandidateCause] = []
    for each in asked:
        own = _tips(bench, [each])
        if np.abs(own).max(initial=0.0) > 0.0 and not any(_alike(own, np.hstack([frame, o])) for o in others):
            kept.append(each)
            others.append(own)
    return [each for each in candidates if each not in asked or each in kept]


def without_twins(bench: Bench, candidates: Sequence[CandidateCause]) -> list[CandidateCause]:
    """The temporary candidates without parameters that are indistinguishable in every channel from an earlier
    parameter.

    A force on a drive shifts its carriage by the spring: where the log lacks the drive's force, it is a shift.
    """
    out = []
    for each in candidates:
        if each.of_drive_alone and len(each.parameters) > 1 and any(p.placed for p in each.shapes):
            columns = quick_columns(bench, each, [never_ending(each)])
            seen = [np.isfinite(bench.residual(k)) for k in range(len(bench.runs))]
            flat = np.concatenate([c.dense()[s] for c, s in zip(columns, seen, strict=True)]).T
            twins = [
                p.name
                for i, p in enumerate(each.parameters)
                if i and np.abs(flat[i]).max(initial=0.0) > 0.0 and _alike(flat[i][:, None], flat[:i].T)
            ]
            each = replace(each, without=tuple(twins))
        out.append(each)
    return out


def _tips(bench: Bench, candidates: Sequence[CandidateCause]) -> Floats:
    """Tips' columns (rows of all runs, k) of candidates, in units of their scales."""
    columns = [c for each in candidates for c in candidate_columns(bench, each, shape_default(each))]
    if not columns:
        return np.zeros((sum(3 * len(bench.observed(k)) // run.thin for k, run in enumerate(bench.runs)), 0))
    return np.stack([np.concatenate([run[:, :3].ravel() for run in each]) for each in columns], axis=1)


def _alike(own: Floats, others: Floats) -> bool:
    """Whether `others` (n, k) leave no three deviations of some direction of `own` (n, d) that is LARGE of them."""
    size = np.linalg.norm(others, axis=0)
    basis = np.linalg.qr(others[:, size > 0.0] / size[size > 0.0])[0]
    rest = own - basis @ (basis.T @ own)
    return bool((LARGE**2 * np.sum(rest**2, axis=0) < INDISTINGUISHABLE * np.sum(own**2, axis=0)).any())
