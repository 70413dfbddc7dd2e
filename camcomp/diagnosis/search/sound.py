"""Which sets of causes are answers at all: those whose members all matter, and do not undo one another."""

from collections.abc import Callable, Mapping
from itertools import combinations

from camcomp.diagnosis.fit.floor import MINOR
from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.search.unexplained import SURE_Z, size_um
from camcomp.diagnosis.search.unknown import rows_by_kind, signal_rms
from camcomp.diagnosis.statistics.cause_sets import Fitted, Members, with_minor
from camcomp.diagnosis.statistics.verdict import EQUAL_LOG_ODDS

CANCELLING = 8.0  # size of a member, in units of the whole set, above which the set lives on differences of its members
OPPOSED = 4.0  # the same of two members against both together
GATE_SHARE = 0.1  # of what the causes explain: none is modelled better than that


class Sound:
    """Whether a set is an answer: every member matters, and none undoes another. Asked once of each."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self._minor, self._cancels = dict[Members, Members](), dict[Members, bool]()

    def __call__(self, f: Fitted) -> bool:
        """Of one set."""
        return not self.minor(f) and not self.cancels(f)

    def minor(self, f: Fitted) -> Members:
        """The members that do not matter."""
        if f.members not in self._minor:
            self._minor[f.members] = small_members(self.problem, f)
        return self._minor[f.members]

    def cancels(self, f: Fitted) -> bool:
        """Whether members undo each other."""
        if f.members not in self._cancels:
            self._cancels[f.members] = cancels(self.problem, f)
        return self._cancels[f.members]

    def answers(
        self, done: Mapping[Members, Fitted], fit: Callable[[Members], Fitted], temperature: float = 1.0
    ) -> list[Fitted]:
        """The answers among sets that were fitted, each as likely as the likeliest way to it.

        Of a set with minor members that is as likely as the best answer the others are one: what is minor is there, and nobody
        names it. Else what is larger and undone by another one would take its place.
        """

        def value(f: Fitted) -> float:
            return self.problem.candidates.value(f, temperature)

        found = {f.members: f for f in done.values() if self(f)}
        least = max(map(value, found.values())) - EQUAL_LOG_ODDS
        for f in [f for f in done.values() if value(f) > least and self.minor(f)]:
            less = f
            while small := self.minor(less):
                less = fit(tuple(i for i in less.members if i not in small))
            if not self.cancels(f) and self(less):
                found[less.members] = max(found.get(less.members, less), with_minor(less, f), key=value)
        return sorted(found.values(), key=value, reverse=True)


def small_members(problem: Problem, f: Fitted) -> Members:
    """The members whose effect at the tip is at most MINOR or within the model error of another member.

    A member counts as model error of another at the same actuator, or, below the floor, of any where either acts at no
    actuator: models are exact to GATE_SHARE at best. The joint effect of two members at one actuator is judged as well.
    """
    target = {i: problem.columns.candidates[i].target for i in f.members}
    alone: list[Members] = [(i,) for i in f.members]
    two = [(i, j) for i, j in combinations(f.members, 2) if target[i] == target[j] is not None]
    sizes = {those: size_um(problem, f, those) for those in [*alone, *two]}
    floor = problem.floor.tip_um

    def small(those: Members) -> bool:
        at = target[those[0]]

        def says_wrongly(j: int) -> bool:
            return target[j] == at is not None or (sizes[those] < floor and None in (at, target[j]))

        beside = [sizes[j,] for j in f.members if j not in those and says_wrongly(j)]
        return sizes[those] <= max(MINOR * floor, GATE_SHARE * max(beside, default=0.0))

    found = {i for those in sizes if small(those) for i in those}
    return tuple(i for i in f.members if i in found)


def cancels(problem: Problem, f: Fitted) -> bool:
    """Whether members undo each other nearly: by chance that hardly happens, but a fit of what is unknown seeks it.

    Where another kind of channel shows one of them by itself the fit has had no choice.
    """
    whole = signal_rms(problem, f)
    each = {i: signal_rms(problem, f, (i,)) for i in f.members}
    rows = rows_by_kind(problem)
    for kind in whole:
        undone = [i for i in f.members if each[i][kind] > max(1.0, CANCELLING * whole[kind])]
        loose = [i for i in undone if not _shown_beside(each[i], whole, kind, rows)]
        if len(loose) > 1 or loose == undone != []:
            return True
    alone = {i: size_um(problem, f, (i,)) for i in f.members}
    for i, j in combinations(f.members, 2):
        if min(alone[i], alone[j]) > OPPOSED * size_um(problem, f, (i, j)):
            both = signal_rms(problem, f, (i, j))
            if not any(_shown_beside(each[x], both, "tip", rows) for x in (i, j)):
                return True
    return False


def _shown_beside(own: Mapping[str, float], whole: Mapping[str, float], kind: str, rows: Mapping[str, int]) -> bool:
    """Whether another kind of channel surely shows a member, all its rows together, and the whole set with it; in units of the noise."""
    return any(own[k] * rows[k] ** 0.5 > SURE_Z and CANCELLING * whole[k] > own[k] for k in own if k != kind)
