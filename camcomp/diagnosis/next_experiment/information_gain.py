"""Expected information of an experiment in bits: which of the rival causes, and how large.

Which: the difference between the predicted logs of two rivals, marginalised over nuisances (uncertainty of the fit,
tolerances of healthy machines, offset and clock of the new run) and reduced by model discrepancy, gives the expected odds;
the gain is the expected reduction of the entropy over the rivals.
How large: parameters count by the tip error of their uncertainty on the programs of the runs; the gain is half the logarithm
of the ratio of that error before and after, as far as it exceeds the noise.
Sources: expected information gain over hypotheses (Chaloner and Verdinelli, Statistical Science 10, 1995); designs by the
variance of predictions (I-optimality, Box and Draper 1959).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from camcomp.diagnosis.fit.cause_sets import Fitted
from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.next_experiment.candidates import Candidate
from camcomp.diagnosis.next_experiment.predicted_logs import PredictedLogs, Question, seen_apart
from camcomp.diagnosis.statistics.probability import SEED, TEMPERATURE
from camcomp.ground.datatypes import Floats

_OUTCOME_DRAWS = 64


@dataclass(frozen=True, eq=False, kw_only=True)
class ExpectedGain:
    """Expected information of an experiment.

    separated, narrowed: bits about the cause and about its size; before_um, after_um: rms tip error of the uncertainty on the
    runs' programs; kind: channel with the most information; shows (r,): rms signal of every rival in it, mm or N; left (r,
    r): rms residual of rival i after a fit of rival j; apart (r, r): chi-square of rival j for the mean log of rival i.
    """

    separated: float
    narrowed: float
    before_um: float
    after_um: float
    kind: str
    shows: Floats
    left: Floats
    apart: Floats

    @property
    def gain(self) -> float:
        """Sum of both gains, bits."""
        return self.separated + self.narrowed


def predicted_gain(question: Question, candidate: Candidate, there: PredictedLogs) -> ExpectedGain:
    """Expected information of a predicted candidate."""
    problem, rivals, probability = question.problem, question.rivals, question.probability
    kinds = list(dict.fromkeys(there.kinds.tolist()))
    on = [there.kinds == kind for kind in kinds]
    signals, n = there.signals, len(rivals)
    apart, by_kind, rests = np.zeros((n, n)), np.zeros((n, n, len(kinds))), np.zeros((n, n, len(kinds)))
    own = question.weight[np.ix_(there.theirs, there.theirs)]
    before = after = 0.0
    for j in range(n):
        half = there.reach[j]
        D = there.columns @ half
        M = D.T @ D + np.eye(D.shape[1])
        mine = half[there.mine]
        before += probability[j] * float(np.sum((mine @ mine.T) * own))
        after += probability[j] * float(np.sum((mine @ np.linalg.solve(M, mine.T)) * own))
        for i in range(n):
            if i == j:
                continue
            gap = signals[:, i] - signals[:, j]
            move = np.linalg.solve(M, D.T @ gap)
            left = gap - D @ move
            by_kind[i, j] = [seen_apart(signals[rows][:, [i, j]], left[rows]) for rows in on]
            rests[i, j] = [np.sqrt(np.mean(left[rows] ** 2)) for rows in on]
            apart[i, j] = float(by_kind[i, j].sum()) + float(move @ move)
            apart[i, j] += _by_other_means(problem, rivals[i], rivals[j], candidate)
    noise = (1e-3 * problem.floor.tip_um) ** 2
    k = int(np.argmax(by_kind.sum(axis=(0, 1))))
    size = there.size[kinds[k]]
    return ExpectedGain(
        separated=expected_gain(apart, probability) if n > 1 else 0.0,
        narrowed=0.5 * float(np.log2((before + noise) / (after + noise))), before_um=1e3 * before**0.5,
        after_um=1e3 * after**0.5, kind=kinds[k], shows=size * np.sqrt(np.mean(signals[on[k]] ** 2, axis=0)),
        left=size * rests[:, :, k], apart=apart,
    )  # fmt: skip


def _by_other_means(problem: Problem, truth: Fitted, other: Fitted, candidate: Candidate) -> float:
    """Chi-square between the values of two rivals for the parameters that the candidate measures directly."""
    out = 0.0
    for effect, name, deviation in candidate.knows:
        values = [
            sum(c.values.get(name, 0.0) for c in problem.causes(f.members, f.theta, f.extra) if c.name == effect)
            for f in (truth, other)
        ]
        out += ((values[0] - values[1]) / deviation) ** 2
    return out


def expected_gain(apart: Floats, probability: Floats) -> float:
    """Expected fall of the entropy, bits. apart (r, r): chi-square by which rival j misses the mean log of rival i."""
    rng = np.random.default_rng(SEED)
    after = 0.0
    for i, p in enumerate(probability):
        scatter = np.sqrt(apart[i]) * rng.standard_normal((_OUTCOME_DRAWS, len(probability)))
        logs = np.log(np.maximum(probability, 1e-12)) - (0.5 * apart[i] + scatter) / TEMPERATURE
        weight = np.exp(logs - logs.max(axis=1, keepdims=True))
        after += p * float(np.mean([_entropy(w / w.sum()) for w in weight]))
    return max(_entropy(probability) - float(after), 0.0)


def _entropy(p: Floats) -> float:
    p = p[p > 1e-12]
    return float(-(p * np.log2(p)).sum())
