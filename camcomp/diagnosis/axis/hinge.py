"""Why a hinge follows its set-points late, or ahead of them: the model of every log with the columns of one joint.

    set-point - encoder = T q' + a q'' + c tanh(q'/v0) + o + w1 sin q + w2 cos q + e

T is the time constant of `servo_lag`, the one candidate. Acceleration a, Coulomb friction c, offset o and the weight's
share w1, w2 are sizes that every joint has: they are shrunk, for joints move over a part of a turn in which these columns
are nearly the same. e has a memory: its rows count as one per correlation length.

Source: Swevers, Verdonck, De Schutter, IEEE Control Systems 27 (2007) 58; shrinkage by `camcomp.diagnosis.model`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from camcomp.diagnosis.axis.at_tip import lever_mm
from camcomp.diagnosis.axis.block_least_squares import by_block
from camcomp.diagnosis.axis.channels import series_of, value_of
from camcomp.diagnosis.axis.findings import AxisChannel, AxisFindings, AxisRun
from camcomp.diagnosis.axis.gate import judge
from camcomp.diagnosis.axis.terms import AxisTravel
from camcomp.diagnosis.model.calibration import calibration_of
from camcomp.diagnosis.model.candidates import AmplitudeBounds, PlacedCause
from camcomp.diagnosis.model.evidence import Background, LinearModel
from camcomp.diagnosis.model.group import Group
from camcomp.diagnosis.model.search import search_sets
from camcomp.diagnosis.result.types import FoundCause
from camcomp.diagnosis.statistics.probability import EVEN
from camcomp.ground import shelf
from camcomp.ground.datatypes import Floats

CREEP = 0.02  # of the fastest row: speed at which Coulomb friction has turned round
HEALTHY = ("acceleration", "friction", "offset", "weight")


def follow_hinge(
    found: AxisFindings, runs: list[AxisRun], moves: list[AxisTravel], gaps: list[Floats], floor: float, train: list[int],
    test: list[int], without: set[str],
) -> AxisFindings:  # fmt: skip
    """What was found on a hinge, with the channel of its following error; test: runs that are judged only."""
    found = replace(found, causes=[*found.causes], details={**found.details})
    fastest = max((float(np.abs(moves[k].speed).max(initial=0.0)) for k in train), default=0.0)
    designs = [_columns(m, fastest) for m in moves]
    model, unit = _model(found.name, designs, gaps, floor, train)
    every = search_sets(model.reduced(Background()), 0 if "servo_lag" in without else 1)
    values = every.values
    members = every.best
    weights = np.exp(np.array(list(values.values())) - max(values.values()))
    late = sum(w for m, w in zip(values, weights.tolist(), strict=True) if m) / float(weights.sum())
    mean, spread = _amplitudes(model, members)
    mean = mean * unit
    channel = _channel(runs, moves, gaps, designs, mean, floor, train, test, stated=found.stated.encoder_mm is not None)
    if members:
        scale = calibration_of("axes")
        before, after = (float(np.mean(each)) for each in (channel.first, channel.last))
        above = channel.gate is not None and channel.gate.word == "above"
        p = scale.calibrate(late)
        found.causes.append(
            FoundCause(
                effect="servo_lag", target=found.name, probability=min(p, EVEN) if above and after > 0.5 * before else p,
                share=round(max(1.0 - after / max(before, 1e-300), 0.0), 4),
                parameters={"time_constant_ms": value_of(1e3 * mean[0], 1.96e3 * scale.interval * spread)},
            )
        )  # fmt: skip
    if channel.gate is not None:
        found.unknown_chance = min(found.unknown_chance, channel.gate.chance)
    found.following = channel
    return found


def _columns(m: AxisTravel, fastest: float) -> Floats:
    """Columns (n, 6): speed, acceleration, Coulomb friction, one, sine and cosine of the angle."""
    angle = m.position / lever_mm(True)
    return np.stack(
        [
            m.speed, m.acceleration, np.tanh(m.speed / max(CREEP * fastest, 1e-12)), np.ones_like(angle), np.sin(angle),
            np.cos(angle),
        ],
        axis=1,
    )  # fmt: skip


def _model(
    name: str, designs: Sequence[Floats], gaps: Sequence[Floats], floor: float, train: Sequence[int]
) -> tuple[LinearModel, Floats]:
    """The model of the fitted runs, the lag as the candidate, all else as sizes that every joint has; and a unit (6,) of the columns."""
    A, y = np.concatenate([designs[k] for k in train]), np.concatenate([gaps[k] for k in train])
    left = y - A @ np.linalg.lstsq(A, y, rcond=1e-9)[0]
    sd = max(float(np.sqrt(np.mean(left**2))), floor) * np.sqrt(_rows_together(left))
    size = np.sqrt(np.mean(A**2, axis=0)) + 1e-300
    groups = []
    for k in train:
        white = designs[k] / size * sd  # one floor in size
        parts = (white[:, [1]], white[:, [2]], white[:, [3]], white[:, 4:])
        groups.append(
            Group(
                name=str(k), label="joint", y=gaps[k][:, None], A=designs[k][:, None, :1],
                N=np.zeros((len(gaps[k]), 1, 0)), sd=np.full((len(gaps[k]), 1), sd),
                B={kind: part[:, None, :] for kind, part in zip(HEALTHY, parts, strict=True)},
            )
        )  # fmt: skip
    lag = shelf.load("effects", "servo_lag").PARAMETERS[0]
    bounds = AmplitudeBounds(np.full(1, 1e-3 * lag.low), np.full(1, 1e-3 * lag.high), np.zeros(1), np.zeros(1, bool))
    scale = max(float(np.sqrt(np.mean(y**2))) / sd, 1e-6)
    model = LinearModel(
        tuple(groups), (PlacedCause("servo_lag", name, (0,)),), bounds, healthy=dict.fromkeys(HEALTHY, scale)
    )
    return model, np.append(1.0, sd / size[1:])


def _amplitudes(model: LinearModel, members: tuple[int, ...]) -> tuple[Floats, float]:
    """Amplitudes (6,) of the columns in the order of `_columns`, and the deviation of the lag, s."""
    at = model.posterior(Background(), model.reduced(Background()).slab(members))
    mean = np.zeros(6)
    mean[0] = at.mean[0]
    slots = {"acceleration": [1], "friction": [2], "offset": [3], "weight": [4, 5]}
    for kind, own in slots.items():
        mean[own] = at.mean[model.layout.covariates[kind]]
    spread = float(np.sqrt(at.covariance([0])[0, 0])) if members else 0.0
    return mean, spread


def _channel(
    runs: Sequence[AxisRun], moves: list[AxisTravel], gaps: list[Floats], designs: Sequence[Floats], mean: Floats,
    floor: float, train: list[int], test: list[int], *, stated: bool,
) -> AxisChannel:  # fmt: skip
    """Residuals of the fitted runs, and of those that are judged only, against the floor."""
    data = series_of(moves, gaps, train)
    channel = AxisChannel(data, train, by_block(data, data.y), by_block(data, data.y), floor=floor, stated=stated)
    channel.all_names = [r.name for r in runs]
    channel.columns, channel.moves = np.concatenate([designs[k] for k in train]), [moves[k] for k in train]
    left = {k: gaps[k] - designs[k] @ mean for k in (*train, *test)}
    channel.left = [left[k] for k in train]
    channel.last = by_block(data, np.concatenate(channel.left))
    if test:
        seen = series_of(moves, gaps, test)
        channel.first = by_block(seen, seen.y)
        channel.last = by_block(seen, np.concatenate([left[k] for k in test]))
    channel.held = {k: left[k] for k in test}
    channel.held_whole = {k: gaps[k] for k in test}
    channel.held_times = {k: moves[k].time for k in test}
    order = [*train, *test]
    channel.names = [runs[k].name for k in order]
    channel.gate = judge([left[k] for k in order], [left[k] for k in order], [moves[k].time for k in order], floor)
    return channel


def _rows_together(left: Floats) -> float:
    """Rows that count as one: the integral of the autocorrelation of residuals (n,) up to its first zero, both ways."""
    centred = left - left.mean()
    n = len(centred)
    power = np.abs(np.fft.rfft(centred, 2 * n)) ** 2
    rho = np.fft.irfft(power)[:n]
    rho = rho / max(float(rho[0]), 1e-300)
    ends = np.flatnonzero(rho <= 0.0)
    return float(1.0 + 2.0 * rho[1 : ends[0] if len(ends) else n].sum())
