"""When a program is where: trapezoidal speed along each motion, exact stop at its end, time 0 at the first feed move.

Motions are those of a Path; rapids take no time here, because logs leave them out.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from camcomp.ground import path_geometry
from camcomp.ground.datatypes import RAPID, Floats, Ints, Path


@dataclass(frozen=True, eq=False)
class Timeline:
    """The feed motions of a path in time. k motions; all arrays (k,).

    index: motion in the path. start, duration: s. length: mm. feed: mm/s. acceleration: mm/s2. A duration that differs
    from the trapezoid's own stretches it.
    """

    path: Path
    index: Ints
    start: Floats
    duration: Floats
    length: Floats
    feed: Floats
    acceleration: float

    @property
    def end(self) -> float:
        """End of the last motion, s."""
        return float(self.start[-1] + self.duration[-1]) if len(self.start) else 0.0

    def locate(self, time: Floats) -> tuple[Ints, Floats]:
        """Which feed motion (n,) and which share of its length, 0 to 1 (n,), at each time (n,) s."""
        k = np.clip(np.searchsorted(self.start, time, side="right") - 1, 0, len(self.start) - 1)
        return k, self.share(k, time)

    def share(self, k: Ints, time: Floats) -> Floats:
        """Share (n,) of motion k (n,) done at time (n,)."""
        natural = trapezoid_duration(self.length[k], self.feed[k], self.acceleration)
        spent = np.clip(time - self.start[k], 0.0, self.duration[k])
        with np.errstate(invalid="ignore", divide="ignore"):
            t = np.where(self.duration[k] > 0, spent * natural / self.duration[k], 0.0)
            done = _trapezoid(t, natural, self.length[k], self.feed[k], self.acceleration)
            return np.where(self.length[k] > 0, np.clip(done / self.length[k], 0.0, 1.0), 1.0)


def trapezoid_duration(length: Floats, feed: Floats, acceleration: float) -> Floats:
    """Time (n,) s for length mm from stop to stop at feed mm/s with acceleration mm/s2."""
    cruise = length / feed + feed / acceleration
    return np.where(length * acceleration >= feed**2, cruise, 2.0 * np.sqrt(length / acceleration))


def _trapezoid(t: Floats, duration: Floats, length: Floats, feed: Floats, acceleration: float) -> Floats:
    peak = np.minimum(feed, np.sqrt(length * acceleration))
    ramp = peak / acceleration
    left = np.maximum(duration - t, 0.0)
    up, down = 0.5 * acceleration * t**2, length - 0.5 * acceleration * left**2
    return np.where(t < ramp, up, np.where(left < ramp, down, 0.5 * acceleration * ramp**2 + peak * (t - ramp)))


def schedule(path: Path, acceleration: float) -> Timeline:
    """Timeline of a path's feed motions, one after the other from time 0; motions without length take no time."""
    length = path_geometry.lengths(path)
    index = np.flatnonzero((path.kind != RAPID) & (length > 0) & ~path.machine)
    feed = path.feed[index] / 60.0
    duration = trapezoid_duration(length[index], feed, acceleration)
    start = np.concatenate([[0.0], np.cumsum(duration)[:-1]]) if len(index) else np.zeros(0)
    return Timeline(path, index, start, duration, length[index], feed, acceleration)


@dataclass(frozen=True, eq=False)
class Fit:
    """A timeline brought into line with a log: whether it was as expected, and how far its starts were off."""

    timeline: Timeline
    as_expected: bool
    off_s: float
    rows: NDArray[np.bool_]  # (n,) rows whose line belongs to the program


def fit_to_log(timeline: Timeline, time: Floats, line: Floats, slack_s: float = 0.002) -> Fit:
    """Moves motion starts so that every row lies in a motion of its source line; (n,) time s, (n,) line, NaN = unknown.

    Kept as it is when no row contradicts it by more than `slack_s`. Otherwise motions start between the last row of
    the line before and the first row of their own; runs of motions on one line share its time by their own lengths.
    """
    own = timeline.path.line[timeline.index]
    known = np.isfinite(line)
    inside = known & np.isin(np.where(known, line, -1), own)
    if not inside.any():
        return Fit(timeline, True, 0.0, inside | ~known)
    k, _ = timeline.locate(time)
    # A row at the seam may carry either line.
    early, late = timeline.locate(time - slack_s)[0], timeline.locate(time + slack_s)[0]
    agree = (own[k] == line) | (own[early] == line) | (own[late] == line)
    if (agree | ~inside).all():
        return Fit(timeline, True, 0.0, inside | ~known)
    starts, ends = _bounds(own, time[inside], line[inside].astype(int), timeline)
    off = float(np.max(np.abs(starts - timeline.start)))
    moved = replace(timeline, start=starts, duration=np.maximum(ends - starts, 1e-9))
    return Fit(moved, False, off, inside | ~known)


def _bounds(own: Ints, time: Floats, line: Ints, timeline: Timeline) -> tuple[Floats, Floats]:
    """Start and end (k,) of every motion from the rows' lines, matched in order."""
    change = np.flatnonzero(np.diff(line)) + 1
    first, last = np.concatenate([[0], change]), np.concatenate([change - 1, [len(line) - 1]])
    block_edges = np.flatnonzero(np.diff(own)) + 1
    a, b = np.concatenate([[0], block_edges]), np.concatenate([block_edges, [len(own)]])
    start, end = timeline.start.copy(), timeline.start + timeline.duration
    step = float(np.median(np.diff(time))) if len(time) > 1 else 0.02
    seen = 0
    shift = 0.0
    for i, j in zip(a, b, strict=True):
        match = next((r for r in range(seen, len(first)) if line[first[r]] == own[i]), None)
        natural = timeline.duration[i:j]
        if match is None:  # no row of this line: keep its own duration behind the one before
            begin = timeline.start[i] + shift
            finish = begin + natural.sum()
        else:
            t0, t1 = time[first[match]], time[last[match]]
            before = time[last[match - 1]] if match > 0 else t0 - step
            after = time[first[match + 1]] if match + 1 < len(first) else t1 + step
            begin, finish = max(0.5 * (before + t0), t0 - step), min(0.5 * (t1 + after), t1 + step)
            natural_end = begin + natural.sum()
            # A stretch that the rows do not ask for is none.
            if t1 <= natural_end <= after:
                finish = natural_end
            seen = match + 1
            shift = finish - (timeline.start[j - 1] + timeline.duration[j - 1])
        edges = begin + (finish - begin) * np.concatenate([[0.0], np.cumsum(natural) / natural.sum()])
        start[i:j], end[i:j] = edges[:-1], edges[1:]
    return np.maximum.accumulate(start), end
