"""What to measure next: candidates chosen one by one, and then exchanged, for their expected information.

Candidate i has rows X_i (c, k) of a linear model with amplitudes a ~ N(0, C) and noise of size 1. Some of them tell

    gain = 1/2 log2 det (I + C sum_i X_i' X_i)   bits.

Source: Fedorov, Theory of Optimal Experiments (1972).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from camcomp.ground.datatypes import Floats


@dataclass(frozen=True, eq=False)
class Design:
    """Candidates chosen, as indices, their information on all amplitudes (bits), and what stays uncertain (k, k)."""

    chosen: tuple[int, ...]
    gain: float
    covariance: Floats


def designed(X: Floats, covariance: Floats, count: int) -> Design:
    """`count` of n candidates with rows X (n, c, k) in units of the noise, under a prior covariance (k, k): exchanged one
    by one until a whole round tells no more.
    """
    root = np.linalg.cholesky(covariance)
    W, M = X @ root, np.eye(len(root))
    chosen: list[int] = []
    count, gain = min(count, len(X)), -1.0
    while gain < (gain := bits(M)):
        for _ in range(count):
            if len(chosen) == count:  # the first one is given back
                back = W[chosen.pop(0)]
                M -= back.T @ back
            spread = np.einsum("nik,kl,njl->nij", W, np.linalg.inv(M), W, optimize=True)
            value = np.linalg.slogdet(np.eye(X.shape[1]) + spread)[1]
            value[chosen] = -np.inf
            chosen.append(int(np.argmax(value)))
            M += W[chosen[-1]].T @ W[chosen[-1]]
    return Design(tuple(chosen), gain, root @ np.linalg.inv(M) @ root.T)


def bits(M: Floats) -> float:
    """Half the log2 det of a matrix (k, k): information that shrinks a covariance by it."""
    return 0.5 * float(np.linalg.slogdet(M)[1]) / float(np.log(2.0))
