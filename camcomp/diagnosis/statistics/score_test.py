"""What do functions of a covariate explain of a residual, with causes free and every healthy tolerance allowed for?

The covariates' functions enter by their normal equations, causes and tolerances integrated out. Their joint size is compared
with what chance makes of it (Rao's score test), and their evidence at a scale is that of model/discrepancy.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.linalg import block_diag

from camcomp.diagnosis.statistics.evidence import Prior, posterior
from camcomp.diagnosis.statistics.normal_equations import NormalEquations
from camcomp.ground.datatypes import Floats, Ints

Shares = tuple[tuple[str, float], ...]  # covariates with the share that each carries alone, largest first


def products_of_effect(
    joint: NormalEquations, prior: Prior, members: Sequence[int], own: Sequence[int], theta: Floats
) -> Floats:
    """Products (1 + p, 1 + p) of a cause with columns `own` at coordinates theta (d,), and of the patterns behind the columns of a
    prior (k,), with the columns `members` free and all others within tolerance.
    """
    patterns = np.arange(len(prior.tolerance), len(joint.b))
    gram, _ = posterior(joint, prior, members, own).blocks_without([np.append(own, patterns)])[0]
    effect = block_diag(theta[:, None], np.eye(len(patterns)))
    return np.asarray(effect.T @ gram @ effect)


def score_test(P: Floats, h: Floats, labels: Sequence[str], kinds: Sequence[str]) -> dict[str, Shares]:
    """Shares of the energy beyond chance of the patterns of every kind of channel, the kind with most of it first.

    P (p, p), h (p,): normal equations with all else integrated out; labels, kinds (p,): covariate of every pattern, and kind of the channel that it moves.
    """
    found = []
    for kind in dict.fromkeys(kinds):
        mine = np.flatnonzero(np.array(kinds) == kind)
        own, b = P[np.ix_(mine, mine)], h[mine]
        found.append(
            (explained(own, b, np.arange(len(mine))), kind, _shares(own, b, [labels[i] for i in mine.tolist()]))
        )
    return {kind: shares for _, kind, shares in sorted(found, key=lambda each: -each[0])}


def explained(P: Floats, h: Floats, index: Ints) -> float:
    """Energy beyond chance, in units of the noise, of some patterns."""
    if not len(index):
        return 0.0
    size = np.sqrt(np.maximum(np.diag(P)[index], 1e-30))
    g = h[index] / size
    amount, _, freedom, _ = np.linalg.lstsq(P[np.ix_(index, index)] / size[:, None] / size, g, rcond=1e-3)
    return max(float(g @ amount) - int(freedom), 0.0)


def _shares(P: Floats, h: Floats, labels: Sequence[str]) -> Shares:
    """Energy that the patterns of one covariate carry alone, per covariate, as shares of the largest sum."""
    every = np.array(labels)
    energy = {name: explained(P, h, np.flatnonzero(every == name)) for name in dict.fromkeys(labels)}
    whole = explained(P, h, np.arange(len(labels)))
    if whole <= 0.0:
        return ()
    ranked = sorted(energy.items(), key=lambda each: -each[1])
    return tuple((name, min(value / whole, 1.0)) for name, value in ranked if value > 0.0)
