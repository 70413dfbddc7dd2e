"""Static poses as the model of every log: columns and candidates of effects, and covariates of the dictionary.

A pose is a row with three channels, the tip in machine axes. Candidates are every effect at every target; an effect at
all joints is a family. Covariates are angles and torques of joints, places of the tip, time and temperature; each may
move the tip along all three axes, or as one joint moves it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from camcomp.diagnosis.arm.poses import CURVE, ArmBench, Column
from camcomp.diagnosis.model.candidates import AmplitudeBounds, Place, PlacedCause
from camcomp.diagnosis.model.discrepancy import covariate_columns, smooth_functions
from camcomp.diagnosis.model.evidence import LinearModel
from camcomp.ground.datatypes import Floats
from camcomp.model.statics.arm import joint_lines
from camcomp.model.statics.hanging import Hung

HARMONICS = (2, 4, 40)  # waves of the curve of a single joint, in as many ways
BY = " > "  # covariate > joint by whose motion it acts
DRIFT, DRIFT_FLOORS = "drift", 0.35  # how far a healthy instrument wanders over a campaign, in floors
STEADY_K = 0.1  # by which a temperature has to change to drive anything


@dataclass(frozen=True, eq=False)
class Shelf:
    """Columns of all effects that may move a standing arm, and the candidates that they make."""

    columns: tuple[Column, ...]
    candidates: tuple[PlacedCause, ...]

    @staticmethod
    def of(columns: Sequence[Column]) -> Shelf:
        """Every effect at every target, once for each shape."""
        own: dict[tuple[Place, tuple[Any, ...]], list[int]] = {}
        for j, column in enumerate(columns):
            own.setdefault(((column.effect, column.target), column.shape), []).append(j)
        shapes: dict[Place, int] = {}
        for place, _ in own:
            shapes[place] = shapes.get(place, 0) + 1
        out: list[PlacedCause] = []
        for (place, _), each in own.items():
            if place[0] != CURVE:
                out.append(PlacedCause(*place, tuple(each), float(shapes[place])))
                continue
            for most in HARMONICS:
                waves = tuple(j for j in each if wave_order(columns[j]) <= most)
                out.append(PlacedCause(*place, waves, float(len(HARMONICS))))
        return Shelf(tuple(columns), tuple(out))

    def with_more(self, columns: Sequence[Column], candidates: Sequence[PlacedCause]) -> Shelf:
        """With further columns behind those there are, and their candidates."""
        return Shelf((*self.columns, *columns), (*self.candidates, *candidates))

    def without_shapes(self) -> Shelf:
        """The columns that need no shape, and waves of single joints."""
        most = sorted(HARMONICS)[-2]
        return Shelf.of([c for c in self.columns if not c.shape and (c.effect != CURVE or wave_order(c) <= most)])

    @property
    def families(self) -> dict[str, tuple[int, ...]]:
        """Effects with several targets and no shape to choose, with their columns at all of them."""
        own: dict[str, list[int]] = {}
        for j, column in enumerate(self.columns):
            if not column.shape and column.target is not None:
                own.setdefault(column.effect, []).append(j)
        return {name: tuple(on) for name, on in own.items() if len({self.columns[j].target for j in on}) > 1}

    @property
    def bounds(self) -> AmplitudeBounds:
        """AmplitudeBounds of the columns."""
        return AmplitudeBounds.of([c.parameter for c in self.columns], [bool(c.shape) for c in self.columns])


def wave_order(column: Column) -> int:
    """How often a wave of a joint repeats per turn."""
    return int(column.parameter.name.split("_")[1])


def linearise(
    bench: ArmBench, shelf: Shelf, sd: float, at: Floats | None = None, weights: Sequence[Floats] | None = None
) -> LinearModel:
    """The model of a bench at amplitudes (k,), or at none; sd: noise, mm per coordinate, times weights (n,) of campaigns."""
    on = {} if at is None else {int(j): float(at[j]) for j in np.flatnonzero(at)}
    functions = dictionary(bench, sd)
    groups = [
        replace(g, B={name: columns[k] for name, columns in functions.items()})
        for k, g in enumerate(bench.groups(shelf.columns, sd, on))
    ]
    if weights is not None:
        groups = [replace(g, sd=g.sd * w[:, None]) for g, w in zip(groups, weights, strict=True)]
    healthy = {DRIFT: DRIFT_FLOORS} if DRIFT in groups[0].B else {}
    return LinearModel(
        groups=tuple(groups), candidates=shelf.candidates, bounds=shelf.bounds, fitted=bench.own,
        families=shelf.families, healthy=healthy,
    )  # fmt: skip


def dictionary(bench: ArmBench, sd: float) -> dict[str, list[Floats]]:
    """Covariate -> columns (n, 3, q) of every campaign, about one floor sd (mm) in size.

    A covariate of a joint moves the tip along all three axes, or as one joint moves it (`covariate > joint`); the position of a
    slide turns it as well: six error motions (ISO 230-1).
    """
    hung = [bench.standing(c, ()).hung for c in bench.campaigns]
    motion = [bench.joint_motion(c, (), bench.start[k]) for k, c in enumerate(bench.campaigns)]
    axes = [np.broadcast_to(sd * np.eye(3), (len(c.q), 3, 3)) for c in bench.campaigns]
    size = np.sqrt(np.mean(np.concatenate([(m**2).sum(axis=1) for m in motion]), axis=0) / 3.0)
    ways = [sd * m / np.maximum(size, 1e-12) for m in motion]
    out: dict[str, list[Floats]] = {}
    for a, drive in enumerate(bench.robot.actuators):
        for kind, values in (
            ("position", [c.q[:, a] for c in bench.campaigns]),
            ("force", [h.drive[:, a] for h in hung]),
        ):
            if np.ptp(np.concatenate(values)) > 0.0:
                turned = kind == "position" and not drive.revolute
                out[f"{kind}:{drive.name}"] = _of(values, _error_motions(bench, a, hung, axes) if turned else axes)
                for i, joint in enumerate(bench.actuators):
                    out[f"{kind}:{drive.name}{BY}{joint}"] = _of(values, [w[:, :, i : i + 1] for w in ways])
    for i, axis in enumerate("xyz"):
        out[f"position:{axis}"] = _of([h.point[:, i] for h in hung], axes)
    out |= _of_time(bench, [h.rotation for h in hung], axes, sd)
    heat = [c.temperature for c in bench.campaigns]
    known = [t for t in heat if t is not None]
    if len(known) == len(heat) and np.ptp(np.concatenate(known)) > STEADY_K:
        out["temperature"] = _of(known, axes)
    return out


def _of(values: Sequence[Floats], directions: Sequence[Floats]) -> list[Floats]:
    low, high = float(min(v.min() for v in values)), float(max(v.max() for v in values))
    return [
        covariate_columns(smooth_functions(v, low, high), d) for v, d in zip(values, directions, strict=True)
    ]  # fmt: skip


def _error_motions(bench: ArmBench, a: int, hung: Sequence[Hung], axes: Sequence[Floats]) -> list[Floats]:
    """Directions (n, 3, 6) of every campaign: shifts along the axes, and turns about a point of joint a that move the tip as far."""
    levers = [
        each.point - np.array([joint_lines(bench.arm, q)[1][a] for q in campaign.q])
        for each, campaign in zip(hung, bench.campaigns, strict=True)
    ]
    length = float(np.sqrt(np.mean(np.concatenate(levers) ** 2)))
    return [
        np.concatenate([e, np.cross(e, lever[:, :, None] / length, axis=1)], axis=2)
        for lever, e in zip(levers, axes, strict=True)
    ]


def _of_time(bench: ArmBench, rotation: Sequence[Floats], axes: Sequence[Floats], sd: float) -> dict[str, list[Floats]]:
    """Functions of time, of every campaign its own: drift of a healthy instrument, and of frame and target beyond it."""
    if not any(c.has_clock for c in bench.campaigns):
        return {}
    waves = [smooth_functions(c.order, 0.0, 1.0) * c.has_clock for c in bench.campaigns]
    both = [np.concatenate([e, sd * r], axis=2) for r, e in zip(rotation, axes, strict=True)]
    return {
        DRIFT: _apart([covariate_columns(w, e) for w, e in zip(waves, axes, strict=True)]),
        "time": _apart([covariate_columns(w, d) for w, d in zip(waves, both, strict=True)]),
    }


def _apart(parts: Sequence[Floats]) -> list[Floats]:
    """Columns (n, 3, q) of every campaign as columns that are 0 in the others."""
    width, many = parts[0].shape[2], len(parts)
    out = [np.zeros((len(part), 3, width * many)) for part in parts]
    for k, part in enumerate(parts):
        out[k][:, :, width * k : width * (k + 1)] = part
    return out
