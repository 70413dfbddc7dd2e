"""Fit the calibration maps of a kind of log on experiments of its generator, and store them with their seeds.

    python -m tests.validation calibrate poses|axes|programs ROWS.jsonl --count N

Experiments are answered with an empty map. ROWS.jsonl holds their scores, one JSON object a line; a second call goes on.
"""

from __future__ import annotations

import json
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from unittest import mock

import numpy as np

import camcomp
from camcomp.diagnosis.arm.case import POSES_MAP, UNKNOWN_MAP
from camcomp.diagnosis.model.calibration import CalibrationMap
from tests.validation import scoring
from tests.validation.generators import FOR_GENERATORS
from tests.validation.recordings import recording

LEAST_PER_LEVEL = 20  # causes of one level of the map: a rate known to a tenth
MOST_LOG_ODDS = 20.0  # beyond it a posterior is as good as certain
BELOW = 8  # log odds: knots of the map where no experiment was, one each
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
    "poses": Kind(("arm.answer", "arm.case"), ((POSES_MAP, (False,)), (UNKNOWN_MAP, (True,))), _poses),
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


def fit_map(probability: Sequence[float], right: Sequence[bool], misses: Sequence[float]) -> CalibrationMap:
    """The map that makes stated probabilities come true: pool adjacent violators, levels of LEAST_PER_LEVEL and more (Zadrozny, Elkan, KDD 2002).

    misses: |value - truth| in half widths of 95 % intervals, of parameters that were named; their 95 % quantile is the
    factor on half widths.
    """
    p = np.clip(np.array(probability, float), 1e-12, 1.0 - 1e-12)
    odds = np.clip(np.log(p / (1.0 - p)), -MOST_LOG_ODDS, MOST_LOG_ODDS)
    order = np.argsort(odds, kind="stable")
    levels = [[odds[i], float(right[i]), 1.0] for i in order]
    pooled: list[list[float]] = []
    for level in levels:
        pooled.append(level)
        while len(pooled) > 1 and (
            pooled[-2][1] / pooled[-2][2] >= pooled[-1][1] / pooled[-1][2] or pooled[-2][2] < LEAST_PER_LEVEL
        ):
            last = pooled.pop()
            own = pooled[-1]
            weight = own[2] + last[2]
            pooled[-1] = [(own[0] * own[2] + last[0] * last[2]) / weight, own[1] + last[1], weight]
    knots = np.array([[o, (r + 0.5) / (n + 1.0)] for o, r, n in pooled])
    if knots[0, 0] > 0.0:  # below even odds nothing was seen: the posterior as it is, below the first level
        odds = np.linspace(-BELOW, 0.0, BELOW + 1)
        knots = np.vstack([np.column_stack([odds, 2.0 * min(knots[0, 1], 0.5) / (1.0 + np.exp(-odds))]), knots])
    factor = max(float(np.quantile(misses, 0.95)), 1.0) if len(misses) >= LEAST_PER_LEVEL else 1.0
    return CalibrationMap(
        tuple(knots[:, 0].tolist()), tuple(np.maximum.accumulate(knots[:, 1]).tolist()), round(factor, 3)
    )
