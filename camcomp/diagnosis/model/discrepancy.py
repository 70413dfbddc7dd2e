"""The dictionary of discrepancy: smooth functions of one covariate, and smooth processes over posture or time.

A covariate x enters by cosines sqrt(2) cos(pi k u) / k of its place u in its range, k = 1 ... ORDERS, once for every
direction in which it may move the channels; the scale of a covariate is in noise floors. A process is the limit of all
functions of all coordinates of a posture together, and enters by its covariance.

Sources: Kennedy, O'Hagan, J. R. Statist. Soc. B 63 (2001) 425; Brynjarsdottir, O'Hagan, Inverse Problems 30 (2014) 114007.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import log

import numpy as np
from scipy.linalg import eigh

from camcomp.diagnosis.model.evidence import Background, LinearModel, Members
from camcomp.diagnosis.model.group import Group, SmoothProcess, split_regions
from camcomp.diagnosis.statistics.probability import EQUAL_LOG_ODDS, stated
from camcomp.ground.datatypes import Floats

ORDERS = 8  # cosines of a covariate
SCALES = (1.0, 2.0, 5.0, 10.0, 30.0, 100.0)  # of the floor: size of a covariate's function, of a family or of a process
LENGTHS = {"posture": (0.15, 0.3, 0.6, 1.2), "time": (0.01, 0.03, 0.1, 0.3)}
ROWS_OF_PROCESS = 250  # of a region on which a process is fitted
UNKNOWN = 0.2  # prior probability that something unmodelled acts
EVERYWHERE = 0.01  # prior probability that an effect acts at all its targets


def smooth_functions(values: Floats, low: float, high: float, orders: int = ORDERS) -> Floats:
    """Cosines (n, orders) of values (n,) between low and high, of size 1/k (rms)."""
    place = np.clip((values - low) / max(high - low, 1e-300), 0.0, 1.0)
    k = np.arange(1, orders + 1)
    return np.asarray(np.sqrt(2.0) / k * np.cos(np.pi * k * place[:, None]), float)


def covariate_columns(functions: Floats, directions: Floats) -> Floats:
    """Columns (n, c, d orders) by which functions (n, orders) act along directions (n, c, d), which are one floor long."""
    n, c, d = directions.shape
    return np.asarray(np.einsum("nk,ncd->ncdk", functions, directions).reshape(n, c, d * functions.shape[1]), float)


def with_discrepancy(probability: float) -> float:
    """Probability of a cause beside a discrepancy of any form that is certain: the data do not determine causes beside it, and
    its prior probability stays.
    """
    return stated((1.0 - UNKNOWN) * probability)


def prior_of_covariate(model: LinearModel) -> float:
    """Log prior odds of one covariate or process at one scale against the absence of discrepancy."""
    many = len(model.layout.covariates) - len(model.healthy) + len(LENGTHS)
    return log(UNKNOWN / (1.0 - UNKNOWN)) - log(many)


def prior_of_family(model: LinearModel) -> float:
    """Log prior of an effect at all its targets, against none."""
    return log(EVERYWHERE / (1.0 - EVERYWHERE)) - log(max(len(model.families), 1))


def gains_of_more(model: LinearModel, background: Background, members: Members) -> dict[Background, float]:
    """Log Bayes factors, priors included, of one further covariate or family at each of SCALES, jointly with a set of
    causes.
    """
    at = model.posterior(background, model.reduced(background).slab(members))
    active = {*model.healthy, *(name for name, _ in background.scales)}
    covariates = {name: np.arange(s.start, s.stop) for name, s in model.layout.covariates.items() if name not in active}
    families = {name: model.family(name) for name in model.families if name not in dict(background.families)}
    families = {name: own for name, own in families.items() if len(own[0])}
    blocks = at.blocks_without([*covariates.values(), *(on for on, _ in families.values())])
    out: dict[Background, float] = {}
    prior = prior_of_covariate(model) - log(len(SCALES))
    for name, (gram, moment) in zip(covariates, blocks, strict=False):
        for scale, gain in zip(SCALES, gains_at_scales(gram, moment)[0], strict=True):
            out[replace(background, scales=(*background.scales, (name, scale)))] = gain + prior
    prior = prior_of_family(model) - log(len(SCALES))
    for (name, (_, unit)), (gram, moment) in zip(families.items(), blocks[len(covariates) :], strict=True):
        for scale, gain in zip(SCALES, gains_at_scales(unit[:, None] * gram * unit, unit * moment)[0], strict=True):
            out[replace(background, families=(*background.families, (name, scale)))] = gain + prior
    return out


def gains_of_covariates(
    model: LinearModel, background: Background, members: Members
) -> dict[str, tuple[float, Background]]:
    """Log Bayes factor, priors included, of every further covariate at its best scale, jointly with a set of causes, and the
    background with it.
    """
    best: dict[str, tuple[float, Background]] = {}
    for b, gain in gains_of_more(model, background, members).items():
        if len(b.scales) > len(background.scales) and gain > best.get(b.scales[-1][0], (-np.inf, b))[0]:
            best[b.scales[-1][0]] = gain, b
    return best


def share_of_covariate(model: LinearModel, background: Background, more: Background, members: Members) -> float:
    """Share of the energy of the residual jointly with a background that functions take which `more` has in addition."""
    left = residuals(model, background, members), residuals(model, more, members, unmodelled=False)
    before, after = (sum(float((r**2).sum()) for r in each) for each in left)
    return min(max(1.0 - after / max(before, 1e-300), 0.0), 1.0)


def gains_at_scales(gram: Floats, moment: Floats, unit: float = 1.0) -> tuple[Floats, Floats]:
    """Log Bayes factors (scales,) of columns with normal equations gram (q, q), moment (q,) at SCALES of `unit`, against
    none, and their amplitudes (q,) at the best of them.
    """
    size, way = eigh(gram)
    size, toward = np.maximum(size, 0.0), way.T @ moment
    square = (unit * np.array(SCALES)[:, None]) ** 2
    grown = 1.0 + square * size
    gains = 0.5 * ((square * toward**2 / grown).sum(axis=1) - np.log(grown).sum(axis=1))
    best = int(np.argmax(gains))
    return np.asarray(gains, float), way @ (square[best] * toward / grown[best])


def fit_process(groups: Sequence[Group], left: Sequence[Floats], over: str) -> SmoothProcess | None:
    """The most likely process over posture or time for residuals `left` (n, c), in noise floors.

    Its noise is free: the residual of many causes is less than the floor. None where rows lack a clock or a posture, or
    where noise alone is as likely.
    """
    parts = []
    for g, r in zip(groups, left, strict=True):
        if (g.order if over == "time" else g.position) is None:
            return None
        at = g.positions(over)
        region = split_regions(at, -(-len(r) // ROWS_OF_PROCESS))
        parts += [(at[region == i], r[region == i]) for i in np.unique(region)]
    values = sum(r.size for _, r in parts)
    plain = -0.5 * values * log(max(sum(float((r**2).sum()) for _, r in parts) / values, 1e-300))
    best: tuple[float, SmoothProcess | None] = plain + EQUAL_LOG_ODDS, None
    for length in LENGTHS[over]:
        spectra = []
        for at, r in parts:
            size, way = eigh(SmoothProcess(1.0, length, over).correlation(at))
            spectra.append((np.maximum(size, 0.0), ((way.T @ r) ** 2).sum(axis=1), r.shape[1]))
        for size_of in SCALES:
            square = sum(float((z / (1.0 + size_of**2 * e)).sum()) for e, z, _ in spectra) / values
            logs = sum(0.5 * c * float(np.log1p(size_of**2 * e).sum()) for e, _, c in spectra)
            value = -0.5 * values * log(max(square, 1e-300)) - logs
            if value > best[0]:
                best = value, SmoothProcess(size_of * max(square, 1e-12) ** 0.5, length, over)
    return best[1]


def residuals(model: LinearModel, background: Background, members: Members, *, unmodelled: bool = True) -> list[Floats]:
    """Residuals (n, c) of the fitted groups in floors, with causes, minor effects and nuisances fitted.

    unmodelled: whether the discrepancy stays in them.
    """
    mean = model.posterior(background, model.reduced(background).slab(members)).mean.copy()
    for name, own in model.layout.covariates.items() if unmodelled else ():
        mean[own] = mean[own] if name in model.healthy else 0.0
    out = []
    for group in (model.groups[g] for g in model.own):
        left = group.y - model.layout.design(group) @ mean
        out.append(np.where(np.isfinite(left), left, 0.0) / group.sd)
    return out
