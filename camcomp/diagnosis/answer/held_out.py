"""Shrinkage of the gap on held-out runs by the named causes, its attainable value, and the nuisances that were
re-fitted.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from camcomp.diagnosis.answer.unseen import JudgedRun, unseen_shrinkage
from camcomp.diagnosis.fit.bench import Bench, CandidateCause, Run
from camcomp.diagnosis.fit.columns import candidate_columns
from camcomp.diagnosis.fit.gap import square_lengths
from camcomp.diagnosis.fit.labels import EFFECT_OF, apart
from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.result.types import UnseenShrinkage
from camcomp.diagnosis.statistics.cause_sets import Fitted
from camcomp.ground import shelf
from camcomp.ground.datatypes import Floats
from camcomp.model.effect import Cause

_STEP = 0.02  # of an interval's half width, for differences of the gap


def shrinkage_of(
    problem: Problem,
    best: Fitted,
    *,
    seen: Bench,
    chosen: Sequence[Mapping[int, Cause]],
    order: Sequence[int],
    part: slice,
    floor_um: float,
) -> UnseenShrinkage:
    """The `shrinkage` of the result. seen: the held-out runs; chosen: per run the causes by candidate, chosen and fitted without
    it; order: of the members; part: the channels of the gap.
    """
    free, named = _nuisances(seen, problem.bench.runs, part)
    members = [best.members[j] for j in order]

    def squares(count: int) -> list[Floats]:
        """With so many members of the answer, as far as they were chosen; with all of them, all that was."""
        these = [[c for i, c in each.items() if count == len(members) or i in members[:count]] for each in chosen]
        return [
            square_lengths(gap) for gap in _without([seen.gap(k, each)[:, part] for k, each in enumerate(these)], free)
        ]

    per_step = [squares(count) for count in range(len(members) + 1)]
    candidates = [problem.columns.candidates[i] for i in members]
    found = unseen_shrinkage(
        [JudgedRun(each) for each in zip(*per_step, strict=True)], [(c.name, c.target) for c in candidates],
        holdout=tuple(run.name for run in seen.runs), noise_floor_um=round(floor_um, 3), refitted=tuple(named),
    )  # fmt: skip
    ceiling, before = _ceiling(problem, best, seen, part, free), found.before_rms_um
    ratio = round(1.0 - ceiling / before, 4) if before > 0 else 0.0
    return found.model_copy(update={"ceiling_rms_um": round(ceiling, 3), "ceiling_ratio": ratio})


def _ceiling(problem: Problem, best: Fitted, seen: Bench, part: slice, free: Sequence[Floats]) -> float:
    """rms, um, that the same causes leave when they are fitted to the held-out runs themselves."""

    def gaps(theta: Floats) -> list[Floats]:
        causes = problem.causes(best.members, theta, best.extra)
        return _without([seen.gap(k, causes)[:, part] for k in range(len(seen.runs))], free)

    here = np.concatenate([gap.ravel() for gap in gaps(best.theta)])
    known = np.isfinite(here)
    if len(best.theta):
        steps = np.maximum(_STEP * 2.0 * np.sqrt(np.diag(best.covariance)), 1e-6)
        moved = [np.concatenate([gap.ravel() for gap in gaps(best.theta + step)]) for step in np.diag(steps)]
        D = np.stack([(m - here)[known] / s for m, s in zip(moved, steps, strict=True)], axis=1)
        change = np.linalg.lstsq(D, -here[known], rcond=1e-9)[0]
        here = np.concatenate([gap.ravel() for gap in gaps(best.theta + change)])
    squares = here**2
    width = part.stop - part.start
    rows = max(float(np.isfinite(squares.reshape(-1, width)).any(axis=1).sum()), 1.0)
    return 1e3 * float(np.sqrt(np.nansum(squares) / rows))


def _nuisances(seen: Bench, fitted: Sequence[Run], part: slice) -> tuple[list[Floats], list[str]]:
    """Columns (per run (n, c, k)) and names of the nuisances that only held-out runs determine: the workpiece frame of
    another clamping and the offset of another clock.
    """
    blocks = [np.zeros((len(run.run_path.time) // run.thin, part.stop - part.start, 0)) for run in seen.runs]
    named: list[str] = []
    if part.start != 0:
        return blocks, named
    for label, what in (("clamping", "workpiece frame"), ("clock", "clock offset")):
        effect = EFFECT_OF[label]
        every = [getattr(run, label) for run in (*fitted, *seen.runs)]
        others = [each for each in apart(every) if each in {getattr(run, label) for run in seen.runs}]
        if not others:
            continue
        columns = candidate_columns(seen, CandidateCause(effect, None, shelf.load("effects", effect)), {})
        for other in others:
            mine = [k for k, run in enumerate(seen.runs) if getattr(run, label) == other]
            named += [f"{what} of {seen.runs[k].name} ({label} {other})" for k in mine]
            for column in columns:
                for k in range(len(blocks)):
                    one = column[k][:, part] if k in mine else np.zeros_like(column[k][:, part])
                    blocks[k] = np.concatenate([blocks[k], one[:, :, None]], axis=2)
    return blocks, named


def _without(gaps: Sequence[Floats], free: Sequence[Floats]) -> list[Floats]:
    """Gaps minus their least-squares fit by the free columns, over all runs together."""
    if not free or free[0].shape[2] == 0:
        return list(gaps)
    r = np.concatenate([gap.ravel() for gap in gaps])
    D = np.concatenate([block.reshape(-1, block.shape[2]) for block in free])
    known = np.isfinite(r)
    a = np.linalg.lstsq(D[known], r[known], rcond=1e-9)[0]
    return [gap - block @ a for gap, block in zip(gaps, free, strict=True)]
