"""Whether what a set of causes names is surely there, and more than every healthy machine has."""

import numpy as np
from scipy.special import chdtri

from camcomp.diagnosis.fit.floor import MINOR
from camcomp.diagnosis.fit.intervals import joint_covariance
from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.search.tempering import tempering
from camcomp.diagnosis.search.unexplained import size_um
from camcomp.diagnosis.statistics.cause_sets import Fitted, Members, Scale, predictive, total

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
    """The member that is wanted least, by the evidence and on withheld runs, or that may be minor; None where none is idle."""
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
