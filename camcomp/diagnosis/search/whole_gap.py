"""Whether a set of causes is what the gap consists of, as a user sees it: every row counts alike.

A fit makes little of rows of which little is known, those beside corners where only the tip is logged. What rings there
may leave most of the gap as it is, and a cause that fits the rest of the rows has not explained it.
"""

from __future__ import annotations

from camcomp.diagnosis.fit.gap import floor_um, gap_sizes
from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.search.unexplained import size_um
from camcomp.diagnosis.statistics.cause_sets import Fitted, Members

STANDS_OUT = 1.3  # of the floor: what a gap, or what is left of it, has to be to be more than drifts
REMAINS = 0.5  # of what a gap, or a cause, has to its square beyond the floor: who leaves more has not explained it


def nothing_to_explain(problem: Problem, f: Fitted) -> bool:
    """Whether the gap is not above the floor, and none of a set's members takes of it what it moves the tip by."""
    at_floor = _square(problem, f, ()) <= floor_um(problem) ** 2
    return bool(f.members) and at_floor and _idle(problem, f) == set(f.members)


def idle(problem: Problem, f: Fitted) -> set[int]:
    """Members of a set that leaves most of the gap without which that is hardly larger, for all that they move the tip by."""
    floor, before, after = floor_um(problem) ** 2, _square(problem, f, ()), _square(problem, f, f.members)
    if after <= STANDS_OUT**2 * floor or after - floor <= REMAINS * (before - floor):
        return set()
    return _idle(problem, f)


def _idle(problem: Problem, f: Fitted) -> set[int]:
    after, out = _square(problem, f, f.members), set()
    for i in f.members:
        taken = _square(problem, f, tuple(j for j in f.members if j != i)) - after
        if taken < (1.0 - REMAINS) * size_um(problem, f, (i,)) ** 2:
            out.add(i)
    return out


def _square(problem: Problem, f: Fitted, members: Members) -> float:
    """Mean square of the gap with some members of a set, um²."""
    return float((gap_sizes(problem, f, members) ** 2).mean())
