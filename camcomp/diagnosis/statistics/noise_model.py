"""Noise of every channel as white noise plus a slow part, and rows made white by it.

A block is one run: residuals (n, c) over c channels, NaN where a channel has no value. Rows next to a gap start afresh.
The slow part is a first-order autoregression; whitening is the exact innovations form (Kalman 1960).
"""

from dataclasses import dataclass, field

import numpy as np

from camcomp.diagnosis.statistics.by_channel import ByChannel
from camcomp.ground.compiled import kept
from camcomp.ground.datatypes import Bools, Floats, Ints
from camcomp.model.seams import missing_rows

BLOCK = 8  # rows that are averaged, or whose noise shares a sign


@dataclass(frozen=True, eq=False)
class _Channel:
    """Rows (w,) that a channel of a run has, their deviation (w,), and which of them (w,) start afresh."""

    rows: Ints
    scale: Floats
    fresh: Bools


@dataclass(frozen=True, eq=False)
class Noise:
    """Per run and channel (runs, c): sigma size of one row, slow share of the variance that remembers, memory from row to row."""

    sigma: Floats
    slow: Floats
    memory: Floats
    _laid: dict[int, tuple[Floats, Floats, dict[int, _Channel]]] = field(default_factory=dict, init=False, repr=False)

    def rows(self, run: int, values: Floats, inflate: Floats, time: Floats) -> Floats:
        """White rows (w, k) of values (n, c, k): channel by channel, missing rows left out.

        inflate (n, c) >= 1: by how much a row is less certain than its channel. time (n,) s.
        """
        channels = ByChannel.of(values[:, j] for j in range(values.shape[1]))
        return np.asarray(self.by_channel(run, channels, inflate, time)[:, np.arange(values.shape[2])])

    def by_channel(self, run: int, values: ByChannel, inflate: Floats, time: Floats) -> ByChannel:
        """The same of values whose channels, n rows each, lie one behind the other."""
        known, parts = self._known(run, inflate, time), []
        for j, (on, x) in enumerate(values.parts):
            if j in known:
                each, white = known[j], np.empty((len(known[j].rows), len(on)))
                _innovations(x, each.rows, each.scale, each.fresh, self.slow[run, j], self.memory[run, j], white)
                parts.append((on, white))
        return ByChannel(values.width, tuple(parts))

    def _known(self, run: int, inflate: Floats, time: Floats) -> dict[int, _Channel]:
        """The channels of a run that have rows; those of a problem are asked for again and again."""
        kept = self._laid.get(run)
        if kept is None or kept[0] is not inflate or kept[1] is not time:
            found = {}
            for j in range(inflate.shape[1]):
                present = np.isfinite(inflate[:, j])
                if present.any() and np.isfinite(self.sigma[run, j]):
                    scale = self.sigma[run, j] * inflate[present, j]
                    found[j] = _Channel(np.flatnonzero(present), scale, starts(time, present))
            kept = self._laid[run] = (inflate, time, found)
        return kept[2]


@kept
def _innovations(x, rows, scale, fresh, slow, memory, out):  # type: ignore[no-untyped-def]  # pragma: no cover
    n, k = out.shape
    expected = np.zeros(k)
    unsure = slow
    for t in range(n):
        if fresh[t]:
            expected[:] = 0.0
            unsure = slow
        whole = unsure + 1.0 - slow
        gain, root, row, size = unsure / whole, 1.0 / np.sqrt(whole), rows[t], scale[t]
        for j in range(k):
            surprise = x[row, j] / size - expected[j]
            out[t, j] = surprise * root
            expected[j] = memory * (expected[j] + gain * surprise)
        unsure = memory * memory * unsure * (1.0 - gain) + slow * (1.0 - memory * memory)


def starts(time: Floats, present: Bools) -> Bools:
    """Of the rows present: which begin after a gap in time (n,) or in the channel."""
    index = np.flatnonzero(present)
    if len(index) == 0:
        return np.zeros(0, bool)
    return np.concatenate([[True], missing_rows(time[index]) | (np.diff(time[index]) <= 0.0)])


def effective_rows(noise: Noise, channel: int, n: int) -> float:
    """How many independent rows n correlated ones are worth for a mean."""
    slow, memory = noise.slow[:, channel], np.maximum(noise.memory[:, channel], 0.0)
    return n / float(np.mean(1.0 + 2.0 * slow * memory / (1.0 - memory)))


def weighted_median(values: Floats, weights: Floats) -> float:
    """The value of (n,) with half of the weights (n,) on either side; 0 of none."""
    if not len(values):
        return 0.0
    order = np.argsort(values)
    done = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(done, 0.5 * done[-1])])
