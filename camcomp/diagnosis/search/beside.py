"""Which causes stand beside an effect that no library has, and how sure they are where it points at their own place."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from camcomp.diagnosis.fit.gap import rest_by_actuator, tip_by_actuator
from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.search.unexplained import Unexplained, size_um, worst
from camcomp.diagnosis.search.unknown import foretelling, signal_rms
from camcomp.diagnosis.statistics.cause_sets import SIZES, Fitted, Members
from camcomp.diagnosis.statistics.probability import EVEN

LEAST_BESIDE = 0.4  # size in units of an unknown effect below which nothing is named beside it
PART_OF_UNKNOWN = 2.0  # size in units of an unknown effect below which a cause at its place is taken for a part of it
POINTED = 0.85  # share of what is left that one actuator has to have to be that place
ONE_MORE = SIZES[2] / SIZES[1]  # prior odds of one cause more than the unknown effect
STAGES = 7  # control, drive, structure, process, tool, workpiece, sensor: contract, section 6
ROWS_OF_AN_INSTANT = 2.0  # to both sides, between which something may have begun or ended


@dataclass(frozen=True)
class _Beside:
    """size: of a cause in units of what is left in the kind of channel that shows the cause best, of_all: of what is left in
    any; share: of that at the cause's actuator, 1 where the cause is of none; there: whether that points at the cause's actuator;
    anywhere: whether the cause is of no actuator.
    """

    size: float
    of_all: float
    share: float
    there: bool
    anywhere: bool


def beside_unknown(problem: Problem, f: Fitted, beyond: Mapping[str, Unexplained]) -> Members:
    """The members that stand beside an unknown effect, one by one.

    They foretell what unseen runs show. What is smaller than the unknown one and aimed at the actuator that the rest
    points at is most likely a part of it; so is what is smaller and of no actuator. What began at several actuators at once is
    one event, of a place that all of them move.
    """
    members = foretelling(problem, f)
    events = _shared_events(problem, f, members)
    members = tuple(i for i in members if i not in events)
    each = _beside(problem, f, beyond, members)

    def stands(of: _Beside) -> bool:
        return of.of_all > LEAST_BESIDE and of.size > (PART_OF_UNKNOWN if of.there else 1.0 if of.anywhere else 0.0)

    return tuple(i for i in members if stands(each[i]))


def _shared_events(problem: Problem, f: Fitted, members: Members) -> set[int]:
    """The members that act for a while and began when another one of another actuator did."""
    began = {i: f.extra[i][problem.columns.candidates[i].shapes[0].name] for i in members if problem.passing(i)}
    if len(began) < 2:
        return set()
    rows = max(float(np.median(np.diff(run.run_path.time))) for run in problem.bench.runs)
    return {i for i in began for j in began if i != j and abs(began[i] - began[j]) <= ROWS_OF_AN_INSTANT * rows}


def doubted(
    problem: Problem, f: Fitted, beyond: Mapping[str, Unexplained], drawn: Mapping[int, float]
) -> dict[int, float]:
    """Most that the probability of each member can be beside what is left.

    Either there is a cause more than the unknown effect, which by chance is where that one is: at the same actuator, one of m, or
    in the same stage. Or the member imitates it, as far as it is there or goes by what it goes by (drawn: how far that
    draws the member): up to which share of its energy an unknown effect can be imitated nobody knows, so that every share is
    as likely. Of what shows at another place, in another kind of channel or by another law, it is no imitation.
    """
    out = {}
    for i, each in _beside(problem, f, beyond, f.members).items():
        chance = ONE_MORE / (STAGES if each.anywhere else len(problem.bench.actuators))
        alike = drawn[i] if each.anywhere else each.share
        out[i] = chance / (chance + alike / (1.0 + each.size**2))
    return out


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
        size = size_um(problem, f, (i,))
        share = 1.0 if target is None else shares.get(target, 0.0)
        out[i] = _Beside(size / max(left, 1e-9), size / max(whole, 1e-9), share, there, target is None and not there)
    return out
