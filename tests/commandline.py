"""Runs camcomp as a user does, in a process of its own, and reads what it wrote."""

import csv
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parent.parent


def camcomp(*words, cwd=None, stdin=b""):
    """The finished process of one command line; output captured as bytes."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.run(
        [sys.executable, "-m", "camcomp", *map(str, words)],
        input=stdin,
        capture_output=True,
        cwd=cwd or ROOT,
        env=environment,
        timeout=300,
        check=False,
    )


def table(path):
    """Columns of a CSV file by name, float arrays; empty cells are NaN."""
    with open(path, newline="") as stream:
        rows = list(csv.DictReader(stream))
    return {name: np.array([float(row[name] or "nan") for row in rows]) for name in rows[0]}


def rms_um(residuals, kind):
    """Root mean square distance of a table of residuals, kind `gap` or `rest`."""
    return 1e3 * np.sqrt(np.nanmean(np.sum(residuals.array(*(f"{kind}_{axis}_mm" for axis in "xyz")) ** 2, axis=1)))


def compensated(folder, program, config, *more):
    """Outputs of one compensation: (process, joint table, paths table, summary, corrected program bytes)."""
    out = {key: folder / f"{key}" for key in ("out.nc", "joints.csv", "paths.csv", "summary.json")}
    configs = [word for each in ([config] if isinstance(config, str | Path) else config) for word in ("--config", each)]
    done = camcomp(
        "compensate", program, *configs, "-o", out["out.nc"], "--joints", out["joints.csv"],
        "--paths", out["paths.csv"], "--summary", out["summary.json"], *more,
    )  # fmt: skip
    if done.returncode not in (0, 1) or not out["out.nc"].exists():
        raise AssertionError(f"exit {done.returncode}: {done.stderr.decode()}")
    return (
        done,
        table(out["joints.csv"]),
        table(out["paths.csv"]),
        json.loads(out["summary.json"].read_text()),
        out["out.nc"].read_bytes(),
    )
