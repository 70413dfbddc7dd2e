"""How well the parameters of an answer are known: amplitudes and shapes together, allowing for what no model states.

Three parts: the posterior of the linear fit with everything else within tolerance, and springs and forces as far off as
they are on any machine, unless the rows say better; the scatter of what the fit leaves, block of time by block of time (a
model that is a little wrong leaves more than noise, and leaves it in one piece); and what every healthy machine has of
the same parameter, which is in the data as well.
Source of the second part: sandwich covariance over blocks (Liang, Zeger 1986; Newey, West 1987).
"""

import numpy as np

from camcomp.diagnosis.fit.cause_sets import Fitted
from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.statistics.evidence import FREE, gram, within
from camcomp.diagnosis.statistics.normal_equations import AmplitudePosterior, sum_grams
from camcomp.ground.datatypes import Floats

FORMULA = 0.005  # share of its size by which an effect's formula itself is off: no guide turns round as Dahl wrote
STATED = 0.05  # share by which stated springs and forces are off on any machine, whether it is a cause or not
BLOCKS = (6, 24, 96)  # per run


def joint_covariance(problem: Problem, f: Fitted) -> Floats:
    """Covariance (d + s, d + s) of the members' coordinates and, behind them, of their shapes in their own units."""
    index = problem.member_columns(f.members)
    names = problem.shapes_of(f.members)
    d, s = len(index), len(names)
    k = len(problem.columns.names)
    shapes = problem.shape_columns(f.members, f.theta, f.extra) if s else [np.zeros((len(W), 0)) for W in f.white]
    # a shape that the data do not tell is known to about a third
    reach = np.array([0.3 * f.extra[i][p.name] for i, p in names])
    G = [W.appended(D * reach) for W, D in zip(problem.white_at(f), shapes, strict=True)]
    usual, most = _stated(problem)
    precision = np.concatenate([usual, np.ones(s)])
    precision[index] = FREE
    all_columns = AmplitudePosterior.of(sum_grams([gram(g, r) for g, r in zip(G, f.residual, strict=True)]), precision)
    most = np.concatenate([most, np.full(s, np.inf)])
    most[index] = np.inf
    mean = within(all_columns.mean, all_columns.across, most)[0]
    mine = np.array([*index, *range(k, k + s)], int)
    C = all_columns.across(mine)
    scatter = np.zeros((len(BLOCKS), d + s))
    for run, (g, r) in enumerate(zip(G, f.residual, strict=True)):
        pull = (g @ C) * (r - g @ mean)[:, None]
        at = problem.row_places(run)
        for b, count in enumerate(BLOCKS):
            block = np.minimum((at * count).astype(int), count - 1)
            sums = np.zeros((count, d + s))
            np.add.at(sums, block, pull)
            scatter[b] += np.sum(sums**2, axis=0)
    own = np.diag(C[mine])
    wider = np.sqrt(np.maximum(scatter.max(axis=0) / own, 1.0))
    unit = np.concatenate([np.ones(d), reach])
    out = C[mine] * np.outer(wider * unit, wider * unit)
    healthy = np.concatenate(
        [problem.prior.tolerance[index], [p.tolerance * (f.extra[i][p.name] if p.log else 1.0) for i, p in names]]
    )
    parameters = [p for i in f.members for p in problem.columns.candidates[i].parameters]
    # of a factor it is the whole of what it multiplies that the formula is off by
    whole = [1.0 / p.scale if p.log else t for p, t in zip(parameters, f.theta, strict=True)]
    formula = np.concatenate([FORMULA * np.asarray(whole, float), np.zeros(s)])
    return np.asarray(out + np.diag(healthy**2 + formula**2), float)


def _stated(problem: Problem) -> tuple[Floats, Floats]:
    """Precision and reach (k,) of all columns, with springs and forces known to STATED of themselves only."""
    precision, reach = problem.prior.precision, problem.prior.reach.copy()
    for candidate, columns in zip(problem.columns.candidates, problem.candidates.columns, strict=True):
        for p, c in zip(candidate.parameters, columns, strict=True):
            if p.log:
                precision[c] = min(precision[c], (p.scale / STATED) ** 2)
                reach[c] = np.inf
    return precision, reach
