"""The proof of the interpolation of a long program: some of its points solved exactly."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from camcomp.compensation.long.field import Field
from camcomp.compensation.program.result import BOUND_UM, Interpolation
from camcomp.ground.datatypes import Bools, Floats
from camcomp.model.statics.solve import inverse
from camcomp.model.statics.target import correct, settle

if TYPE_CHECKING:
    from camcomp.compensation.long.linear_corrector import CorrectedRun, LinearCorrector
    from camcomp.compensation.program.totals import JointTableRows
    from camcomp.model.job import Job

MOST_CHECKED, CHECKED_SHARE = 1000, 0.02  # points that are solved exactly, at most and of all


def judge(field: Field, gaps: tuple[Floats, ...], joints: Floats, drive: Floats, solved: int) -> Interpolation:
    """Result of a check by points (k,) solved exactly; keeps the tiles if they are good enough.

    gaps (k, 3) mm, joints (k, m), drive (k, m): differences; solved: exact solutions besides those of the tiles.
    """
    worst = max(1e3 * float(np.abs(each).max()) for each in (*gaps, joints * field.reach))
    field.keep(sound=worst <= BOUND_UM)
    return Interpolation(
        bound_um=BOUND_UM, checked=len(drive), worst_um=worst if np.isfinite(worst) else float("inf"),
        worst_drive_force=float(np.nan_to_num(np.abs(drive), nan=np.inf).max()), tiles=int(field.used.sum()),
        exact_solutions=int(field.tiles.solved[field.used].sum()) + solved,
    )  # fmt: skip


class Sample:
    """Random rows of a program; digest and size, bytes, of the program decide which."""

    def __init__(self, digest: str, size: int) -> None:
        self._random = np.random.default_rng(int(digest[:16], 16))
        self._share = min(1.0, 3.0 * MOST_CHECKED * 24.0 / max(size, 1))  # a line has some 24 bytes
        self._rows: list[Floats] = []
        self._points: list[Floats] = []  # of pieces on an interpolated machine: target (3), force (3), machine frame

    def add(self, corrector: LinearCorrector, done: CorrectedRun, rows: JointTableRows) -> None:
        """Draw some of the rows of a run."""
        chosen = np.flatnonzero(self._random.random(len(rows.s)) < self._share)
        if len(chosen):
            answers, target = done.answers, corrector.job.frame.to_machine(rows.target)
            drive = answers.rest[:, 3 : 3 + rows.drive.shape[1]]
            moves = (answers.correction, answers.unloaded, drive, rows.joints, corrector.off(done))
            self._rows.append(np.concatenate([each[chosen] for each in (target, rows.force, *moves)], axis=1))

    def add_points(self, job: Job, rows: JointTableRows, corrected: Bools) -> None:
        """Draw some of the corrected rows (N,) of a piece."""
        chosen = np.flatnonzero(corrected & (self._random.random(len(rows.s)) < self._share))
        target = job.frame.to_machine(rows.target[chosen])
        self._points.append(np.concatenate((target, rows.force[chosen]), axis=1))

    def proof(self, corrector: LinearCorrector, points: int, job: Job) -> tuple[Interpolation | None, int]:
        """Differences of rows to their exact solutions, and the most iterations.

        points: rows of the program. job: of the pieces that were not corrected as runs of linear moves.
        """
        if self._points:
            target, force = np.split(np.concatenate(self._points), [3], axis=1)
            return job.real_machine.answers.proof(target, force)  # type: ignore[no-any-return]
        if corrector.field is None or not self._rows:
            return None, 0
        machine, sample = corrector.machine, np.concatenate(self._rows)
        count, m = min(MOST_CHECKED, max(MOST_CHECKED // 10, int(CHECKED_SHARE * points))), len(machine.actuators)
        sample = sample[self._random.permutation(len(sample))[:count]]
        sample = sample[np.lexsort(sample[:, :3].T)]
        p, f, correction, unloaded, drive, joints, off = np.split(sample, np.cumsum([3, 3, 3, 3, m, m]), axis=1)
        exact, (tip, _) = correct(machine, p, f), settle(machine, p, f)
        gaps, written = (exact.commanded - p - correction, tip - p - unloaded), inverse(machine, p + correction + off)
        found = judge(corrector.field, gaps, written - joints, exact.drive - drive, 2 * len(p) + 2 * corrector.exact)
        return found, int(exact.iterations.max())
