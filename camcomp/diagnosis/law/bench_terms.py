"""Terms on the bench: where a form acts, what it does to the channels of every run, and that in white rows."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from camcomp.diagnosis.fit.bench import Bench, means, thinned
from camcomp.diagnosis.law.forms import Form, Sizes, SmoothForm, sizes
from camcomp.diagnosis.statistics.by_channel import AT_ONCE, ByChannel
from camcomp.diagnosis.statistics.folds import RunColumns
from camcomp.diagnosis.statistics.noise_model import Noise
from camcomp.ground.datatypes import Floats
from camcomp.model.effect import Load
from camcomp.model.law.covariates import DriveRows, TipRows
from camcomp.model.law.expression import parse
from camcomp.model.law.spline_map import splines, tensor
from camcomp.model.statics.description import Robot

Rows = TipRows | DriveRows
AXES = "xyz"
OF_ACTUATORS = ("control", "drive", "force")  # places of a law


@dataclass(frozen=True)
class Spot:
    """Where a law acts: on control, drive or drive force of an actuator (its index), or on the tip along a program axis (0 to 2)."""

    on: str
    index: int


@dataclass(frozen=True)
class Term:
    """A form at a spot: columns that belong together."""

    spot: Spot
    form: Form | SmoothForm

    @property
    def kind(self) -> tuple[Spot, str, tuple[str, ...]]:
        """All but its shape."""
        return self.spot, self.form.family, self.form.about


def spots(actuators: int, kind: str) -> list[Spot]:
    """Where a law may act that shows in a kind of channel: behind encoders that were logged, or in front of them."""
    if kind == "encoder":
        return [Spot("control", j) for j in range(actuators)]
    return [Spot("structure", a) for a in range(3)] + [Spot("drive", j) for j in range(actuators)]


class TermRows(ABC):
    """Evaluates terms on rows of runs, whatever channels show them.

    actuators: names in order. row_counts: rows of every run. wide: size of these channels, standard deviation of what a law
    may move them by, before any data.
    """

    actuators: Sequence[str]
    row_counts: Sequence[int]
    wide: float

    @abstractmethod
    def unit(self, spot: Spot) -> str:
        """Of what a law does at a spot."""

    @abstractmethod
    def rows(self, spot: Spot) -> Sequence[Mapping[str, Floats]]:
        """Covariates per run where the spot is."""

    @abstractmethod
    def rms(self, spot: Spot, values: Sequence[Floats]) -> Floats:
        """By how much each of functions (n, f) at a spot moves the channels (f,), per unit of its coefficient: over all rows."""

    @abstractmethod
    def white(self, spot: Spot, values: Sequence[Floats]) -> RunColumns:
        """Functions (n, f) per run as white columns."""

    def where(self, spot: Spot) -> str:
        """A spot in words."""
        return f"{spot.on} {self.actuators[spot.index]}" if spot.on in OF_ACTUATORS else f"tip {AXES[spot.index]}"

    def sizes(self, spot: Spot) -> Sizes:
        """Reach of the covariates there."""
        return sizes(self.rows(spot))

    def values(self, spot: Spot, *forms: Form | SmoothForm) -> list[Floats]:
        """Functions of forms (n, f), one behind the other, per run: mm or rad per unit of their coefficients; 0 where they are none."""
        known = dict.fromkeys(self.rows(spot)[0])
        functions = [_functions(form, known) for form in forms]
        # rows of a function lie together, as they are worked out
        each = (
            np.concatenate([f(rows, n) for f in functions])
            for rows, n in zip(self.rows(spot), self.row_counts, strict=True)
        )
        return [np.nan_to_num(values, copy=False).T for values in each]

    def precision(self, spot: Spot, values: Sequence[Floats], count: int) -> Floats:
        """Prior precision (f, count) of functions (n, f count) of which each `count` belong together."""
        size = np.mean(self.rms(spot, values).reshape(-1, count) ** 2, axis=1) / self.wide**2
        return np.repeat(size[:, None] + 1e-12, count, axis=1)

    @cached_property
    def at_once(self) -> int:
        """Functions whose values in all rows, before rows are thinned, are AT_ONCE."""
        return max(AT_ONCE // sum(self.row_counts), 8)


class TermBench(TermRows):
    """Evaluates terms on the runs of a bench; noise: of its rows."""

    def __init__(self, bench: Bench, noise: Noise) -> None:
        self.bench, self.noise = bench, noise
        self._rows: dict[tuple[str, int], list[Rows]] = {}
        self._reaches: dict[tuple[Spot, int], tuple[list[int], Floats]] = {}
        self.actuators, self.row_counts = bench.actuators, [len(run.run_path.time) for run in bench.runs]
        gaps = np.concatenate([bench.gap(k)[:, :3].ravel() for k in range(len(bench.runs))])
        self.wide = float(np.sqrt(np.nanmean(gaps**2)))  # of a coordinate of the tip, mm

    def unit(self, spot: Spot) -> str:
        """Of what a law does at a spot."""
        hinge = spot.on in ("control", "drive") and self.bench.twin.robot.actuators[spot.index].revolute
        return "rad" if hinge else "mm"

    def rows(self, spot: Spot) -> Sequence[Rows]:
        """Covariates per run where the spot is."""
        key = (spot.on, spot.index) if spot.on in ("control", "drive") else ("tip", 0)
        if key not in self._rows:
            bench = self.bench
            self._rows[key] = (
                [TipRows(r.tip, Load(r.dyno, np.zeros((len(r.tip), 6))), r.motion) for r in bench.nominal]
                if key[0] == "tip"
                else [*_drive_rows(bench, spot.index, setpoints=spot.on == "control")]
            )
        return self._rows[key]

    def tip_ways(self, spot: Spot) -> list[Floats]:
        """By how much the tip (n, 3), program frame, moves per unit at the spot, per run."""
        if spot.on in ("control", "drive"):
            return [slopes[:, :, spot.index] for slopes in self.bench.row_slopes]
        return [np.tile(np.eye(3)[spot.index], (n, 1)) for n in self.row_counts]

    def rms(self, spot: Spot, values: Sequence[Floats]) -> Floats:
        """By how much each of functions (n, f) at a spot moves the tip (f,), per unit of its coefficient: over all rows."""
        energy = np.sum(
            [(way**2).sum(axis=1) @ v**2 for way, v in zip(self.tip_ways(spot), values, strict=True)], axis=0
        )
        return np.asarray(np.sqrt(energy / sum(self.row_counts)))

    def moves(self, spot: Spot, values: Sequence[Floats]) -> list[Floats]:
        """What functions (n, f) at a spot do to the tip (n', 3, f), thinned, per run."""
        out = []
        for way, v, run in zip(self.tip_ways(spot), values, self.bench.runs, strict=True):
            out.append(thinned(way[:, :, None] * v[:, None, :], run.thin))
        return out

    def _reach(self, spot: Spot, k: int) -> tuple[list[int], Floats]:
        """The channels that a spot reaches in run k, and by how much (c, n) each moves per unit at the spot."""
        if (spot, k) not in self._reaches:
            run = self.bench.runs[k]
            n = len(run.run_path.time)
            if spot.on == "structure" and run.turn is None:
                self._reaches[spot, k] = [spot.index], np.ones((1, n))
            elif spot.on == "control" and run.by == "setpoint" and run.measured.has("encoder"):
                self._reaches[spot, k] = [3 + spot.index], np.ones((1, n))
            else:
                ways = np.ascontiguousarray(self.bench.turned(k, self.tip_ways(spot)[k]).T)
                moved = np.flatnonzero(np.abs(ways).max(axis=1) > 1e-9)
                self._reaches[spot, k] = moved.tolist(), ways[moved]
        return self._reaches[spot, k]

    def reached(self, spot: Spot, k: int, values: Floats) -> ByChannel:
        """Functions (n, f) of run k in all of its channels, n' rows each, thinned."""
        run, every = self.bench.runs[k], np.arange(values.shape[1])
        channels, ways = self._reach(spot, k)
        moved = dict(zip(channels, means(values, ways, run.thin), strict=True))
        none = every[:0], np.zeros((len(values) // run.thin, 0))
        parts = [(every, moved[c]) if c in moved else none for c in range(self.noise.sigma.shape[1])]
        return ByChannel(len(every), tuple(parts))

    def white(self, spot: Spot, values: Sequence[Floats]) -> RunColumns:
        """Functions (n, f) per run as white columns of the channels that the spot reaches."""
        return [self.noise.by_channel(k, self.reached(spot, k, v)) for k, v in enumerate(values)]


def _functions(form: Form | SmoothForm, known: Mapping[str, object]) -> Callable[[Mapping[str, Floats], int], Floats]:
    """Functions (f, n) of a form, as a function of n rows with known covariates."""
    if isinstance(form, SmoothForm):
        along = list(zip(form.about, form.limits, form.counts, strict=True))
        return lambda rows, _: tensor([splines(rows[name], *limits, count) for name, limits, count in along]).T
    parsed = [parse(text, known) for text in form.said]
    return lambda rows, n: np.array([each(rows, n) for each in parsed])


def _load_names(robot: Robot, j: int) -> tuple[str, ...]:
    """The covariates that are loads of drives, where actuator j is meant: its own first, then those of the others that a formula
    can name.
    """
    units = [(each.name, "Nmm" if each.revolute else "N") for each in robot.actuators]
    own = f"load_{units[j][1]}"
    return (
        own,
        *(f"load_{name}_{unit}" for k, (name, unit) in enumerate(units) if k != j and f"load_{name}".isidentifier()),
    )


def _drive_rows(bench: Bench, j: int, *, setpoints: bool) -> list[DriveRows]:
    """Per run, of actuator j; setpoints: what the control was told instead of where the encoder was."""
    others = () if setpoints else _load_names(bench.twin.robot, j)
    out = []
    for run, reading in zip(bench.runs, bench.nominal, strict=True):
        motion = reading.motion
        if setpoints:
            motion = replace(motion, encoder=run.run_path.row_rho)
        elif run.by == "setpoint" and run.measured.has("encoder"):
            seen = run.measured.encoder
            motion = replace(motion, encoder=np.where(np.isfinite(seen), seen, motion.encoder))
        out.append(DriveRows(motion, j, others))
    return out
