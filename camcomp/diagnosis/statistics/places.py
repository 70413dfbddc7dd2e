"""Where the gap lies: shares by axis, actuator, source line and time, and what the gap depends on.

Energies are those of the difference between log and model less what noise of the same size would have; lines and
intervals count where they stand out of the run's own noise (false discovery rate 1 %, autocorrelation respected).
Source: Benjamini and Hochberg 1995; effective sample size by the noise's autoregression.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc
from scipy.stats import false_discovery_control

from camcomp.ground.datatypes import Floats, Ints

FALSE = 0.01  # share of discoveries that are none
_BIN_S = 0.4


@dataclass(frozen=True, eq=False, kw_only=True)
class RunGap:
    """One run: gap (n, 3) mm of the tip (or (n, m) of the encoders), noise (3 or m,) mm, rows per independent one,
    time (n,), line (n,) (NaN unknown), drives: the gap as motion of the carriages (n, m).
    """

    name: str
    gap: Floats
    noise: Floats
    thin: float
    time: Floats
    line: Floats
    drives: Floats


def shares(values: Mapping[str, float]) -> dict[str, float]:
    """Values as shares of their sum, rounded to 4 places; all zero when the sum is zero."""
    whole = sum(max(v, 0.0) for v in values.values())
    return {k: round(max(v, 0.0) / whole, 4) if whole > 0 else 0.0 for k, v in values.items()}


def axes(runs: Sequence[RunGap], names: Sequence[str]) -> dict[str, float]:
    """Energy above the noise by channel."""
    out = {}
    for j, name in enumerate(names):
        out[name] = sum(max(float(np.nansum(r.gap[:, j] ** 2 - r.noise[j] ** 2)), 0.0) for r in runs)
    return shares(out)


def actuators(runs: Sequence[RunGap], names: Sequence[str]) -> dict[str, float]:
    """Energy of the gap, read as motion of the carriages."""
    return shares({a: sum(float(np.nansum(r.drives[:, j] ** 2)) for r in runs) for j, a in enumerate(names)})


Part = Sequence[tuple[RunGap, Ints]]  # rows of runs that belong together
Labelled = tuple[Mapping[str, object], Part]


def _energy(part: Part) -> float:
    """Sum of squares, mm2, of the gap in the rows of a part."""
    return sum(float(np.nansum(run.gap[rows] ** 2)) for run, rows in part)


def _chance(part: Part) -> float:
    """Chance that noise alone makes a part as large."""
    normal = [(run.gap[rows] / run.noise, run.thin) for run, rows in part]
    count = sum(np.isfinite(z).sum() / thin for z, thin in normal)
    return float(chdtrc(max(count, 1.0), sum(np.nansum(z**2) / thin for z, thin in normal)))


def _standing_out(parts: Sequence[Labelled]) -> list[Labelled]:
    """The parts that stand out of the noise."""
    real = false_discovery_control([_chance(part) for _, part in parts]) <= FALSE
    return [each for each, ok in zip(parts, real, strict=True) if ok]


def _largest(runs: Sequence[RunGap], parts: Sequence[Labelled], most: int) -> list[dict[str, object]]:
    """The labels of the parts with most of the gap's energy, with its share and rms."""
    whole, out = sum(float(np.nansum(run.gap**2)) for run in runs), []
    for label, part in sorted(parts, key=lambda each: -_energy(each[1]))[:most]:
        energy, count = _energy(part), sum(len(rows) for _, rows in part)
        rms = 1e3 * float(np.sqrt(energy / count))
        out.append({**label, "share": round(energy / whole, 4), "rms_um": round(rms, 3)})
    return out


def lines(runs: Sequence[RunGap], most: int = 12) -> list[dict[str, object]]:
    """Source lines by share of the gap's energy; only those that stand out of the noise."""
    every: list[Labelled] = [
        ({"run": run.name, "line": int(line)}, [(run, np.flatnonzero(run.line == line))])
        for run in runs
        for line in np.unique(run.line[np.isfinite(run.line)])
    ]
    return _largest(runs, _standing_out(every), most)


def intervals(runs: Sequence[RunGap], most: int = 12) -> list[dict[str, object]]:
    """Stretches of time where the gap stands out of the noise, neighbours joined, by share of its energy."""
    bins = [np.floor((run.time - run.time[:1]) / _BIN_S).astype(int) for run in runs]
    every: list[Labelled] = [
        ({}, [(run, np.flatnonzero(own == b))]) for run, own in zip(runs, bins, strict=True) for b in np.unique(own)
    ]
    joined: list[tuple[RunGap, Ints]] = []
    for _, [(run, rows)] in _standing_out(every):
        before, last = joined[-1] if joined else (None, rows)
        if before is run and last[-1] + 1 == rows[0]:
            joined[-1] = run, np.concatenate([last, rows])
        else:
            joined.append((run, rows))
    named: list[Labelled] = [
        ({"run": run.name, "t0_s": round(float(run.time[rows[0]]), 3), "t1_s": round(float(run.time[rows[-1]]), 3)}, [(run, rows)])
        for run, rows in joined
    ]  # fmt: skip
    return [{name: v for name, v in each.items() if name != "rms_um"} for each in _largest(runs, named, most)]
