"""The proof of the interpolation of a long program: some of its points solved exactly."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from camcomp.compensation.long.field import Field
from camcomp.compensation.program.result import BOUND_UM, Interpolation
from camcomp.ground.datatypes import Bools, Floats

if TYPE_CHECKING:
    from camcomp.compensation.program.totals import JointTableRows
    from camcomp.model.job import Job

MOST_CHECKED = 1000  # points that are solved exactly


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
        self._points: list[Floats] = []  # target (3) and force (3), machine frame

    def add(self, job: Job, rows: JointTableRows, corrected: Bools) -> None:
        """Draw some of the corrected rows (N,) of a piece."""
        chosen = np.flatnonzero(corrected & (self._random.random(len(rows.s)) < self._share))
        target = job.frame.to_machine(rows.target[chosen])
        self._points.append(np.concatenate((target, rows.force[chosen]), axis=1))

    def proof(self, job: Job) -> tuple[Interpolation | None, int]:
        """Differences of rows to their exact solutions, and the most iterations. job: with the machine that was interpolated."""
        if not self._points:
            return None, 0
        target, force = np.split(np.concatenate(self._points), [3], axis=1)
        return job.real_machine.answers.proof(target, force)  # type: ignore[no-any-return]
