"""Where the gap lies: shares by axis, actuator, source line and time, and what the gap depends on.

Energies are those of the difference between log and model less what noise of the same size would have; lines and
intervals count where they stand out of the run's own noise (false discovery rate 1 %, autocorrelation respected).
Source: Benjamini and Hochberg 1995; effective sample size by the noise's autoregression.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc

from camcomp.ground.datatypes import Floats, Ints

FALSE = 0.01  # share of discoveries that are none
_BIN_S = 0.4
_CLOSE_MM = 3.0  # behind a reversal


@dataclass(frozen=True, eq=False, kw_only=True)
class RunGap:
    """One run: gap (n, 3) mm of the tip (or (n, m) of the encoders), noise (3 or m,) mm, rows per independent one,
    time (n,), line (n,) (NaN unknown), drives: the gap as motion of the carriages (n, m). tip (n, 3): where the model is,
    program frame; position, direction (n, m): of the actuators, direction as in Motion.
    """

    name: str
    gap: Floats
    noise: Floats
    thin: float
    time: Floats
    line: Floats
    drives: Floats
    tip: Floats
    position: Floats
    direction: Floats


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


def _energy(run: RunGap) -> Floats:
    out: Floats = np.nansum(run.gap**2, axis=1)
    return out


def _chance(run: RunGap, rows: Ints) -> float:
    """Chance that noise alone makes these rows as large."""
    normal = run.gap[rows] / run.noise
    count = np.isfinite(normal).sum() / run.thin
    return float(chdtrc(max(count, 1.0), np.nansum(normal**2) / run.thin))


def discoveries(chances: Sequence[float]) -> list[bool]:
    """Benjamini-Hochberg."""
    order = np.argsort(chances)
    n = len(order)
    passed = [i for i, k in enumerate(order) if chances[k] <= FALSE * (i + 1) / n]
    last = max(passed) if passed else -1
    out = [False] * n
    for i in order[: last + 1]:
        out[int(i)] = True
    return out


def lines(runs: Sequence[RunGap], most: int = 12) -> list[dict[str, object]]:
    """Source lines by share of the gap's energy; only those that stand out of the noise."""
    whole = sum(float(_energy(r).sum()) for r in runs)
    found = []
    for run in runs:
        for line in np.unique(run.line[np.isfinite(run.line)]):
            rows = np.flatnonzero(run.line == line)
            energy = float(_energy(run)[rows].sum())
            found.append((energy, run, int(line), rows))
    real = discoveries([_chance(run, rows) for _, run, _, rows in found]) if found else []
    kept = sorted((f for f, ok in zip(found, real, strict=True) if ok), key=lambda f: -f[0])[:most]
    return [
        {
            "run": run.name,
            "line": line,
            "share": round(energy / whole, 4),
            "rms_um": round(1e3 * float(np.sqrt(energy / len(rows))), 3),
        }
        for energy, run, line, rows in kept
    ]


def intervals(runs: Sequence[RunGap], most: int = 12) -> list[dict[str, object]]:
    """Stretches of time where the gap stands out of the noise, neighbours joined, by share of its energy."""
    whole = sum(float(_energy(r).sum()) for r in runs)
    found = []
    pieces = []
    for run in runs:
        if len(run.time) > 1:
            bins = np.floor((run.time - run.time[0]) / _BIN_S).astype(int)
            pieces.append((run, [np.flatnonzero(bins == b) for b in np.unique(bins)]))
    every = discoveries([_chance(run, rows) for run, groups in pieces for rows in groups]) if pieces else []
    at = 0
    for run, groups in pieces:
        real, at = every[at : at + len(groups)], at + len(groups)
        open_rows: list[np.ndarray] = []
        for rows, ok in [*zip(groups, real, strict=True), (np.zeros(0, int), False)]:
            if ok:
                open_rows.append(rows)
            elif open_rows:
                joined = np.concatenate(open_rows)
                found.append((float(_energy(run)[joined].sum()), run, joined))
                open_rows = []
    found.sort(key=lambda f: -f[0])
    return [
        {
            "run": run.name, "t0_s": round(float(run.time[rows[0]]), 3), "t1_s": round(float(run.time[rows[-1]]), 3),
            "share": round(energy / whole, 4),
        }
        for energy, run, rows in found[:most]
    ]  # fmt: skip


def travel(runs: Sequence[RunGap], names: Sequence[str]) -> dict[str, dict[str, float]]:
    """Per actuator, of the gap read as motion of its carriage: the shares that do not depend on the direction of travel, that
    turn round with it, and that follow a reversal closely (what is left of the first millimetres behind one).
    """
    out = {}
    for j, name in enumerate(names):
        y = np.concatenate([r.drives[:, j] for r in runs])
        sign = np.concatenate([np.sign(np.round(r.direction[:, j], 2)) for r in runs])
        behind = np.concatenate([_behind(r.position[:, j], np.sign(np.round(r.direction[:, j], 2))) for r in runs])
        moving = sign != 0
        same = np.full(len(y), y[moving].mean() if moving.any() else 0.0)
        ways = [y[sign == s].mean() if (sign == s).any() else 0.0 for s in (1.0, -1.0)]
        odd = 0.5 * (ways[0] - ways[1]) if (sign > 0).any() and (sign < 0).any() else 0.0
        rest = y - same - odd * sign
        close = behind < _CLOSE_MM
        extra = float((rest[close] ** 2).sum()) - close.mean() * float((rest**2).sum())
        whole = float((y**2).sum())
        out[name] = {
            "both_ways": round(float((same**2).sum()) / whole, 4) if whole > 0 else 0.0,
            "with_direction": round(float(((odd * sign) ** 2).sum()) / whole, 4) if whole > 0 else 0.0,
            "after_reversal": round(max(float(extra), 0.0) / whole, 4) if whole > 0 else 0.0,
        }
    return out


def _behind(x: Floats, sign: Floats) -> Floats:
    """Travel (n,) since the last reversal of x (n,); inf before the first."""
    gone = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(x)))])
    turned = np.concatenate([[False], (sign[1:] != sign[:-1]) & (sign[1:] != 0) & (sign[:-1] != 0)])
    return gone - np.maximum.accumulate(np.where(turned, gone, -np.inf))


def places(runs: Sequence[RunGap], most: int = 6) -> list[dict[str, object]]:
    """Regions of the workspace (thirds of the visited range, per axis) where the gap exceeds the noise, by share."""
    tips = np.concatenate([r.tip for r in runs])
    low, span = tips.min(axis=0), np.ptp(tips, axis=0)
    parts = np.where(span > 1.0, 3, 1)
    whole = sum(float(_energy(r).sum()) for r in runs)
    found = []
    for cell in np.ndindex(*parts):
        a = low + span * np.array(cell) / parts
        b = low + span * (np.array(cell) + 1) / parts
        energy = rows = 0.0
        normal = count = 0.0
        for r in runs:
            inside = np.flatnonzero(((r.tip >= a - 1e-9) & (r.tip <= b + 1e-9)).all(axis=1))
            energy += float(_energy(r)[inside].sum())
            rows += len(inside)
            z = r.gap[inside] / r.noise
            normal, count = normal + float(np.nansum(z**2)) / r.thin, count + np.isfinite(z).sum() / r.thin
        if rows:
            found.append((energy, rows, a, b, float(chdtrc(max(count, 1.0), normal))))
    real = discoveries([f[-1] for f in found]) if found else []
    kept = sorted((f for f, ok in zip(found, real, strict=True) if ok), key=lambda f: -f[0])[:most]
    return [
        {
            **{f"{axis}_mm": [round(float(a[i]), 2), round(float(b[i]), 2)] for i, axis in enumerate("xyz")},
            "share": round(energy / whole, 4), "rms_um": round(1e3 * float(np.sqrt(energy / rows)), 3),
        }
        for energy, rows, a, b, _ in kept
    ]  # fmt: skip
