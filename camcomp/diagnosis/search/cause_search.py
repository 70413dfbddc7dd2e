"""The search for causes on one problem: sets are fitted, answers among them weighed, and probabilities stated."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from camcomp.diagnosis.fit.floor import GATE
from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.search.beside import beside_unknown, doubted
from camcomp.diagnosis.search.established import LEAST_PROBABILITY, established, stands_for_more
from camcomp.diagnosis.search.fitted_sets import EXCHANGED, EXCHANGES, HOPELESS_LOG, FittedSets
from camcomp.diagnosis.search.imitation import credibility
from camcomp.diagnosis.search.indistinguishable import likeness, stand_ins
from camcomp.diagnosis.search.sound import GATE_SHARE, Sound, cancels
from camcomp.diagnosis.search.stated import StatedEvidence, held_against, state_probabilities
from camcomp.diagnosis.search.tempering import TEMPERATURE, misfit, tempering
from camcomp.diagnosis.search.unexplained import SURE_Z, Unexplained, size_um, unexplained, worst
from camcomp.diagnosis.search.unknown import firm_prior, residual_tests
from camcomp.diagnosis.search.whole_gap import idle, nothing_to_explain
from camcomp.diagnosis.statistics.cause_sets import (
    Fitted,
    Members,
    both_exchanged,
    predictive,
    probabilities,
)
from camcomp.diagnosis.statistics.probability import EVEN
from camcomp.diagnosis.statistics.score_test import ResidualTest
from camcomp.diagnosis.statistics.verdict import Verdict, judge
from camcomp.ground.datatypes import Floats

BEYOND_DOUBT = (
    20.0  # log evidence of a member, all tolerances strained as far as they like, above which no run vetoes it
)
HARM_LOG = 2.0  # log density by which a cause has to harm the prediction of other runs before it goes
SAME_EVIDENCE = 2.0  # log evidence by which two sets may differ and still be the same answer, whatever their priors
GATE_LOCAL = 1.5  # of the floor: the same for what acts for a while only
LEFT_OPEN = 0.25  # of what causes explain together: no set explains what leaves more, however large its members are
MOST_SCALES = 8.0  # the same that nobody believes of a rival that fits as well
INSTEAD = 0.95  # probability of something unknown in place of a cause, where without it nothing unknown would show


@dataclass(frozen=True, eq=False)
class CauseSearch:
    """Sets of causes that were fitted, their probabilities, the verdict, and what the best of them leaves."""

    fits: tuple[Fitted, ...]
    probability: Floats
    verdict: Verdict
    left: Mapping[str, ResidualTest]  # per kind of channel
    unknown_in: str | None  # the kind in which an effect shows that the library does not have
    beyond: Mapping[str, Unexplained]  # what unseen runs show beyond the floor, per kind of channel


def search_causes(problem: Problem) -> CauseSearch:
    """Fit sets, weigh the answers among them, look beside the best one for something unmodelled, state probabilities."""
    sets = FittedSets(problem, Sound(problem))
    sets.search()
    weighed = _weigh_answers(problem, sets)
    best = weighed.fits[weighed.verdict.best]
    beside = _look_beside(problem, best, sets)
    weighed = _with_answer(problem, weighed, beside.known)
    prior = problem.prior if beside.kind is None else firm_prior(problem)
    left = residual_tests(problem, beside.known, prior)
    kind = beside.kind if beside.kind is None or beside.kind in left else next(iter(left))
    depends = left[kind].labels[0][0] if kind and left[kind].labels else ""
    evidence = StatedEvidence(
        known=beside.known,
        named_before=best.members,
        credible=beside.credible,
        is_unknown=beside.kind is not None,
        idle=set() if beside.kind else idle(problem, beside.known),
        depends=depends,
    )
    verdict = state_probabilities(problem, weighed.fits, weighed.probability, weighed.verdict, evidence)
    return CauseSearch(weighed.fits, weighed.probability, verdict, left, kind, beside.beyond)


@dataclass(frozen=True, eq=False)
class _Weighed:
    """Sets that are answers with their probabilities at a temperature, and the verdict among them."""

    fits: tuple[Fitted, ...]
    probability: Floats
    verdict: Verdict
    temperature: float


def _weigh_answers(problem: Problem, sets: FittedSets) -> _Weighed:
    """Sets that predict other runs and whose members are surely more than minor, with rivals by structure, and their verdict."""
    for _ in range(EXCHANGES):
        temperature = tempering(problem, sets.sound.answers(sets.done, sets.fit)[0])
        fits = tuple(sets.sound.answers(sets.done, sets.fit, temperature))
        probability = probabilities(fits, problem.candidates, temperature)
        fits, probability, harmful = _prune(problem, fits, temperature, probability)
        fits, probability = established(problem, fits, sets.fit, temperature, probability)
        best = fits[int(np.argmax(probability))]
        if not sets.is_exchangeable(best):
            break
        sets.exchange(best)  # without its weak members a set has rivals of its own
    fits, probability, same = _with_stand_ins(problem, fits, probability, sets, temperature)
    verdict = judge(fits, probability, same, problem.candidates)
    return _Weighed(
        fits, probability, held_against(problem, fits, probability, verdict, harmful, temperature), temperature
    )


@dataclass(frozen=True, eq=False)
class _Beside:
    """The answer that stays beside something unmodelled, how sure its members are, and what unseen runs show beyond it.

    kind: of channel in which something unmodelled shows, None where none does.
    """

    known: Fitted
    credible: Mapping[int, float]
    beyond: Mapping[str, Unexplained]
    kind: str | None


def _look_beside(problem: Problem, best: Fitted, sets: FittedSets) -> _Beside:
    """Whether something unmodelled acts beside the best answer, and which of its members stay."""
    beyond = unexplained(problem, sets.fit(best.all_members))  # minor effects explain their part, too
    kind = unknown_kind(problem, best, beyond)
    known, credible, instead = _credible(problem, best, beyond, sets.fit)
    if kind is None and nothing_to_explain(problem, known):
        known = sets.null
    if known.members != best.members:
        beyond = unexplained(problem, known)
        kind = unknown_kind(problem, known, beyond) or (worst(beyond).kind if kind or instead else None)
    return _Beside(known, credible, beyond, kind)


def _with_answer(problem: Problem, weighed: _Weighed, known: Fitted) -> _Weighed:
    """The sets with the answer that stays at their head."""
    if known.members == weighed.fits[weighed.verdict.best].members:
        return weighed
    fits = (known, *(f for f in weighed.fits if f.members != known.members))
    word = "identified" if known.members else "none"
    return replace(
        weighed,
        fits=fits,
        probability=probabilities(fits, problem.candidates, weighed.temperature),
        verdict=replace(weighed.verdict, word=word, best=0, rivals=()),
    )


def _credible(
    problem: Problem,
    f: Fitted,
    beyond: Mapping[str, Unexplained],
    fit: Callable[[Members], Fitted],
) -> tuple[Fitted, dict[int, float], bool]:
    """What is left of a set when members that something unknown does as well have gone, one by one; how sure they are;
    whether something unknown took the place of one, even where what every machine has would stretch to cover it.

    Where something unknown shows, those that do not foretell unseen runs beside it go first.
    """
    instead = False
    while True:
        unknown = unknown_kind(problem, f, beyond) is not None
        kept = beside_unknown(problem, f, beyond) if unknown else f.members
        if kept == f.members:
            credible = credibility(problem, f, surely=unknown, temperature=TEMPERATURE)
            replaced = credible.replaced
            most = max(replaced, key=lambda i: replaced[i], default=None)
            if most is None or replaced[most] < (EVEN if unknown else INSTEAD):
                doubt = doubted(problem, f, beyond, credible.drawn) if unknown else {}
                return f, {i: min(p, doubt.get(i, 1.0)) for i, p in credible.present.items()}, instead
            instead = instead or size_um(problem, f, (most,)) > _least(problem, f)
            kept = tuple(i for i in f.members if i != most)
        f = fit(kept)
        beyond = unexplained(problem, f)


def unknown_kind(problem: Problem, f: Fitted, beyond: Mapping[str, Unexplained]) -> str | None:
    """The kind of channel in which unseen runs show more than the floor, None where none does."""
    least = _least(problem, f)
    for_a_while = max(GATE_LOCAL * problem.floor.tip_um, 2.0 * _modelled(problem, f))
    # where the tip is measured it says itself what moves it; only of the control it knows nothing
    counts = [beyond[kind] for kind in (("tip", "encoder") if "tip" in beyond else beyond) if kind in beyond]
    found = [each for each in counts if each.z > SURE_Z and (each.excess_um > least or each.local_um > for_a_while)]
    return max(found, key=lambda each: each.excess_um).kind if found else None


def _least(problem: Problem, f: Fitted) -> float:
    """Size (um at the tip) from which on something beside what a set explains is worth a name."""
    return max(GATE * problem.floor.tip_um, _modelled(problem, f))


def _modelled(problem: Problem, f: Fitted) -> float:
    """How far (um at the tip) what a set leaves may be an error of its own members.

    That of the largest: what undoes another's work is modelled no better for it. But what is left of that work sets a limit.
    """
    together, alone = size_um(problem, f), [size_um(problem, f, (i,)) for i in f.members]
    return min(GATE_SHARE * max(together, *alone, 0.0), LEFT_OPEN * together)


def _with_stand_ins(
    problem: Problem, fits: tuple[Fitted, ...], probability: Floats, sets: FittedSets, temperature: float
) -> tuple[tuple[Fitted, ...], Floats, list[tuple[Members, Members]]]:
    """The fits with those sets added that do the same as the leader by their structure, and all pairs that are alike.

    Where two members have others that do the same, all that these make together is added: one of them would else look more
    sure than the other, by the number of sets in which it was tried.
    """
    fit, sound = sets.fit, sets.sound
    best = fits[int(np.argmax(probability))]
    found = {f.members: f for f in fits}
    by_structure = [fit(members) for members in stand_ins(likeness(problem), best.members, best.theta)]
    by_structure = [f for f in by_structure if _possible(problem, f) and not cancels(problem, f)]
    found = {f.members: f for f in by_structure} | found
    # what is minor beside the leader may be beside its effects at other targets, too: else it would choose between them
    if best.minor:
        rivals = _same_effects(problem, tuple(found.values()), fit(best.members))
        sound.share_minor(found, {best.members, *rivals}, fit, temperature)
        best = found[best.members]
    near = [members for _, members in _same(problem, tuple(found.values()), best)]
    for members in both_exchanged(problem.candidates, best.members, near):
        if members not in found and not cancels(problem, other := fit(members)):
            found[members] = other
    sound.share_minor(found, {best.members, *near, *(f.members for f in by_structure)}, fit, temperature)
    best = found[best.members]
    if found != {f.members: f for f in fits}:
        fits = tuple(found.values())
        probability = probabilities(fits, problem.candidates, temperature)
    same = _same(problem, fits, best) + [(best.members, f.members) for f in by_structure]
    return fits, probability, same


def _same_effects(problem: Problem, fits: Sequence[Fitted], best: Fitted) -> list[Members]:
    """The sets of the same effects as the best one at other targets that come near it, the likeliest first."""
    value = problem.candidates.value

    def names(f: Fitted) -> list[str]:
        return sorted(problem.columns.candidates[i].name for i in f.members)

    alike = [f for f in fits if f.members != best.members and names(f) == names(best)]
    near = [f for f in alike if value(f) > value(best) - HOPELESS_LOG]
    return [f.members for f in sorted(near, key=value, reverse=True)[:EXCHANGED]]


def _prune(
    problem: Problem, fits: tuple[Fitted, ...], temperature: float, probability: Floats
) -> tuple[tuple[Fitted, ...], Floats, list[Fitted]]:
    """Scores the leaders on runs not used for fitting; a set that predicts worse than the same set less a member goes.

    Behind the others those gone that are far more likely than what they are without it: something is there that it explains.
    """
    keep, harmful = list(range(len(fits))), list[Fitted]()
    if len(problem.bench.runs) < 2:
        return fits, probability, harmful
    for j in list(np.argsort(-probability)[:4]):
        f = fits[j]
        if not f.members or probability[j] < LEAST_PROBABILITY:
            continue
        less = [g.log_evidence for g in fits if set(g.members) < set(f.members)]
        if less and f.log_evidence - max(less) > BEYOND_DOUBT:
            continue  # what is within tolerance foretells as well once it is strained; the strain is what speaks
        smaller = [tuple(x for x in f.members if x != i) for i in f.members]
        scores = predictive(f.grams, problem.prior, problem.candidates, [f.members, *smaller])
        if scores[0] < scores[1:].max() - HARM_LOG:
            keep.remove(j)
            if stands_for_more(problem, f, smaller[int(np.argmax(scores[1:]))], temperature):
                harmful.append(f)
    kept = tuple(fits[j] for j in keep)
    return kept, probability[keep] / probability[keep].sum(), harmful


def _same(problem: Problem, fits: tuple[Fitted, ...], best: Fitted) -> list[tuple[Members, Members]]:
    """Pairs of the best set and a set of its size that fits as well, whatever the priors say of them.

    Priors of sizes, and of how far off the tolerances are all together: the rows and the stated tolerances have to tell.
    """
    found = []
    for f in fits:
        if f is best or len(f.members) != len(best.members) or not best.members:
            continue
        behind = 0.5 * (misfit(problem, f) - misfit(problem, best))
        if min(behind, best.log_evidence - f.log_evidence) < SAME_EVIDENCE and _plausible(problem, f):
            found.append((best.members, f.members))
    return found


def _possible(problem: Problem, f: Fitted) -> bool:
    """Whether the members are of sizes that their effects can have at all: no fit can exclude by less what is the same by structure."""
    causes = problem.causes(f.members, f.theta, f.extra)
    return _of_their_signs(problem, f) and all(
        p.low < each.values[p.name] < p.high
        for each, i in zip(causes, f.members, strict=True)
        for p in problem.columns.candidates[i].parameters
        if p.name in each.values
    )


def _plausible(problem: Problem, f: Fitted) -> bool:
    return _of_their_signs(problem, f) and all(abs(t) < MOST_SCALES for t in f.theta)


def _of_their_signs(problem: Problem, f: Fitted) -> bool:
    parameters = [p for i in f.members for p in problem.columns.candidates[i].parameters]
    return all(p.sign == 0 or t > 0 for t, p in zip(f.theta, parameters, strict=True))
