"""Why single axes follow their set-points late and push harder than they should: logs of the control, without any tip.

Following error = lag x speed + (inertia in the loop) x acceleration + friction's reversal + constant.
Drive force     = mass x acceleration + friction + constant + what nobody states.
Inertia and constants belong to every axis and are no causes. Every further term has to prove itself on stretches of time
that it was not fitted on.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from camcomp.diagnosis.axis.block_least_squares import Gain, Series, fit, gain, log10_chance, series, solve, withheld
from camcomp.diagnosis.axis.terms import PRESLIDING_GRID_MM, AxisTravel, Ripple, ripple, strangers, travel
from camcomp.diagnosis.result.types import (
    DiagnosisResult,
    Driver,
    Estimate,
    Floor,
    FoundCause,
    GapSize,
    RippleDriver,
    ShrinkageStep,
    UnknownCause,
    UnseenShrinkage,
    Where,
)
from camcomp.diagnosis.statistics.probability import probability_of_chance, stated
from camcomp.ground.datatypes import Floats
from camcomp.model.motion.log_columns import log_columns

LEAST_Z = 4.0  # mean gain over its standard error
LEAST_SHARE = 0.03  # of the rms of withheld blocks
LEAST_RIPPLE = 0.02  # share of the leftover's energy
ROWS = 50  # below which a run says nothing
BOOTSTRAP_SEED = 20190101  # drawing has to give the same answer twice


@dataclass(frozen=True, eq=False)
class AxisRun:
    """Log of one axis in one run: time (n,) s; setpoint, encoder mm; force N, each (n,), NaN where nothing was logged."""

    name: str
    time: Floats
    setpoint: Floats
    encoder: Floats
    force: Floats


@dataclass(eq=False)
class _Channel:
    """One channel of one axis: what was fitted, block by block."""

    data: Series
    runs: list[int]
    first: Floats  # mean squares of withheld blocks without causes
    last: Floats
    steps: list[tuple[str, float]] = field(default_factory=list)  # effect, rms after
    left: list[Floats] = field(default_factory=list)  # per run
    floor: float = 0.0
    unseen: bool = False  # whether first and last are of whole runs that were not fitted


@dataclass(eq=False)
class _Axis:
    """What was found on one axis."""

    name: str
    causes: list[FoundCause] = field(default_factory=list)
    following: _Channel | None = None
    force: _Channel | None = None
    ripple: Ripple | None = None
    unknown_in: list[tuple[str, float]] = field(default_factory=list)  # covariate kind, share
    unknown_chance: float = 0.0  # log10, the least of all that is unknown
    details: dict[str, Any] = field(default_factory=dict)


def study(
    axes: Mapping[str, Sequence[AxisRun]], *, holdout: Sequence[str] = (), without: Sequence[str] = ()
) -> DiagnosisResult:
    """Result for logs of axes by name. holdout: runs that are judged and never fitted.

    Raises ValueError where no run of any axis has enough rows.
    """
    found = [_axis(name, list(runs), set(holdout), set(without)) for name, runs in axes.items()]
    found = [a for a in found if a.following is not None or a.force is not None]
    if not found:
        raise ValueError(
            "no axis has a run with set-points and encoders, or encoders and drive forces, in 50 rows or more"
        )
    strange = any(a.ripple or a.unknown_in for a in found)
    main = [c for a in found if (c := a.following or a.force) is not None]
    whole = sum((a.following is not None) + (a.force is not None) for a in found)  # every channel weighs alike
    causes = [c.model_copy(update={"share": round(c.share / whole, 4)}) for a in found for c in a.causes]
    causes.sort(key=lambda c: (-c.probability, -c.share))
    if strange:
        causes += [_unknown(a, whole) for a in found if a.ripple or a.unknown_in]
    names = sorted({r.name for runs in axes.values() for r in runs})
    gap = _gap(main)
    return DiagnosisResult(
        verdict="unknown" if strange else "identified" if causes else "none",
        gap=gap,
        where=_where(found, causes),
        causes=tuple(causes),
        shrinkage=_shrinkage(main, [n for n in names if not holdout or n in holdout]),
        floor=Floor(um=gap.noise_floor_um, source="rows"),
        axes_in_detail={a.name: a.details for a in found},
    )


def _axis(name: str, runs: list[AxisRun], holdout: set[str], without: set[str]) -> _Axis:
    found = _Axis(name)
    usable = [r for r in runs if np.isfinite(r.encoder).sum() >= ROWS]
    if not usable:
        return found
    moves = [travel(r.time, r.encoder) for r in usable]
    train = [k for k, r in enumerate(usable) if r.name not in holdout]
    test = [k for k, r in enumerate(usable) if r.name in holdout]
    gaps = [r.setpoint - r.encoder for r in usable]
    if train and all(np.isfinite(gaps[k]).all() for k in train):
        _following(found, usable, moves, gaps, train, test, without)
    if train and all(np.isfinite(usable[k].force).all() for k in train):
        _force(found, usable, moves, train, test, without)
    return found


# -- following error --------------------------------------------------------------------------------------------------


def _following(
    found: _Axis, runs: list[AxisRun], moves: list[AxisTravel], gaps: list[Floats], train: list[int], test: list[int],
    without: set[str],
) -> None:  # fmt: skip
    data = series([runs[k].time for k in train], [gaps[k] for k in train])

    def table(ks: Sequence[int], *columns: Any) -> Floats:
        return np.concatenate([np.stack([c(moves[k]) for c in columns], axis=1) for k in ks])

    one, push = (lambda m: np.ones_like(m.time)), (lambda m: m.acceleration)
    speed = lambda m: m.speed
    length = _presliding(data, lambda d: table(train, speed, push, one, lambda m: m.reversal(d)))
    turn = lambda m: m.reversal(length)
    before, last = withheld(data, table(train, one)), withheld(data, table(train, one, push))
    channel = _Channel(data, train, before, last)
    columns = [one, push]
    if "servo_lag" not in without:
        lag = withheld(data, table(train, one, push, speed, turn))
        blind = withheld(data, table(train, one, push, turn))
        g = gain(blind, lag)
        if g.z > LEAST_Z and g.log_ratio > LEAST_SHARE:
            columns = [one, push, speed, turn]
            c, C = fit(data, table(train, *columns))
            spread = 1.96 * float(np.sqrt(C[2, 2]))
            found.causes.append(
                FoundCause(
                    effect="servo_lag",
                    target=found.name,
                    probability=_probability(g),
                    share=round(1.0 - float(np.mean(lag) / np.mean(before)), 4),
                    parameters={"time_constant_ms": _value(1e3 * c[2], 1e3 * spread)},
                )
            )
            found.details["following"] = {
                "reversal_um": _value(1e3 * c[3], 1.96e3 * float(np.sqrt(C[3, 3]))),
                "presliding_mm": length,
                "acceleration_us2": _value(1e6 * c[1], 1.96e6 * float(np.sqrt(C[1, 1]))),
            }
            last = lag
    _close(found, channel, "servo_lag", last, data, table, columns, test, gaps, moves)
    found.following = channel


def _close(
    found: _Axis, channel: _Channel, effect: str, last: Floats, data: Series, table: Any, columns: list[Any],
    test: list[int], values: list[Floats], moves: list[AxisTravel],
) -> None:  # fmt: skip
    """Leftovers of the channel; where runs are held out, what is left there takes the place of withheld blocks."""
    c = solve(table(channel.runs, *columns), data.y)
    channel.left = [np.array(values[k] - table([k], *columns) @ c, dtype=np.float64) for k in channel.runs]
    channel.floor = float(np.sqrt(np.mean([_noise(each) ** 2 for each in channel.left])))
    channel.last = last
    channel.unseen = bool(test) or data.whole
    if test:
        base = solve(table(channel.runs, *columns[:1]), data.y)
        seen = series([moves[k].time for k in test], [values[k] for k in test])
        squares = [(seen.y - table(test, *cols) @ w) ** 2 for cols, w in ((columns[:1], base), (columns, c))]
        channel.first, channel.last = (
            np.array([s[seen.block == b].mean() for b in range(len(seen.others))]) for s in squares
        )
    if any(each.effect == effect for each in found.causes):
        channel.steps.append((effect, float(np.sqrt(np.mean(channel.last)))))


# -- drive force ------------------------------------------------------------------------------------------------------


def _force(
    found: _Axis, runs: list[AxisRun], moves: list[AxisTravel], train: list[int], test: list[int], without: set[str]
) -> None:
    forces = [r.force for r in runs]
    data = series([runs[k].time for k in train], [forces[k] for k in train])

    def table(ks: Sequence[int], *columns: Any) -> Floats:
        return np.concatenate([np.stack([c(moves[k]) for c in columns], axis=1) for k in ks])

    one, push = (lambda m: np.ones_like(m.time)), (lambda m: 1e-3 * m.acceleration)
    speed, both = (lambda m: m.speed), (lambda m: np.abs(m.speed))
    length = _presliding(data, lambda d: table(train, one, push, speed, both, lambda m: m.reversal(d)))
    turn = lambda m: m.reversal(length)
    columns = [one, push]
    before = withheld(data, table(train, *columns))
    channel = _Channel(data, train, withheld(data, table(train, one)), before)
    last = before
    if "friction" not in without:
        after = withheld(data, table(train, one, push, turn, speed))
        g = gain(before, after)
        if g.z > LEAST_Z and g.log_ratio > LEAST_SHARE:
            columns, last = [one, push, turn, speed], after
            lopsided = withheld(data, table(train, *columns, both))
            more = gain(last, lopsided)
            if more.z > LEAST_Z and more.log_ratio > LEAST_SHARE:
                columns, last = [*columns, both], lopsided
            found.causes.append(_friction(found, data, table(train, *columns), length, _probability(g), before, last))
            found.details["force"]["asymmetry_z"] = round(more.z, 2)
    _refused(found, data, table, train, columns, last, length)
    _close(found, channel, "friction", last, data, table, columns, test, forces, moves)
    found.force = channel
    line = ripple([moves[k] for k in train], channel.left)
    if line is not None and line.share > LEAST_RIPPLE:
        found.ripple = line
        waves = [lambda m, w=wave: w(2.0 * np.pi * m.position / line.period) for wave in (np.sin, np.cos)]
        g = gain(last, withheld(data, table(train, *columns, *waves)))
        found.unknown_chance = min(found.unknown_chance, log10_chance(g, line.tried))


def _friction(
    found: _Axis, data: Series, A: Floats, length: float, probability: float, before: Floats, last: Floats
) -> FoundCause:
    c, C = fit(data, A)
    spread = 1.96 * np.sqrt(np.diag(C))
    parameters = {
        "force_N": _value(c[2], spread[2]),
        "viscous_Ns_per_mm": _value(c[3], spread[3]),
        "presliding_mm": Estimate(value=length, ci95=_around(length)),
    }
    if len(c) > 4:
        parameters["asymmetry_Ns_per_mm"] = _value(c[4], spread[4])
    found.details["force"] = {"mass_kg": _value(c[1], spread[1]), "constant_N": _value(c[0], spread[0])}
    return FoundCause(
        effect="friction",
        target=found.name,
        probability=probability,
        share=round(1.0 - float(np.mean(last) / np.mean(before)), 4),
        parameters=parameters,
    )


def _refused(
    found: _Axis, data: Series, table: Any, train: list[int], columns: list[Any], last: Floats, length: float
) -> None:
    """Terms that nobody states, tried on withheld blocks; those that hold are part of the unknown."""
    tried = {}
    terms = strangers(AxisTravel(*(np.zeros(2) for _ in range(4))), 1.0)
    for name, (kind, _) in terms.items():
        column = lambda m, name=name: strangers(m, length)[name][1]
        g = gain(last, withheld(data, table(train, *columns, column)))
        tried[name] = {"z": round(g.z, 2), "gain": round(g.log_ratio, 4)}
        if g.z > LEAST_Z and g.log_ratio > LEAST_SHARE:
            found.unknown_chance = min(found.unknown_chance, log10_chance(g, len(terms)))
            found.unknown_in.append((f"{kind}:{found.name}", 1.0 - float(np.exp(-2.0 * g.log_ratio))))
    found.details.setdefault("force", {})["tried"] = tried


# -- common -----------------------------------------------------------------------------------------------------------


def _presliding(data: Series, table: Any) -> float:
    """The distance over which friction turns round, by withheld blocks; what is shorter than sampled comes out as a step."""
    return min(PRESLIDING_GRID_MM, key=lambda d: float(np.mean(np.log(withheld(data, table(d))))))


def _around(length: float) -> tuple[float, float]:
    """Neighbours of a value of the scan: what it is known to."""
    i = PRESLIDING_GRID_MM.index(length)
    return PRESLIDING_GRID_MM[max(i - 1, 0)], PRESLIDING_GRID_MM[min(i + 1, len(PRESLIDING_GRID_MM) - 1)]


def _probability(g: Gain) -> float:
    """That a term is at work, by the chance that withheld blocks gain as much from one that is not."""
    return stated(probability_of_chance(log10_chance(g)))


def _noise(left: Floats) -> float:
    """Noise of one row by second differences."""
    return float(np.sqrt(np.mean(np.diff(left, 2) ** 2) / 6.0)) if len(left) > 3 else 0.0


def _value(value: float, spread: float) -> Estimate:
    low, high = (float(f"{value + sign * spread:.6g}") for sign in (-1.0, 1.0))
    return Estimate(value=float(f"{value:.6g}"), ci95=(low, high))


def _unknown(axis: _Axis, whole: int) -> UnknownCause:
    """What is left of the drive force on purpose: its share of the gap, not of the leftover, as for every cause."""
    assert axis.force is not None
    parts = [axis.ripple.share] if axis.ripple else []
    left = float(np.mean([np.mean(each**2) for each in axis.force.left])) / max(
        float(np.mean(axis.force.first)), 1e-300
    )
    share = max([*parts, *(s for _, s in axis.unknown_in)]) * left / whole
    probability = stated(probability_of_chance(axis.unknown_chance))
    return UnknownCause(target=axis.name, probability=probability, share=round(share, 6))


def _gap(channels: Sequence[_Channel]) -> GapSize:
    """Size of the following errors in um; where only forces were logged, of these in mN."""
    size = 1e3 * np.abs(np.concatenate([c.data.y - (np.mean(c.data.y) if c.data.y.size else 0.0) for c in channels]))
    return GapSize(
        rms_um=round(float(np.sqrt(np.mean(size**2))), 3),
        p95_um=round(float(np.quantile(size, 0.95)), 3),
        max_um=round(float(size.max()), 3),
        noise_floor_um=round(1e3 * float(np.sqrt(np.mean([c.floor**2 for c in channels]))), 3),
    )


def _where(found: Sequence[_Axis], causes: Sequence[FoundCause]) -> Where:
    known = [c for c in causes if not isinstance(c, UnknownCause)]
    energy = {a.name: float(np.mean(c.first)) for a in found if (c := a.following or a.force) is not None}
    total = max(sum(energy.values()), 1e-300)
    drivers: list[Driver] = []
    for a in found:
        if a.ripple:
            line = a.ripple
            drivers.append(
                RippleDriver(
                    covariate=f"position:{a.name}",
                    share=round(line.share, 4),
                    channel=log_columns([a.name], [False]).drive[0],
                    period_mm=round(line.period, 4),
                    amplitude_N=round(line.amplitude, 3),
                    forward_N=round(line.forward, 3),
                    backward_N=round(line.backward, 3),
                )
            )
        drivers += [Driver(covariate=name, share=round(share, 4)) for name, share in a.unknown_in]
    lag = any(c.effect == "servo_lag" for c in known)
    return Where(
        stage="control" if lag or not known else "drive",
        axes={axis: round(energy.get(axis, 0.0) / total, 4) for axis in "xyz"},
        actuators={name: round(e / total, 4) for name, e in energy.items()},
        drivers=tuple(sorted(drivers, key=lambda d: -d.share)),
    )


def _shrinkage(channels: Sequence[_Channel], names: list[str]) -> UnseenShrinkage | None:
    """On whole runs that the fit has not seen; stretches of a run that was fitted are no such run."""
    if not all(c.unseen for c in channels):
        return None
    first, last = (np.concatenate([getattr(c, part) for c in channels]) for part in ("first", "last"))
    before, after = (float(np.sqrt(np.mean(s))) for s in (first, last))
    pick = np.random.default_rng(BOOTSTRAP_SEED).integers(0, len(first), (2000, len(first)))
    drawn = 1.0 - np.sqrt(last[pick].sum(axis=1) / np.maximum(first[pick].sum(axis=1), 1e-300))
    ratio = 1.0 - after / before if before > 0 else 0.0
    low, high = np.quantile(drawn, [0.025, 0.975])
    return UnseenShrinkage(
        holdout=tuple(names),
        before_rms_um=round(1e3 * before, 3),
        after_rms_um=round(1e3 * after, 3),
        ratio=round(ratio, 4),
        ci95=(round(float(min(low, ratio)), 4), round(float(max(high, ratio)), 4)),
        steps=tuple(
            ShrinkageStep(effect=e, target=None, after_rms_um=round(1e3 * s, 3)) for c in channels for e, s in c.steps
        ),
    )
