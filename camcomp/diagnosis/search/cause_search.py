"""The search for causes on one problem: sets are fitted, answers among them weighed, and probabilities stated."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from camcomp.diagnosis.fit.cause_sets import Fitted, Scale, probabilities, temperature_of
from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.model.calibration import calibration_of
from camcomp.diagnosis.model.classes import do_the_same
from camcomp.diagnosis.model.discrepancy import with_discrepancy
from camcomp.diagnosis.model.evidence import Members
from camcomp.diagnosis.model.folds import ABOVE
from camcomp.diagnosis.model.search import ROUNDS
from camcomp.diagnosis.model.verdict import Word, decide
from camcomp.diagnosis.search.credible import MODELLED, credibility, with_unmodelled
from camcomp.diagnosis.search.fitted_sets import FittedSets
from camcomp.diagnosis.search.unexplained import SURE_Z, Unexplained, unexplained, worst
from camcomp.diagnosis.search.unknown import Shares, foretelling, residual_tests
from camcomp.diagnosis.statistics.probability import EQUAL_LOG_ODDS, EVEN
from camcomp.ground.datatypes import Floats

LEFT_OPEN = 0.25  # of what causes explain together: no set explains what leaves more, however large its members are


@dataclass(frozen=True, eq=False)
class RankedSets:
    """Fitted sets that are answers with their probabilities (n,).

    first: index of the leading set. rivals: of those that explain the data as well, the most probable first. inclusion:
    probability of every candidate that any set has.
    """

    fits: tuple[Fitted, ...]
    probability: Floats
    first: int
    rivals: tuple[int, ...]
    inclusion: dict[int, float]

    @property
    def best(self) -> Fitted:
        """The leading set."""
        return self.fits[self.first]


def rank(fits: Sequence[Fitted], probability: Floats, twins: Sequence[Members]) -> RankedSets:
    """The ranking of fits by their probabilities; twins: sets that the data cannot tell from the best one.

    Twins of the best set and itself have equal parts of their common probability: neither a prior nor other sets break that tie.
    """
    order = np.argsort(-probability)
    best = int(order[0])
    leader = fits[best]
    rivals, twin = list[int](), [best]
    for j in order[1:] if leader.members else ():
        members = fits[j].members
        same = members in twins
        near = np.log(max(probability[best], 1e-300) / max(probability[j], 1e-300)) < EQUAL_LOG_ODDS
        # a set with a superfluous member, or one too few, is no rival but the same answer less well put
        nested = set(members) >= set(leader.members) or set(members) <= set(leader.members)
        if (same or near) and not nested and len(members) <= len(leader.members):
            rivals.append(int(j))
            twin += [int(j)] if same else []
    held = probability.copy()
    held[twin] = held[twin].mean()
    inclusion: dict[int, float] = {}
    for fit, p in zip(fits, held, strict=True):
        for i in fit.members:
            inclusion[i] = inclusion.get(i, 0.0) + float(p)
    for i in leader.members:
        inclusion[i] = min(inclusion[i], sum(i in fits[j].members for j in twin) / len(twin))
    return RankedSets(tuple(fits), probability, best, tuple(rivals), inclusion)


@dataclass(frozen=True, eq=False, kw_only=True)
class CauseSearch:
    """Fitted sets of causes with their ranking, the verdict, and the residual of the best set."""

    sets: RankedSets
    word: Word
    stated: Mapping[int, float]  # calibrated probability of every candidate of a fitted set
    left: Mapping[str, Shares]  # per kind of channel, where something unmodelled shows
    unknown_in: str | None  # the kind in which an effect shows that the library does not have
    beyond: Mapping[str, Unexplained]  # what unseen runs show beyond the floor, per kind of channel


def search_causes(problem: Problem) -> CauseSearch:
    """Fit sets, rank them, test the best one for an unmodelled effect, and state probabilities."""
    fitted = FittedSets(problem)
    ranked, temperature = _rank_answers(problem, fitted)
    known, credible, beyond, kind = _keep_causes(problem, ranked.best, fitted)
    ranked = _with_answer(problem, ranked, known, temperature)
    credible, imitated = _weigh_imitations(problem, known, credible, beyond, kind)
    stated = _stated(ranked, credible, imitated=imitated)
    left = residual_tests(problem, known) if kind else {}
    kind = kind if kind is None or kind in left else next(iter(left))
    return CauseSearch(
        sets=ranked, word=_verdict(ranked, stated, kind), stated=stated, left=left, unknown_in=kind, beyond=beyond
    )


def _rank_answers(problem: Problem, sets: FittedSets) -> tuple[RankedSets, float]:
    """Sets without small members, ranked, and the temperature of their probabilities."""
    best = sets.null
    for _ in range(ROUNDS):
        sets.search_near(best)
        first = sets.answers()[0]
        temperature = temperature_of(first, problem.prior, problem.member_columns(first.members))
        fits = tuple(sets.answers(temperature))
        probability = probabilities(fits, problem.candidates, temperature)
        best = fits[int(np.argmax(probability))]
        if best.members in sets.searched:
            break
    return rank(fits, probability, _same(problem, fits, best)), temperature


def _keep_causes(
    problem: Problem, best: Fitted, sets: FittedSets
) -> tuple[Fitted, Mapping[int, float], Mapping[str, Unexplained], str | None]:
    """Drop members of the best answer, one by one, that an unmodelled effect explains as well.

    Where one shows, members that do not predict withheld runs jointly with it are dropped first. What replaces a member
    above the size that counts shows, too.

    Returns:
        The answer that is kept, the probabilities of its members, the excess residual on held-out runs, and the kind of
        channel in which something unmodelled shows, None where none does.
    """
    f, beyond = best, unexplained(problem, sets.fit(best.all_members))  # minor effects explain their part, too
    kind = at_first = unknown_kind(problem, best, beyond)
    instead = False
    while True:
        kept = foretelling(problem, f) if kind else f.members
        if kept == f.members:
            present, replaced = credibility(problem, f, surely=kind is not None)
            most = max(replaced, key=replaced.__getitem__, default=None)
            if most is None or replaced[most] < EVEN:
                break
            instead = instead or problem.moved_um(f, (most,)) > _least(problem, _modelled(problem, f))
            kept = tuple(i for i in f.members if i != most)
        f = sets.fit(kept)
        beyond = unexplained(problem, f)
        kind = unknown_kind(problem, f, beyond)
    if kind is None and (at_first or instead):
        kind = worst(beyond).kind
    return f, present, beyond, kind


def _weigh_imitations(
    problem: Problem, f: Fitted, credible: Mapping[int, float], beyond: Mapping[str, Unexplained], kind: str | None
) -> tuple[Mapping[int, float], bool]:
    """Probabilities of members that something unmodelled may imitate, and whether withheld runs show any."""
    above = above_floor(problem, beyond)
    if kind is None and not above:
        return credible, False
    excess_um = max((each.excess_um for each in above), default=worst(beyond).excess_um)
    jointly = with_unmodelled(problem, f, excess_um)
    return {i: min(p, jointly[i]) for i, p in credible.items()}, True


def _with_answer(problem: Problem, sets: RankedSets, known: Fitted, temperature: float) -> RankedSets:
    """The sets with the answer that stays at their head."""
    if known.members == sets.best.members:
        return sets
    fits = (known, *(f for f in sets.fits if f.members != known.members))
    probability = probabilities(fits, problem.candidates, temperature)
    return replace(sets, fits=fits, probability=probability, first=0, rivals=())


def _stated(sets: RankedSets, credible: Mapping[int, float], *, imitated: bool) -> dict[int, float]:
    """Calibrated probability of every candidate: that all sets have it and that nothing unmodelled imitates it.

    imitated: whether withheld runs exceed the floor, where causes share what the prior of a discrepancy of any form leaves.
    """
    # the posterior of the sets lacks causes that are seen only jointly with something unmodelled
    posterior = dict.fromkeys(credible, 1.0) | sets.inclusion
    posterior = {i: min(p, credible.get(i, 1.0)) for i, p in posterior.items()}
    calibrate = calibration_of("programs").calibrate
    return {i: calibrate(with_discrepancy(p) if imitated else p) for i, p in posterior.items()}


def _verdict(sets: RankedSets, stated: Mapping[int, float], kind: str | None) -> Word:
    """The verdict on the best set; kind: of channel in which something unmodelled shows."""
    return decide(
        unknown=float(kind is not None), best=min((stated[i] for i in sets.best.members), default=1.0),
        causes=len(sets.best.members), alternatives=len(sets.rivals),
    )  # fmt: skip


def above_floor(problem: Problem, beyond: Mapping[str, Unexplained], modelled_um: float = 0.0) -> list[Unexplained]:
    """The kinds of channel in which withheld runs exceed the floor, and what errors of causes explain (um at the tip).

    Where the tip is measured it says itself what moves it; only of the control it knows nothing.
    """
    counts = [beyond[kind] for kind in (("tip", "encoder") if "tip" in beyond else beyond) if kind in beyond]
    return [each for each in counts if each.z > SURE_Z and each.excess_um > _least(problem, modelled_um)]


def unknown_kind(problem: Problem, f: Fitted, beyond: Mapping[str, Unexplained]) -> str | None:
    """The kind of channel in which withheld runs show most that errors of a set's own members do not explain, or None."""
    found = above_floor(problem, beyond, _modelled(problem, f))
    return max(found, key=lambda each: each.excess_um).kind if found else None


def _least(problem: Problem, modelled_um: float) -> float:
    """Smallest excess residual (um at the tip) that makes a set of causes incomplete."""
    return max(float(np.sqrt(ABOVE - 1.0)) * problem.floor.tip_um, modelled_um)


def _modelled(problem: Problem, f: Fitted) -> float:
    """Residual (um at the tip) that errors in a set's own members may explain.

    MODELLED of the largest member or of all together, at most LEFT_OPEN of all together: members that cancel are not
    modelled more exactly.
    """
    together, alone = problem.moved_um(f), [problem.moved_um(f, (i,)) for i in f.members]
    return min(MODELLED * max(together, *alone, 0.0), LEFT_OPEN * together)


def _same(problem: Problem, fits: tuple[Fitted, ...], best: Fitted) -> list[Members]:
    """Sets of the size of the best one that do the same, whatever the priors say of them: the rows and the stated tolerances have
    to tell.
    """
    if not best.members:
        return []
    others = [f.members for f in fits if f is not best and len(f.members) == len(best.members)]
    data = Scale(best.data, problem.prior, problem.candidates).sets(range(len(problem.candidates.columns)))
    return [each for each in others if do_the_same(data, best.members, best.theta, each)]
