"""Runs on the bench: differences between logs and twin, and how every parameter would change them.

Columns are differences of the twin itself, at nominal or at any set of causes, so that what is fitted is what
simulate and compensate use.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from camcomp.diagnosis.fit.measured import Measured, stack
from camcomp.ground.datatypes import Bools, Floats, Path
from camcomp.model.effect import Cause, Parameter, public_values
from camcomp.model.motion.loaded_structure import Slopes, Solved, rows_together
from camcomp.model.motion.run_path import RunPath
from camcomp.model.motion.twin import Reading, Twin
from camcomp.model.signal_path import fitted_parameters, stages_of
from camcomp.model.statics.arm import ARM_LENGTH

SHARE_OF_SCALE = 0.05  # step of a difference, or of the logarithm of a spring or a force
MOST_ROWS = 3000  # of a run; neighbours of longer ones are averaged
_KEPT = 12  # changed machines whose structures are kept per run


@dataclass(frozen=True)
class CandidateCause:
    """One possible cause: an effect at a target. Fitted parameters in order; shape holds the scanned ones.

    hinge: the target is a rotary actuator, for which an effect may have parameters of its own. without: parameters that
    stay nominal, because these runs do not tell them from the others.
    """

    name: str
    target: str | None
    effect: Any
    hinge: bool = False
    without: tuple[str, ...] = ()

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The fitted parameters whose nominal value means no effect, i.e. all but the scanned shapes."""
        return tuple(p for p in fitted(self) if not p.shape)

    @property
    def shapes(self) -> tuple[Parameter, ...]:
        """The scanned parameters."""
        return tuple(p for p in fitted(self) if p.scan)

    @property
    def switches(self) -> tuple[Parameter, ...]:
        """The shapes that are one of a few values."""
        return tuple(p for p in fitted(self) if p.either)

    @property
    def of_drive_alone(self) -> bool:
        """Whether it acts between encoder and carriage only, so that columns come straight from its hooks."""
        return stages_of(self.effect) == {"drive"}

    @property
    def label(self) -> str:
        """Name for messages."""
        return f"{self.name}({self.target})" if self.target else self.name


def fitted(candidate: CandidateCause) -> tuple[Parameter, ...]:
    """The parameters in which an effect is fitted; those of its file unless it says otherwise."""
    effect = candidate.effect
    if hasattr(effect, "SOUGHT"):
        return tuple(effect.SOUGHT.get(candidate.target, ()))
    return tuple(p for p in fitted_parameters(effect, candidate.hinge) if p.name not in candidate.without)


@dataclass(frozen=True, eq=False, kw_only=True)
class Run:
    """A run on the bench: its run path, what was measured, its labels, and a factor by which rows are thinned."""

    name: str
    run_path: RunPath
    measured: Measured
    clamping: str | int | None
    clock: str | int | None
    thin: int = 1
    by: str = "setpoint"  # the channel that is the motion
    unsure: Bools | None = None  # (n,) rows without a usable tip
    program: Path | None = None  # what the control was given
    turn: Floats | None = None  # (n, 3, 3) program axes to along and across the path, where the tip is the motion

    def commanded(self, twin: Twin) -> Floats:
        """Tips (n, 3), program frame, of the unloaded machine at the set-points."""
        path = self.run_path
        return twin.to_program(path.row_place.of(path.node_tip) if path.driven is None else path.driven.tip)

    @cached_property
    def encoders(self) -> Floats | None:
        """Encoders (n, m) of the log, None where the log lacks them."""
        return self.measured.encoder if self.measured.has("encoder") else None


@dataclass(eq=False, kw_only=True)
class Bench:
    """A twin and the runs compared with it."""

    twin: Twin
    runs: Sequence[Run]
    solved: list[Solved] = field(default_factory=list)
    slopes: list[Slopes] = field(default_factory=list)
    nominal: list[Reading] = field(default_factory=list)
    # of candidates at nominal, worked out before: parameters, then runs (n, c)
    columns: dict[tuple[Any, ...], list[list[Floats]]] = field(default_factory=dict)
    _out: list[Bools] = field(default_factory=list)
    # structures of changed machines, by run and change
    _changed: dict[tuple[Any, ...], Solved] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for run in self.runs:
            reading, solved = self.twin.sense(run.run_path, measured=run.encoders)
            slopes = self.twin.slopes(run.run_path, (), solved)
            self.solved.append(solved)
            self.slopes.append(slopes)
            reading, _ = self.twin.sense(run.run_path, solved=solved, slopes=slopes, measured=run.encoders)
            self.nominal.append(reading)

    def without(self, outlying: Sequence[Bools]) -> None:
        """Leaves out cells (n, c) per run from all that follows."""
        self._out = list(outlying)

    @property
    def actuators(self) -> tuple[str, ...]:
        """Names in order."""
        return self.twin.actuators

    @cached_property
    def parts(self) -> dict[str, slice]:
        """The channels of every kind, in their order."""
        m = len(self.actuators)
        ends = np.cumsum([0, 3, m, m, 3]).tolist()
        return dict(zip(("tip", "encoder", "drive", "dyno"), map(slice, ends, ends[1:]), strict=False))

    def read(self, k: int, causes: Sequence[Cause]) -> Reading:
        """Readings of run k with causes on top of the config."""
        return self._sense(k, causes, self.runs[k].encoders)

    def _sense(self, k: int, causes: Sequence[Cause], encoders: Floats | None) -> Reading:
        """Readings of run k; the structure of a machine that was asked for lately is not solved again."""
        key = (k, self.twin.edited((*self.twin.causes, *causes))[1])
        solved = self._changed.get(key, self.solved[k])
        reading, used = self.twin.sense(
            self.runs[k].run_path, causes, solved=solved, slopes=self.slopes[k], measured=encoders
        )
        if used is not self.solved[k]:
            if len(self._changed) >= _KEPT * len(self.runs):
                self._changed.pop(next(iter(self._changed)))
            self._changed[key] = used
        return reading

    @cached_property
    def row_slopes(self) -> list[Floats]:
        """Derivative (n, 3, m) of the tip in the program frame by the carriages, at every row of every run."""
        every = zip(self.runs, self.slopes, strict=True)
        at_rows = [run.run_path.row_place.of(self.twin.rotation.T @ slopes.tip_rho) for run, slopes in every]
        return [rows_together(each) for each in at_rows]

    @cached_property
    def thin_slopes(self) -> list[Floats]:
        """The same (n', 3, m) at the rows that are kept after thinning."""
        return [thinned(slopes, run.thin) for slopes, run in zip(self.row_slopes, self.runs, strict=True)]

    @cached_property
    def springs(self) -> Floats:
        """Stiffness (m,) of the drives, N/mm or N mm/rad; infinite where none is stated."""
        return np.array([np.inf if a.stiffness is None else a.stiffness for a in self.twin.robot.actuators])

    @cached_property
    def levers(self) -> Floats:
        """Way (m,), mm, per unit of every actuator: 1 of a slide, that at the end of an arm of a hinge."""
        return np.array([ARM_LENGTH if a.revolute else 1.0 for a in self.twin.robot.actuators])

    def at_tip(self, k: int) -> Floats:
        """Motion of the tip (n, 3, c), machine axes, per unit of every channel at the rows of run k.

        An encoder moves it by the kinematics, a drive force by the spring that it loads, a dynamometer by the compliance.
        """
        slopes = self.slopes[k].at(self.runs[k].run_path.row_place)
        force = per_force(slopes.tip_wrench, self.twin.nominal.tool)
        tip = np.broadcast_to(np.eye(3), force.shape)
        return np.concatenate([tip, slopes.tip_rho, slopes.tip_rho / self.springs, force], axis=2)

    @cached_property
    def tip_sizes(self) -> Floats:
        """Rms (runs, c) of these motions over the rows of every run."""
        each = [np.mean(np.sum(self.at_tip(k) ** 2, axis=1), axis=0) for k in range(len(self.runs))]
        return np.sqrt(each)

    def channels(self, k: int, reading: Reading) -> Floats:
        """Channels (n, c) of readings of run k; its tip along and across the path where the tip is the motion."""
        return stack(self.turned(k, reading.tip), reading.encoder, reading.drive, reading.dyno)

    def turned(self, k: int, tip: Floats) -> Floats:
        """Vectors (n, 3), program axes, as the tip's channels of run k have them."""
        turn = self.runs[k].turn
        return tip if turn is None else np.einsum("nij,nj->ni", turn, tip)

    def observed(self, k: int) -> Floats:
        """Channels (n, c) as measured in run k.

        NaN where missing, where set-point or force are unknown, and in the channel that is the
        motion itself.
        """
        run, m = self.runs[k], self.runs[k].measured
        tip, encoder = self.turned(k, m.tip), m.encoder
        if run.unsure is not None:
            tip = np.where(run.unsure[:, None], np.nan, tip)
        if run.turn is not None:
            tip = np.where([True, False, False], np.nan, tip)
        if run.by != "setpoint":
            encoder = np.full_like(encoder, np.nan)
        loaded = np.where(run.run_path.jumping, np.nan, 0.0)[:, None]
        out = stack(tip + loaded, encoder, m.drive + loaded, m.dyno + loaded)
        if self._out:
            out[self._out[k]] = np.nan
        return out

    def off(self, k: int) -> Floats:
        """Measured minus nominal model (n, c) in every row of run k."""
        return self.observed(k) - self.channels(k, self.nominal[k])

    def residual(self, k: int) -> Floats:
        """Measured minus nominal model (n, c) in run k, thinned."""
        return thinned(self.off(k), self.runs[k].thin)

    def difference(self, k: int, reading: Reading) -> Floats:
        """Measured minus a reading (n, c) of run k, thinned."""
        return thinned(self.observed(k) - self.channels(k, reading), self.runs[k].thin)

    def change(self, k: int, after: Reading, before: Reading) -> Floats:
        """Change (n', c) of the channels of run k from one reading to another, thinned; the same arrays do not change."""
        n, thin = len(after.tip) // self.runs[k].thin, self.runs[k].thin
        pairs = (
            (self.turned(k, after.tip), self.turned(k, before.tip)),
            (after.encoder, before.encoder),
            (after.drive, before.drive),
            (after.dyno, before.dyno),
        )
        return stack(*(np.zeros((n, a.shape[1])) if a is b else thinned(a - b, thin) for a, b in pairs))

    def gap(self, k: int, causes: Sequence[Cause] = ()) -> Floats:
        """Measured minus model (n, c) in run k, thinned, with the model's own encoders: the gap as a user sees it.

        In program axes; along the path nothing is missing where the tip is the motion.
        """
        run = self.runs[k]
        gap = self.observed(k) - self.channels(
            k, self._sense(k, causes, None if run.by == "setpoint" else run.encoders)
        )
        if run.turn is not None:
            known = np.asarray(np.isfinite(gap[:, 1:3]).all(axis=1))
            back = np.einsum("nji,nj->ni", run.turn[:, 1:], gap[:, 1:3])
            gap[:, :3] = np.where(known[:, None], back, np.nan)
        return thinned(gap, run.thin)


def per_force(slopes: Floats, tool: Floats) -> Floats:
    """Slopes (n, c, 3) by a force on the tip of a tool (3,) mm, from slopes (n, c, 6) by the wrench at the platform."""
    return np.asarray(slopes[:, :, :3] + np.cross(slopes[:, :, 3:], tool))


def thinned(values: Floats, factor: int) -> Floats:
    """Means (n // factor, ...) of `factor` rows (n, ...) each, NaN where one is missing."""
    if factor == 1:
        return values
    n = len(values) // factor
    return np.asarray(np.einsum("nf...->n...", values[: n * factor].reshape(n, factor, *values.shape[1:])) / factor)


def means(values: Floats, ways: Floats, factor: int) -> Floats:
    """Means (c, n // factor, f) of functions (n, f) times ways (c, n) over `factor` rows each."""
    n = len(values) // factor
    functions, each = values[: n * factor].reshape(n, factor, -1), ways[:, : n * factor].reshape(-1, n, factor)
    return np.asarray(np.einsum("nif,cni->cnf", functions, each) / factor)


def cause_of(candidate: CandidateCause, coordinates: Mapping[str, float]) -> Cause:
    """The cause at fitting coordinates by parameter name; a missing coordinate takes its nominal value."""
    values = {p.name: p.value(coordinates.get(p.name, p.nominal if p.shape else 0.0)) for p in fitted(candidate)}
    return Cause(candidate.name, candidate.effect, candidate.target, public_values(candidate.effect, values))


def step_of(parameter: Parameter) -> float:
    """Coordinate step of a difference."""
    return parameter.scale * SHARE_OF_SCALE if not parameter.scan else 1e-4 * max(abs(parameter.nominal), 1e-3)
