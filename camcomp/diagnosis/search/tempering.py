"""What evidence is divided by before it becomes a probability: no model is as good as its noise."""

from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.statistics.cause_sets import Fitted, total
from camcomp.diagnosis.statistics.evidence import estimate
from camcomp.diagnosis.statistics.probability import TEMPERATURE


def tempering(problem: Problem, f: Fitted) -> float:
    """The temperature where a set is the best: evidence is worth less by as much as it leaves more than noise (quasi-likelihood)."""
    return TEMPERATURE * max(1.0, misfit(problem, f) / max(total(f.grams).rows, 1))


def misfit(problem: Problem, f: Fitted) -> float:
    """Minimum chi-square with the members free and all other coordinates under their tolerances, penalties included."""
    data = total(f.grams)
    index = problem.member_columns(f.members)
    mean, _ = estimate(data, problem.prior, index, 1.0)
    precision = problem.prior.precision(1.0)
    precision[index] = 0.0
    return float(data.c - 2.0 * data.b @ mean + mean @ data.A @ mean + precision @ mean**2)
