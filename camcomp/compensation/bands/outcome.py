"""Bands of a program: what is known of every row, and what is expected of the program as a whole."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from camcomp.compensation.bands.scatter import LEVEL, TipMoves, gained, size_below
from camcomp.ground.datatypes import Bools, Floats
from camcomp.ground.records import dataclass
from camcomp.ground.result import Result, Size
from camcomp.model.config.spread import UncertainInput
from camcomp.model.drawn import UncertainJob

MACHINES = 1000  # drawn for what is expected of the program
LITTLE = 0.005  # of a correction
POINTS = 600  # points of the program that they are judged on


class ExpectedError(Result):
    """Error after compensation of machines drawn from the uncertain numbers of the config, at the points of the program."""

    rms_um: Annotated[Size, Field(description="over points and machines")]
    p95_um: Annotated[Size, Field(description="95 % of all points of all machines have an error below it")]
    rms_ci95_um: Annotated[tuple[Size, Size], Field(description="holds the rms of 95 % of the machines")]


class BandShare(Result):
    """How much of the band an uncertain input makes."""

    input: Annotated[str, Field(description="its group, or the key of the number")]
    share: Annotated[float, Field(description="of the mean square")]


class TakenCorrection(Result):
    """Points that cut, by the share of the correction that a policy other than `full` took."""

    policy: str
    points: int
    shrunk: Annotated[int, Field(description="points that take less than all of the correction")]
    left_alone: Annotated[int, Field(description="points that take none of it")]


class BandTotals:
    """Accumulate the expected error of a program, piece by piece."""

    def __init__(self, inputs: Sequence[UncertainJob]) -> None:
        self.inputs = [each.source for each in inputs]
        self.points, self._square, self._by_input = 0, 0.0, np.zeros(len(inputs))
        self._kept: list[tuple[int, Floats, TipMoves]] = []  # how many points, errors and moves at some of them
        self.shrunk = self.alone = 0  # points that take less than all of the correction, and none of it

    def add(self, error: Floats, moves: TipMoves, share: Floats | None = None) -> None:
        """Add points: errors (n, 3) mm at the stated values, tip moves by input, shares (n,) of the correction."""
        if share is not None:
            self.alone += int((share <= LITTLE).sum())
            self.shrunk += int(((share > LITTLE) & (share < 1.0 - LITTLE)).sum())
        if not (known := np.isfinite(error).all(axis=1)).all():
            error, moves = error[known], moves.take(np.flatnonzero(known))
        if not len(error):
            return
        self.points += len(error)
        mean = error + moves.mean
        squares = moves.squares
        self._square += float((mean**2).sum() + squares.sum())
        self._by_input += squares
        some = np.unique(np.linspace(0, len(error) - 1, min(len(error), POINTS)).astype(int))
        self._kept.append((len(error), error[some], moves.take(some)))

    def join(self, other: BandTotals) -> BandTotals:
        """Add the totals of another part of the program; return self."""
        self.points, self._square = self.points + other.points, self._square + other._square
        self._by_input = self._by_input + other._by_input
        self._kept += other._kept
        self.shrunk, self.alone = self.shrunk + other.shrunk, self.alone + other.alone
        return self

    def expected(self) -> ExpectedError:
        """Expected error, µm, over drawn machines; zero without points."""
        if not self.points:
            return ExpectedError.model_construct(rms_um=0.0, p95_um=0.0, rms_ci95_um=(0.0, 0.0))
        z = np.random.default_rng(0).standard_normal((len(self.inputs), MACHINES))
        total, sizes, weights = np.zeros(MACHINES), [], []
        for count, error, moves in self._thinned():
            square = ((error[:, :, None] + moves.drawn(z)) ** 2).sum(axis=1)
            total += count * square.mean(axis=0)
            sizes.append(square.ravel())
            weights.append(np.full(square.size, count / square.size))
        rms = np.sqrt(total / self.points)
        tail = 0.5 * (1.0 - LEVEL)
        low, high = np.quantile(rms, (tail, 1.0 - tail))
        p95 = np.sqrt(_weighted_quantile(np.concatenate(sizes), np.concatenate(weights), LEVEL))
        mean = np.sqrt(self._square / self.points)
        return ExpectedError.model_construct(
            rms_um=1e3 * float(mean), p95_um=1e3 * float(p95), rms_ci95_um=(1e3 * float(low), 1e3 * float(high))
        )

    def shares(self) -> list[tuple[str, float]]:
        """Every input's share of the mean square of the band, the largest first."""
        total = float(self._by_input.sum())
        shares = self._by_input / total if total > 0.0 else self._by_input
        order = np.argsort(-shares, kind="stable")
        return [(self.inputs[k].name, float(shares[k])) for k in order]

    def _thinned(self) -> list[tuple[int, Floats, TipMoves]]:
        """Of every piece as many points as keep them all together near POINTS."""
        some = slice(None, None, max(1, sum(len(error) for _, error, _ in self._kept) // POINTS))
        return [(count, error[some], moves.take(some)) for count, error, moves in self._kept]


@dataclass(frozen=True, eq=False, kw_only=True)
class Bands:
    """Bands of the end points (N,) of a program or of a piece of it, with the totals of its expected error."""

    before: Floats  # (N, 3) mm error of the original program at the stated values
    after: Floats  # (N, 3) mm of the corrected one
    moves: TipMoves
    share: Floats  # (N,) of the correction that was taken
    known: Bools  # (N,) False: passes as programmed
    totals: BandTotals

    def band_um(self, level: float = LEVEL) -> Floats:
        """Error (N,) after compensation below which `level` of the machines drawn stay."""
        size = size_below(self.after + self.moves.mean, self.moves.covariance, level)
        return np.where(self.known, 1e3 * size, np.nan)

    def gain_um(self, level: float = LEVEL) -> Floats:
        """By how much (N,) the error of `level` of the machines drawn is smaller, at least, than without compensation."""
        return np.where(self.known, 1e3 * gained(self.before, self.after, self.moves, level), np.nan)

    def columns(self, *, with_share: bool) -> Floats:
        """Columns (N, 2 or 3) of the joint table."""
        parts = (self.band_um(), self.gain_um()) + ((np.where(self.known, self.share, np.nan),) if with_share else ())
        return np.column_stack(parts)


def _weighted_quantile(values: Floats, weights: Floats, level: float) -> float:
    """Smallest value (k,) up to which the weights (k,) sum to `level` of all of them, at least 0.5."""
    goal, middle = level * float(weights.sum()), int((2.0 * level - 1.0) * len(values))
    upper = values > np.partition(values, middle)[middle]
    if len(values) and (below := float(weights[~upper].sum())) < goal:  # sorting the upper values is enough
        values, weights, goal = values[upper], weights[upper], goal - below
    order = np.argsort(values)
    return float(values[order[np.searchsorted(np.cumsum(weights[order]), goal)]])


ADVICE = (
    ("process.force", "cut two slots with different feeds and run camcomp diagnose"),
    ("effects", "log more runs and run camcomp diagnose"),
    ("tool.length", "measure the tool on a presetter"),
    ("tool", "measure the tool"),
    ("workpiece", "probe the workpiece"),
    ("process", "measure it during the cut"),
    ("robot", "log runs with and without load and run camcomp diagnose"),
)  # fmt: skip


def in_words(inputs: Sequence[UncertainInput], shares: Sequence[tuple[str, float]]) -> str:
    """Name the largest contribution to the band and how to reduce it."""
    name, share = shares[0]
    source = next(each for each in inputs if each.name == name)
    first = source.members[0].name
    what = next(text for start, text in ADVICE if first.startswith(start))
    meant = (
        "the cutting force" if first.startswith("process.force") else "the machine" if first.startswith("robot") else ""
    )
    called = f"{meant} ({name})" if meant else name
    return f"{100.0 * share:.0f} % of this spread comes from {called}: {what}"


def band_figures(totals: BandTotals, policy: str) -> dict[str, Any]:
    """The figures of a summary that uncertain numbers add."""
    shares = totals.shares()
    taken = TakenCorrection.model_construct(
        policy=policy, points=totals.points, shrunk=totals.shrunk, left_alone=totals.alone
    )
    return {
        **({} if policy == "full" else {"taken": taken}),
        "expected": totals.expected(),
        "band": tuple(BandShare.model_construct(input=name, share=share) for name, share in shares),
        "advice": in_words(totals.inputs, shares),
    }
