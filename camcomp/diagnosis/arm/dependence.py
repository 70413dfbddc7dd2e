"""What the leftover of an arm depends on: functions of one joint's angle, its torque, temperature, time.

Shares are of the energy that is predicted for groups of neighbouring poses that were left out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

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


def shares(
    patterns: Mapping[str, Sequence[Floats]], rest: Sequence[Floats], features: Sequence[Floats], noise: float
) -> list[tuple[str, float]]:
    """Covariates with their shares of the leftovers rest (n, 3) mm of every campaign, largest first.

    patterns: covariate -> per campaign (n, 3, p), in units in which an amplitude of 1 is usual. noise: mm per coordinate.
    """
    names = list(patterns)
    widths = [patterns[name][0].shape[2] for name in names]
    parts = []
    for k, r in enumerate(rest):
        F = np.concatenate([patterns[name][k] for name in names], axis=2)
        group = regions(features[k], max(len(r) // NEIGHBOURS, FOLDS))
        parts.append((F, r, group % FOLDS))
    p = sum(widths)
    A, b = np.zeros((FOLDS, p, p)), np.zeros((FOLDS, p))
    for F, r, fold in parts:
        for i in range(FOLDS):
            D = F[fold == i].reshape(-1, p)
            A[i] += D.T @ D
            b[i] += D.T @ r[fold == i].ravel()
    predicted = [np.zeros((len(r), 3, len(names))) for _, r, _ in parts]
    ends = np.cumsum([0, *widths])
    for i in range(FOLDS):
        M = A.sum(axis=0) - A[i] + noise**2 * np.eye(p)
        amplitude = np.linalg.solve(M, b.sum(axis=0) - b[i])
        for (F, _, fold), out in zip(parts, predicted, strict=True):
            for j in range(len(names)):
                s = slice(ends[j], ends[j + 1])
                out[fold == i, :, j] = F[fold == i][:, :, s] @ amplitude[s]
    whole = sum(float((r**2).sum()) for _, r, _ in parts)
    left = sum(float(((r - out.sum(axis=2)) ** 2).sum()) for (_, r, _), out in zip(parts, predicted, strict=True))
    explained = max(1.0 - left / whole, 0.0) if whole > 0 else 0.0
    energy = np.array([sum(float((out[:, :, j] ** 2).sum()) for out in predicted) for j in range(len(names))])
    split = energy / max(float(energy.sum()), 1e-300)
    return sorted(
        ((name, explained * float(s)) for name, s in zip(names, split, strict=True)), key=lambda each: -each[1]
    )
