"""`python -m tests.validation.poses.calibrate ROWS.jsonl...`: fit the calibration maps of static poses and store them.

ROWS: scored experiments, one JSON object a line (`tests.validation.scoring.run`), answered with an empty calibration.json. A
later row of the same experiment replaces the earlier one.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import camcomp
from camcomp.diagnosis.arm.answer import BESIDE_MAP, POSES_MAP
from camcomp.diagnosis.model.calibration import fit_map

SHAPES = 50.0  # half widths: intervals of scanned shapes have next to no width, and no factor mends them
STORED = Path(camcomp.__file__).parent / "data" / "calibration.json"


def calibrate(files: list[str]) -> dict:
    """The maps of causes with nothing unmodelled, and beside something unmodelled, with the seeds they were fitted on."""
    rows = {}
    for file in files:
        for line in Path(file).read_text().splitlines():
            row = json.loads(line)
            rows[row["name"]] = row
    misses = [m for row in rows.values() for m in row.get("misses", ()) if m < SHAPES]
    out = {}
    for kind, unknown in ((POSES_MAP, False), (BESIDE_MAP, True)):
        own = [row for row in rows.values() if "failed" not in row and row["unknown"] == unknown]
        pairs = [pair for row in own for pair in row["calibration"] if pair[0]]
        found = fit_map([p for p, _ in pairs], [right for _, right in pairs], misses)
        seeds = sorted(int(row["name"].split("-")[1]) for row in own)
        out[kind] = {
            "log_odds": [round(v, 3) for v in found.log_odds],
            "probability": [round(v, 4) for v in found.probability],
            "interval": found.interval,
            "seeds": seeds,
        }
    return out


if __name__ == "__main__":
    stored = json.loads(STORED.read_text()) | calibrate(sys.argv[1:])
    STORED.write_text(json.dumps(stored, indent=1) + "\n")
