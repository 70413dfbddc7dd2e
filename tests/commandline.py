"""Runs camcomp's command line and reads its output."""

import csv
import io
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from camcomp.ground import notes
from camcomp.terminal.cli import run

ROOT = Path(__file__).parent.parent


@dataclass
class Ended:
    """How a command line ended: exit code, output and messages."""

    returncode: int
    stdout: bytes
    stderr: bytes


def camcomp(*words, cwd=None, stdin=b"", together=False):
    """Run one command line in this process, which saves the start of another one, with standard streams of its own.

    together: messages are part of the output, in the order of writing.
    """
    streams = {name: io.TextIOWrapper(io.BytesIO(), "utf-8", write_through=True) for name in ("stdout", "stderr")}
    if together:
        streams["stderr"] = streams["stdout"]
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(cwd or ROOT)
        patch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(stdin), "utf-8"))
        for name, stream in streams.items():
            patch.setattr(f"sys.{name}", stream)
        patch.setattr(notes, "_told", set())
        code = run([str(each) for each in words])
    return Ended(code, **{name: stream.buffer.getvalue() for name, stream in streams.items()})


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
