"""Fit the calibration maps of a kind of log on experiments of its generator, and store them with their seeds.

    python -m tests.validation calibrate poses|axes|programs ROWS.jsonl --count N

Experiments are answered with an empty map. ROWS.jsonl holds their scores, one JSON object a line; a second call goes on.
"""

from __future__ import annotations

import json
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from unittest import mock

import camcomp
from camcomp.diagnosis.arm.answer import POSES_MAP, UNKNOWN_MAP
from camcomp.diagnosis.model.calibration import CalibrationMap, fit_map
from tests.validation import scoring
from tests.validation.generators import FOR_GENERATORS
from tests.validation.recordings import recording

SHAPES = 50.0  # half widths: intervals of scanned shapes have next to no width, and no factor mends them
FIRST = 90_000  # development seeds; the bench draws its seeds from 10 000 000 on
STORED = Path(camcomp.__file__).parent / "data" / "calibration.json"


@dataclass(frozen=True)
class Kind:
    """Modules that ask for the map of a kind of log, its maps by whether something unmodelled was found, and its generator."""

    modules: tuple[str, ...]
    maps: tuple[tuple[str, tuple[bool, ...]], ...]
    make: Callable[[int, Path], object]


def _poses(seed: int, folder: Path) -> None:
    from tests.validation.poses.make import make

    make(seed, folder, None)


def _axes(seed: int, folder: Path) -> None:
    from tests.validation.axes.make import make

    make(seed, folder, None)


def _programs(seed: int, folder: Path) -> None:
    from tests.validation.parallel.__main__ import write
    from tests.validation.serial.make import make

    with recording.taken_from(FOR_GENERATORS[seed % len(FOR_GENERATORS)]):
        (make if seed % 2 else write)(seed, folder, None)


EITHER = (False, True)
KINDS = {
    "poses": Kind(("arm.answer",), ((POSES_MAP, (False,)), (UNKNOWN_MAP, (True,))), _poses),
    "axes": Kind(("axis.channel_fit",), (("axes", EITHER),), _axes),
    "programs": Kind(("search.cause_search", "diagnose"), (("programs", EITHER),), _programs),
}


def answered(kind: str, rows: Path, count: int, minutes: float | None = None) -> Iterator[dict]:
    """Score the first `count` development seeds that the file `rows` does not hold yet; one row each."""
    done = {int(row["name"].split("-")[1]) for row in _read(rows)}
    ends, known = time.monotonic() + 60 * minutes if minutes else float("inf"), scoring.library()
    with ExitStack() as empty:
        for name in KINDS[kind].modules:
            where = f"camcomp.diagnosis.{name}.calibration_of"
            empty.enter_context(mock.patch(where, lambda kind: CalibrationMap()))
        for seed in (FIRST + k for k in range(count) if FIRST + k not in done):
            if time.monotonic() > ends:
                return
            with tempfile.TemporaryDirectory() as place, rows.open("a") as out:
                folder = Path(place)
                KINDS[kind].make(seed, folder)
                truth = folder / "truth" / f"e-{seed}.json"
                row = scoring.trial((str(folder / f"e-{seed}"), str(truth), known))
                out.write(json.dumps(row) + "\n")
            yield row


def calibrate(kind: str, file: Path) -> dict:
    """The maps of a kind of log with the seeds that they were fitted on."""
    rows = {row["name"]: row for row in _read(file) if "failed" not in row}
    misses = [m for row in rows.values() for m in row.get("misses", ()) if m < SHAPES]
    out = {}
    for name, unknown in KINDS[kind].maps:
        own = [row for row in rows.values() if row["unknown"] in unknown]
        pairs = [pair for row in own for pair in row["calibration"] if pair[0]]
        found = fit_map([p for p, _ in pairs], [right for _, right in pairs], misses)
        out[name] = {
            "log_odds": [round(v, 3) for v in found.log_odds],
            "probability": [round(v, 4) for v in found.probability],
            "interval": found.interval,
            "seeds": sorted(int(row["name"].split("-")[1]) for row in own),
        }
    return out


def store(kind: str, file: Path) -> None:
    """Replace the maps of a kind of log in the package's calibration.json."""
    stored = json.loads(STORED.read_text()) | calibrate(kind, file)
    STORED.write_text(json.dumps(stored, indent=1) + "\n")


def _read(file: Path) -> list[dict]:
    return [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []
