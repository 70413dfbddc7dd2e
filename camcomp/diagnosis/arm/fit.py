"""Groups of effects fitted to the campaigns of an arm: chosen by what they predict, then through the model itself."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from camcomp.diagnosis.arm.discrepancy import (
    Discrepancy,
    Evidence,
    ResidualBlock,
    fit_discrepancy,
    regions,
    without_nuisance,
)
from camcomp.diagnosis.arm.few_causes import Few
from camcomp.diagnosis.arm.forward_selection import Taken, take
from camcomp.diagnosis.arm.noise_floor import far_off
from camcomp.diagnosis.arm.poses import ArmBench, Column, Poses, combined, visible
from camcomp.ground import headway
from camcomp.ground.datatypes import Floats
from camcomp.model.effect import Cause

REGIONS = 8  # of postures, where there is one campaign only
HYPER_POSES = 400  # rows of a region on which the discrepancy is fitted


@dataclass(frozen=True, eq=False)
class ArmFit:
    """The fit behind a result: columns, which were taken with their amplitudes and covariance, and the leftovers."""

    columns: tuple[Column, ...]
    groups: dict[str, list[int]]
    taken: Taken
    amount: Floats  # (k,) in units of scales
    covariance: Floats  # (k, k)
    discrepancy: Discrepancy
    evidence: Evidence
    linear: tuple[ResidualBlock, ...]
    rest: tuple[Floats, ...]  # (n, 3) mm per campaign, machine frame
    chosen: Taken  # before anything held out had a say
    rough: Discrepancy | None = None  # beside the groups alone, where waves of joints were taken as well
    few: Few | None = None  # where groups are single places

    def effect(self, group: str) -> str:
        """The effect of a group."""
        return self.columns[self.groups[group][0]].effect

    def target(self, group: str) -> str | None:
        """The target of a group at a single place; None of an effect at all joints."""
        return None if self.few is None else self.columns[self.groups[group][0]].target

    def signed(self, evidence: Evidence, widths: Floats, blocks: Sequence[int]) -> Floats:
        """Widths (k,) without those of positive amounts that want to be negative on some blocks: they are none."""
        amount, _ = evidence.fit(widths, blocks)
        wrong = [j for j, c in enumerate(self.columns) if c.parameter.sign > 0 and amount[j] < 0.0]
        return np.where(np.isin(np.arange(len(widths)), wrong), 0.0, widths)

    def causes(self, groups: Sequence[str] | None = None) -> list[Cause]:
        """Causes of the groups taken, or of some of them."""
        names = [s.group for s in self.taken.steps] if groups is None else groups
        on = {j: float(self.amount[j]) for name in names for j in self.groups[name] if self.amount[j] != 0.0}
        return combined(self.columns, on)


@dataclass(frozen=True, eq=False)
class Prepared:
    """Columns that move some tip, campaigns linearised about the nominal arm, and runs and rows of poses far off."""

    columns: tuple[Column, ...]
    linear: tuple[ResidualBlock, ...]
    outliers: tuple[tuple[str, int], ...]


def prepared(bench: ArmBench, without: Sequence[str] = ()) -> Prepared:
    """What every fit begins with. Poses far off beside the richest model are taken from the bench."""
    columns = bench.columns(without)
    linear = bench.blocks(columns)
    seen = visible(linear, columns)
    columns = [columns[j] for j in seen]
    linear = [replace(b, X=b.X[:, :, seen]) for b in linear]
    outliers: list[tuple[str, int]] = []
    campaigns = list(bench.campaigns)
    for k, left in enumerate(_beside_everything(linear)):
        far = far_off(np.linalg.norm(left, axis=1), campaigns[k].time)
        outliers += named_rows(campaigns[k], far)
        campaigns[k], linear[k] = campaigns[k].take(~far), taken_rows(linear[k], ~far).loosened(left[~far])
    bench.campaigns = campaigns
    return Prepared(tuple(columns), tuple(linear), tuple(outliers))


def investigate(bench: ArmBench, start: Prepared) -> ArmFit:
    """Groups of effects at all joints that predict withheld blocks, fitted through the model itself."""
    groups: dict[str, list[int]] = {}
    for j, column in enumerate(start.columns):
        groups.setdefault(column.effect, []).append(j)
    discrepancy = fit_of_leftovers(start.linear)
    with headway.part(0.0, 0.6):
        taken = take(Evidence.of(parts(start.linear), discrepancy), groups)
    with headway.part(0.6, 1.0):
        return fitted(bench, start.columns, groups, start.linear, discrepancy, taken)


def fitted(
    bench: ArmBench, columns: Sequence[Column], groups: dict[str, list[int]], linear: Sequence[ResidualBlock],
    discrepancy: Discrepancy, taken: Taken, passes: int = 2,
) -> ArmFit:  # fmt: skip
    """Amplitudes of the groups taken, by the model itself instead of its derivative at nominal.

    passes: how often the derivatives are taken anew; one will do where they were taken at these groups already.
    """
    amount = np.zeros(len(columns))
    covariance = np.zeros((len(columns), len(columns)))
    widths = taken.widths.copy()
    evidence = Evidence.of(linear, discrepancy)
    passes = passes if taken.steps else 0
    for _ in headway.steps(range(passes), passes):
        amount, covariance = evidence.fit(widths)
        wrong = [j for j, c in enumerate(columns) if c.parameter.sign > 0 and amount[j] < 0.0]
        widths[wrong] = 0.0  # a positive amount that wants to be negative is none
        amount, covariance = evidence.fit(widths)
        amount[widths == 0.0] = 0.0
        linear = relinearised(bench, columns, linear, amount)
        evidence = Evidence.of(linear, discrepancy)
    if taken.steps:
        covariance = _widened(covariance, Evidence.of(parts(linear), discrepancy), widths)
    rest = tuple(bench.gap(k, combined(columns, dict(enumerate(amount)))) for k in range(len(linear)))
    return ArmFit(tuple(columns), groups, taken, amount, covariance, discrepancy, evidence, tuple(linear), rest, taken)


def _widened(covariance: Floats, evidence: Evidence, widths: Floats) -> Floats:
    """Covariance (k, k) whose variances are no less than what leaving out one campaign, or one region, changes.

    Jackknife over blocks: what a model lacks differs from block to block, and no noise of rows says by how much. Source:
    Efron, Stein, Ann. Statist. 9 (1981) 586.
    """
    each = np.array([evidence.fit(widths, fold.others)[0] for fold in evidence.folds])
    between = (len(each) - 1) / len(each) * ((each - each.mean(axis=0)) ** 2).sum(axis=0)
    own = np.diag(covariance)
    scale = np.sqrt(np.maximum(between, own) / np.maximum(own, 1e-300))
    return np.asarray(scale[:, None] * covariance * scale, float)


def relinearised(
    bench: ArmBench, columns: Sequence[Column], linear: Sequence[ResidualBlock], amount: Floats
) -> list[ResidualBlock]:
    """Blocks whose columns are the model's derivatives at amounts (k,), where these are not 0."""
    on = np.flatnonzero(amount)
    if not len(on):
        return list(linear)
    exact = bench.blocks([columns[int(j)] for j in on], {i: float(amount[j]) for i, j in enumerate(on)})
    out = []
    for b, e in zip(linear, exact, strict=True):
        X = b.X.copy()
        X[:, :, on] = e.X
        out.append(replace(b, X=X, N=e.N, r=e.r))
    return out


def masks(blocks: Sequence[ResidualBlock]) -> list[tuple[int, np.ndarray]]:
    """What is withheld: whole campaigns, or regions of the only one, as its number and a mask of its poses."""
    if len(blocks) > 1:
        return [(k, np.ones(len(b.r), bool)) for k, b in enumerate(blocks)]
    group = regions(blocks[0].features, REGIONS)
    return [(0, group == i) for i in range(REGIONS) if (group == i).any()]


def parts(blocks: Sequence[ResidualBlock]) -> list[ResidualBlock]:
    """The blocks of `masks`."""
    return [replace(taken_rows(blocks[k], mask), alone=len(blocks) > 1) for k, mask in masks(blocks)]


def taken_rows(b: ResidualBlock, mask: np.ndarray) -> ResidualBlock:
    """The rows of a mask."""
    loose, order = (None if own is None else own[mask] for own in (b.loose, b.order))
    return replace(b, features=b.features[mask], X=b.X[mask], N=b.N[mask], r=b.r[mask], loose=loose, order=order)


def named_rows(poses: Poses, mask: np.ndarray) -> list[tuple[str, int]]:
    """Runs and rows of the poses of a mask."""
    return [(str(run), int(row)) for run, row in zip(poses.run[mask], poses.rows[mask], strict=True)]


def _beside_everything(blocks: Sequence[ResidualBlock]) -> list[Floats]:
    """Leftovers (n, 3) of every campaign beside the richest model."""
    size = max(float(np.median(np.abs(np.concatenate([b.r.ravel() for b in blocks])))), 1e-9)
    rough = Evidence.of(blocks, Discrepancy(0.0, 1.0, size))
    amount, _ = rough.fit(np.ones(rough.effects))
    return [without_nuisance(b.r - b.X @ amount, b.N) for b in blocks]


def fit_of_leftovers(blocks: Sequence[ResidualBlock]) -> Discrepancy:
    """Discrepancy beside the richest model, from regions small enough to be quick."""
    features, rest = [], []
    for b, left in zip(blocks, _beside_everything(blocks), strict=True):
        group = regions(b.features, -(-len(left) // HYPER_POSES))
        for i in np.unique(group):
            features.append(b.features[group == i])
            rest.append(left[group == i])
    return fit_discrepancy(features, rest)
