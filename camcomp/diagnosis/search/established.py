"""Whether what a set of causes names is surely more than every healthy machine has."""

import numpy as np
from scipy.stats import chi2

from camcomp.diagnosis.fit.floor import MINOR
from camcomp.diagnosis.fit.intervals import joint_covariance
from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.search.unexplained import size_um
from camcomp.diagnosis.statistics.cause_sets import Fitted

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
        reach = float(np.sqrt(chi2.isf(2.0 * CHANCE, len(theta))))
        surely = size_um(problem, f, (i,)) * (1.0 - reach / max(far, 1e-12))
        if surely < least:
            least, found = surely, i
    return found
