"""Is every member of a set of causes significantly above MINOR, and which data contradict it?"""

from collections.abc import Callable

import numpy as np
from scipy.special import chdtri

from camcomp.diagnosis.fit.floor import MINOR
from camcomp.diagnosis.fit.intervals import joint_covariance
from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.search.tempering import tempering
from camcomp.diagnosis.search.unexplained import size_um
from camcomp.diagnosis.statistics.cause_sets import (
    Fitted,
    Members,
    Scale,
    predictive,
    probabilities,
    total,
    with_minor,
)
from camcomp.ground.datatypes import Floats

LEAST_PROBABILITY = 0.02  # of a set that is looked at more closely
CHANCE = 0.16  # of a member that looks as large as it does although it is minor: one standard deviation


def weakest(problem: Problem, f: Fitted) -> int | None:
    """The member that may as well be minor, the weakest of several; None where all are surely more.

    By the end of its interval that is nearer to nothing (Wald's test, all parameters of a member together).
    """
    if not f.members:
        return None
    C = joint_covariance(problem, f, as_stated=True)
    least, found, at = MINOR * problem.floor.tip_um, None, 0
    for i in f.members:
        mine = slice(at, at + len(problem.candidates.columns[i]))
        at, theta = mine.stop, f.theta[mine]
        far = float(np.sqrt(theta @ np.linalg.solve(C[mine, mine], theta)))
        reach = float(np.sqrt(chdtri(len(theta), 2.0 * CHANCE)))
        surely = size_um(problem, f, (i,)) * (1.0 - reach / max(far, 1e-12))
        if surely < least:
            least, found = surely, i
    return found


def established(
    problem: Problem,
    fits: tuple[Fitted, ...],
    fit: Callable[[Members], Fitted],
    temperature: float,
    probability: Floats,
) -> tuple[tuple[Fitted, ...], Floats]:
    """Drop members whose effect at the tip is not significantly above MINOR; the reduced sets take the places of the
    fits.

    Every likely set is reduced, not the best alone: otherwise rivals would keep a member that the best one has lost.
    Probabilities are computed again after each step.
    """
    firm = set[Members]()
    while True:
        likely = [int(j) for j in np.argsort(-probability) if probability[j] >= LEAST_PROBABILITY]
        at = next((j for j in likely if fits[j].members not in firm), None)
        if at is None:
            return fits, probability
        least = weakest(problem, f := fits[at])
        if least is None:
            firm.add(f.members)
            continue
        without = tuple(i for i in f.members if i != least)
        same = [g for g in fits if g.members == without] or [fit(without)]
        less = max(*same, with_minor(same[0], f), key=lambda g: problem.candidates.value(g, temperature))
        fits = (*(g for j, g in enumerate(fits) if j != at and g.members != without), less)
        probability = probabilities(fits, problem.candidates, temperature)


def standing(problem: Problem, members: Members) -> Fitted:
    """The fit of those members that are still wanted in a problem that has more in it than when they were found.

    A cause that was named before a law was known may have followed what the law says.
    """
    while True:
        f = problem.refit(members)
        least = _idle(problem, f)
        if least is None:
            return f
        members = tuple(i for i in members if i != least)


def _idle(problem: Problem, f: Fitted) -> int | None:
    """The member that evidence or withheld runs speak against most, else one that may be minor; None where every member
    is needed.
    """
    if not f.members:
        return None
    smaller = [tuple(each for each in f.members if each != i) for i in f.members]
    scale, candidates = Scale(total(f.grams), problem.prior, problem.candidates), problem.candidates
    odds = np.array(
        [(scale(f.members) - scale(less)) / tempering(problem, f) - candidates.prior(less) for less in smaller]
    )
    odds += candidates.prior(f.members)
    unseen = predictive(f.grams, problem.prior, candidates, [f.members, *smaller])
    if len(f.grams) > 1:
        lasting = np.array([not problem.passing(i) for i in f.members])  # of what passes, other runs say nothing
        odds = np.where(lasting, np.minimum(odds, unseen[0] - unseen[1:]), odds)
    if odds.min() < 0.0:
        return f.members[int(np.argmin(odds))]
    return weakest(problem, f)
