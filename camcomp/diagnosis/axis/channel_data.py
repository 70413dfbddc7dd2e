"""Rows of one channel of an axis, and the priors of the sizes that every axis has."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import norm

from camcomp.diagnosis.axis.effect_columns import AxisCause, ChannelName
from camcomp.diagnosis.axis.findings import AxisRun
from camcomp.diagnosis.axis.gate import within_a_row
from camcomp.diagnosis.axis.noise_floor import noise_after_fit
from camcomp.diagnosis.axis.terms import AxisTravel
from camcomp.diagnosis.model.noise import MINOR
from camcomp.ground.datatypes import Bools, Floats

LEAST = 1e-3  # of the largest column: below it bodies do not show
HEALTHY_SHARE = 0.3  # of the channel's size: scale of a size that every axis has
FORM = 0.2  # of the torque by which friction of a hinge is smaller while it turns round: laws of that are no better than this
CLOCK, TURNING = "clock", "turning"  # kinds: rows that are late; friction while it turns round, limited by its peak
MASSES = "load of stated masses"  # kind: that deflects a loop, where the rows show it
BETWEEN = "between rows"  # kind: motion between two rows, as far off as it may be
BODIES = "bodies"  # kind: masses, first moments and inertias of the links behind a hinge, as a base of their columns
ACCELERATION = "acceleration"  # kind: what the loop of a drive does, and inertia
# kinds that may be unmodelled in a following error, and the covariate by which they are told
BEYOND = {ACCELERATION: "acceleration", "friction": "reversal", "weight": "position"}
Sizes = Mapping[str, Floats]  # kind -> columns (n, q)
Response = Callable[[int, Sequence[tuple[AxisCause, Floats]]], Floats]  # run, causes that act -> values (n,)


def no_response(run: int, acting: Sequence[tuple[AxisCause, Floats]]) -> Floats:
    """Response of a channel whose causes are not known yet."""
    raise NotImplementedError


@dataclass(frozen=True, eq=False, kw_only=True)
class ChannelData:
    """Rows of one channel of an axis, per run: the log, how the axis moved in the rows that count, and their values (n,).

    train, test: runs that are fitted, and that are judged only. floor: noise of the channel. whole: times and values of every row,
    those that count where it is not given. asymmetric: whether friction in the drive force differs between the
    directions, which deflects the loop. ahead: whether encoders are ahead of their set-points by half a row or more. unsure (n,) per run: uncertainty of rows in addition to the floor, 0 where it is not
    given; misfit: rms residual in floors, at least 1, to which it is added. between (n, 2) per run: uncertainty by the
    set-points between two rows, which no log holds. healthy: columns of the sizes that every axis has; inertia: those that
    are force of inertia alone; minor: kinds of healthy sizes that are no larger than on a healthy machine, while others may be as
    large as the channel; between_s2: following error per acceleration by the motion between two rows. covariates (n,) of the
    dictionary. response: what causes with their amplitudes (d,) add to the channel of run k (n,). level: constant without a
    meaning. clock: standard deviation of the instants of rows against the motion, s. scatter: of the encoders by which the axis
    moved, row by row. deflected: columns of healthy sizes that deflect a loop, as it follows
    them beside causes that act on run k.
    """

    channel: ChannelName
    runs: Sequence[AxisRun]
    moves: Sequence[AxisTravel]
    values: Sequence[Floats]
    train: Sequence[int]
    test: Sequence[int]
    floor: float
    stated: bool
    whole: Sequence[tuple[Floats, Floats]] = ()
    asymmetric: bool = False
    ahead: bool = False
    unsure: Sequence[Floats] = ()
    misfit: float = 1.0
    between: Sequence[Floats] = ()
    healthy: Sequence[Sizes] = ()
    inertia: Sequence[Sizes] = ()
    minor: frozenset[str] = frozenset()
    between_s2: float = 0.0
    covariates: Sequence[Mapping[str, Floats]] = ()
    response: Response = no_response
    level: float = 0.0
    clock: float = 0.0
    scatter: float = 0.0
    deflected: Callable[[int, Sequence[tuple[AxisCause, Floats]]], Sizes] = lambda run, acting: {}

    @property
    def hinge(self) -> bool:
        """Whether the axis turns."""
        return self.runs[0].revolute

    @property
    def fastest(self) -> float:
        """Largest speed of the fitted runs."""
        return max((float(np.abs(self.moves[k].speed).max(initial=0.0)) for k in self.train), default=0.0)

    @property
    def seen(self) -> list[Bools]:
        """Rows (n,) of every run that count."""
        return [np.isin(run.time, m.time) for run, m in zip(self.runs, self.moves, strict=True)]

    def in_floors(self, rows: Mapping[int, Floats]) -> Floats:
        """Rows of the fitted runs one after the other, each over its noise. rows: values (n,) or columns (n, k) by run."""
        return np.concatenate([(rows[k].T / self.noise(k)).T for k in self.train])

    def noise(self, run: int) -> Floats:
        """Noise (n,) of the rows of a run in units of their misfit, 1 where they are known to the floor."""
        own = self.unsure[run] if self.unsure else np.zeros(len(self.values[run]))
        return np.asarray(np.hypot(1.0, own / (self.misfit * self.floor)))

    def with_misfit(self, left: Floats) -> ChannelData:
        """The data with the misfit of residuals (n,) of the fitted runs, each row over its noise."""
        return replace(self, misfit=max(float(np.sqrt(np.mean(left**2))) / self.floor, 1.0))

    def where(self, acting: Sequence[tuple[AxisCause, Floats]]) -> ChannelData:
        """The data with the healthy sizes beside causes that act, as they are with amplitudes (d,)."""
        some = [each for each in acting if each[1].any()]
        pushed = [self.deflected(k, some) for k in range(len(self.healthy))]
        healthy = [
            {kind: new.get(kind, own[kind]) for kind in own} for own, new in zip(self.healthy, pushed, strict=True)
        ]
        return replace(self, healthy=healthy)

    def without(self, kind: str) -> ChannelData:
        """The data without the healthy sizes of a kind."""
        return replace(self, healthy=[{k: own[k] for k in own if k != kind} for own in self.healthy])

    def healthy_columns(self, run: int) -> Floats:
        """Columns (n, q) of healthy sizes of all kinds."""
        return np.concatenate([*self.healthy[run].values()], axis=1)

    def residual_of(self, run: int, left: Sequence[Floats]) -> ChannelData:
        """Residuals (n,) of one run, to which a constant is fitted; left: of every run."""
        one = [{"offset": np.ones((len(each), 1))} for each in left]
        return replace(self, values=left, healthy=one, train=[run], level=0.0, clock=0.0)

    def minor_size(self, kind: str) -> float:
        """Effect (rms) on the fitted runs that sizes of a kind have on a healthy machine."""
        rows = np.concatenate([self.healthy[k][kind] for k in self.train])
        between = self.between_s2 * float(np.sqrt(np.mean(rows**2))) if kind == ACCELERATION else 0.0
        return float(np.hypot(MINOR * self.floor, between))

    @property
    def scales(self) -> dict[str, Floats]:
        """Standard deviations (q,) of the amplitudes of healthy columns before the rows are seen, by kind."""
        size = float(np.sqrt(np.mean(np.concatenate([self.values[k] for k in self.train]) ** 2)))
        out = {}
        for kind in self.healthy[0]:
            own = np.concatenate([self.healthy[k][kind] for k in self.train])
            each = np.abs(own).max(axis=0) if kind == TURNING else np.sqrt(np.mean(own**2, axis=0))
            most = self.minor_size(kind) if kind in self.minor else HEALTHY_SHARE * max(size, self.floor)
            out[kind] = np.divide(most, each, out=np.zeros_like(each), where=each > 0.0)
            out[kind] = np.full(1, self.clock) if kind == CLOCK else out[kind]
            out[kind] = np.ones(own.shape[1]) if kind == BETWEEN else out[kind]
            out[kind] = np.full(n := own.shape[1], most / np.sqrt(max(n, 1))) if kind == BODIES else out[kind]
        return out

    def friction_unknown(self, run: int, sizes: Mapping[str, Floats], caused: Floats) -> Floats:
        """What friction (n,) is not known to, row by row: its form while it turns round, in a hinge, and which way it acts.

        sizes: healthy ones by kind. caused (n,): force of the causes.
        """
        form = FORM * self.hinge * (self.healthy[run][TURNING] @ sizes[TURNING])
        return np.asarray(np.hypot(form, caused * sense_unknown(self.moves[run])))

    def refined(self, left: Sequence[Floats], sizes: Mapping[str, Floats]) -> ChannelData:
        """The data with a column for rows that are later or earlier than the motion, and with the noise of rows in which inertia
        is not known to the floor, for the instant of a force within its row is not, or friction, while it turns round or may act
        either way.

        left: residuals (n,) per run. sizes: healthy sizes by kind of the same fit.
        """
        if self.clock == 0.0:
            return self
        own = [y - each for y, each in zip(self.values, left, strict=True)]
        slopes = [np.gradient(each, m.time)[:, None] for each, m in zip(own, self.moves, strict=True)]
        inertia = [np.sum([own[kind] @ sizes[kind] for kind in own], axis=0) for own in self.inertia]
        caused = [each - sum(h[kind] @ sizes[kind] for kind in h) for each, h in zip(own, self.healthy, strict=True)]
        forms = [self.friction_unknown(k, sizes, each) for k, each in enumerate(caused)]
        return replace(
            self, healthy=[{**own, CLOCK: each} for own, each in zip(self.healthy, slopes, strict=True)],
            unsure=[np.hypot(within_a_row(each), form) for each, form in zip(inertia, forms, strict=True)],
        )  # fmt: skip


def sense_unknown(move: AxisTravel) -> Floats:
    """Standard deviation (n,) of the sense in which an axis moves, 1 where it may be either.

    The speed of a row is not known to what the acceleration changes within a row.
    """
    unsure = within_a_row(move.acceleration) * np.gradient(move.time)
    forth = norm.cdf(np.divide(np.abs(move.speed), unsure, out=np.full(len(unsure), np.inf), where=unsure > 0.0))
    return np.asarray(2.0 * np.sqrt(forth * (1.0 - forth)))


def base_of(columns: Sequence[Floats]) -> Floats:
    """Independent combinations (c, b) of columns (n, c) per run, each column at its usual size.

    Gautier, Khalil, IEEE Trans. Robotics and Automation 6 (1990): only these combinations of inertial parameters show.
    """
    rows = np.concatenate(columns)
    size = np.sqrt(np.mean(rows**2, axis=0))
    unit = np.divide(1.0, size, out=np.zeros_like(size), where=size > LEAST * size.max(initial=0.0))
    values, vectors = np.linalg.eigh(unit[:, None] * (rows.T @ rows / len(rows)) * unit)
    return np.asarray(unit[:, None] * vectors[:, values > LEAST**2 * values.max(initial=0.0)])


def shrunk(A: Floats, y: Floats, prior: Floats, sd: float) -> tuple[Floats, Floats]:
    """Amplitudes (k,) of columns (n, k) under a prior of standard deviations (k,), and their covariance (k, k)."""
    weight = 1.0 / np.maximum(prior, 1e-30)
    unit = 1.0 / np.sqrt(np.sum((A / sd) ** 2, axis=0) + weight**2 + 1e-60)
    rows = np.concatenate([A / sd * unit, np.diag(weight * unit)])
    mean = np.linalg.lstsq(rows, np.concatenate([y / sd, np.zeros(len(unit))]), rcond=1e-9)[0] * unit
    return mean, np.linalg.pinv(rows.T @ rows, rcond=1e-12, hermitian=True) * np.outer(unit, unit)


def healthy_sizes(columns: Floats, values: Floats, floor: float) -> tuple[Floats, Floats]:
    """Sizes (q,) that every axis has, of columns (n, q) in values (n,), under the prior of `fit_channel`, with their covariance."""
    sd, size = noise_after_fit(columns, values, floor), np.sqrt(np.mean(columns**2, axis=0)) + 1e-300
    most = max(HEALTHY_SHARE * float(np.sqrt(np.mean(values**2))), 1e-6 * sd)
    return shrunk(columns, values, most / size, sd)
