"""What to measure when the cause is unknown: change one thing that it may depend on, and nothing else.

Each covariate that the leftover follows is a hypothesis, weighed by the share that it carries alone. An experiment that
changes some of them and leaves the others tells whether the driver is among those; its gain is the entropy of that
answer, in bits, if it comes out clear.
"""

from collections.abc import Sequence

import numpy as np

from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.next_experiment.candidates import candidates, site_of
from camcomp.diagnosis.next_experiment.information_gain import WORTH, Proposal, feasible
from camcomp.model.job import Job

ENOUGH = 0.6  # share of the best gain from which on the shorter experiment is the better one


def explore(problem: Problem, labels: Sequence[tuple[str, float]], job: Job) -> Proposal | None:
    """The experiment that tells most about what an unknown effect depends on, per minute; None where nothing would.

    labels: covariates (`time:x`) with the share of the leftover that each carries alone.
    """
    weight: dict[str, float] = {}
    for name, share in labels:
        family = name.partition(":")[0]
        weight[family] = max(weight.get(family, 0.0), share)
    whole = sum(weight.values())
    found = []
    for candidate in candidates(site_of(problem.bench)):
        p = sum(weight.get(family, 0.0) for family in candidate.varies) / whole if whole > 0 else 0.0
        gain = -float(sum(q * np.log2(q) for q in (p, 1.0 - p) if q > 0.0))
        if gain > WORTH:
            found.append(Proposal(candidate, gain, ("unknown",)))
    most = max((each.gain for each in found), default=0.0)
    ranked = sorted(found, key=lambda each: (each.gain < ENOUGH * most, -each.gain / each.candidate.minutes))
    return next((each for each in ranked if feasible(problem, each.candidate, job)), None)
