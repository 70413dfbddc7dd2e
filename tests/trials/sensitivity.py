"""How much the answers of a diagnosis hang on its tuned constants: each halved and doubled on a fixed set of experiments.

The set is small on purpose (three short runs each): what is asked is which constants decide anything at all, and at which
size of a change, not what the rates are. `python -m tests.trials sensitivity` prints the column of camcomp/data/constants.md.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any

import camcomp
from tests.trials import score
from tests.trials.experiment import Plan, make, write

PACKAGE = Path(camcomp.__file__).parent
SHORT = {"runs": 3, "rows": 200, "stated": False, "rapids": True}
SET = (
    Plan(8101, "null", **SHORT),
    Plan(8102, "null", machine="router", **SHORT),
    Plan(8103, "imperfect", imperfect=True, **SHORT),
    Plan(8104, "single", (("backlash", "y"),), (1.0,), **SHORT),
    Plan(8105, "single", (("screw_pitch", "x"),), (3.0,), **SHORT),
    Plan(8106, "single", (("friction", "x"),), (10.0,), machine="router", **SHORT),
    Plan(8107, "single", (("joint_offset", "A2"),), (10.0,), machine="kuka-kr210", **SHORT),
    Plan(8108, "pair", (("servo_lag", None), ("cutting_force", None)), (3.0, 6.0), machine="delta", **SHORT),
    Plan(8109, "unknown", (("guide_bump", "x"),), (10.0,), **SHORT),
    Plan(8110, "unknown", (("disturbed_drive", "y"),), (3.0,), **SHORT),
)


def written(folder: Path) -> list[Path]:
    """The experiments of the fixed set below a folder."""
    out = []
    for plan in SET:
        there = folder / f"s-{plan.seed}"
        out.append(there / "experiment.yaml")
        if not out[-1].exists():
            write(make(plan), plan, there)
    return out


@contextmanager
def changed(module: str, name: str, factor: float) -> Iterator[None]:
    """The constant of a module below camcomp/diagnosis, there and wherever it is imported, `factor` times its value."""
    home = import_module(f"camcomp.diagnosis.{module}")
    usual = getattr(home, name)
    other = _times(usual, factor)
    places = [home, *(sys.modules[each] for each in _importers(f"camcomp.diagnosis.{module}", name))]
    for each in places:
        setattr(each, name, other)
    try:
        yield
    finally:
        for each in places:
            setattr(each, name, usual)


def _times(value: Any, factor: float) -> Any:
    if isinstance(value, tuple):
        return tuple(_times(each, factor) for each in value)
    return max(round(value * factor), 1) if isinstance(value, int) else value * factor


def _importers(module: str, name: str) -> list[str]:
    found = []
    for path in PACKAGE.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and node.module == module and name in {a.name for a in node.names}:
                found.append("camcomp." + ".".join(path.relative_to(PACKAGE).with_suffix("").parts))
    return [each for each in found if each in sys.modules]


def answer(experiment: Path) -> str:
    """What an answer comes to: verdict and causes."""
    result = score.ask(experiment)
    if "failed" in result:
        return "failed"
    causes = sorted(f"{c['effect']}({c['target']})" for c in result["causes"])
    return f"{result['verdict']} {' '.join(causes)}"


def differing(experiments: list[Path], usual: list[str], module: str, name: str) -> tuple[int, int]:
    """How many answers differ with the constant halved and doubled."""
    counts = []
    for factor in (0.5, 2.0):
        with changed(module, name, factor):
            counts.append(sum(answer(e) != u for e, u in zip(experiments, usual, strict=True)))
    return counts[0], counts[1]
