"""Hits and totals of every rate, added up one experiment at a time."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from tests.validation import scoring

Row = dict[str, Any]
BINS = 10
KEPT_MISSES = 40  # answers that were wrong, listed by seed


def of_answer(row: Row) -> Iterator[tuple[str, bool]]:
    """Rates that one answer of a generator with `scoring.judge` counts for, and whether it is a hit."""
    yield "no answer", "failed" in row
    if "failed" in row:
        return
    unmodelled, true = bool(row["foreign"]), row["true"]
    if unmodelled:
        yield "unmodelled effect: verdict unknown", row["unknown"]
        if row["left"] >= 1:
            yield "unmodelled effect that the library cannot imitate: unknown", row["unknown"]
        if true:
            yield "cause jointly with an unmodelled effect: named", bool(row["all"])
    else:
        if not true:
            yield "nothing wrong: verdict none", row["none"]
        elif row["kind"] == "imperfect":
            yield "imperfect model: every cause from 2.7 x noise named", scoring.all_due(row)
        elif len(true) == 1:
            size = "from" if row["ratio"] >= scoring.DUE else "below"
            yield f"one cause {size} 2.7 x noise: first, or among the alternatives", row["first_or_class"]
        elif row["kind"] == "pair" and len(row["due"]) > 1:
            yield "two causes: both named", bool(row["all"])
        yield "complete library: false unknown", row["unknown"]
    if "honest" in row:
        yield "answer that the data allow", row["honest"]
    yield "false cause with p above 0.5", row["false_cause"]
    yield "false cause with p above 0.8", row["sure_and_wrong"]
    for hit in row["held"]:
        yield "95 % interval holds the true value", hit
    yield "whole answer right", scoring.right(row)


def of_orthoglide(row: Row) -> Iterator[tuple[str, bool]]:
    """The same of a case on the reference Orthoglide."""
    yield "no answer", "failed" in row
    if "failed" in row:
        return
    category, large = row["category"], row["ratio"] >= 3
    if category in ("single", "poor"):
        what = "poor channels" if category == "poor" else "one cause"
        yield (
            f"{what} {'from' if large else 'below'} 3 x noise: first, or among the alternatives",
            row["first_or_class"],
        )
    elif category == "null":
        yield "nothing wrong: verdict none", row["none"]
    elif category == "equal":
        yield "two causes with the same log: ambiguous, the true one among them", row["named"]
        yield "two causes with the same log: one named alone", row["single_member"]
    elif category == "pair":
        yield "two causes: both named", row["named"]
    else:
        what = "unmodelled effect" if category == "foreign" else "effect withheld from the library"
        if row["left"] >= 0.5:
            yield f"{what} that the library cannot imitate: unknown", row["unknown"]
    if category in ("single", "pair", "null"):
        yield "complete library: false unknown", row["unknown"]
    for hit in row["inside"] if large else ():
        yield "95 % interval holds the true value", hit


def of_hidden_law(row: Row) -> Iterator[tuple[str, bool]]:
    """The same of an experiment with a law that no library has."""
    if row["effect"] == "null":
        yield "nothing wrong: verdict none", row["verdict"] == "none"
        yield "nothing wrong: a law found by a forced search", bool(row["law"])
        return
    size = f"{row['ratio']:g} x noise"
    yield f"{size}: a law found", bool(row["law"])
    yield f"{size}: form of the true law", bool(row["form"])
    yield f"{size}: stage and axis of the true law", bool(row["place"])
    if row.get("off") is not None:
        yield f"{size}: shrinkage within 0.05 of the true law's", row["off"] <= 0.05
    yield f"{size}: a cause that is not there", any(effect != "unknown" for effect, _ in row["causes"])


def of_changed_data(row: Row) -> Iterator[tuple[str, bool]]:
    """The same of a change of data: less of it, or the same written differently."""
    if row.get("failed"):
        yield "no answer", True
    elif row["less"]:
        yield "less data: another single cause", row["another"]
        if row["before"] in ("unknown", "ambiguous"):
            yield "less data: open verdict closed", row["surer"]
    else:
        yield "the same data in another form: answer changed", bool(row["said"])


def of_left_out_run(row: Row) -> Iterator[tuple[str, bool]]:
    """The same of a held-out run: does the predicted shrinkage hold on it?"""
    if "ratio" in row:
        yield "95 % interval of the shrinkage holds on a further run", row["low"] <= row["ratio"] <= row["high"]


def add(result: Row, seed: int, outcomes: list[tuple[str, bool]], rows: list[Row]) -> None:
    """Add one experiment to a result, with the probabilities of its causes and its wrong claims."""
    counts = result.setdefault("counts", {})
    for name, hit in outcomes:
        count = counts.setdefault(name, [0, 0])
        count[0] += bool(hit)
        count[1] += 1
    bins = result.setdefault("calibration", [[0, 0.0, 0] for _ in range(BINS)])
    for row in rows:
        for p, true in (pair for pair in row.get("calibration", ()) if pair[0]):
            one = bins[min(int(p * BINS), BINS - 1)]
            one[:] = [one[0] + 1, round(one[1] + p, 4), one[2] + bool(true)]
        result["seconds"] = round(result.get("seconds", 0.0) + row.get("seconds", 0.0), 1)
        if row.get("wrong") and len(result.setdefault("misses", [])) < KEPT_MISSES:
            result["misses"].append([seed, row["wrong"]])
    result["experiments"] = result.get("experiments", 0) + 1
    result["next_seed"] = seed + 1


def calibration_error(bins: list[list[float]]) -> tuple[float, int]:
    """Mean distance of stated probability and rate over bins (number, sum of p, hits), and the number of causes."""
    total = int(sum(each[0] for each in bins))
    return (sum(abs(each[1] - each[2]) for each in bins) / total if total else float("nan")), total


def expected_by_chance(bins: list[list[float]]) -> float:
    """The same error if all probabilities were right, by 2000 draws."""
    counts = np.array([each[0] for each in bins], int)
    p = np.array([each[1] for each in bins]) / np.maximum(counts, 1)
    drawn = np.random.default_rng(0).binomial(counts, p, (2000, len(counts)))
    return float((np.abs(drawn - counts * p).sum(1) / max(counts.sum(), 1)).mean())
