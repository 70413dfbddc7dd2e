"""What is left on unseen poses against the floor: in size, among neighbours, in time, per actuator and period.

Only what poses that were not fitted leave counts, and only beyond what the uncertainty of the fit does to them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.linalg import eigh
from scipy.spatial import KDTree
from scipy.stats import chi2, norm, wilcoxon
from scipy.stats import f as f_ratio

from camcomp.diagnosis.arm.dependence import Dependence, dependences
from camcomp.diagnosis.arm.discrepancy import (
    CHI2_3_EDGE,
    CHI2_3_MEDIAN,
    Evidence,
    Posterior,
    design,
    regions,
    without_nuisance,
)
from camcomp.diagnosis.arm.noise_floor import FAR, IN_A_ROW, TipFloor
from camcomp.ground.datatypes import Floats

MINOR = 0.3  # of the floor: what moves the tip less is no cause and no unknown
ABOVE = 1.25  # of the floor's square: instruments do not know themselves to better than an eighth
LEVEL = 1.5  # of the floor's square that a leftover has to stay below to be the floor
SURE, LIKELY = 0.99, 0.95  # that a leftover is above the floor; that it is at it
CHANCE = 1e-3  # of a structure in noise alone, over all that is tried
FALSE = 0.01  # of what is named as a driver
STEPS = 16  # stretches of time, regions of postures
SHORTEST = 12  # poses in a stretch
INSTANTS = 48  # of a campaign, at which something may have changed for good


@dataclass(frozen=True, eq=False)
class LeftOver:
    """Leftovers (n, 3) mm of unseen poses, one entry per block, with their white squares (n,), which the floor makes 3 each.

    moved: of every block whose poses move what the effects do there by more than the floor (rms), log10 of the chance that they
    do so within what the others leave open.
    """

    rest: tuple[Floats, ...]
    squares: tuple[Floats, ...]
    moved: tuple[float, ...] = ()


@dataclass(frozen=True, eq=False)
class Gate:
    """The test of a leftover. word: `above` the floor, `at` it, or `open`, where the data decide neither.

    chance: log10 of the chance of the strongest sign in noise alone; drivers: what the leftover depends on; floor:
    whether there is one; structured: whether the leftover follows something, so that it is no noise of whatever size.
    """

    word: Literal["above", "at", "open"]
    chance: float
    drivers: tuple[Dependence, ...]
    left: LeftOver
    floor: bool
    structured: bool = False


def unseen(evidence: Evidence, widths: Floats, sd: float, effects: int | None = None) -> LeftOver:
    """What the folds of an evidence, which was whitened by the floor sd alone, leave of their blocks. effects: how many columns
    are those of effects; all, where it is not said.

    Every block may move the fit within what the others leave open: what is left then is nobody's uncertainty.
    """
    rest, squares, moved = [], [], []
    k = evidence.effects
    for fold in evidence.folds:
        b = evidence.blocks[fold.block]
        others = evidence.posterior(widths, fold.others)
        both = evidence.posterior(widths, (*fold.others, fold.block))
        D = design(b, k, len(others.mean))
        near = b.r - D @ both.mean
        own = (evidence.left(fold, others) * near).sum(axis=1) / sd**2
        way = b.X[:, :, :effects] @ (both.mean - others.mean)[:k][:effects]
        if (without_nuisance(way, b.N) ** 2).sum(axis=1).mean() > 3.0 * sd**2:
            square = float(own.sum() - (near**2).sum() / sd**2)
            moved.append(chance_of_move(evidence.grams[fold.block], others, square))
        freedom = 3.0 * len(b.r) - (9.0 if b.alone else 0.0)
        rest.append(near)
        squares.append(3.0 * own * len(b.r) / freedom)
    return LeftOver(tuple(rest), tuple(squares), tuple(moved))


def chance_of_move(gram: Floats, others: Posterior, square: float) -> float:
    """log10 of the chance that a block of some Gram matrix (q, q) moves a fit to the others as far, in squares of what they leave
    open: a sum of chi2 with the weights l / (1 + l), of which mean and variance are kept. Source: Satterthwaite, Biometrics
    Bulletin 2 (1946) 110.
    """
    size = 1.0 / np.sqrt(np.diag(others.precision))
    own, before = (size[:, None] * each * size for each in (gram[np.ix_(others.on, others.on)], others.precision))
    ratio = eigh(own, before, eigvals_only=True).clip(0.0)
    weight = ratio / (1.0 + ratio)
    mean, variance = float(weight.sum()), 2.0 * float((weight**2).sum())
    if variance == 0.0:  # the block says nothing of what is open
        return 0.0
    return float(chi2.logsf(2.0 * mean * square / variance, 2.0 * mean**2 / variance) / np.log(10.0))


def judge(
    left: LeftOver, floor: TipFloor | None, features: Sequence[Floats], times: Sequence[Floats],
    patterns: Mapping[str, Sequence[Floats]], frames: Sequence[tuple[int, Floats]] = (),
) -> Gate:  # fmt: skip
    """The leftover against the floor; features (n, f), times (n,), patterns per block of the leftover; frames: of every block the
    number of its campaign, and its nuisances (n, 3, 9).
    """
    found = dependences(patterns, left.rest, features)
    whole = [*found, neighbours(left.rest, features), stretches(left.rest, times), change(left.rest, times, frames)]
    tried = len(whole)
    limit = np.log10(CHANCE / tried)
    sure = [each for each in whole if each.log10_chance < limit]
    energy = float(np.mean(np.concatenate([(r**2).sum(axis=1) for r in left.rest])))
    size = [each.share * energy for each in sure]
    if floor is None:  # then the part that depends on nothing stands for it
        structured = any(s > MINOR**2 * (energy - s) for s in size)
    else:
        structured = any(s > MINOR**2 * 3.0 * floor.sd**2 for s in size)
    chance = min((each.log10_chance for each in sure), default=0.0) + np.log10(tried)
    largest = sorted(discovered(whole), key=lambda e: -e.share)
    drivers = tuple({each.covariate: each for each in reversed(largest) if each.covariate}.values())[::-1]
    if floor is None:
        return Gate("above" if structured else "open", min(chance, 0.0), drivers, left, False, structured)
    mean, spread = level(left, features, floor)
    many = regions_above(left, features)
    if structured or mean - norm.ppf(SURE) * spread > ABOVE or many < np.log10(FALSE) or lasting(left, times):
        if mean - norm.ppf(SURE) * spread > ABOVE:
            chance = min(chance, float(norm.logsf((mean - ABOVE) / spread) / np.log(10.0)))
        chance = min(chance, many, float(np.log10(CHANCE)) if lasting(left, times) else 0.0)
        return Gate("above", min(chance, 0.0), drivers, left, True, structured)
    at_it = mean + norm.ppf(LIKELY) * spread < LEVEL and not moved(left)
    return Gate("at" if at_it else "open", 0.0, drivers, left, True)


def discovered(tried: Sequence[Dependence]) -> list[Dependence]:
    """Those of which one in a hundred is false. Source: Benjamini, Hochberg, J. R. Statist. Soc. B 57 (1995) 289."""
    order = sorted(tried, key=lambda each: each.log10_chance)
    found = [i for i, each in enumerate(order, 1) if each.log10_chance <= np.log10(FALSE * i / len(order))]
    return order[: max(found, default=0)]


def level(left: LeftOver, features: Sequence[Floats], floor: TipFloor) -> tuple[float, float]:
    """Mean square in units of the floor's, and its standard error: between regions of postures, and of the floor itself."""
    total, n = _by_region(left, features)
    mean = float(total.sum() / n.sum())
    between = float(np.sqrt(((total - mean * n) ** 2).sum() * len(n) / max(len(n) - 1, 1)) / n.sum())
    even = mean * float(np.sqrt(2.0 / (3.0 * n.sum())))  # the least that noise does
    return mean, float(np.hypot(max(between, even), mean * np.sqrt(2.0 / floor.freedom)))


def regions_above(left: LeftOver, features: Sequence[Floats]) -> float:
    """log10 of the chance that regions of postures have mean squares as far above ABOVE as these, where as many lie below.

    Signed ranks, for leftovers of which a few regions have nearly all: means and their spread then say little. Source:
    Wilcoxon, Biometrics Bulletin 1 (1945) 80.
    """
    total, n = _by_region(left, features)
    return float(np.log10(wilcoxon(total / n - ABOVE, alternative="greater").pvalue))


def moved(left: LeftOver) -> bool:
    """Whether blocks move the fit farther than chance does: what an effect does there and was not fitted is not at the floor, and
    one way among hundreds of poses does little to their mean square.
    """
    return bool(min(left.moved, default=0.0) < np.log10(CHANCE / len(left.rest)))


def lasting(left: LeftOver, times: Sequence[Floats]) -> bool:
    """Whether poses one after the other are all so far off as no noise is: too few for a mean, and no mistakes."""
    for square, time in zip(left.squares, times, strict=True):
        far = square[np.argsort(time, kind="stable")] > FAR**2 * CHI2_3_MEDIAN
        if len(far) >= IN_A_ROW and np.lib.stride_tricks.sliding_window_view(far, IN_A_ROW).all(axis=1).any():
            return True
    return False


def _by_region(left: LeftOver, features: Sequence[Floats]) -> tuple[Floats, Floats]:
    """Sums of squares in units of the floor's (regions,), and numbers of poses (regions,)."""
    sums, counts = [], []
    for s, f in zip(left.squares, features, strict=True):
        group = regions(f, min(STEPS, max(len(s) // 4, 2)))
        for g in np.unique(group):
            sums.append(float(s[group == g].sum() / 3.0))
            counts.append(float((group == g).sum()))
    return np.array(sums), np.array(counts)


def neighbours(rest: Sequence[Floats], features: Sequence[Floats]) -> Dependence:
    """Whether neighbouring postures share their leftover: noise does not, and what depends on the joints does."""
    products: list[Floats] = []
    energy, count = 0.0, 0
    for r, f in zip(rest, features, strict=True):
        if len(r) > 1:
            near = KDTree(f).query(f, k=2)[1][:, 1]
            products.append((r * r[near]).sum(axis=1))
            energy, count = energy + float((r**2).sum()), count + len(r)
    if energy <= 0.0:
        return Dependence("", 0.0, 0.0)
    every = np.concatenate(products)
    spread = np.sqrt(2.0 * (every**2).mean() / count)  # a pair that are each other's nearest counts once
    chance = float(norm.logsf(every.mean() / max(float(spread), 1e-300)) / np.log(10.0))
    return Dependence("", max(float(every.mean()) / (energy / count), 0.0), chance)


def stretches(rest: Sequence[Floats], times: Sequence[Floats]) -> Dependence:
    """Whether stretches of time have a leftover of their own."""
    white, freedom, energy, count = 0.0, 0, 0.0, 0
    for r, t in zip(rest, times, strict=True):
        parts = windows(t)
        if len(parts) < 2:
            continue
        spread = np.cov(r.T) + 1e-18 * np.eye(3)
        for own in parts:
            mean = r[own].mean(axis=0) - r.mean(axis=0)
            white += len(own) * float(mean @ np.linalg.solve(spread, mean))
            energy += len(own) * float(mean @ mean)
        freedom, count = freedom + 3 * (len(parts) - 1), count + 1
    if not freedom:
        return Dependence("", 0.0, 0.0)
    whole = sum(float((r**2).sum()) for r in rest)
    expected = freedom / 3.0 * whole / sum(len(r) for r in rest)  # what noise alone does
    share = max(energy - expected, 0.0) / max(whole, 1e-300)
    return Dependence("time", share, float(chi2.logsf(white, freedom) / np.log(10.0)))


def change(rest: Sequence[Floats], times: Sequence[Floats], frames: Sequence[tuple[int, Floats]]) -> Dependence:
    """Whether the frame of an instrument, or the place of its target, is another one from some instant of a campaign on.

    Postures that are visited in turns hide it: what it does to them points everywhere. Rows far out weigh less (Huber's psi): noise
    has tails, and is louder at times.
    """
    whole = sum(float((r**2).sum()) for r in rest)
    best = Dependence("", 0.0, 0.0)
    for number in {number for number, _ in frames}:
        own = [i for i, (each, _) in enumerate(frames) if each == number]
        when = np.concatenate([times[i] for i in own])
        order = np.argsort(when, kind="stable")
        r, N = (np.concatenate(part) for part in ([rest[i] for i in own], [frames[i][1] for i in own]))
        instants = np.unique(np.linspace(0, len(r), INSTANTS + 2).astype(int)[1:-1])
        instants = instants[(instants >= SHORTEST) & (instants <= len(r) - SHORTEST)]
        freedom = 3 * len(r) - 2 * N.shape[2]
        if not len(instants) or freedom <= 0 or not whole > 0.0:
            continue
        energy, square = float((r**2).sum()), (r**2).sum(axis=1)
        edge = max(float(np.median(square)) / CHI2_3_MEDIAN * CHI2_3_EDGE, 1e-300)
        r, N = (r / np.maximum(np.sqrt(square / edge), 1.0)[:, None])[order], N[order]
        Q, _ = np.linalg.qr(N.reshape(-1, N.shape[2]))
        left = r.ravel() - Q @ (Q.T @ r.ravel())
        before = float(left @ left)
        for at in instants:
            D = np.where(np.arange(len(r))[:, None, None] < at, 0.0, N).reshape(-1, N.shape[2])
            D = D - Q @ (Q.T @ D)
            taken = float(np.sum((np.linalg.qr(D)[0].T @ left) ** 2))
            after = max(before - taken, 1e-300)
            ratio = (taken / N.shape[2]) / (after / freedom)
            chance = float(f_ratio.logsf(ratio, N.shape[2], freedom) + np.log(len(instants) * len(frames))) / np.log(
                10.0
            )
            if chance < best.log10_chance:
                share = max(taken - N.shape[2] * after / freedom, 0.0) / float((r**2).sum())
                best = Dependence("time", min(share, 1.0) * energy / whole, chance)
    return best


def windows(time: Floats) -> list[np.ndarray]:
    """Indices of at most STEPS stretches of time of SHORTEST poses or more."""
    count = min(STEPS, len(time) // SHORTEST)
    return list(np.array_split(np.argsort(time, kind="stable"), count)) if count > 1 else []


def standing_out(size: Floats, groups: Sequence[np.ndarray]) -> list[int]:
    """Groups of indices whose sizes (n,) are larger than those of the others: rank sums, 1 % over all groups.

    Source: Mann, Whitney, Ann. Math. Stat. 18 (1947) 50.
    """
    rank = np.empty(len(size))
    rank[np.argsort(size, kind="stable")] = np.arange(1, len(size) + 1)
    out = []
    for i, own in enumerate(groups):
        n, m = len(own), len(size) - len(own)
        if not n or not m:
            continue
        z = (rank[own].sum() - n * (n + m + 1) / 2.0) / np.sqrt(n * m * (n + m + 1) / 12.0)
        if norm.sf(z) < FALSE / len(groups):
            out.append(i)
    return out
