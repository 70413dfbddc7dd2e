"""Which vibrations show in the gap: lines at one frequency in time.

Sines of every period are fitted by least squares to what a smooth trend leaves; a line counts where chance would not make
it among all the periods tried, in runs of different speed. Source: least-squares spectra (Scargle, Astrophysical Journal
263, 1982), Bonferroni over periods.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.polynomial import Polynomial
from scipy.signal import lombscargle

from camcomp.diagnosis.statistics.by_channel import AT_ONCE
from camcomp.diagnosis.statistics.places import FALSE, RunGap
from camcomp.ground.datatypes import Floats

_TREND = 4  # terms of the polynomial that is taken out, and half waves of the longest period
_STANDS_OUT = 0.2  # share of what the trend leaves


def _spectrum(y: Floats, x: Floats, frequencies: Floats) -> tuple[Floats, float]:
    """Energy (f,) that sines of x at each frequency explain in what a polynomial leaves of y (n,), and the whole energy of that."""
    rest = y - Polynomial.fit(x, y, _TREND - 1)(x)
    parts = np.array_split(2.0 * np.pi * frequencies, max(len(frequencies) * len(x) // AT_ONCE, 1))
    return 2.0 * np.hstack([lombscargle(x, rest, part) for part in parts]), float(rest @ rest)


def frequencies(runs: Sequence[RunGap], names: Sequence[str]) -> list[dict[str, Any]]:
    """Lines at one frequency in time, in the channels of the gap; phases differ from run to run."""
    found, whole = [], sum(float(np.nansum(r.gap**2)) for r in runs)
    for j, name in enumerate(names):
        known = [(r, np.isfinite(r.gap[:, j])) for r in runs]
        parts = [(r.gap[on, j], r.time[on], r.thin) for r, on in known if on.sum() > 30]
        if not parts:
            continue
        spans = [float(np.ptp(t)) for _, t, *_ in parts]
        step = max(float(np.median(np.diff(t))) for _, t, *_ in parts)
        tried = np.arange(0.5 * _TREND / min(spans), 1.0 / (2.0 * step), 0.25 / max(spans))
        if (line := _line(parts, tried, len(names))) is not None:
            hertz, energy = line
            size = 1e3 * float(np.mean([np.sqrt(2.0 * e / len(y)) for e, (y, *_) in zip(energy, parts, strict=True)]))
            share = round(sum(energy) / max(whole, 1e-300), 4)
            found.append({"axis": name, "hertz": round(hertz, 4), "amplitude_um": round(size, 3), "share": share})
    return sorted(found, key=lambda line: -line["share"])


def _line(parts: Sequence[tuple[Floats, Floats, float]], tried: Floats, names: int) -> tuple[float, list[float]] | None:
    """The best of the frequencies tried (f,), and the energy of its sines per series, if chance and trends do not make it.

    parts: per series values (n,), places (n,), rows per independent one. names: number of actuators or axes.
    """
    if not len(tried):
        return None
    logs, energies, shares = np.zeros(len(tried)), list[Floats](), list[Floats]()
    for y, x, thin in parts:
        explained, energy = _spectrum(y, x, tried)
        left = np.clip(1.0 - explained / max(energy, 1e-300), 1e-12, 1.0)
        logs += 0.5 * max(len(y) / thin - 2.0, 0.0) * np.log(left)  # chance that noise leaves so little unexplained
        shares.append(explained / max(energy, 1e-300))
        energies.append(explained)
    common = np.median(shares, axis=0)
    best = int(np.argmax(common))
    chance = logs[best] + np.log(len(tried) * names)
    if common[best] < _STANDS_OUT or chance > np.log(FALSE):
        return None
    return float(tried[best]), [float(each[best]) for each in energies]
