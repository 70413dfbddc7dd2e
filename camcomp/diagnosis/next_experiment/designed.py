"""Search for the next experiment: the best of a grid over position, plane, radius, feed, direction, load and dwell; what each of
its outcomes would mean, a sentence each.

The objective is the information minus the price of machine time, so that a short experiment with little
information does not win. The search is deterministic.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from camcomp.diagnosis.fit.cause_sets import Fitted
from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.law.words import listed
from camcomp.diagnosis.model.classes import INDISTINGUISHABLE, MOST_SETS
from camcomp.diagnosis.next_experiment.candidates import (
    Candidate,
    by_other_means,
    coarse,
    single_changes,
)  # fmt: skip
from camcomp.diagnosis.next_experiment.design import SETUP_MIN
from camcomp.diagnosis.next_experiment.information_gain import ExpectedGain, predicted_gain
from camcomp.diagnosis.next_experiment.predicted_logs import ONLY_NOISE, Question, predict_logs
from camcomp.diagnosis.next_experiment.ready_program import can_be_run
from camcomp.diagnosis.next_experiment.site import Site, site_of
from camcomp.ground.datatypes import Floats
from camcomp.model.job import Job
from camcomp.report.plot import brief

_WHAT = {
    "tip": ("the tip is", 1e3, "µm"),
    "encoder": ("the encoders are", 1e3, "µm"),
    "drive": ("the drive forces are", 1.0, "N"),
    "dyno": ("the cutting force is", 1.0, "N"),
}
NEITHER = "If what is left stays above the noise whichever it is, something unknown is at work as well."
PRICE = 0.5 / 60.0  # bits per minute of machine time
LEAST_BITS = PRICE * SETUP_MIN  # an experiment has to tell more than it costs to set one up


@dataclass(frozen=True, eq=False, kw_only=True)
class Proposal:
    """An experiment, its expected information (bits), the effects that it separates, and what each outcome would mean."""

    candidate: Candidate
    gain: float
    separates: tuple[str, ...]
    outcomes: tuple[str, ...]

    @property
    def value(self) -> float:
        """Bits minus the price of the machine time."""
        return self.gain - PRICE * self.candidate.minutes


def propose(problem: Problem, rivals: Sequence[Fitted], probability: Floats, job: Job) -> Proposal | None:
    """The best next experiment to separate fitted sets of causes; None if all tell less than it costs to set one up."""
    if not any(f.members for f in rivals):
        return None
    question = Question(problem, rivals, probability, job)
    separates, site = question.separates, question.site
    useful = [
        each for each in (*coarse(site), *by_other_means(site)) if all(effect in separates for effect, *_ in each.knows)
    ]
    return _best(problem, site, job, useful, partial(judged, question))


def judged(question: Question, each: Candidate) -> Proposal | None:
    """A candidate with its expected information about a question; None if it is infeasible or has no gain."""
    there = predict_logs(question, each)
    if there is None:
        return None
    found = predicted_gain(question, each, there)
    outcomes = outcomes_of(found, each, question.names)
    return Proposal(candidate=each, gain=found.gain, separates=question.separates, outcomes=outcomes)


def _best(
    problem: Problem, site: Site, job: Job, tried: Iterable[Candidate], judge: Callable[[Candidate], Proposal | None]
) -> Proposal | None:
    """The proposal of most value that tells more than it costs to set one up, of those that the machine can run."""
    bench = problem.bench
    every = [judge(each) for each in tried if site.holds(each.design.points())]
    worth = sorted((p for p in every if p is not None and p.gain > LEAST_BITS), key=lambda p: -p.value)
    return next((p for p in worth if can_be_run(p.candidate, bench.runs, job, bench.twin)), None)


def explore(problem: Problem, labels: Sequence[tuple[str, float]], job: Job) -> Proposal | None:
    """The experiment with the largest gain about the covariate of an unknown effect, or None.

    A run in which some covariates of the residual change shows whether the true one is among them: its gain is the entropy
    of that outcome, bits. labels: covariates (`time:x`) with the share of the residual that each explains alone.
    """
    weight: dict[str, float] = {}
    for name, share in labels:
        family = name.partition(":")[0]
        weight[family] = max(weight.get(family, 0.0), share)
    whole = sum(weight.values())

    def judge(each: Candidate) -> Proposal:
        p = sum(weight.get(family, 0.0) for family in each.varies) / whole if whole > 0 else 0.0
        gain = -float(sum(q * np.log2(q) for q in (p, 1.0 - p) if q > 0.0))
        others = [family for family in sorted(weight, key=lambda of: -weight[of]) if family not in each.varies]
        outcomes = after_unknown([v for v in each.varies if v in weight] or each.varies, others)
        return Proposal(candidate=each, gain=gain, separates=("unknown",), outcomes=outcomes)

    site = site_of(problem.bench, job)
    return _best(problem, site, job, single_changes(site), judge)


def outcomes_of(found: ExpectedGain, candidate: Candidate, names: Sequence[str]) -> tuple[str, ...]:
    """What each outcome of a candidate would mean; names: of the rival sets of causes, in their order."""
    if len(names) == 1:
        return (
            (
                f"If no more than the noise is left on it with {names[0]} in the model, that holds; what stays uncertain then moves the tip by "
                f"{_um(found.after_um)} (rms) on the runs' programs instead of {_um(found.before_um)}."
            ),
            "If more is left, something acts there that these runs did not show.",
        )
    if candidate.knows:
        [(effect, *_)] = candidate.knows
        return (*(_by_hand(name, effect) for name in names[:MOST_SETS]), NEITHER)
    return (*(_by_log(found, names, i) for i in range(min(len(names), MOST_SETS))), NEITHER)


def _by_hand(name: str, effect: str) -> str:
    if effect in name:
        return f"If it is off by what {name} says, that is the cause, and with it in the config the gap is gone."
    return f"If it is as the machine file states, and the gap stays with --without {effect}, the cause is {name}."


def _by_log(found: ExpectedGain, names: Sequence[str], i: int) -> str:
    if names[i] == ONLY_NOISE:
        return "If nothing but noise is left on it, there is no cause."
    what, scale, unit = _WHAT[found.kind]
    off = f"If it is {names[i]}, {what} off by {brief(scale * float(found.shows[i]), 2)} {unit} (rms) on it"
    others = [j for j in range(len(names)) if j != i]
    if alike := [names[j] for j in others if found.apart[i, j] < INDISTINGUISHABLE]:
        return f"{off}; {listed(alike[:MOST_SETS])} would look the same there."
    left, nearest = min((float(found.left[i, j]), j) for j in others)
    return f"{off}, of which {names[nearest]} cannot explain {brief(scale * left, 2)} {unit}."


def after_unknown(varies: Sequence[str], others: Sequence[str]) -> tuple[str, ...]:
    """Outcomes for an unknown effect; varies: changed covariates, others: unchanged covariates of the residual."""
    changed, stays = " and ".join(varies), " or ".join(others[:MOST_SETS])
    return (
        f"If what is left changes, it goes with {changed}.",
        f"If it stays as it is, it does not go with {changed}" + (f" but with {stays}." if stays else "."),
    )


def _um(value: float) -> str:
    return f"{brief(value, 2)} µm"
