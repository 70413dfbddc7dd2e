"""Next experiment for an unknown cause: a run in which a single covariate changes.

Each covariate of the residual is a hypothesis, weighted by the share that it explains alone. An experiment that changes some
covariates and keeps the others shows whether the true one is among the former; its gain is the entropy of that outcome, in
bits.
"""

from collections.abc import Sequence

import numpy as np

from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.next_experiment.candidates import single_changes
from camcomp.diagnosis.next_experiment.outcomes import after_unknown
from camcomp.diagnosis.next_experiment.predicted_logs import feasible
from camcomp.diagnosis.next_experiment.proposal import WORTH, Proposal
from camcomp.diagnosis.next_experiment.ready_program import can_be_run
from camcomp.diagnosis.next_experiment.site import room_of, site_of
from camcomp.model.job import Job


def explore(problem: Problem, labels: Sequence[tuple[str, float]], job: Job) -> Proposal | None:
    """The experiment with the largest gain about the covariate of an unknown effect, or None.

    labels: covariates (`time:x`) with the share of the residual that each explains alone.
    """
    weight: dict[str, float] = {}
    for name, share in labels:
        family = name.partition(":")[0]
        weight[family] = max(weight.get(family, 0.0), share)
    whole = sum(weight.values())
    found = []
    for candidate in single_changes(site_of(problem.bench), room_of(problem.bench, job)):
        p = sum(weight.get(family, 0.0) for family in candidate.varies) / whole if whole > 0 else 0.0
        gain = -float(sum(q * np.log2(q) for q in (p, 1.0 - p) if q > 0.0))
        if gain > WORTH:
            others = [
                family for family in sorted(weight, key=lambda each: -weight[each]) if family not in candidate.varies
            ]
            outcomes = after_unknown([v for v in candidate.varies if v in weight] or candidate.varies, others)
            found.append(Proposal(candidate=candidate, gain=gain, separates=("unknown",), outcomes=outcomes))
    ranked = sorted(found, key=lambda each: -each.value)
    bench = problem.bench
    can = (each for each in ranked if can_be_run(each.candidate, bench.runs, job, bench.twin))
    return next((each for each in can if feasible(problem, each.candidate, job)), None)
