"""Whether the interval of the shrinkage contains that of one more run: every run is held out once, with its causes.

The interval is of an experiment that never had the run, what it has to hold of the same experiment with the run named as `holdout`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

from tests.validation.scoring import Row, ask


def runs_left_out(folder: Path) -> list[Row]:
    """One row per run of the experiment in a folder: its name, interval and value; nothing where nothing was named."""
    path = folder / "experiment.yaml"
    whole: dict[str, Any] = yaml.safe_load(path.read_text())
    rows: list[Row] = []
    for run in whole["runs"]:
        name, less = run["name"], [each for each in whole["runs"] if each is not run]
        foretold, shown = (_asked(folder, {**whole, **change}) for change in ({"runs": less}, {"holdout": [name]}))
        row: Row = {"name": folder.name, "run": name}
        if any("failed" in each for each in (foretold, shown)):
            row["failed"] = foretold.get("failed") or shown.get("failed")
        elif foretold["shrinkage"] and shown["shrinkage"] and foretold["shrinkage"]["steps"]:
            low, high = foretold["shrinkage"]["ci95"]
            row |= {"low": low, "high": high, "ratio": shown["shrinkage"]["ratio"]}
        rows.append(row)
    return rows


def _asked(folder: Path, experiment: dict[str, Any]) -> Row:
    """The answer to an experiment with the files of a folder, which stays as it is."""
    path = folder / "left-out.yaml"
    path.write_text(yaml.safe_dump(experiment))
    try:
        return ask(path)
    finally:
        path.unlink()
