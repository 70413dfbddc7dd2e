"""Which causes are kept jointly with an unmodelled effect, and how probable are they where it acts at their own
actuator?
"""

from collections.abc import Mapping
from dataclasses import dataclass

from camcomp.diagnosis.fit.gap import rest_by_actuator, tip_by_actuator
from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.search.unexplained import Unexplained, worst
from camcomp.diagnosis.search.unknown import foretelling, signal_rms
from camcomp.diagnosis.statistics.cause_sets import Fitted, Members
from camcomp.diagnosis.statistics.probability import EVEN

LEAST_NAMED = 0.4  # size in units of an unknown effect below which nothing is named beside it
PART_OF_UNKNOWN = 2.0  # size in units of an unknown effect below which a cause at its place is taken for a part of it
POINTED = 0.85  # share of what is left that one actuator has to have to be that place
ROWS_OF_AN_INSTANT = 2.0  # to both sides, between which something may have begun or ended


@dataclass(frozen=True)
class _Beside:
    """size: of a cause in units of what is left in the kind of channel that shows the cause best, of_all: of what is left in
    any; there: whether that points at the cause's actuator;
    anywhere: whether the cause is of no actuator.
    """

    size: float
    of_all: float
    there: bool
    anywhere: bool


def kept_with_unknown(problem: Problem, f: Fitted, beyond: Mapping[str, Unexplained]) -> Members:
    """The members that are kept jointly with an unknown effect, judged one by one.

    They predict withheld runs. A member that is smaller than the unknown effect is taken for a part of it where it acts
    at the actuator of the residual, or at no actuator.
    """
    members = foretelling(problem, f)
    each = _beside(problem, f, beyond, members)

    def stands(of: _Beside) -> bool:
        return of.of_all > LEAST_NAMED and of.size > (PART_OF_UNKNOWN if of.there else 1.0 if of.anywhere else 0.0)

    return tuple(i for i in members if stands(each[i]))


def _beside(problem: Problem, f: Fitted, beyond: Mapping[str, Unexplained], members: Members) -> dict[int, _Beside]:
    whole, kinds, out = worst(beyond).excess_um, dict[str, dict[str, float]](), dict[int, _Beside]()
    for i in members:
        shown = signal_rms(problem, f, (i,))
        kind = max(shown, key=lambda each: shown[each])
        left = beyond[kind].excess_um if kind in beyond else 0.0
        if kind not in kinds:
            kinds[kind] = rest_by_actuator(problem, f, kind)
        shares, target = kinds[kind], problem.columns.candidates[i].target
        where = next((name for name, share in shares.items() if share >= POINTED), None)
        there = where is not None and target == where
        if where is not None and target is None:
            there = tip_by_actuator(problem, f, i).get(where, 0.0) > EVEN
        size = problem.moved_um(f, (i,))
        out[i] = _Beside(size / max(left, 1e-9), size / max(whole, 1e-9), there, target is None and not there)
    return out
