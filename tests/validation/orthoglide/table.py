"""The campaign's table: rates with Wilson intervals, calibration, sizes, times."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

Row = dict[str, Any]


def wilson(hits: int, total: int) -> tuple[float, float]:
    """95 % interval of a rate."""
    if total == 0:
        return 0.0, 1.0
    z, p = 1.959964, hits / total
    centre = (p + z * z / (2 * total)) / (1 + z * z / total)
    half = z * np.sqrt(p * (1 - p) / total + z * z / (4 * total * total)) / (1 + z * z / total)
    return float(max(0.0, centre - half)), float(min(1.0, centre + half))


def expected_calibration_error(probability: np.ndarray, right: np.ndarray, bins: int = 15) -> float:
    """Mean distance of stated probability and hit rate over bins of equal mass."""
    order = np.argsort(probability)
    total = 0.0
    for part in np.array_split(order, min(bins, len(order))):
        if len(part):
            total += len(part) * abs(probability[part].mean() - right[part].mean())
    return total / max(len(order), 1)


def _rate(label: str, rows: Iterable[Row], key: Callable[[Row], bool], target: str) -> str:
    values = [bool(key(r)) for r in rows]
    low, high = wilson(sum(values), len(values))
    rate = sum(values) / len(values) if values else float("nan")
    return f"{label:<58} {rate:6.3f}  [{low:.3f}, {high:.3f}]  n={len(values):<5} {target}"


def render(rows: list[Row]) -> str:
    """The table as text."""
    done = [r for r in rows if "verdict" in r]
    lines = [f"{len(done)} experiments, {len(rows) - len(done)} refused or failed", ""]

    def pick(category: str, *ratios: float) -> list[Row]:
        return [r for r in done if r["category"] == category and (not ratios or r["ratio"] in ratios)]

    def isolable(category: str, ratio: float, wanted: bool) -> list[Row]:
        return [r for r in pick(category, ratio) if (r.get("left", 1.0) >= 0.5) == wanted]

    for ratio in (0.3, 1.0, 3.0, 10.0):
        target = "target >= 0.95" if ratio >= 3 else "target >= 0.90" if ratio == 1 else ""
        lines.append(_rate(f"single, {ratio:g} x noise: first, or class named", pick("single", ratio), _hit, target))
    both = [r for r in pick("single") if r["ratio"] >= 3]
    lines.append(_rate("single, >= 3 x noise: exactly and only the truth", both, lambda r: r["exact"], ""))
    lines.append(_rate("pairs: both named", pick("pair"), lambda r: r["named"], "target >= 0.85"))
    lines.append(_rate("null: false alarm", pick("null"), lambda r: not r["none"], "target <= 0.05"))
    for ratio, target in ((3.0, "target >= 0.80"), (10.0, "target >= 0.95")):
        for category in ("foreign", "withheld"):
            label = f"{category}, {ratio:g} x noise"
            lines.append(_rate(f"{label}, not absorbable: unknown", isolable(category, ratio, True), _unknown, target))
            lines.append(_rate(f"{label}, absorbable: unknown", isolable(category, ratio, False), _unknown, ""))
    known = [r for r in done if r["category"] in ("single", "pair", "null")]
    lines.append(_rate("false unknown with the complete library", known, _unknown, "target <= 0.03"))
    equal = pick("equal")
    lines.append(_rate("equal pairs: one member named alone", equal, lambda r: r["single_member"], "target 0"))
    lines.append(_rate("equal pairs: reported as ambiguous, truth inside", equal, lambda r: r["named"], ""))
    lines.append(_rate("poorer designs, 3 x noise: first, or class named", pick("poor"), _hit, ""))
    lines += ["", *_figures(done)]
    return "\n".join(lines)


def _hit(r: Row) -> bool:
    return r["first_or_class"]


def _unknown(r: Row) -> bool:
    return r["unknown"]


def _figures(done: list[Row]) -> list[str]:
    lines = []
    known = [r for r in done if r["category"] in ("single", "pair") and r["ratio"] >= 3]
    inside = [x for r in known for x in r["inside"]]
    low, high = wilson(sum(inside), len(inside))
    lines.append(
        f"95 % intervals cover the truth: {np.mean(inside or [np.nan]):.3f} [{low:.3f}, {high:.3f}] "
        f"n={len(inside)}  target 0.90-0.98"
    )
    error = np.abs([x for r in known for x in r["error"]])
    if len(error):
        lines.append(f"size error: median {np.median(error):.3f}, 90 % below {np.quantile(error, 0.9):.3f}")
    sure = [r for r in done if r.get("probability") is not None and r["category"] in ("single", "pair", "poor")]
    if sure:
        p = np.array([r["probability"] for r in sure], float)
        right = np.array([r["first"] for r in sure], float)
        clipped = np.clip(np.where(right > 0, p, 1 - p), 1e-6, 1)
        lines.append(
            f"probability of the first cause: ECE {expected_calibration_error(p, right):.3f} (target <= 0.05), "
            f"Brier {np.mean((p - right) ** 2):.3f}, log loss {-np.log(clipped).mean():.3f}, n={len(sure)}"
        )
    shrunk = [r for r in known if "shrinkage" in r]
    if shrunk:
        gap = np.array([r["shrinkage"] - r["oracle"] for r in shrunk])
        cover = [r["shrinkage_inside"] for r in shrunk if "shrinkage_inside" in r]
        harm = np.mean([r["shrinkage"] < -0.02 for r in done if "shrinkage" in r])
        lines.append(
            f"|shrinkage - oracle|: median {np.median(np.abs(gap)):.3f}, within 0.05: {np.mean(np.abs(gap) <= 0.05):.3f}"
            f", interval holds the oracle: {np.mean(cover or [np.nan]):.3f}, harm rate {harm:.3f}"
        )
    aimed = [r["actuator"] for r in known if "actuator" in r]
    lines.append(f"actuator with the largest share is the right one: {np.mean(aimed or [np.nan]):.3f} n={len(aimed)}")
    times = np.array([r["seconds"] for r in done]) if done else np.zeros(1)
    lines.append(f"seconds per experiment: median {np.median(times):.1f}, 95 % below {np.quantile(times, 0.95):.1f}")
    return lines


def misses(rows: list[Row]) -> str:
    """One line per wrong answer, for reading."""
    out = []
    for r in rows:
        if "verdict" not in r:
            out.append(f"{r['name']:<16} {r.get('failed', '?')}")
            continue
        good = {
            "null": r["none"],
            "foreign": r["unknown"],
            "withheld": r["unknown"],
            "equal": r["named"],
            "pair": r["named"],
        }.get(r["category"], r["first_or_class"])
        if not good:
            share = f" left {r['left']:.2f}" if "left" in r else ""
            out.append(
                f"{r['name']:<16} {r['ratio']:>4g}  true {r['true']}  {r['verdict']}: {r['found']}"
                f"  ({r['alternatives']} sets){share}"
            )
    return "\n".join(out)
