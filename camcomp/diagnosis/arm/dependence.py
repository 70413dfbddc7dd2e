"""What the leftover of an arm depends on: functions of one joint's angle, its torque, temperature, time.

Shares are of the energy that is predicted for groups of neighbouring poses that were left out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from camcomp.diagnosis.arm.discrepancy import regions
from camcomp.ground.datatypes import Floats

HARMONICS = 40  # per turn: gears and encoders repeat 1 to some 40 times
AMPLITUDE = 3e-4  # rad
FOLDS = 5
NEIGHBOURS = 20  # poses per group


def turns(joint: Floats, angle: Floats) -> Floats:
    """Motion (n, 3, 2 HARMONICS) of tips by a joint error that repeats with the joint's angle (n,). joint (n, 3): mm/rad."""
    k = np.arange(1, HARMONICS + 1) * angle[:, None]
    waves = np.concatenate([np.sin(k), np.cos(k)], axis=1)
    out: Floats = AMPLITUDE * joint[:, :, None] * waves[:, None, :]
    return out


@dataclass(frozen=True)
class Dependence:
    """A covariate, the share of a leftover's energy that it predicts, and log10 of the chance that noise looks alike."""

    covariate: str
    share: float
    log10_chance: float


def dependences(
    patterns: Mapping[str, Sequence[Floats]], rest: Sequence[Floats], features: Sequence[Floats]
) -> list[Dependence]:
    """What every covariate alone predicts of the leftovers rest (n, 3) mm of every block.

    patterns: covariate -> per block (n, 3, p). Groups of neighbouring poses are withheld in turn, and their gains compared:
    Student's t of their mean.
    """
    split = [regions(f, max(len(r) // NEIGHBOURS, 2 * FOLDS)) for f, r in zip(features, rest, strict=True)]
    whole = sum(float((r**2).sum()) for r in rest)
    return [_predicted(name, parts, rest, split, whole) for name, parts in patterns.items()] if whole > 0.0 else []


def _predicted(
    name: str, parts: Sequence[Floats], rest: Sequence[Floats], split: Sequence[np.ndarray], whole: float
) -> Dependence:
    p = parts[0].shape[2]
    A, b = np.zeros((FOLDS, p, p)), np.zeros((FOLDS, p))
    for F, r, group in zip(parts, rest, split, strict=True):
        for i in range(FOLDS):
            D = F[group % FOLDS == i].reshape(-1, p)
            A[i] += D.T @ D
            b[i] += D.T @ r[group % FOLDS == i].ravel()
    # the pattern may be as large as the leftover, no coefficient more than another
    ridge = max(float(np.trace(A.sum(axis=0))), 1e-300) * np.eye(p)
    rows = sum(r.size for r in rest)
    gains = []
    coefficient = [np.linalg.solve(A.sum(axis=0) - A[i] + ridge / rows, b.sum(axis=0) - b[i]) for i in range(FOLDS)]
    for F, r, group in zip(parts, rest, split, strict=True):
        left = r.copy()
        for i in range(FOLDS):
            on = group % FOLDS == i
            left[on] -= F[on] @ coefficient[i]
        gain = (r**2).sum(axis=1) - (left**2).sum(axis=1)
        gains += [float(gain[group == g].sum()) for g in np.unique(group)]
    every = np.array(gains)
    spread = float(every.std(ddof=1)) / np.sqrt(len(every)) if len(every) > 1 else 0.0
    chance = float(student.logsf(every.mean() / spread, len(every) - 1) / np.log(10.0)) if spread > 0.0 else 0.0
    return Dependence(name, max(float(every.sum()) / whole, 0.0), chance)
