"""Make a case, ask camcomp about it, score the answer.  The truth never enters the folder that camcomp reads."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path
from typing import Any

from tests.validation.orthoglide import absorb
from tests.validation.orthoglide.cases import Case
from tests.validation.orthoglide.score import score
from tests.validation.plants.experiments import make, write
from tests.validation.runner import CONFIG, ask


def run_case(case: Case) -> dict[str, Any]:
    """Makes, asks and scores one case."""
    row: dict[str, Any] = {"name": case.name, "category": case.category, "ratio": case.ratio}
    row |= {"design": case.plan.design, "channels": case.plan.channels}
    with tempfile.TemporaryDirectory() as folder:
        made = make(case.plan)
        path = write(made, case.plan, Path(folder) / "experiment", CONFIG)
        begin = time.perf_counter()
        try:
            result = ask(path, case.without)
        except Exception as error:  # noqa: BLE001 - a crash is a result too: it is counted, not hidden
            return row | {"failed": f"{type(error).__name__}: {error}"[:500]}
        row["seconds"] = time.perf_counter() - begin
    row |= score(result, made.record)
    if case.category in ("foreign", "withheld"):
        row["left"] = absorb.left(case.plan.causes[0], case.plan, case.without)
    return row
