"""Fit the calibration maps of static poses on experiments of the generator, and store them with their seeds.

    python -m tests.validation calibrate ROWS.jsonl --count N

Experiments are answered with an empty map. ROWS.jsonl holds their scores, one JSON object a line; a second call goes on.
"""

from __future__ import annotations

import json
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import camcomp
from camcomp.diagnosis.arm import answer
from camcomp.diagnosis.model.calibration import CalibrationMap, fit_map
from tests.validation import scoring
from tests.validation.poses.make import make

SHAPES = 50.0  # half widths: intervals of scanned shapes have next to no width, and no factor mends them
FIRST = 90_000  # development seeds; the bench draws its seeds from 10 000 000 on
STORED = Path(camcomp.__file__).parent / "data" / "calibration.json"


def answered(rows: Path, count: int, minutes: float | None = None) -> Iterator[dict]:
    """Score the first `count` development seeds that the file `rows` does not hold yet; one row each."""
    seeds = [FIRST + k for k in range(count)]
    done = {int(row["name"].split("-")[1]) for row in _read(rows)}
    ends, known = time.monotonic() + 60 * minutes if minutes else float("inf"), scoring.library()
    stored, answer.calibration_of = answer.calibration_of, lambda kind: CalibrationMap()
    try:
        for seed in (each for each in seeds if each not in done):
            if time.monotonic() > ends:
                return
            with tempfile.TemporaryDirectory() as place, rows.open("a") as out:
                folder = Path(place)
                make(seed, folder, None)
                truth = folder / "truth" / f"e-{seed}.json"
                row = scoring.trial((str(folder / f"e-{seed}"), str(truth), known))
                out.write(json.dumps(row) + "\n")
            yield row
    finally:
        answer.calibration_of = stored


def calibrate(file: Path) -> dict:
    """The maps of causes without and with an unmodelled effect, with the seeds they were fitted on."""
    rows = {row["name"]: row for row in _read(file) if "failed" not in row}
    misses = [m for row in rows.values() for m in row.get("misses", ()) if m < SHAPES]
    out = {}
    for kind, unknown in ((answer.POSES_MAP, False), (answer.UNKNOWN_MAP, True)):
        own = [row for row in rows.values() if row["unknown"] == unknown]
        pairs = [pair for row in own for pair in row["calibration"] if pair[0]]
        found = fit_map([p for p, _ in pairs], [right for _, right in pairs], misses)
        out[kind] = {
            "log_odds": [round(v, 3) for v in found.log_odds],
            "probability": [round(v, 4) for v in found.probability],
            "interval": found.interval,
            "seeds": sorted(int(row["name"].split("-")[1]) for row in own),
        }
    return out


def store(file: Path) -> None:
    """Replace the maps of static poses in the package's calibration.json."""
    stored = json.loads(STORED.read_text()) | calibrate(file)
    STORED.write_text(json.dumps(stored, indent=1) + "\n")


def _read(file: Path) -> list[dict]:
    return [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []
