"""Which vibrations show in the gap: lines at one frequency in time.

Sines of every period are fitted by least squares jointly with a smooth trend; a line counts where chance would not make
it among all the periods tried, in runs of different speed. Source: least-squares spectra (Scargle, Astrophysical Journal
263, 1982), Bonferroni over periods.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from camcomp.diagnosis.statistics.by_channel import AT_ONCE
from camcomp.diagnosis.statistics.places import FALSE, RunGap
from camcomp.ground.datatypes import Floats

_TREND = 4  # terms of the polynomial that is taken out with the sines, and half waves of the longest period
_STANDS_OUT = 0.2  # share of what the trend leaves


def _trend(x: Floats) -> Floats:
    """Columns (n, k) of polynomials in x (n,)."""
    u = 2.0 * (x - x.min()) / max(float(np.ptp(x)), 1e-9) - 1.0
    return np.asarray(u[:, None] ** np.arange(_TREND))


def _spectrum(y: Floats, x: Floats, frequencies: Floats, trend: Floats) -> tuple[Floats, float]:
    """Energy (f,) that sines of x at each frequency explain in y (n,) after the trend is removed, and the total
    energy.
    """
    Q, _ = np.linalg.qr(trend)
    rest = y - Q @ (Q.T @ y)
    found = [np.zeros(0)]
    for part in np.array_split(frequencies, max(len(frequencies) * len(x) // AT_ONCE, 1)):
        turn = 2.0 * np.pi * x[:, None] * part
        waves = np.sin(turn), np.cos(turn)  # (n, f) each
        smooth = [Q.T @ each for each in waves]
        M = np.empty((len(part), 2, 2))
        for i, j in ((0, 0), (0, 1), (1, 1)):
            M[:, i, j] = np.einsum("nf,nf->f", waves[i], waves[j]) - np.einsum("kf,kf->f", smooth[i], smooth[j])
        M[:, 1, 0] = M[:, 0, 1]
        M = M + (1e-9 * np.trace(M, axis1=1, axis2=2)[:, None, None] + 1e-30) * np.eye(2)
        b = np.stack([rest @ each for each in waves], axis=1)
        found.append(np.einsum("fi,fi->f", b, np.linalg.solve(M, b[:, :, None])[:, :, 0]))
    return np.concatenate(found), float(rest @ rest)


def frequencies(runs: Sequence[RunGap], names: Sequence[str]) -> list[dict[str, Any]]:
    """Lines at one frequency in time, in the channels of the gap; phases differ from run to run."""
    found, whole = [], sum(float(np.nansum(r.gap**2)) for r in runs)
    for j, name in enumerate(names):
        known = [(r, np.isfinite(r.gap[:, j])) for r in runs]
        parts = [(r.gap[on, j], r.time[on], r.thin, _trend(r.time[on])) for r, on in known if on.sum() > 30]
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


def _line(
    parts: Sequence[tuple[Floats, Floats, float, Floats]], tried: Floats, names: int
) -> tuple[float, list[float]] | None:
    """The best of the frequencies tried (f,), and the energy of its sines per series, if chance and trends do not make it.

    parts: per series values (n,), places (n,), rows per independent one, trend (n, k). names: number of actuators or axes.
    """
    if not len(tried):
        return None
    logs, energies, shares = np.zeros(len(tried)), list[Floats](), list[Floats]()
    for y, x, thin, trend in parts:
        explained, energy = _spectrum(y, x, tried, trend)
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
