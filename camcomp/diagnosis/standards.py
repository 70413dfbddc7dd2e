"""Values of ISO 230-2 from the runs of a diagnosis, where these hold what the standard asks for: stops at five targets or
more on a line that one axis drives, each approached five times from either side, without load.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass

import numpy as np

from camcomp.diagnosis.fit.bench import Run
from camcomp.diagnosis.result.standards import AxisPositioning, StandardValues
from camcomp.diagnosis.statistics.standard_values import positioning
from camcomp.ground.datatypes import Floats
from camcomp.model.motion.twin import Twin

TARGETS, APPROACHES = 5, 5  # ISO 230-2:2014, 5.3.2: at least
_STILL_MM = 1e-4  # between rows in which the axes stand
_SAME_MM = 1e-3  # between targets that are one
_ALONE = 1e-3  # largest share of an approach that other axes may make
NO_STOPS = "ISO 230-2: no axis without load stopped at five targets, approached five times from either side, with the tip measured"


@dataclass(frozen=True, eq=False)
class _Stop:
    """A stop at `target` (3,) mm behind an approach along one axis, forward or backward, with the tip `off` it, mm."""

    axis: int
    target: Floats
    forward: bool
    off: float


def of_runs(twin: Twin, runs: Sequence[Run]) -> StandardValues:
    """What runs with programs hold of ISO 230-2."""
    lines: dict[tuple[int, tuple[float, ...]], list[_Stop]] = {}
    for run in runs:
        path = run.run_path
        if run.turn is not None or np.any(path.row_force):
            continue
        told = twin.to_program(path.row_place.of(path.node_tip) if path.driven is None else path.driven.tip)
        for stop in stops(told, run.measured.tip):
            beside = np.delete(np.round(stop.target / _SAME_MM) * _SAME_MM, stop.axis)
            lines.setdefault((stop.axis, tuple(beside + 0.0)), []).append(stop)
    found = [each for (axis, beside), own in lines.items() if (each := _positioning(axis, beside, own)) is not None]
    return StandardValues(positioning=tuple(found), absent=() if found else (NO_STOPS,))


def stops(commanded: Floats, tip: Floats) -> Iterator[_Stop]:
    """Stops in rows (n, 3) mm behind approaches along one axis; of the rows at a stop the later half counts."""
    moved = np.diff(commanded, axis=0)
    still = np.concatenate(([False], (np.abs(moved) < _STILL_MM).all(axis=1), [False]))
    edges = np.flatnonzero(np.diff(still.astype(int)))
    for begin, end in zip(edges[::2], edges[1::2], strict=True):  # rows `begin` to `end` stand
        rows = slice((begin + end + 1) // 2, end + 1)
        if begin == 0 or not np.isfinite(tip[rows]).all():
            continue
        way = moved[begin - 1]
        axis = int(np.argmax(np.abs(way)))
        if np.delete(np.abs(way), axis).max() > _ALONE * abs(way[axis]):
            continue
        off = float(np.mean(tip[rows, axis] - commanded[rows, axis]))
        yield _Stop(axis, commanded[end], bool(way[axis] > 0.0), off)


def _positioning(axis: int, beside: Sequence[float], found: Sequence[_Stop]) -> AxisPositioning | None:
    """Values of a line, None where the standard asks for more."""
    by_target: dict[int, tuple[list[float], list[float]]] = {}
    for stop in found:
        ways = by_target.setdefault(round(float(stop.target[axis]) / _SAME_MM), ([], []))
        ways[not stop.forward].append(stop.off)
    whole = [ways for _, ways in sorted(by_target.items()) if min(map(len, ways)) >= APPROACHES]
    if len(whole) < TARGETS:
        return None
    values = positioning(*([np.array(ways[k]) for ways in whole] for k in (0, 1)))
    others = [name for k, name in enumerate("XYZ") if k != axis]
    return AxisPositioning(
        axis="XYZ"[axis],
        line=" ".join(f"{name}{value:g}" for name, value in zip(others, beside, strict=True)),
        targets=len(whole),
        approaches=min(len(way) for ways in whole for way in ways),
        **{f"{name}_um": round(1e3 * value, 3) for name, value in asdict(values).items()},
    )
