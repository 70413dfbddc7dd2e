"""Noise that is none: too smooth, or too large in one direction, to come from a sensor.

Patterns cannot follow every unknown effect (a vibration, stick-slip); what they leave would pass for noise. A sensor's
noise is nearly white, or has the same colour in all its axes; an effect of the machine has a favourite axis.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from camcomp.ground.datatypes import Floats

SMOOTH = 2.0  # size over roughness that any sensor may have: autocorrelation 0.65 from row to row
SAME_SCATTER = 1.35  # by how much the colour of two axes of one sensor may differ
LOPSIDED = 2.5  # by how much their sizes may differ
LINE_SHARE = 0.4  # of the energy within one line of the spectrum: a vibration


@dataclass(frozen=True, eq=False)
class Colour:
    """excess (c,): standard deviation beyond what a sensor explains; floor (c,): what a sensor explains, both in mm."""

    excess: Floats
    floor: Floats

    @property
    def ratio(self) -> float:
        """Size of the excess in units of the floor."""
        floor = float(np.linalg.norm(self.floor))
        return float(np.linalg.norm(self.excess)) / floor if floor > 0 else 0.0


def colour(sigma: Floats, rough: Floats) -> Colour:
    """From sizes and roughnesses (runs, c) of channels of one kind; NaN where nothing was measured.

    Over runs by energy: what shakes in two runs of six is there.
    """
    known = np.isfinite(sigma).all(axis=1) & np.isfinite(rough).all(axis=1)
    if not known.any():
        return Colour(np.zeros(sigma.shape[1]), np.zeros(sigma.shape[1]))
    size, grain = np.sqrt(np.mean(sigma[known] ** 2, axis=0)), np.sqrt(np.mean(rough[known] ** 2, axis=0))
    ratio = size / np.maximum(grain, 1e-12)
    smooth = max(SMOOTH, SAME_SCATTER * float(ratio.min()))
    most = np.minimum(smooth * grain, LOPSIDED * float(size.min()))
    floor = np.where(size > most, np.minimum(grain * min(float(ratio.min()), SMOOTH), SAME_SCATTER * size.min()), size)
    return Colour(np.where(size > most, np.sqrt(np.maximum(size**2 - floor**2, 0.0)), 0.0), floor)


def line_share(x: Floats, time: Floats) -> tuple[float, float]:
    """Share of the energy of x (n,) in its strongest spectral line, and the line's frequency, Hz."""
    known = np.isfinite(x)
    if known.sum() < 32:
        return 0.0, 0.0
    step = float(np.median(np.diff(time[known])))
    even = np.arange(time[known][0], time[known][-1], step)
    y = np.interp(even, time[known], x[known])
    power = np.abs(np.fft.rfft((y - y.mean()) * np.hanning(len(y)))) ** 2
    peak = int(np.argmax(power))
    near = power[max(peak - 2, 0) : peak + 3].sum()
    return float(near / max(power.sum(), 1e-300)), peak / (len(y) * step)


def covariate(rest: Sequence[Floats], times: Sequence[Floats], drives: Sequence[Floats], names: Sequence[str],
              actuators: Sequence[str], excess: Floats) -> str:  # fmt: skip
    """What the excess depends on: time where it is a line at one frequency, else the motion of one actuator.

    rest: per run what no model explains (n, c) in channels `names`; drives: the same as motion of the carriages (n, m).
    """
    axis = int(np.argmax(excess))
    lines = [line_share(r[:, axis], t) for r, t in zip(rest, times, strict=True)]
    share, frequency = (np.array(each) for each in zip(*lines, strict=True))
    heard = frequency[share > 0]
    if np.median(share) > LINE_SHARE and len(heard) and np.std(heard) < 0.1 * np.mean(heard):
        return f"time:{names[axis]}"
    energy = sum(np.nansum(d**2, axis=0) for d in drives)
    return f"velocity:{actuators[int(np.argmax(energy))]}"
