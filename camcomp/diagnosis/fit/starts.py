"""Which rows are uncertain because lost motion and guides start in an unknown state?

Until an actuator has moved, its carriage may be at either side of its play. The same holds after motions that the log
lacks. Where the unknown state lasts for some rows it is a nuisance; where it lasts for one row, that row gets a large
standard deviation.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from camcomp.diagnosis.model.noise import IN_A_ROW
from camcomp.diagnosis.statistics.noise_model import BLOCK
from camcomp.ground.datatypes import Bools, Floats
from camcomp.model.seams import missing_rows

if TYPE_CHECKING:
    from camcomp.diagnosis.fit.bench import Bench

Nuisance = tuple[str, float, list[Floats]]  # name, size, column (n, c) per run
STOOD_MM = 5e-3  # by which what stands may move from row to row: a digit of its encoder
STANDING_MM_PER_S = 0.05  # below which a tip has no direction of its own
START_MM = 0.1  # by which an actuator has to move before its play is taken up: play and guides as bad as they come
START_N = 1000.0  # how hard its guide may hold its carriage until then
ALWAYS = 0.2  # of a run: what moves for less of it hardly ever moves
SWING_S = 0.03  # times the speed with which a log begins: how far a loop may then stand from where it is told
SWINGS_S = 0.06  # in which that dies away: loops of 5 to 60 Hz as they are tuned


def start_columns(bench: Bench, only: Callable[[int, Floats], list[Floats]]) -> list[Nuisance]:
    """One column per run and actuator for the rows before it has moved, where there are enough of them, and one for the force
    with which its guide holds it: name, size, column per run (as `only` makes it of all rows of one run).
    """
    found = list[Nuisance]()
    for r, run in enumerate(bench.runs):
        if not run.run_path.ordered:
            continue
        for j, a in enumerate(bench.actuators):
            lever = bench.levers[j]
            still = _standing(lever * run.run_path.row_rho[:, j])[0]
            if still.sum() <= 1:
                continue
            shift = np.zeros_like(bench.observed(r))
            shift[:, :3] = bench.turned(r, bench.row_slopes[r][:, :, j] * still[:, None])
            begins = still.mean() < 1.0 - ALWAYS
            width = START_MM if begins else STOOD_MM
            found.append((f"start.{run.name}.{a}", width / lever, only(r, shift)))
            if begins and run.measured.has("drive"):
                held = np.zeros_like(shift)
                held[:, bench.parts["drive"]][:, j] = still
                found.append((f"held.{run.name}.{a}", START_N * lever, only(r, held)))
    return found


def unknown_starts(bench: Bench, k: int) -> Floats:
    """Standard deviations (n, c) of single rows of run k by the unknown motion of its actuators before them.

    These are the first row and rows after missing ones at which an actuator reverses, up to the row at which its play
    is taken up; for encoders, rows until the loop has settled.
    """
    out, path = np.zeros_like(bench.observed(k)), bench.runs[k].run_path
    if not path.ordered or len(path.time) < 3:
        return out
    out[:, bench.parts["encoder"]] = _swing(path.time, path.row_rho)
    behind = np.flatnonzero(missing_rows(path.time)) + 1
    behind = behind[behind < len(path.time) - 1]
    for j, lever in enumerate(bench.levers):
        rho = lever * path.row_rho[:, j]
        turned = behind[(rho[behind] - rho[behind - 1]) * (rho[behind + 1] - rho[behind]) <= 0.0]
        rows: list[int] = []
        for i in (0, *turned):
            standing, under_way = _standing(rho[i:])
            short = standing.sum() <= 1
            rows += [i] if short else []
            rows += (i + np.flatnonzero(under_way)).tolist() if short or i == 0 else []
        unknown = np.zeros(len(path.time))
        unknown[rows] = START_MM / lever
        out[:, :3] = np.hypot(out[:, :3], bench.turned(k, bench.row_slopes[k][:, :, j] * unknown[:, None]))
        out[rows, bench.parts["drive"].start + j] = START_N * lever
    return out


def _swing(time: Floats, rho: Floats) -> Floats:
    """How far (n, m) loops at rho (n, m) may swing that came in motion to the first row, or to one behind many missing ones."""
    out, step = np.zeros_like(rho), np.diff(time)
    for i in (0, *np.flatnonzero(step > IN_A_ROW * float(np.median(step))) + 1):
        if i + 2 < len(time) and step[i] > 0.0 and step[i + 1] > 0.0:
            first, second = (rho[i + 1] - rho[i]) / step[i], (rho[i + 2] - rho[i + 1]) / step[i + 1]
            speed = np.abs(
                first - 0.5 * (second - first)
            )  # at the row itself: none where the rows show how it speeds up
            since = time[i:] - time[i]
            out[i:] = np.hypot(out[i:], SWING_S * speed * np.exp(-since / SWINGS_S)[:, None])
    return out


def _standing(rho: Floats) -> tuple[Bools, Bools]:
    """Rows (n,) in which an actuator at rho (n,) mm has its play not yet taken up: those with one common state, and those on its way.

    On its way its carriage begins to follow at an unknown point. Where that takes more than a BLOCK of rows they share one
    state: the way from one to the next is short.
    """
    moved = np.maximum.accumulate(np.abs(rho - rho[0]))
    still = moved < START_MM
    under_way = still & (moved > STOOD_MM)
    if under_way.sum() > BLOCK:
        under_way = np.zeros(len(rho), bool)
    return np.asarray(still & ~under_way), under_way
