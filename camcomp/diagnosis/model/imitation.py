"""How probable is a cause where something unmodelled acts for certain, which may do what the cause seems to do?

Functions f = B w of one covariate, w ~ N(0, s^2), leave an excess residual of size U beside all that was fitted. A part of
size C of a cause's effect is nothing that the other columns explain. With e its direction, and B_o = (I - e e') B,

    without the cause:   C ~ U rho t_nu,      rho^2 = |B'e|^2 / tr L,      nu = (tr L)^2 / tr L^2,      L = B_o' B_o
    with the cause:      C ~ N(0, slab^2 + rho^2 U^2),

for the scale s is not known but by U. A cause that explains many times what is unmodelled is sure, one that explains as
much is not.

Source: Brynjarsdottir, O'Hagan, Inverse Problems 30 (2014) 114007; Gelman et al., Bayesian Data Analysis, section 3.2.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.special import expit, logsumexp
from scipy.stats import norm, t

from camcomp.diagnosis.model.evidence import WIDTHS
from camcomp.ground.datatypes import Floats


def products_across(effect: Floats, others: Floats, functions: Floats, noise: float) -> Floats:
    """Products (1 + q, 1 + q) of what columns leave of an effect and of functions.

    Args:
        effect: (n,) what a cause adds to a channel.
        others: (n, k) columns of all else that was fitted, per standard deviation of their amplitudes before the data.
        functions: (n, q) of one covariate.
        noise: standard deviation of a row that counts as one of its own.
    """
    M = others.T @ others + noise**2 * np.eye(others.shape[1])
    X = np.column_stack([effect, functions])
    X = X - others @ np.linalg.solve(M, others.T @ X)
    return np.asarray(X.T @ X)


def probability_with_unmodelled(
    whole: float,
    functions: Mapping[str, tuple[float, Floats]],
    *,
    rows: float,
    excess: float,
    floor: float,
    odds: float,
) -> float:
    """Probability of a cause jointly with an unmodelled effect.

    Args:
        whole: rms of what the cause adds.
        functions: covariate -> log evidence that the unmodelled effect is a function of it, and products (1 + q, 1 + q) of
            what all else that was fitted leaves of the cause's effect and of these functions.
        rows: number of rows of these products.
        excess: rms of the residual beyond its noise.
        floor: noise, in which slabs are measured.
        odds: log prior odds of the cause.
    """
    if not (excess > 0.0 and whole > 0.0):
        return 1.0 if whole > 0.0 else float(expit(odds))
    without, with_cause, weight = [], [], []
    for gain, products in functions.values():
        square = float(products[0, 0])
        along = products[0, 1:] / np.sqrt(max(square, 1e-300))
        spread = np.maximum(np.linalg.eigvalsh(products[1:, 1:] - np.outer(along, along)), 0.0)
        if not (square > 0.0 and spread.sum() > 0.0):
            continue
        size = float(np.sqrt(square / rows))
        slabs = np.array(WIDTHS) * max(floor, whole / WIDTHS[-1]) * size / whole
        scale = excess * max(float(np.sqrt(along @ along / spread.sum())), 1e-9)
        without.append(float(t.logpdf(size / scale, spread.sum() ** 2 / (spread**2).sum()) - np.log(scale)))
        with_cause.append(float(logsumexp(norm.logpdf(size, 0.0, np.hypot(slabs, scale))) - np.log(len(slabs))))
        weight.append(gain)
    if not weight:
        return float(expit(odds))
    return float(expit(odds + logsumexp(np.add(with_cause, weight)) - logsumexp(np.add(without, weight))))
