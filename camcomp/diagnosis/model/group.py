"""A run or campaign as rows of the model, and the normal equations of all groups.

y_g = A_g a_S + N_g b_g + B_g w + e_g,  e_g ~ N(0, R_g): g is the unit that is left out. R_g is a standard deviation per
row and channel, correlated by a smooth process over the positions of the rows where there is one.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import cholesky, solve_triangular

from camcomp.diagnosis.statistics.normal_equations import NormalEquations
from camcomp.ground.datatypes import Floats, Ints


@dataclass(frozen=True)
class SmoothProcess:
    """Smooth process over positions of rows: size in units of the noise, length in units of the positions.

    over: `posture` (positions of the group) or `time` (its order, 0 to 1).
    """

    size: float
    length: float
    over: str = "posture"

    def correlation(self, positions: Floats) -> Floats:
        """Covariance (n, n) of rows at positions (n, f), in squares of the noise, without the noise."""
        square = (positions**2).sum(axis=1)
        distance = np.maximum(square[:, None] + square[None, :] - 2.0 * positions @ positions.T, 0.0)
        return np.asarray(self.size**2 * np.exp(-0.5 * distance / self.length**2), float)


@dataclass(frozen=True, eq=False, kw_only=True)
class Group:
    """Rows of one run or campaign; n rows, c channels, k columns of effects.

    y (n, c): measured minus modelled, NaN where a channel has no value. A (n, c, k): motion of the channels per unit of an
    amplitude. N (n, c, p): nuisances; groups with the same `label` share their amplitudes. sd (n, c): noise, resolution
    included. B: covariate -> (n, c, q), smooth functions of it of size 1. position (n, f): what makes rows neighbours;
    order (n,): 0 to 1 in time, None where rows have no clock.
    """

    name: str
    label: Hashable
    y: Floats
    A: Floats
    N: Floats
    sd: Floats
    B: Mapping[str, Floats] = field(default_factory=dict)
    position: Floats | None = None
    order: Floats | None = None

    def take(self, rows: np.ndarray) -> Group:
        """The rows of a mask or of indices."""
        position, order = (None if each is None else each[rows] for each in (self.position, self.order))
        return Group(
            name=self.name, label=self.label, y=self.y[rows], A=self.A[rows], N=self.N[rows], sd=self.sd[rows],
            B={name: each[rows] for name, each in self.B.items()}, position=position, order=order,
        )  # fmt: skip

    def whiten(self, D: Floats, process: SmoothProcess | None = None) -> tuple[Floats, float]:
        """Columns D (n, c, q) as (n c, q) in which the noise is white and of size 1, rows without a value 0, and the
        logarithm of the size that the noise had: sum of log sd, and of the process where there is one.
        """
        seen = np.isfinite(self.y) & np.isfinite(self.sd)
        white = np.where(seen[:, :, None], D / np.where(seen, self.sd, 1.0)[:, :, None], 0.0)
        log_size = float(np.log(self.sd[seen]).sum())
        if process is not None:
            K = process.correlation(self.positions(process.over)) + np.eye(len(white))
            half = cholesky(K, lower=True)
            white = solve_triangular(half, white.reshape(len(white), -1), lower=True).reshape(white.shape)
            log_size += self.y.shape[1] * float(np.log(np.diag(half)).sum())
        return np.asarray(white.reshape(-1, white.shape[2]), float), log_size

    def positions(self, over: str) -> Floats:
        """Positions (n, f) that a process over `posture` or `time` goes by."""
        at = self.position if over == "posture" else None if self.order is None else self.order[:, None]
        return np.zeros((len(self.y), 1)) if at is None else at


@dataclass(frozen=True, eq=False)
class ColumnLayout:
    """Columns of the normal equations: effects first, then nuisances by label, then the dictionary by covariate."""

    effects: int
    nuisances: Mapping[Hashable, slice]
    covariates: Mapping[str, slice]

    @staticmethod
    def of(groups: Sequence[Group]) -> ColumnLayout:
        """The layout of groups, whose dictionaries have the same number of columns per covariate."""
        at = effects = groups[0].A.shape[2]
        nuisances: dict[Hashable, slice] = {}
        for g in groups:
            if g.label not in nuisances:
                nuisances[g.label] = slice(at, at := at + g.N.shape[2])
        covariates: dict[str, slice] = {}
        for name in dict.fromkeys(name for g in groups for name in g.B):
            width = next(g.B[name].shape[2] for g in groups if name in g.B)
            covariates[name] = slice(at, at := at + width)
        return ColumnLayout(effects, nuisances, covariates)

    @property
    def size(self) -> int:
        """Number of columns."""
        ends = [each.stop for each in (*self.nuisances.values(), *self.covariates.values())]
        return int(max([self.effects, *ends]))

    def design(self, g: Group) -> Floats:
        """Columns (n, c, size) of a group."""
        D = np.zeros((*g.y.shape, self.size))
        D[:, :, : self.effects] = g.A
        D[:, :, self.nuisances[g.label]] = g.N
        for name, each in g.B.items():
            D[:, :, self.covariates[name]] = each
        return D


def normal_equations(
    g: Group, layout: ColumnLayout, process: SmoothProcess | None = None, columns: Ints | None = None
) -> NormalEquations:
    """Normal equations of one group, of some columns or all."""
    D = layout.design(g)
    D = np.concatenate([D if columns is None else D[:, :, columns], np.nan_to_num(g.y)[:, :, None]], axis=2)
    white, log_size = g.whiten(D, process)
    own, y = white[:, :-1], white[:, -1]
    return NormalEquations(own.T @ own, own.T @ y, float(y @ y), int(np.isfinite(g.y).sum()), log_size)


def split_regions(positions: Floats, count: int) -> np.ndarray:
    """Region number (n,) of every row: the largest region is halved along its longest direction until there are `count`."""
    group = np.zeros(len(positions), int)
    for new in range(1, count):
        rows = np.flatnonzero(group == np.argmax(np.bincount(group)))
        if len(rows) < 2:
            break
        centred = positions[rows] - positions[rows].mean(axis=0)
        along = centred @ np.linalg.svd(centred, full_matrices=False)[2][0]
        group[rows[along > np.median(along)]] = new
    return group
