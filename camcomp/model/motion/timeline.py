"""Time along a program: trapezoidal speed along each motion, exact stop at its end, time 0 at the first feed move.

Motions are those of a Path; rapids take no time here, because logs do not contain them.
"""

import numpy as np

from camcomp.ground import path_geometry
from camcomp.ground.datatypes import RAPID, Floats, Ints, Path
from camcomp.ground.records import dataclass


@dataclass(frozen=True, eq=False, kw_only=True)
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
        """Feed motion (n,) and share of its length, 0 to 1 (n,), at each time (n,) s."""
        k = np.clip(np.searchsorted(self.start, time, side="right") - 1, 0, len(self.start) - 1)
        return k, self.share(k, time)

    def share(self, k: Ints, time: Floats) -> Floats:
        """Share (n,) of motion k (n,) done at time (n,)."""
        natural = trapezoid_duration(self.length[k], self.feed[k], self.acceleration)
        spent = np.clip(time - self.start[k], 0.0, self.duration[k])
        with np.errstate(invalid="ignore", divide="ignore"):
            t = np.where(self.duration[k] > 0, spent * natural / self.duration[k], 0.0)
            done = trapezoid(t, natural, self.length[k], self.feed[k], self.acceleration)
            return np.where(self.length[k] > 0, np.clip(done / self.length[k], 0.0, 1.0), 1.0)


def trapezoid_duration(length: Floats | float, feed: Floats | float, acceleration: float) -> Floats:
    """Time (n,) s for length mm from stop to stop at feed mm/s with acceleration mm/s2."""
    cruise = length / feed + feed / acceleration
    return np.where(length * acceleration >= feed**2, cruise, 2.0 * np.sqrt(length / acceleration))


def trapezoid(
    t: Floats, duration: Floats | float, length: Floats | float, feed: Floats | float, acceleration: float
) -> Floats:
    """Length (n,) mm done t (n,) s after a stop, of lengths that take durations from stop to stop."""
    peak = np.minimum(feed, np.sqrt(length * acceleration))
    ramp = peak / acceleration
    left = np.maximum(duration - t, 0.0)
    up, down = 0.5 * acceleration * t**2, length - 0.5 * acceleration * left**2
    return np.where(t < ramp, up, np.where(left < ramp, down, 0.5 * acceleration * ramp**2 + peak * (t - ramp)))


def schedule(path: Path, acceleration: float) -> Timeline:
    """Timeline of a path's feed motions in succession from time 0; the duration of motions without length is 0."""
    length = path_geometry.lengths(path)
    index = np.flatnonzero((path.kind != RAPID) & (length > 0) & ~path.machine)
    feed = path.feed[index] / 60.0
    duration = trapezoid_duration(length[index], feed, acceleration)
    start = np.concatenate([[0.0], np.cumsum(duration)[:-1]]) if len(index) else np.zeros(0)
    return Timeline(
        path=path,
        index=index,
        start=start,
        duration=duration,
        length=length[index],
        feed=feed,
        acceleration=acceleration,
    )
