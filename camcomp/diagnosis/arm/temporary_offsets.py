"""Spells of an arm's poses in which a joint may have been shifted: for each joint the stretch of time that explains most."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from camcomp.diagnosis.arm.poses import ArmBench, Column
from camcomp.diagnosis.model.candidates import PlacedCause
from camcomp.diagnosis.model.folds import without_nuisances
from camcomp.ground import shelf
from camcomp.ground.datatypes import Floats

EFFECT = "disturbance"
SHORTEST = 4  # poses: fewer are outliers
LONGEST = 0.7  # of a campaign's poses: a temporary offset lasts at most so long
LEAST_FREE = 0.02  # of a temporary offset's squares that frames have to leave
STEP = 256  # begins that are looked at together


def temporary_offsets(
    bench: ArmBench, rest: Sequence[Floats], frames: Sequence[Floats], joints: Sequence[Floats], first: int
) -> tuple[list[Column], list[PlacedCause]]:  # fmt: skip
    """Columns and candidates, one per joint and campaign. rest (n, 3) mm: what is left beside the nuisances frames (n, 3, 9).

    joints (n, 3, m): motion of the tip per rad (mm) of every joint; first: index of the first of these columns.
    """
    module = shelf.load("effects", EFFECT)
    columns: list[Column] = []
    found: list[PlacedCause] = []
    for k in bench.own:
        poses = bench.campaigns[k]
        order = np.argsort(poses.time, kind="stable")
        time = poses.time[order]
        n = len(order)
        if n < 3 * SHORTEST or not poses.has_clock:
            continue
        left = without_nuisances(rest[k], frames[k])[order]
        for a, drive in enumerate(bench.robot.actuators):
            begin, end = _window(joints[k][order, :, a], left, frames[k][order])
            if begin == end:
                continue
            edges = [_between(time, begin), _between(time, end)]
            names = ("from_s", "to_s")
            shape = tuple((name, *edge) for name, edge in zip(names, edges, strict=True))
            own = getattr(module, "ROTARY", module.PARAMETERS) if drive.revolute else module.FITTED
            parameter = next(p for p in own if p.name.startswith("shift"))
            columns.append(Column(EFFECT, drive.name, module, parameter, shape))
            found.append(PlacedCause(EFFECT, drive.name, (first + len(found),), 0.5 * n * n * len(bench.own)))
    return columns, found


def _between(time: Floats, k: int) -> tuple[float, float, float]:
    """An instant between rows k - 1 and k, and where it may lie: one row further on either side."""
    before, after = time[max(k - 1, 0)], time[min(k, len(time) - 1)]
    margin = 1.0 if k in (0, len(time)) else 0.0
    value = 0.5 * (before + after) + (margin if k == len(time) else -margin)
    return float(value), float(time[max(k - 2, 0)] - margin), float(time[min(k + 1, len(time) - 1)] + margin)


def _window(joint: Floats, left: Floats, frame: Floats) -> tuple[int, int]:
    """First row and end row of the temporary offset that reduces the squares of left (n, 3) most, the frames fitted
    jointly.
    """
    n = len(left)
    Q = np.linalg.qr(frame.reshape(-1, frame.shape[2]))[0].reshape(n, 3, -1)
    said = np.concatenate([[0.0], np.cumsum((joint * left).sum(axis=1))])
    size = np.concatenate([[0.0], np.cumsum((joint**2).sum(axis=1))])
    taken = np.concatenate([np.zeros((1, Q.shape[2])), np.cumsum(np.einsum("ni,nik->nk", joint, Q), axis=0)])
    best, found = 0.0, (0, 0)
    ends = np.arange(n + 1)
    for start in range(0, n, STEP):
        begin = np.arange(start, min(start + STEP, n))
        rows = ends[None, :] - begin[:, None]
        free = size[None, :] - size[begin, None] - ((taken[None, :] - taken[begin, None]) ** 2).sum(axis=2)
        whole = size[None, :] - size[begin, None]
        good = (rows >= SHORTEST) & (rows <= LONGEST * n) & (free > LEAST_FREE * whole)
        gain = np.where(good, (said[None, :] - said[begin, None]) ** 2 / np.where(good, free, 1.0), 0.0)
        i, j = np.unravel_index(int(np.argmax(gain)), gain.shape)
        if gain[i, j] > best:
            best, found = float(gain[i, j]), (int(begin[i]), int(j))
    return found
