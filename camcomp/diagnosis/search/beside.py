"""Which causes stand beside an effect that no library has, and how sure they are where it points at their own place."""

from collections.abc import Mapping
from dataclasses import dataclass

from camcomp.diagnosis.fit.gap import rest_by_actuator, tip_by_actuator
from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.search.unexplained import Unexplained, size_um, worst
from camcomp.diagnosis.search.unknown import foretelling, signal_rms
from camcomp.diagnosis.statistics.cause_sets import Fitted, Members
from camcomp.diagnosis.statistics.probability import EVEN

LEAST_BESIDE = 0.4  # size in units of an unknown effect below which nothing is named beside it
PART_OF_UNKNOWN = 2.0  # size in units of an unknown effect below which a cause at its place is taken for a part of it
POINTED = 0.85  # share of what is left that one actuator has to have to be that place


@dataclass(frozen=True)
class _Beside:
    """size: of a cause in units of the unknown effect; there: whether that shows at the cause's actuator, and as it does;
    nowhere: whether neither is of one actuator, but both show alike.
    """

    size: float
    there: bool
    nowhere: bool


def beside_unknown(problem: Problem, f: Fitted, beyond: Mapping[str, Unexplained]) -> Members:
    """The members that stand beside an unknown effect, one by one.

    They foretell what unseen runs show. What is smaller than the unknown one and aimed at the actuator that the rest
    points at is most likely a part of it; so is what is smaller where neither points anywhere.
    """
    members = foretelling(problem, f)
    each = _beside(problem, f, beyond, members)

    def least(of: _Beside) -> float:
        return PART_OF_UNKNOWN if of.there else 1.0 if of.nowhere else LEAST_BESIDE

    return tuple(i for i in members if each[i].size > least(each[i]))


def doubted(problem: Problem, f: Fitted, beyond: Mapping[str, Unexplained]) -> dict[int, float]:
    """Most that the probability of each member can be beside what is left.

    Either the unknown effect is at the member's actuator by chance, one of m, or the member imitates it: up to which share
    of its energy an unknown effect can be imitated nobody knows, so that every share is as likely. Of what shows at another
    place, or in another kind of channel, it is no imitation.
    """
    out = {}
    for i, each in _beside(problem, f, beyond, f.members).items():
        chance = 1.0 / len(problem.bench.actuators) if each.there else 1.0
        imitated = 1.0 / (1.0 + each.size**2) if each.there or each.nowhere else 0.0
        out[i] = chance / (chance + imitated)
    return out


def _beside(problem: Problem, f: Fitted, beyond: Mapping[str, Unexplained], members: Members) -> dict[int, _Beside]:
    left = worst(beyond)
    shares = rest_by_actuator(problem, f, left.kind)
    where = max(shares, key=lambda a: shares[a]) if shares else None
    if where is not None and shares[where] < POINTED:
        where = None

    def one(i: int) -> _Beside:
        size, shown = size_um(problem, f, (i,)) / max(left.excess_um, 1e-9), signal_rms(problem, f, (i,))
        if max(shown, key=lambda kind: shown[kind]) != left.kind:
            return _Beside(size, False, False)  # the forces of a drive show nothing of what only the tip shows
        target = problem.columns.candidates[i].target
        if where is None:
            return _Beside(size, False, target is None)
        aimed = target is None and tip_by_actuator(problem, f, i).get(where, 0.0) > EVEN
        return _Beside(size, target == where or aimed, False)

    return {i: one(i) for i in members}
