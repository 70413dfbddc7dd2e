"""Make the cases, ask camcomp about each, score the answers.  The truth never enters the folder that camcomp reads."""

from __future__ import annotations

import json
import os
import tempfile
import time
from multiprocessing import get_context
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


def run(cases: list[Case], results: Path, processes: int = 2) -> list[dict[str, Any]]:
    """Runs the cases that `results` (JSON lines) does not hold yet and returns all rows."""
    rows: dict[str, dict[str, Any]] = {}
    if results.exists():
        for line in results.read_text().splitlines():
            row = json.loads(line)
            if "failed" not in row:
                rows[row["name"]] = row
    todo = [c for c in cases if c.name not in rows]
    os.environ.setdefault("NUMBA_NUM_THREADS", "1")
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # not concurrent.futures: in Python 3.11 its pool stands still when all workers have done their share at once
    with results.open("a") as out, get_context("spawn").Pool(processes, maxtasksperchild=200) as pool:
        for row in pool.imap_unordered(run_case, todo):
            rows[row["name"]] = row
            out.write(json.dumps(row) + "\n")
            out.flush()
    wanted = {c.name for c in cases}
    return [r for n, r in rows.items() if n in wanted]
