"""The probability that a result states of every cause: all that happens to one after the posterior happens here.

    p = snap(min(cap, (1 - LOOKALIKE) * min(posterior, credible)))

posterior: of all sets that have the cause (`judge`), less sure by what sets that harm other runs explain as well
(`held_against`). credible: beside families of functions of one covariate (`credibility`). cap: EVEN for a cause that takes
nothing of the gap, and for one that may be a part of something unmodelled; UNSURE for one below the noise floor. snap: a
lead of less than BARE_ODDS is none.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from camcomp.diagnosis.fit.bench import CandidateCause
from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.search.unexplained import size_um
from camcomp.diagnosis.statistics.cause_sets import Fitted, Members, probabilities
from camcomp.diagnosis.statistics.probability import EVEN, UNSURE
from camcomp.diagnosis.statistics.verdict import BARE_ODDS, EQUAL_LOG_ODDS, Verdict
from camcomp.ground.datatypes import Floats

LOOKALIKE = 0.01  # probability that something unmodelled looks the same as a cause that explains all down to the noise


@dataclass(frozen=True, eq=False, kw_only=True)
class StatedEvidence:
    """What is known of the answer beside the posterior of the sets.

    known: the answer; named_before: the best set as if nothing unmodelled acted; credible: probability of members beside
    families of functions; is_unknown: whether something unmodelled shows; idle: members that take
    nothing of the gap, where nothing unmodelled shows; depends: the covariate that it goes with most.
    """

    known: Fitted
    named_before: Members
    credible: Mapping[int, float]
    is_unknown: bool
    idle: Collection[int]
    depends: str


def state_probabilities(
    problem: Problem, fits: Sequence[Fitted], probability: Floats, verdict: Verdict, evidence: StatedEvidence
) -> Verdict:
    """The verdict with the probabilities that are stated; `ambiguous` where these leave an identified set in doubt."""
    known = evidence.known
    # of a cause that only shows beside something unmodelled the posterior of the sets says nothing
    posterior = verdict.inclusion | {i: 1.0 for i in known.members if i not in evidence.named_before}
    cap = {i: UNSURE for i in known.members if size_um(problem, known, (i,)) < problem.floor.tip_um}
    cap |= dict.fromkeys(evidence.idle, EVEN)
    inclusion = {}
    for i, p in posterior.items():
        sure = (1.0 - LOOKALIKE) * min(p, evidence.credible.get(i, 1.0))
        inclusion[i] = worth_a_mention(min(sure, cap.get(i, 1.0)))
        if is_part_of_unknown(problem.columns.candidates[i], evidence.depends):
            inclusion[i] = min(inclusion[i], EVEN)
    verdict = replace(verdict, inclusion=inclusion)
    return verdict if evidence.is_unknown else open_where_even(verdict, fits, probability)


def worth_a_mention(probability: float) -> float:
    """The probability of a cause, or even where its lead is not worth a mention: errors of the model make as much."""
    return EVEN if EVEN < probability < BARE_ODDS / (1.0 + BARE_ODDS) else probability


def is_part_of_unknown(candidate: CandidateCause, depends: str) -> bool:
    """Whether a cause may be a part of something unmodelled that depends on one covariate above all; empty: nothing is.

    A wave may be the part that waves of what depends on a place, a lag the part that grows with speed of what depends on the
    same drive's speed.
    """
    of, _, target = depends.partition(":")
    if of == "position":
        return any(p.turns for p in candidate.shapes)
    return of == "velocity" and candidate.effect.STAGE == "control" and candidate.target in (None, target)


def held_against(
    problem: Problem, fits: tuple[Fitted, ...], probability: Floats, verdict: Verdict, others: Sequence[Fitted],
    temperature: float,
) -> Verdict:  # fmt: skip
    """The verdict beside sets that are no answer and explain as well: causes that these lack are less sure.

    None of them counts for more than the best answer.
    """
    best = fits[verdict.best]
    beside = {f.members: f for f in others if all(f.members != g.members for g in fits)}.values()
    shares = [probabilities((f, best), problem.candidates, temperature) for f in beside]
    counts = np.array([min(mine / max(its, 1e-300), 1.0) for mine, its in shares]) * probability[verdict.best]
    whole = 1.0 + float(counts.sum())
    inclusion = {i: p / whole for i, p in verdict.inclusion.items()}
    for f, p in zip(beside, counts, strict=True):
        for i in f.members:
            inclusion[i] = inclusion.get(i, 0.0) + float(p) / whole
    return replace(verdict, inclusion=inclusion)


def open_where_even(verdict: Verdict, fits: Sequence[Fitted], probability: Floats) -> Verdict:
    """The verdict, but `ambiguous` where a member of what it identifies has at most EVEN: sets without it are its rivals.

    Where all members have, and no set rivals them, something unmodelled does.
    """
    members = set(fits[verdict.best].members)
    doubtful = {i for i in members if verdict.inclusion[i] <= EVEN}
    least = float(probability[verdict.best]) * np.exp(-EQUAL_LOG_ODDS)
    rivals = tuple(
        int(j)
        for j in np.argsort(-probability)
        if j != verdict.best and probability[j] > least and fits[j].members and doubtful - set(fits[j].members)
    )
    if verdict.word != "identified" or not (rivals or doubtful == members):
        return verdict
    return replace(verdict, word="ambiguous", rivals=rivals)
