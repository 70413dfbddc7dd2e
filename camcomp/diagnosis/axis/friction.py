"""Friction in the drive force of an axis: over which ways it turns round, how large it is, and what its law is not known to."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from camcomp.diagnosis.axis.block_least_squares import Series, fit, gain, solved, withheld
from camcomp.diagnosis.axis.channels import KNOWN, MIN_DIFFERENCE_Z, Column, helps, value_of
from camcomp.diagnosis.axis.findings import AxisFindings
from camcomp.diagnosis.axis.terms import PRESLIDING_GRID_MM, AxisTravel, Turning
from camcomp.diagnosis.result.types import Estimate, FoundCause
from camcomp.ground.datatypes import Bools, Floats


def brakes(data: Series, A: Floats) -> bool:
    """Whether the first two of the columns A (n, k), friction that turns round and drag with the speed, may be against the motion
    where it is slow and where it is fast: other friction is none.
    """
    c, C = fit(data, A)
    fast = float(np.abs(A[:, 1]).max())
    ways = np.array([[1.0, 0.0], [1.0, fast]])
    most = ways @ c[:2] + 1.96 * np.sqrt(np.einsum("ij,jk,ik->i", ways, C[:2, :2], ways))
    return bool(np.all(most > 0.0))


@dataclass(frozen=True, eq=False)
class TurningShape:
    """How friction turns round over a second distance, mm, as well: a column, and what withheld blocks leave with it."""

    distance: float
    column: Column
    last: Floats


def second_distance(
    data: Series, table: Any, *, train: list[int], columns: list[Column], last: Floats, length: Turning, moving: Bools
) -> TurningShape | None:
    """The second distance that helps withheld blocks most; None where one is enough.

    A guide has bristles of many lengths, and an encoder may sit behind a spring (the elements of a generalized Maxwell slip
    model: Al-Bender, Lampaert, Swevers, IEEE Trans. Autom. Control 50 (2005) 1883).
    """

    def with_it(distance: float) -> TurningShape:
        def column(m: AxisTravel) -> Floats:
            return m.reversal(Turning(distance)) - m.reversal(length)

        return TurningShape(distance, column, withheld(data, table(train, *columns, column)))

    every = [with_it(d) for d in PRESLIDING_GRID_MM if d != length.distance]
    best = min(every, key=lambda each: float(np.mean(np.log(np.maximum(each.last, 1e-300)))))
    more = gain(last, best.last, moving)
    return best if helps(more) else None


def friction_of(
    found: AxisFindings,
    data: Series,
    *,
    tables: Sequence[Floats],
    length: Turning,
    shape: TurningShape | None,
    lengths: Sequence[float],
    probability: float,
    before: Floats,
    last: Floats,
) -> FoundCause:
    """Tables (n, k): the columns, last, and before them those with the ways, over `lengths`, of turning round as well.

    shape: the last of the columns, where there is one.
    """
    c, C = fit(data, tables[-1])
    beside = [np.abs(solved(data, A) - c) for A in tables]
    spread = np.maximum(1.96 * np.sqrt(np.diag(C)), np.max(beside, axis=0))
    fast = max(float(np.sqrt(np.mean(tables[-1][:, 3] ** 2))), 1e-12)
    law = KNOWN * (abs(float(c[2])) + fast * abs(float(c[3])))  # N
    spread[2:] += law / np.array([1.0, *(fast for _ in c[3:])])
    turns = length.distance
    if shape is not None:  # the same way lost at a reversal
        turns = max(turns + float(c[-1] / c[2]) * (shape.distance - turns), PRESLIDING_GRID_MM[0])
        c = c[:-1]
    reach = [*lengths, turns]
    parameters = {
        "force_N": value_of(c[2], spread[2]),
        "viscous_Ns_per_mm": value_of(c[3], spread[3]),
        "presliding_mm": Estimate(value=float(f"{turns:.4g}"), ci95=(min(reach), max(reach))),
    }
    if len(c) > 4:
        parameters["asymmetry_Ns_per_mm"] = value_of(c[4], spread[4])
    found.details["force"] = {"mass_kg": value_of(c[1], spread[1]), "constant_N": value_of(c[0], spread[0])}
    if length.speed is not None:
        found.details["force"]["turning_mm_per_s"] = length.speed
    return FoundCause(
        effect="friction", target=found.name, probability=probability,
        share=round(1.0 - float(np.mean(last) / np.mean(before)), 4), parameters=parameters,
    )  # fmt: skip


def as_good(data: Series, table: Any, length: float) -> list[float]:
    """Distances of the scan with which friction may turn round as well, by withheld blocks."""
    best = withheld(data, table(Turning(length)))
    return [
        d for d in PRESLIDING_GRID_MM
        if d == length or gain(withheld(data, table(Turning(d))), best).z < MIN_DIFFERENCE_Z
    ]  # fmt: skip


def around(lengths: Sequence[float]) -> list[float]:
    """Distances of the scan from the shortest to the longest of these, and their neighbours.

    Two shorter ones: bristles do over a fraction of their length what an exponential does over the whole of its own, and
    the law of the drive is nobody's.
    """
    ends = [PRESLIDING_GRID_MM.index(each(lengths)) for each in (min, max)]
    return list(PRESLIDING_GRID_MM[max(ends[0] - 2, 0) : ends[1] + 2])


def uncertainty_of_friction(
    data: Series,
    turned: Callable[..., Floats],
    *,
    train: list[int],
    runs: Sequence[int],
    length: Turning,
    alike: Sequence[float],
    unsure: Mapping[int, Floats],
) -> dict[int, Floats]:
    """What rows (n,) of runs are not known to, where friction may turn round over other distances as well."""
    fitted = {d: solved(data, turned(Turning(d), train)) for d in (length.distance, *alike)}
    out = dict(unsure)
    for k in runs:
        force = {d: turned(Turning(d), [k]) @ c for d, c in fitted.items()}
        off = [np.abs(each - force[length.distance]) for each in force.values()]
        out[k] = np.hypot(out.get(k, 0.0), np.max(off, axis=0))
    return out
