"""What evidence is divided by before it becomes a probability: no model is as good as its noise."""

from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.statistics.cause_sets import Fitted, total
from camcomp.diagnosis.statistics.evidence import estimate

TEMPERATURE = (
    1.5  # what evidence is divided by before it becomes a probability, where the model is as good as its noise
)


def tempering(problem: Problem, f: Fitted) -> float:
    """The temperature where a set is the best: evidence is worth less by as much as it leaves more than noise (quasi-likelihood).

    What it leaves is taken with the members free and everything else within tolerance, penalties included.
    """
    data = total(f.grams)
    mean, _ = estimate(data, problem.prior, problem.member_columns(f.members), 1.0)
    left = data.c - float(data.b @ mean)
    return TEMPERATURE * max(1.0, left / max(data.rows, 1))
