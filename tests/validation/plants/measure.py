"""Distance of the truth plant's cuts from the programmed path."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from tests.validation.plants.machine import State
from tests.validation.plants.motion import Timeline, read

JOINING = 1.0  # mm beside the end of a move: joining lines lead from one cutting force to the next there


def misses(state: State, program: str) -> np.ndarray:
    """Distances (n,) mm of the cut tips from the path of `program`; without those near the ends of its moves."""
    line = Timeline(read(program))
    dense = line.sample(np.linspace(0.0, line.log_end, 20_000))
    step = np.linalg.norm(np.diff(dense["tip"], axis=0), axis=1).max()
    ends = np.array([at for move in line.moves for at in (move.start, move.end)])
    cut = state.tip[state.cuts]
    cut = cut[cKDTree(ends).query(cut)[0] > JOINING]
    nearest = cKDTree(dense["tip"]).query(cut)[1]
    off, along = cut - dense["tip"][nearest], dense["along"][nearest]
    between = np.clip((off * along).sum(axis=1), -step, step)  # the path goes on between its samples
    return np.linalg.norm(off - between[:, None] * along, axis=1)


def path_error(state: State, program: str) -> float:
    """rms (mm) of `misses`."""
    return float(np.sqrt(np.mean(misses(state, program) ** 2)))
