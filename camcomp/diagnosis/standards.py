"""Which values of ISO 230-2 and ISO 230-4 do the runs of a diagnosis give?

ISO 230-2 needs at least five unloaded stops on a line of one axis, each approached five times from either side. ISO
230-4 needs whole circles.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from camcomp.diagnosis.circles import Turn, points, turns_of
from camcomp.diagnosis.fit.bench import Run
from camcomp.diagnosis.model.noise import REPEATABILITY_MM
from camcomp.diagnosis.result.standards import AxisPositioning, CircularTest, CircularTurn, StandardValues
from camcomp.diagnosis.statistics.standard_values import circular_deviation, positioning
from camcomp.ground.datatypes import Floats
from camcomp.model.motion.twin import Twin

LEAST = 5  # targets, and approaches of each from either side: ISO 230-2:2014, 5.3.2
_STILL_MM = 1e-4  # between rows in which the axes stand
_ALONE = 1e-3  # largest share of an approach that other axes may make
NO_STOPS = "ISO 230-2: no axis without load stopped at five targets, approached five times from either side, with the tip measured"
NO_CIRCLES = (
    "ISO 230-4: no program drove a whole circle with the tip measured in X, Y and Z and the motion known beside it"
)


@dataclass(frozen=True, eq=False)
class _Stop:
    """A stop at `target` (3,) mm behind an approach along one axis, forward or backward, with the tip `off` it, mm."""

    axis: int
    target: Floats
    forward: bool
    off: float


def of_runs(twin: Twin, runs: Sequence[Run]) -> StandardValues:
    """What runs with programs hold of ISO 230-2 and ISO 230-4."""
    lines: dict[tuple[int, tuple[float, ...]], list[_Stop]] = {}
    rounds: dict[tuple[str, bool], list[tuple[CircularTurn, Floats]]] = {}
    for run in runs:
        path, tip = run.run_path, run.measured.tip
        if run.turn is not None:
            continue
        told = run.commanded(twin)
        loaded = bool(np.any(path.row_force))
        if run.program is not None:
            for turn in turns_of(run.program, told, tip):
                rounds.setdefault((turn.circle.name, loaded), []).append(_circular_turn(run.name, turn, tip))
        if loaded:
            continue
        for stop in stops(told, tip):
            beside = np.delete(np.round(stop.target / REPEATABILITY_MM) * REPEATABILITY_MM, stop.axis)
            lines.setdefault((stop.axis, tuple(beside + 0.0)), []).append(stop)
    found = [each for (axis, beside), own in lines.items() if (each := _positioning(axis, beside, own)) is not None]
    circles = tuple(_circular_test(name, loaded, own) for (name, loaded), own in rounds.items())
    absent = ((NO_STOPS,) if not found else ()) + ((NO_CIRCLES,) if not circles else ())
    return StandardValues(positioning=tuple(found), circles=circles, absent=absent)


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


def _circular_turn(run: str, turn: Turn, tip: Floats) -> tuple[CircularTurn, Floats]:
    """Values of a circle in one direction in one run, and its points (360, 2) mm."""
    off = turn.off(tip)
    shape = points(turn.circle, off)
    size = _um(1e3 * circular_deviation([shape]))
    return CircularTurn(run=run, direction=turn.way, G_um=size, F_max_um=_um(off.max()), F_min_um=_um(off.min())), shape


def _circular_test(circle: str, loaded: bool, rounds: Sequence[tuple[CircularTurn, Floats]]) -> CircularTest:
    """Values of a circle that was driven under one load."""
    turns, shapes = zip(*rounds, strict=True)
    both = _um(1e3 * circular_deviation(shapes)) if len({turn.direction for turn in turns}) == 2 else None
    return CircularTest(circle=circle, cutting=loaded, turns=turns, G_both_um=both)


def _um(value: float) -> float:
    return round(float(value), 3)


def _positioning(axis: int, beside: Sequence[float], found: Sequence[_Stop]) -> AxisPositioning | None:
    """Values of a line, None where the standard asks for more."""
    by_target: dict[int, tuple[list[float], list[float]]] = {}
    for stop in found:
        ways = by_target.setdefault(round(float(stop.target[axis]) / REPEATABILITY_MM), ([], []))
        ways[not stop.forward].append(stop.off)
    whole = [ways for _, ways in sorted(by_target.items()) if min(map(len, ways)) >= LEAST]
    if len(whole) < LEAST:
        return None
    values = positioning(*([np.array(ways[k]) for ways in whole] for k in (0, 1)))
    others = [name for k, name in enumerate("XYZ") if k != axis]
    return AxisPositioning(
        axis="XYZ"[axis],
        line=" ".join(f"{name}{value:g}" for name, value in zip(others, beside, strict=True)),
        targets=len(whole),
        approaches=min(len(way) for ways in whole for way in ways),
        **{f"{name}_um": _um(1e3 * value) for name, value in values.items()},
    )
