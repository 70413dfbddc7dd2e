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

    def around(self, own: slice) -> Engaged:
        """For a path in which the motions of the run are `own`, with one motion on either side where there is any."""
        return Engaged.joined(self.parts(own))

    def parts(self, own: slice) -> list[Engaged]:
        """The same in parts one behind the other."""
        parts = [] if own.start == 0 or self.before is None else [_still(self.before, -1, own.start - 1)]
        parts.append(replace(self.own, motion=self.own.motion + own.start))
        return parts if self.after is None else [*parts, _still(self.after, 0, own.stop)]

    def within(self, first: int, last: int) -> Engaged:
        """For a path whose first motion is the one before the run, whose motions first on are the run's, and which ends at
        motion `last` with the one behind it.
        """
        parts = [] if first == 0 or self.before is None else [_still(self.before, -1, 0)]
        parts.append(replace(self.own, motion=self.own.motion + first))
        parts += [] if self.after is None else [_still(self.after, 0, last)]
        return Engaged.joined(parts)


def _still(engaged: Engaged, row: int, motion: int) -> Engaged:
    """A motion with the constant engagement of one row."""
    if not len(engaged.u):
        return engaged
    out = engaged.take(np.array([row % len(engaged.u)] * 2))
    return replace(out, motion=np.array([motion, motion]), u=np.array([0.0, 1.0]), bends=np.ones(2, np.bool_))
