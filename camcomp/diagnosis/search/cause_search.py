"""The search for causes on one problem: which sets are tried, in which order, and how they are ranked."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.search.beside import beside_unknown, doubted
from camcomp.diagnosis.search.established import LEAST_PROBABILITY, established, held_against, stands_for_more
from camcomp.diagnosis.search.imitation import credibility
from camcomp.diagnosis.search.indistinguishable import Likeness, likeness, stand_ins
from camcomp.diagnosis.search.sound import GATE_SHARE, Sound, cancels
from camcomp.diagnosis.search.tempering import TEMPERATURE, misfit, tempering
from camcomp.diagnosis.search.unexplained import SURE_Z, Unexplained, size_um, unexplained, worst
from camcomp.diagnosis.search.unknown import firm_prior, residual_tests
from camcomp.diagnosis.search.whole_gap import idle, nothing_to_explain
from camcomp.diagnosis.statistics.cause_sets import (
    SIZES,
    Fitted,
    Members,
    Scale,
    both_exchanged,
    exchanges,
    extensions,
    pairs,
    parted,
    predictive,
    probabilities,
    total,
)
from camcomp.diagnosis.statistics.evidence import estimate
from camcomp.diagnosis.statistics.probability import EVEN, UNSURE
from camcomp.diagnosis.statistics.score_test import ResidualTest
from camcomp.diagnosis.statistics.stepwise import stepwise
from camcomp.diagnosis.statistics.verdict import EQUAL_LOG_ODDS, Verdict, judge, open_where_even, worth_a_mention
from camcomp.ground import headway
from camcomp.ground.datatypes import Floats

# sets that are tried of each size, and of those that begin with an effect at all of its targets
SINGLES, PAIRS, TRIPLES, KINDS = 6, 6, 3, 3
MORE = 3  # rounds in which one member is added to a set of three or more
EXCHANGES = 6  # rounds in which a member of the best sets is exchanged or left out
EXCHANGED = 4  # sets tried in each
EXCHANGEABLE = 5  # members up to which that is done: what takes more is no cause of the library
BEYOND_DOUBT = (
    20.0  # log evidence of a member, all tolerances strained as far as they like, above which no run vetoes it
)
HARM_LOG = 2.0  # log density by which a cause has to harm the prediction of other runs before it goes
SAME_EVIDENCE = 2.0  # log evidence by which two sets may differ and still be the same answer, whatever their priors
GATE = 0.4  # of the noise floor: what unseen runs show beyond it makes an effect that the library lacks
GATE_LOCAL = 1.5  # of the floor: the same for what acts for a while only
LEFT_OPEN = 0.25  # of what causes explain together: no set explains what leaves more, however large its members are
LARGE_SCALES = 3.0  # size of an effect, in its typical ones, that would show at least if it can be seen at all
MOST_SCALES = 8.0  # the same that nobody believes of a rival that fits as well
HOPELESS_LOG = 12.0  # log evidence behind the best at which a set is not fitted any more
LOOKALIKE = 0.01  # probability that what a cause explains down to the noise is something that no library has and that looks the same
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
    """Tries no cause, single causes, pairs and triples; re-fits those that look best."""
    every = [i for i in range(len(problem.columns.candidates)) if visible(problem, i)]
    null = problem.refit(())
    at_null = Scale(total(null.grams), problem.prior, problem.candidates)
    done: dict[Members, Fitted] = {(): null}

    def fit(members: Members, near: Fitted | None = None) -> Fitted:
        if members not in done:
            theta = None
            if near is not None:
                index = problem.member_columns(members)
                theta = estimate(total(near.grams), problem.prior, index)[0][index]
            done[members] = problem.refit(members, theta)
            headway.done(len(done) / (SINGLES + PAIRS + TRIPLES))
        return done[members]

    value = problem.candidates.value
    singles = extensions(at_null, (), every)
    for _, members in singles[:SINGLES]:
        fit(members)
    for members in _same_name(problem, singles[0][1], every):
        fit(members)
    ones = sorted((f for m, f in done.items() if len(m) == 1), key=value, reverse=True)
    found: list[tuple[float, Members, Fitted | None]] = [(v, m, None) for v, m in pairs(at_null, every, PAIRS)]
    for f in ones[:3]:
        scale = Scale(total(f.grams), problem.prior, problem.candidates)
        found += [(v, m, f) for v, m in extensions(scale, f.members, every)[:4]]
    best_one = max(value(f) for f in done.values())
    _fit_best(found, fit, PAIRS, best_one)
    twos = sorted((f for m, f in done.items() if len(m) == 2), key=value, reverse=True)
    found = []
    for f in twos[:2]:
        scale = Scale(total(f.grams), problem.prior, problem.candidates)
        found += [(v, m, f) for v, m in extensions(scale, f.members, every)[:3]]
    _fit_best(found, fit, TRIPLES, max(value(f) for f in done.values()))
    for _ in range(MORE):
        best = max(done.values(), key=value)
        if len(best.members) < 3:
            break
        scale = Scale(total(best.grams), problem.prior, problem.candidates)
        fit(extensions(scale, best.members, every, EXCHANGED)[0][1], best)
        if max(done.values(), key=value) is best:
            break
    best = max(done.values(), key=value)
    linear = at_null(best.members) + problem.candidates.prior(best.members)
    _fit_best(_from_kinds(at_null, problem, every), fit, KINDS, linear)
    sound, looked = Sound(problem), set[Members]()

    def look_beside(near: Fitted) -> None:
        looked.add(near.members)
        scale = Scale(total(near.grams), problem.prior, problem.candidates)
        others = [(v, m, near) for v, m in exchanges(scale, near.members, every, EXCHANGED) if m not in done]
        _fit_best(others, fit, EXCHANGED, value(near))
        if near.members and len(near.members) < EXCHANGEABLE:
            two = parted(scale, near.members, every, EXCHANGED)
            good = [(v, m, near) for v, m in two if v > value(near) - EQUAL_LOG_ODDS and m not in done]
            _fit_best(good, fit, EXCHANGED, value(near))

    for _ in range(EXCHANGES):  # what was taken first may stand for what was found last, and one actuator for another
        answers = sound.answers(done, fit)
        # what may stand for a member of one set may do so in those that are as good
        good = [done[f.all_members] for f in answers if value(f) > value(answers[0]) - EQUAL_LOG_ODDS]
        tied = [f for f in good if f.members not in looked]
        if not tied or len(good[0].members) > EXCHANGEABLE:
            break
        look_beside(max(tied, key=value))
    for _ in range(EXCHANGES):
        temperature = tempering(problem, sound.answers(done, fit)[0])
        fits = tuple(sound.answers(done, fit, temperature))
        probability = probabilities(fits, problem.candidates, temperature)
        fits, probability, harmful = _prune(problem, fits, temperature, probability)
        fits, probability = established(problem, fits, fit, temperature, probability)
        best = fits[int(np.argmax(probability))]
        if not best.members or best.members in looked or len(best.members) > EXCHANGEABLE:
            break
        look_beside(best)  # what is left of a set without its weak members has rivals of its own
    design = likeness(problem)
    fits, probability, same = _with_stand_ins(problem, design, fits, probability, sound, fit, temperature)
    verdict = judge(fits, probability, same, problem.candidates)
    verdict = held_against(problem, fits, probability, verdict, harmful, temperature)
    best = fits[verdict.best]
    # what is minor beside the causes explains what it does, too
    beyond = unexplained(problem, fit(best.all_members))
    kind = unknown_kind(problem, best, beyond)
    known, credible, instead = _credible(problem, best, beyond, fit, every)
    if kind is None and nothing_to_explain(problem, known):
        known = null
    if known.members != best.members:
        beyond = unexplained(problem, known)
        kind = unknown_kind(problem, known, beyond) or (worst(beyond).kind if kind or instead else None)
        fits = (known, *(f for f in fits if f.members != known.members))
        probability = probabilities(fits, problem.candidates, temperature)
        word = "identified" if known.members else "none"
        verdict = replace(verdict, word=word, best=0, rivals=())
    # of what was overlooked because something unknown is there the sets without that say nothing
    inclusion = verdict.inclusion | {i: 1.0 for i in known.members if i not in best.members}
    if kind is None:
        inclusion |= {i: min(inclusion[i], EVEN) for i in idle(problem, known)}
    sure = {i: (1.0 - LOOKALIKE) * min(p, credible.get(i, 1.0)) for i, p in inclusion.items()}
    small = [i for i in known.members if size_um(problem, known, (i,)) < problem.floor.tip_um]
    sure |= {i: min(sure[i], UNSURE) for i in small}  # what the model itself is wrong by may be as large
    verdict = replace(verdict, inclusion={i: worth_a_mention(p) for i, p in sure.items()})
    verdict = verdict if kind else open_where_even(verdict, fits, probability)
    prior = problem.prior if kind is None else firm_prior(problem)
    left = residual_tests(problem, known, prior)
    shown = kind if kind is None or kind in left else next(iter(left))
    return CauseSearch(fits, probability, verdict, left, shown, beyond)


def _credible(
    problem: Problem,
    f: Fitted,
    beyond: Mapping[str, Unexplained],
    fit: Callable[[Members], Fitted],
    every: list[int],
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
                if unknown and (more := _overlooked(problem, f, fit, every)) is not None:
                    f, beyond = more, unexplained(problem, more)
                    continue
                doubt = doubted(problem, f, beyond, credible.drawn) if unknown else {}
                return f, {i: min(p, doubt.get(i, 1.0)) for i, p in credible.present.items()}, instead
            instead = instead or size_um(problem, f, (most,)) > _least(problem, f)
            kept = _needed(problem, fit, tuple(i for i in f.members if i != most))
        f = fit(kept)
        beyond = unexplained(problem, f)


def _overlooked(problem: Problem, f: Fitted, fit: Callable[[Members], Fitted], every: list[int]) -> Fitted | None:
    """The set with one cause more, where that stands beside the unknown effect by every measure; None where none does.

    A set that was found as if nothing unknown were there may hold none of the true causes.
    """
    value = problem.candidates.value
    scale = Scale(total(f.grams), problem.prior, problem.candidates)
    best = max((fit(members) for _, members in extensions(scale, f.members, every)[:EXCHANGED]), key=value)
    beyond = unexplained(problem, best)
    if (
        value(best) < value(f) + BEYOND_DOUBT
        or unknown_kind(problem, best, beyond) is None
        or beside_unknown(problem, best, beyond) != best.members
    ):
        return None
    credible = credibility(problem, best, surely=True, temperature=TEMPERATURE)
    sure = min(credible.present.values()) > INSTEAD and max(credible.replaced.values()) < EVEN
    return best if sure else None


def _needed(problem: Problem, fit: Callable[[Members], Fitted], members: Members) -> Members:
    """The members that earn their place: one that only filled up what another did too much has none without it."""

    def value(each: Members) -> float:
        return fit(each).log_evidence + problem.candidates.prior(each)

    while members:
        less = max((tuple(x for x in members if x != i) for i in members), key=value)
        if value(less) <= value(members):
            break
        members = less
    return members


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
    problem: Problem,
    design: Likeness,
    fits: tuple[Fitted, ...],
    probability: Floats,
    sound: Sound,
    fit: Callable[[Members], Fitted],
    temperature: float,
) -> tuple[tuple[Fitted, ...], Floats, list[tuple[Members, Members]]]:
    """The fits with those sets added that do the same as the leader by their structure, and all pairs that are alike.

    Where two members have others that do the same, all that these make together is added: one of them would else look more
    sure than the other, by the number of sets in which it was tried.
    """
    best = fits[int(np.argmax(probability))]
    found = {f.members: f for f in fits}
    by_structure = [fit(members) for members in stand_ins(design, best.members, best.theta)]
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


def visible(problem: Problem, i: int) -> bool:
    """Whether an effect of three scales would show at all in the channels present."""
    energy = sum(float((W[:, list(problem.candidates.columns[i])] ** 2).sum()) for W in problem.white)
    return energy * LARGE_SCALES**2 > 1.0


def _same_name(problem: Problem, members: Members, every: list[int]) -> list[Members]:
    """The leader's effect at its other targets: right effect, wrong actuator, is the mistake to exclude first."""
    names = {problem.columns.candidates[i].name for i in members}
    return [(i,) for i in every if problem.columns.candidates[i].name in names]


def _from_kinds(scale: Scale, problem: Problem, every: list[int]) -> list[tuple[float, Members, None]]:
    """Sets that stepwise selection leaves of an effect at all of its targets, one for every effect that has several."""
    kinds = [tuple(i for i in kind if i in every) for kind in problem.candidates.kinds]
    left = {stepwise(scale, kind, every, EXCHANGEABLE) for kind in kinds if 1 < len(kind) < len(SIZES)}
    return [(scale(each) + problem.candidates.prior(each), each, None) for each in sorted(left)]


def _fit_best(found, fit, count: int, best: float) -> None:  # type: ignore[no-untyped-def]
    tried: set[Members] = set()
    for v, members, near in sorted(found, key=lambda each: -each[0]):
        if members in tried or v < best - HOPELESS_LOG or len(tried) >= count:
            continue
        tried.add(members)
        fit(members, near)


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
