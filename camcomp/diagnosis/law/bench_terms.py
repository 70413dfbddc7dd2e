"""Terms on the bench: where a form acts, what it does to the channels of every run, and that in white rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from camcomp.diagnosis.fit.bench import Bench, means, thinned
from camcomp.diagnosis.law.forms import Form
from camcomp.diagnosis.law.rows import Rows, drive_rows, tip_rows
from camcomp.diagnosis.law.sizes import Sizes, sizes
from camcomp.diagnosis.law.white import White
from camcomp.diagnosis.statistics.noise_model import Noise
from camcomp.ground.datatypes import Bools, Floats, Ints
from camcomp.model.law.expression import parse

AT_ONCE = 100  # forms that are evaluated together
ROWS_AT_ONCE = 16_000  # rows of several runs for which a function is worked out in one go


@dataclass(frozen=True)
class Spot:
    """Where a law acts: on control or drive of an actuator (its index), or on the tip along a program axis (0 to 2)."""

    on: str
    index: int


@dataclass(frozen=True)
class Term:
    """A form at a spot: one or two columns that belong together."""

    spot: Spot
    form: Form


def spots(actuators: int, kind: str) -> list[Spot]:
    """Where a law may act that shows in a kind of channel: behind encoders that were logged, or in front of them."""
    if kind == "encoder":
        return [Spot("control", j) for j in range(actuators)]
    return [Spot("structure", a) for a in range(3)] + [Spot("drive", j) for j in range(actuators)]


class _Joined(dict[str, Floats]):
    """Covariates of all runs, one run behind the other, worked out when asked for."""

    def __init__(self, runs: Sequence[Rows]) -> None:
        super().__init__()
        self._runs = runs

    def __missing__(self, name: str) -> Floats:
        self[name] = np.concatenate([each[name] for each in self._runs])
        return self[name]


class TermBench:
    """Evaluates terms on the runs of a bench; noise, inflate, times: of its rows, as a Problem has them."""

    def __init__(self, bench: Bench, noise: Noise, inflate: Sequence[Floats], times: Sequence[Floats]) -> None:
        self.bench, self.noise, self.inflate, self.times = bench, noise, inflate, times
        self._rows: dict[tuple[str, int], list[Rows]] = {}
        self._ways: dict[Spot, list[Floats]] = {}
        self._squares: dict[Spot, list[Floats]] = {}
        self._reaches: dict[tuple[Spot, int], tuple[list[int], Floats]] = {}

    def rows(self, spot: Spot) -> Sequence[Rows]:
        """Covariates per run where the spot is."""
        key = (spot.on, spot.index) if spot.on in ("control", "drive") else ("tip", 0)
        if key not in self._rows:
            bench = self.bench
            self._rows[key] = (
                list(tip_rows(bench))
                if key[0] == "tip"
                else list(drive_rows(bench, spot.index, setpoints=spot.on == "control"))
            )
        return self._rows[key]

    def sizes(self, spot: Spot) -> Sizes:
        """Reach of the covariates there."""
        return sizes(self.rows(spot))

    def values(self, spot: Spot, *forms: Form) -> list[Floats]:
        """Functions of forms (n, f), one behind the other, per run: mm or rad per unit of their coefficients; 0 where they are none."""
        rows, known = self.rows(spot), dict.fromkeys(self.rows(spot)[0])
        parsed = [parse(text, known) for form in forms for text in form.said]
        out = [np.empty((len(parsed), r.rows)) for r in rows]  # rows of a function lie together, as they are worked out
        for some in _in_cache([r.rows for r in rows]):
            every = _Joined([rows[k] for k in some])
            ends = np.cumsum([rows[k].rows for k in some])
            for i, each in enumerate(parsed):
                if each.remembers:
                    for k in some:
                        out[k][i] = each(rows[k], rows[k].rows)
                else:
                    for k, values in zip(some, np.split(each(every, int(ends[-1])), ends[:-1]), strict=True):
                        out[k][i] = values
        for own in out:
            if not np.isfinite(own).all():
                np.nan_to_num(own, copy=False)
        return [own.T for own in out]

    def tip_ways(self, spot: Spot) -> list[Floats]:
        """By how much the tip (n, 3), program frame, moves per unit at the spot, per run."""
        if spot not in self._ways:
            self._ways[spot] = self._tip_ways(spot)
        return self._ways[spot]

    def rms(self, spot: Spot, values: Sequence[Floats]) -> Floats:
        """By how much each of functions (n, f) at a spot moves the tip (f,), per unit of its coefficient: over all rows."""
        if spot not in self._squares:
            self._squares[spot] = [np.sum(way**2, axis=1) for way in self.tip_ways(spot)]
        ways = self._squares[spot]
        energy = np.sum([way @ v**2 for way, v in zip(ways, values, strict=True)], axis=0)
        return np.asarray(np.sqrt(energy / sum(len(v) for v in values)))

    def _tip_ways(self, spot: Spot) -> list[Floats]:
        bench = self.bench
        if spot.on in ("control", "drive"):
            return [bench.row_slopes(k)[:, :, spot.index] for k in range(len(bench.runs))]
        return [np.tile(np.eye(3)[spot.index], (len(run.run_path.time), 1)) for run in bench.runs]

    def moves(self, spot: Spot, values: Sequence[Floats]) -> list[Floats]:
        """What functions (n, f) at a spot do to the tip (n', 3, f), thinned, per run."""
        out = []
        for way, v, run in zip(self.tip_ways(spot), values, self.bench.runs, strict=True):
            moved = way[:, :, None] * v[:, None, :]
            out.append(thinned(moved.reshape(len(v), -1), run.thin).reshape(-1, 3, v.shape[1]))
        return out

    def _seen_by_encoders(self, k: int) -> bool:
        run = self.bench.runs[k]
        return run.by == "setpoint" and run.measured.has("encoder")

    @cached_property
    def _slices(self) -> list[dict[int, Ints]]:
        """Per run: the white rows of every channel."""
        out = []
        for k, inflate in enumerate(self.inflate):
            at, found = 0, {}
            for c in range(inflate.shape[1]):
                count = int(np.isfinite(inflate[:, c]).sum())
                if count and np.isfinite(self.noise.sigma[k, c]):
                    found[c] = np.arange(at, at + count)
                    at += count
            out.append(found)
        return out

    def _reach(self, spot: Spot, k: int) -> tuple[list[int], Floats]:
        """The channels that a spot reaches in run k, and by how much (c, n) each moves per unit at the spot."""
        if (spot, k) not in self._reaches:
            n = len(self.bench.runs[k].run_path.time)
            if spot.on == "structure" and self.bench.runs[k].turn is None:
                self._reaches[spot, k] = [spot.index], np.ones((1, n))
            elif spot.on == "control" and self._seen_by_encoders(k):
                self._reaches[spot, k] = [3 + spot.index], np.ones((1, n))
            else:
                ways = np.ascontiguousarray(self.bench.turned(k, self.tip_ways(spot)[k]).T)
                moved = np.flatnonzero(np.abs(ways).max(axis=1) > 1e-9)
                self._reaches[spot, k] = moved.tolist(), ways[moved]
        return self._reaches[spot, k]

    def _reached(self, spot: Spot, k: int, values: Floats) -> dict[int, Floats]:
        """Functions (n, f) of run k in the channels that the spot reaches, thinned: (n', f) each."""
        channels, ways = self._reach(spot, k)
        return dict(zip(channels, means(values, ways, self.bench.runs[k].thin), strict=True))

    def white_rows(self, spot: Spot) -> int:
        """How many white rows of all runs the spot reaches."""
        ones = [np.ones((len(way), 1)) for way in self.tip_ways(spot)]
        return sum(map(len, self.white(spot, ones).rows))

    def seen(self, spot: Spot) -> list[Bools]:
        """Rows (n',) per run, thinned, in which some channel that the spot reaches is known."""
        return [
            np.asarray(np.isfinite(inflate[:, self._reach(spot, k)[0]]).any(axis=1))
            for k, inflate in enumerate(self.inflate)
        ]

    def channels(self, spot: Spot, values: Sequence[Floats]) -> list[Floats]:
        """Functions (n, f) per run as changes of all channels, thinned: (n', c, f)."""
        out = []
        for k, v in enumerate(values):
            every = np.zeros((len(self.times[k]), self.inflate[k].shape[1], v.shape[1]))
            for c, each in self._reached(spot, k, v).items():
                every[:, c] = each
            out.append(every)
        return out

    def white(self, spot: Spot, values: Sequence[Floats]) -> White:
        """Functions (n, f) per run as white columns of the channels that the spot reaches."""
        rows, columns = [], []
        for k, v in enumerate(values):
            found = [
                (self._slices[k][c], self.noise.rows(k, each[:, None, :], self.inflate[k], self.times[k], c))
                for c, each in self._reached(spot, k, v).items()
                if c in self._slices[k]
            ]
            if len(found) == 1:  # nothing has to be copied then
                rows.append(found[0][0])
                columns.append(found[0][1])
                continue
            rows.append(np.concatenate([r for r, _ in found]) if found else np.zeros(0, int))
            columns.append(np.concatenate([x for _, x in found]) if found else np.zeros((0, v.shape[1])))
        return White(tuple(rows), tuple(columns))


def _in_cache(lengths: Sequence[int]) -> list[list[int]]:
    """Numbers of runs of some lengths, those next to each other together as long as the processor keeps their rows at hand."""
    out: list[list[int]] = []
    for k, n in enumerate(lengths):
        if out and n + sum(lengths[i] for i in out[-1]) <= ROWS_AT_ONCE:
            out[-1].append(k)
        else:
            out.append([k])
    return out
