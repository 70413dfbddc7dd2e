"""On which covariates do the residuals of an axis depend: its own motion, its direction, time, or the motion of another
axis?
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from camcomp.diagnosis.axis.block_least_squares import FEWEST, Series, by_block, gain, leftover, log10_chance
from camcomp.diagnosis.axis.gate import ABOVE, FALSE
from camcomp.diagnosis.axis.law import TURN_MM
from camcomp.diagnosis.axis.terms import AxisTravel, Turning
from camcomp.ground.datatypes import Bools, Floats

BINS = 16  # of a covariate
STEPS = 4  # powers of time since a run began
SLOW = 0.01  # of the fastest row: rows of an axis that stands are of one place
SINCE_MM = (0.005, 0.02, 0.1, 0.5, 2.0)  # ways from a reversal on


def dependences(
    data: Series, A: Floats, moves: Sequence[AxisTravel], others: Mapping[str, Sequence[AxisTravel]], floor: float
) -> list[tuple[str, float, float]]:
    """Covariate, share of what columns A (n, k) leave that it foretells, log10 of its chance; one in a hundred is false.

    Told by the withheld blocks that leave more than the floor: where nothing is left there is nothing to foretell. moves: of
    the runs that the rows are of; others: the same runs of other axes by their name, with rows of their own. Own covariates
    have no name: `position`; those of others have one: `acceleration:x`.
    """
    rest = leftover(data, A)
    before = by_block(data, rest)
    telling = before > ABOVE * floor**2
    if telling.sum() < FEWEST:
        return []
    every = list(_covariates(moves, others))
    out: dict[str, tuple[str, float, float]] = {}
    for name, columns in every:
        left = leftover(data, np.concatenate([A, columns], axis=1))
        found = gain(before, by_block(data, left), telling)
        chance, share = log10_chance(found, len(every)), 1.0 - float(np.mean(left**2) / np.mean(rest**2))
        if chance < np.log10(FALSE) and found.log_ratio > 0.0 and share > out.get(name, (name, 0.0, 0.0))[1]:
            out[name] = (name, share, chance)
    return sorted(out.values(), key=lambda each: -each[1])


def _covariates(
    moves: Sequence[AxisTravel], others: Mapping[str, Sequence[AxisTravel]]
) -> Iterator[tuple[str, Floats]]:
    """Names and columns (n, k)."""
    way = np.concatenate([m.reversal(Turning(TURN_MM)) for m in moves])[:, None]
    speed = np.concatenate([m.speed for m in moves])
    moving = np.abs(speed) > SLOW * np.abs(speed).max(initial=0.0)
    place = _stepped(np.concatenate([m.position for m in moves]), moving)
    yield "position", place
    yield "position", np.concatenate([way, place, way * place], axis=1)  # another one on the way back
    yield "position", speed[:, None] * place  # of a loop's gain
    yield "velocity", _stepped(speed, moving)
    yield "acceleration", _stepped(np.concatenate([m.acceleration for m in moves]), moving)
    ways = [np.concatenate([m.reversal(Turning(far)) for m in moves]) for far in SINCE_MM]
    yield "reversal", np.stack(ways, axis=1)
    time = np.concatenate([_while(m.time) for m in moves])
    yield "time", time
    yield "time", np.concatenate([way, time, way * time], axis=1)
    for name, theirs in others.items():
        for kind in ("velocity", "acceleration"):
            values = [
                np.interp(m.time, t.time, t.speed if kind == "velocity" else t.acceleration)
                for m, t in zip(moves, theirs, strict=True)
            ]
            x = np.concatenate(values)
            if np.ptp(x) > 0.0:
                yield f"{kind}:{name}", _stepped(x, x != np.median(x))


def _stepped(x: Floats, where: Bools) -> Floats:
    """Steps (n, BINS - 1) over a covariate (n,), between equally many of some rows; of all where these are none."""
    edges = np.unique(np.quantile(x[where] if where.any() else x, np.linspace(0.0, 1.0, BINS + 1)[1:-1]))
    return (np.searchsorted(edges, x)[:, None] >= np.arange(1, len(edges) + 1)).astype(float)


def _while(time: Floats) -> Floats:
    """Powers (n, STEPS) of the time since the run began: what fades or grows with it."""
    u = (time - time[0]) / max(float(time[-1] - time[0]), 1e-12)
    return np.stack([u**k for k in range(1, STEPS + 1)], axis=1)
