"""Few causes at single places of an arm: all small sets of candidates that look good, weighed by their evidence.

Beside every set stand small errors of everything else and a slow drift of the instrument, none larger than what a healthy
arm and a good instrument have, and the frames, which are free. What is left is the noise of the floor. Amplitudes are
integrated out, over priors of a few widths, so that a cause has to be worth its freedom.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import comb, log

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.special import log_ndtr

from camcomp.diagnosis.arm.discrepancy import FREE, Discrepancy, ResidualBlock
from camcomp.diagnosis.arm.forward_selection import Taken
from camcomp.diagnosis.arm.noise_floor import SWAYS
from camcomp.diagnosis.arm.placed_effects import Place, PlacedEffect
from camcomp.diagnosis.arm.poses import Column
from camcomp.diagnosis.statistics.cause_sets import SIZES
from camcomp.ground.datatypes import Floats

SMALL = 0.08  # of the floor: what an effect of a healthy arm moves its tip by; sixty of them 0.6
DRIFT = 0.35  # of the floor: how far an instrument wanders over a campaign
WIDTHS = (2.0, 6.0, 20.0, 60.0, 200.0)  # of the floor: what causes may move the tip by
KEPT = 12  # sets of each size that are enlarged
SLACK = 6.0  # log evidence by which all sets of one size may lie behind, and be enlarged still
LONG = 20  # columns: one cause with more of them is enough for a set
NEVER = 1e30  # precision of a small error that is none
LEAST = 1e-6  # of the floor: a column that moves the tip less is none
Members = tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Weighed:
    """Normal equations of all columns beside small errors, drift and frames: gram (k, k), moment (k,), amplitudes in scales.

    size (k,): how far a scale moves the tip beside the frames, in floors, 0 where that is nothing; small (k,): width of the
    small error of every column, 0 where it moves nothing, or has a shape that nobody knows; nothing: log evidence of no cause
    at all, up to what all discrepancies share.
    """

    candidates: Sequence[PlacedEffect]
    columns: Sequence[Column]
    gram: Floats
    moment: Floats
    size: Floats
    small: Floats
    nothing: float

    @cached_property
    def _unit(self) -> list[Floats]:
        """Of every candidate the amplitudes (d,) in scales at which it moves the tip by one floor, its columns alike."""
        return [1.0 / (self.size[own] * np.sqrt(len(own))) if (self.size[own] > 0.0).all() else np.zeros(len(own))
                for own in (list(c.columns) for c in self.candidates)]  # fmt: skip

    @cached_property
    def _bounds(self) -> tuple[Floats, Floats, Floats]:
        """Amplitudes (k,) in scales between which columns may be, and their signs (k,), 0 for either."""
        ends = []
        for column in self.columns:
            p = column.parameter
            ends.append([p.coordinate(b) / p.scale if b > 0.0 or not p.log else -np.inf for b in (p.low, p.high)])
        low, high = np.array(ends).T
        return low, high, np.array([column.parameter.sign for column in self.columns], float)

    @cached_property
    def _places(self) -> int:
        return len({c.place for c in self.candidates})

    @property
    def usable(self) -> list[int]:
        """Candidates all of whose columns move the tip."""
        return [i for i, unit in enumerate(self._unit) if unit.all()]

    def widths(self, members: Members) -> Floats:
        """Amplitudes (d,) in scales at which every member moves the tip by one floor."""
        return np.concatenate([np.zeros(0), *(self._unit[i] for i in members)])

    def indices(self, members: Members) -> list[int]:
        """Columns of members, one after the other."""
        return [j for i in members for j in self.candidates[i].columns]

    def prior(self, members: Members) -> float:
        """Log prior of a set: so many causes, each place alike, its ways alike."""
        ways = sum(log(self.candidates[i].ways) for i in members)
        return log(SIZES[len(members)]) - log(comb(self._places, len(members))) - ways

    def beside(self, members: Members, more: Sequence[int]) -> Floats:
        """Log evidence (s,) of a set with one candidate more each, their priors included, against nothing."""
        out = np.array([self.prior((*members, i)) for i in more])
        count = np.array([len(self.candidates[i].columns) for i in more])
        for d in np.unique(count):
            own = np.flatnonzero(count == d)
            value = self._posterior(members, [more[i] for i in own.tolist()])[0]
            most = value.max(axis=1)
            sure = np.where(np.isfinite(most), most, 0.0)
            with np.errstate(divide="ignore"):
                out[own] += sure + np.log(np.exp(value - sure[:, None]).mean(axis=1))
        return out

    def best(self, members: Members) -> tuple[Floats, Floats, float]:
        """Amplitudes (d,), covariance (d, d) and the width at which they are most probable."""
        value, mean = self._posterior(members[:-1], members[-1:])
        k = int(np.argmax(value[0]))
        on, unit = self.indices(members), self.widths(members)
        M = unit[:, None] * self.gram[np.ix_(on, on)] * unit + np.eye(len(on)) / WIDTHS[k] ** 2
        return mean[0, k], unit[:, None] * np.linalg.inv(M) * unit, WIDTHS[k]

    def _posterior(self, members: Members, more: Sequence[int]) -> tuple[Floats, Floats]:
        """Of a set with one of s candidates more each, of e columns all: log evidence (s, widths), amplitudes (s, widths, d).

        The set's own columns are eliminated once for all of them.
        """
        old, new = np.array(self.indices(members), int), np.array([self.candidates[i].columns for i in more])
        a, b = self.widths(members), np.array([self._unit[i] for i in more])
        square = np.array(WIDTHS) ** 2
        A = a[:, None] * self.gram[np.ix_(old, old)] * a + np.eye(len(a)) / square[:, None, None]  # (widths, o, o)
        B = a[:, None] * self.gram[old[:, None], new[:, None, :]] * b[:, None, :]  # (s, o, e)
        C = b[:, :, None] * self.gram[new[:, :, None], new[:, None, :]] * b[:, None, :]
        P = np.linalg.inv(A)
        alone = P @ (a * self.moment[old])  # (widths, o)
        taken = np.einsum("wop,spe->swoe", P, B, optimize=True)
        S = (
            C[:, None]
            + np.eye(b.shape[1]) / square[:, None, None]
            - np.einsum("soe,swof->swef", B, taken, optimize=True)
        )
        Q = np.linalg.inv(S)
        left = (b * self.moment[new])[:, None] - np.einsum("soe,wo->swe", B, alone, optimize=True)
        gained = (Q @ left[..., None])[..., 0]
        value = 0.5 * ((alone @ (a * self.moment[old]))[None] + (left * gained).sum(axis=2))
        value -= 0.5 * (np.linalg.slogdet(A)[1] + np.linalg.slogdet(S)[1] + (len(a) + b.shape[1]) * np.log(square))
        mean = np.concatenate([alone[None] - (taken @ gained[..., None])[..., 0], gained], axis=2)
        variance = np.concatenate([
            np.diagonal(P, axis1=1, axis2=2)[None] + ((taken @ Q) * taken).sum(axis=3), np.diagonal(Q, axis1=2, axis2=3)
        ], axis=2)  # fmt: skip
        on = np.concatenate([np.broadcast_to(old, (len(new), len(old))), new], axis=1)[:, None, :]
        unit = np.concatenate([np.broadcast_to(a, (len(b), len(a))), b], axis=1)[:, None, :]
        mean, sd = unit * mean, unit * np.sqrt(np.maximum(variance, 0.0))
        low, high, sign = self._bounds
        signed = sign[on] > 0.0
        value += np.where(signed, log_ndtr(np.where(signed, mean / sd, 0.0)) + log(2.0), 0.0).sum(axis=2)
        outside = (mean < low[on] - 3.0 * sd) | (mean > high[on] + 3.0 * sd)
        return np.where(outside.any(axis=2), -np.inf, value), mean


@dataclass(frozen=True, eq=False)
class FewCauses:
    """Sets of candidates in falling probability, the probability of every place, and log evidence of the best set."""

    sets: tuple[tuple[Members, float], ...]
    places: dict[Place, float]
    evidence: float


@dataclass(frozen=True, eq=False)
class Few:
    """What choosing among few causes leaves: probabilities of places, sets alike as names of groups, widths (k,) of small errors.

    evidence: log of the best set; again: what other blocks, of campaigns of these numbers, would have chosen.
    """

    places: dict[Place, float]
    sets: tuple[tuple[str, ...], ...]
    small: Floats
    evidence: float
    again: Callable[[Sequence[ResidualBlock], Sequence[int]], Taken]


def weighed(
    blocks: Sequence[ResidualBlock], times: Sequence[Floats], sd: float, discrepancy: Discrepancy,
    candidates: Sequence[PlacedEffect], columns: Sequence[Column],
) -> Weighed:  # fmt: skip
    """Normal equations of blocks of campaigns whose rows are off by a discrepancy. times (n,): of every block's rows.

    sd: floor, mm, which all widths are measured in; where nothing unknown is assumed, it is all there is to the discrepancy.
    """
    k, slow = len(columns), 3 * SWAYS * len(blocks)
    frames = {f: i for i, f in enumerate(dict.fromkeys(b.frame for b in blocks))}
    q = k + slow + 9 * len(frames)
    A, b = np.zeros((q, q)), np.zeros(q)
    size, whole, rows, nothing = np.zeros(k), np.zeros(k), 0, 0.0
    for i, (block, t) in enumerate(zip(blocks, times, strict=True)):
        D = np.zeros((len(t), 3, q + 1))
        D[:, :, :k] = block.X
        D[:, :, k + 3 * SWAYS * i : k + 3 * SWAYS * (i + 1)] = sways(t, sd)
        at = k + slow + 9 * frames[block.frame]
        D[:, :, at : at + 9] = block.N
        D[:, :, q] = block.r
        white, log_size = discrepancy.whitened(D, block)
        A += white[:, :q].T @ white[:, :q]
        b += white[:, :q].T @ white[:, q]
        rows += 3 * len(t)
        nothing -= 0.5 * float(white[:, q] @ white[:, q]) + log_size
        size += _free(block.X, block.N, sd)
        whole += ((block.X / sd) ** 2).sum(axis=(0, 1))
    seen = size > LEAST**2 * np.maximum(whole, rows)
    size = np.where(seen, np.sqrt(np.where(seen, size, 1.0) / rows), 0.0)
    small = np.zeros(k)
    for c in candidates:
        own = [j for j in c.columns if seen[j] and not (columns[j].shape and c.ways > 1.0)]
        small[own] = np.maximum(small[own], SMALL / (size[own] * np.sqrt(len(own) * c.ways)))
    precision = np.concatenate([np.full(k, NEVER), np.ones(slow), np.full(9 * len(frames), FREE)])
    precision[:k][small > 0.0] = 1.0 / small[small > 0.0] ** 2
    dead = np.pad(~seen, (0, q - k))
    A[dead], A[:, dead], b[dead] = 0.0, 0.0, 0.0
    scale = 1.0 / np.sqrt(np.diag(A) + precision)
    M = cho_factor(scale[:, None] * (A + np.diag(precision)) * scale, lower=True)
    left = scale[:, None] * A[:, :k]
    gram = A[:k, :k] - left.T @ cho_solve(M, left)
    moment = b[:k] - left.T @ cho_solve(M, scale * b)
    nothing -= 0.5 * float(-(scale * b) @ cho_solve(M, scale * b))
    nothing -= float(np.log(np.diag(M[0])).sum() - np.log(scale).sum() - 0.5 * np.log(precision).sum())
    return Weighed(candidates, columns, gram, moment, size, small, nothing)


def _free(X: Floats, N: Floats, sd: float) -> Floats:
    """Sums of squares (k,) of columns beside the frames, in squares of sd."""
    flat = X.reshape(-1, X.shape[2]) / sd
    Q = np.linalg.svd(N.reshape(-1, N.shape[2]), full_matrices=False)[0]
    return np.asarray((flat**2).sum(axis=0) - ((Q.T @ flat) ** 2).sum(axis=0), float)


def sways(time: Floats, sd: float) -> Floats:
    """Slow waves (n, 3, 3 SWAYS) over the order in time, as large as the drift of an instrument may be, falling as 1/k."""
    order = np.empty(len(time))
    order[np.argsort(time, kind="stable")] = (np.arange(len(time)) + 0.5) / len(time)
    k = np.arange(1, SWAYS + 1)
    waves = DRIFT * sd * np.sqrt(2.0) / k * np.cos(np.pi * k * order[:, None])
    return np.asarray(np.einsum("nk,ij->nikj", waves, np.eye(3)).reshape(len(time), 3, 3 * SWAYS), float)


def search(w: Weighed, most: int, among: Collection[Place] | None = None) -> FewCauses:
    """Sets of up to `most` causes: from the best of each size one more each, then the best with one dropped or exchanged.

    among: places they may be at, all where nothing is said.
    """
    usable = [i for i in w.usable if among is None or w.candidates[i].place in among]
    long = [len(c.columns) > LONG for c in w.candidates]
    visited: dict[Members, float] = {(): w.prior(())}

    def grow(members: Members) -> list[Members]:
        """The sets with one candidate more, weighed."""
        if len(members) == most:
            return []
        there = {w.candidates[i].place for i in members}
        full = any(long[i] for i in members)
        more = [i for i in usable if w.candidates[i].place not in there and not (full and long[i])]
        grown = {tuple(sorted((*members, i))): i for i in more}
        new = {each: i for each, i in grown.items() if each not in visited}
        if new:
            visited.update(zip(new, w.beside(members, list(new.values())).tolist(), strict=True))
        return list(grown)

    front: list[Members] = [()]
    for size in range(1, most + 1):
        found = {each for members in front for each in grow(members)}
        front = sorted(found, key=lambda m: (-visited[m], m))[: KEPT if size > 1 else 2 * KEPT]
        if not front or (size > 1 and visited[front[0]] < max(visited.values()) - SLACK):
            break
    best = None
    while best != (best := max(visited, key=lambda m: (visited[m], m))):
        for k in range(len(best)):
            less = (*best[:k], *best[k + 1 :])
            if less not in visited:
                visited[less] = float(w.beside(less[:-1], less[-1:])[0])
            grow(less)
    return told(w, visited)


def told(w: Weighed, visited: dict[Members, float]) -> FewCauses:
    """Probabilities of sets, of which those that are the same places in other ways count as one, and of places."""
    value = np.array(list(visited.values()))
    p = np.exp(value - value.max())
    p /= p.sum()
    merged: dict[frozenset[Place], tuple[Members, float, float]] = {}
    places: dict[Place, float] = {}
    for members, each in zip(visited, p, strict=True):
        if each < 1e-12:
            continue
        own = frozenset(w.candidates[i].place for i in members)
        for place in own:
            places[place] = places.get(place, 0.0) + float(each)
        first, most, total = merged.get(own, (members, 0.0, 0.0))
        merged[own] = (members if each > most else first, max(most, float(each)), total + float(each))
    sets = sorted(((m, total) for m, _, total in merged.values()), key=lambda s: -s[1])
    return FewCauses(tuple(sets), places, w.nothing + float(value.max()))
