"""Spells of an arm's poses in which a joint may have been shifted: for each joint the stretch of time that explains most."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from camcomp.diagnosis.arm.poses import ArmBench, Column
from camcomp.diagnosis.model.folds import without_nuisances
from camcomp.diagnosis.model.noise import IN_A_ROW
from camcomp.diagnosis.model.window import best_window
from camcomp.ground import shelf
from camcomp.ground.datatypes import Floats
from camcomp.model.signal_path import fitted_parameters

EFFECT = "disturbance"


def temporary_offsets(
    bench: ArmBench, rest: Sequence[Floats], frames: Sequence[Floats], joints: Sequence[Floats]
) -> list[tuple[Column, float]]:
    """Columns, one per joint and campaign, each with the number of windows it is the best of.

    rest (n, 3) mm: what is left beside the nuisances frames (n, 3, 9). joints (n, 3, m): motion of the tip per rad (mm) of
    every joint.
    """
    module = shelf.load("effects", EFFECT)
    found: list[tuple[Column, float]] = []
    for k in bench.own:
        poses = bench.campaigns[k]
        order = np.argsort(poses.time, kind="stable")
        time = poses.time[order]
        n = len(order)
        if n < 3 * IN_A_ROW or not poses.has_clock:
            continue
        left = without_nuisances(rest[k], frames[k])[order]
        basis = np.linalg.qr(frames[k][order].reshape(3 * n, -1))[0].reshape(n, 3, -1)
        for a, drive in enumerate(bench.robot.actuators):
            _, begin, end = best_window(joints[k][order, :, a], left, basis, np.arange(n + 1), IN_A_ROW)
            if begin == end:
                continue
            edges = [_between(time, begin), _between(time, end)]
            names = ("from_s", "to_s")
            shape = tuple((name, *edge) for name, edge in zip(names, edges, strict=True))
            parameter = next(p for p in fitted_parameters(module, drive.revolute) if p.name.startswith("shift"))
            found.append((Column(EFFECT, drive.name, module, parameter, shape), 0.5 * n * n * len(bench.own)))
    return found


def _between(time: Floats, k: int) -> tuple[float, float, float]:
    """An instant between rows k - 1 and k, and where it may lie: one row further on either side."""
    before, after = time[max(k - 1, 0)], time[min(k, len(time) - 1)]
    margin = 1.0 if k in (0, len(time)) else 0.0
    value = 0.5 * (before + after) + (margin if k == len(time) else -margin)
    return float(value), float(time[max(k - 2, 0)] - margin), float(time[min(k + 1, len(time) - 1)] + margin)
