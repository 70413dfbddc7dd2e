"""The experiments under samples/diagnosis, made by the truth machine: one clear, one ambiguous, one unknown."""

from __future__ import annotations

from pathlib import Path

from tests.validation.plants.causes import Cause
from tests.validation.plants.experiments import Plan, make, write

CONFIG = "../../../config/orthoglide.yaml"
PLANS = {
    "clear": Plan(412, (Cause("backlash", "y", 3),), (6.0,), "six", "all", samples=160),
    "ambiguous": Plan(103, (Cause("tool_length", None, 8022),), (8.0,), "four", "no-forces", samples=160),
    "unknown": Plan(655, (Cause("guide_straightness", "y", 8),), (6.0,), "six", "all", samples=160),
}


def make_all(folder: Path) -> dict[str, dict]:
    """Writes the three folders and returns the truth of each."""
    truths = {}
    for name, plan in PLANS.items():
        made = make(plan)
        write(made, plan, folder / name, CONFIG)
        truths[name] = made.record
    return truths
