"""Engagement of the tool on a run of a long program and on the motions next to it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from camcomp.model.cutting.engaged import Engaged


@dataclass(frozen=True, eq=False)
class RunEngagement:
    """Engagement on a run, at the end of the motion before it, and at the begin of the motion after it."""

    own: Engaged
    before: Engaged | None
    after: Engaged | None

    def parts(self, before: int, first: int, after: int) -> list[Engaged]:
        """Parts one behind the other, for motion `before`, the run's motions from `first` on, and motion `after`."""
        parts = [] if first == 0 or self.before is None else [_still(self.before, -1, before)]
        parts.append(replace(self.own, motion=self.own.motion + first))
        return parts if self.after is None else [*parts, _still(self.after, 0, after)]


def _still(engaged: Engaged, row: int, motion: int) -> Engaged:
    """A motion with the constant engagement of one row."""
    if not len(engaged.u):
        return engaged
    out = engaged.take(np.array([row % len(engaged.u)] * 2))
    return replace(out, motion=np.array([motion, motion]), u=np.array([0.0, 1.0]), bends=np.ones(2, np.bool_))
