"""One answer against one truth: what was right, what was wrong, by how much."""

from __future__ import annotations

from typing import Any

import numpy as np

Pair = tuple[str, str | None]


def pairs(causes: list[dict[str, Any]]) -> list[Pair]:
    """(effect, target) of every listed cause but `unknown`."""
    return [(c["effect"], c["target"]) for c in causes if c["effect"] != "unknown"]


def _covered(cause: dict[str, Any], truth: dict[str, float]) -> tuple[list[bool], list[float]]:
    """Per shared parameter: whether the interval holds the truth, and the relative error."""
    inside, error = [], []
    for name, value in truth.items():
        got = cause.get("parameters", {}).get(name)
        if got is None or got.get("ci95") is None:
            continue
        low, high = got["ci95"]
        if name.startswith("phase"):
            turn = 2 * np.pi
            value = value + turn * round((got["value"] - value) / turn)
        inside.append(bool(low <= value <= high))
        nominal = 1.0 if name == "factor" else 0.0
        error.append(float((got["value"] - value) / max(abs(value - nominal), 1e-12)))
    return inside, error


def score(result: dict[str, Any], truth: dict[str, Any]) -> dict[str, Any]:
    """Flat record of one case; keys that do not apply are missing."""
    true: list[Pair] = [(c["effect"], c["target"]) for c in truth["causes"]]
    found = pairs(result["causes"])
    sets = [frozenset((m["effect"], m["target"]) for m in one) for one in result["alternatives"]]
    out: dict[str, Any] = {"verdict": result["verdict"], "found": found, "true": true}
    out["unknown"] = result["verdict"] == "unknown"
    out["none"] = result["verdict"] == "none"
    out["first"] = bool(found) and bool(true) and found[0] in true
    named = frozenset(true) in sets or (len(true) == 1 and any(true[0] in s and len(s) == 1 for s in sets))
    out["exact"] = set(found) == set(true) and result["verdict"] == "identified"
    out["named"] = bool(true) and (out["exact"] or (result["verdict"] == "ambiguous" and named))
    out["first_or_class"] = bool(true) and (out["first"] or (result["verdict"] == "ambiguous" and named))
    out["single_member"] = result["verdict"] == "identified" and len(found) == 1
    out["alternatives"] = len(sets)
    inside, error = [], []
    for c in truth["causes"]:
        for got in result["causes"]:
            if (got["effect"], got["target"]) == (c["effect"], c["target"]):
                a, b = _covered(got, c["parameters"])
                inside, error = inside + a, error + b
    out["inside"], out["error"] = inside, error
    if found and true:
        out["probability"] = result["causes"][0].get("probability")
    if len(true) == 1 and true[0][1] is not None and result["where"].get("actuators"):
        shares = result["where"]["actuators"]
        out["actuator"] = max(shares, key=shares.get) == true[0][1]
    shrinkage = result.get("shrinkage")
    if shrinkage and shrinkage.get("before_rms_um"):
        kept = [r for r in truth["runs"] if r["name"] in shrinkage["holdout"]]
        noise = truth["noise_rms_um"]
        if kept:
            before = sum(r["effect_rms_um"] ** 2 + noise**2 for r in kept) ** 0.5
            after = sum(r["left_rms_um"] ** 2 + noise**2 for r in kept) ** 0.5
            out["oracle"] = 1 - after / before
            out["shrinkage"] = 1 - shrinkage["after_rms_um"] / shrinkage["before_rms_um"]
            if shrinkage.get("ci95"):
                low, high = shrinkage["ci95"]
                out["shrinkage_inside"] = bool(low <= out["oracle"] <= high)
    following = result.get("next_experiment")
    out["next"] = following["action"] if following else None
    return out
