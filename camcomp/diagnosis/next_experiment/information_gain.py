"""Which experiment to do next: the one that best separates the causes that are still alike, per minute of machine time.

The twin foresees the logs of every candidate for each rival at its fitted size. What tells two rivals apart there, after
all that may differ anyway (the fit's own uncertainty, what every healthy machine has, the new run's offset and clock)
and less what no model gets right, gives the odds that the candidate is expected to produce; its gain is the expected fall of the entropy, in bits.
Source: expected information gain over hypotheses (Chaloner and Verdinelli, Statistical Science 10, 1995).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise
from typing import Any

import numpy as np

from camcomp.diagnosis.fit.bench import Bench, Run
from camcomp.diagnosis.fit.columns import build
from camcomp.diagnosis.fit.measured import Measured
from camcomp.diagnosis.fit.noise import inflation
from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.next_experiment.candidates import CHANNELS, Candidate, candidates, site_of
from camcomp.diagnosis.search.indistinguishable import HIDDEN, LARGE
from camcomp.diagnosis.statistics.cause_sets import Fitted, total
from camcomp.diagnosis.statistics.evidence import estimate
from camcomp.gcode.interpret import read_program
from camcomp.ground.datatypes import Floats
from camcomp.ground.errors import CamcompError
from camcomp.model.cutting.track import lay_track
from camcomp.model.job import Job
from camcomp.model.motion.run_path import path_of_program
from camcomp.model.motion.timeline import schedule

WORTH = 0.1  # bits below which an experiment is not worth proposing
_NEARLY = 0.9
_OUTCOME_DRAWS = 64
_SEED = 20120624
_TEMPERATURE = 1.5  # what evidence is divided by before it becomes a probability, as in the survey
_STRETCH = 2.5  # by how much a new place may be nearer to a singular pose
_ROWS = 2500  # of a foreseen log
_WARMS_K = 5.0  # by how much a temperature may still drift
_USUAL_NOISE = (0.002, 0.0005, 1.0, 2.0)  # mm, mm, N, N: tip, encoders, drives, dynamometer, where never measured


@dataclass(frozen=True, eq=False)
class Proposal:
    """The best candidate, its gain in bits, the effects that it separates."""

    candidate: Candidate
    gain: float
    separates: tuple[str, ...]


def propose(problem: Problem, rivals: Sequence[Fitted], probability: Floats, job: Job) -> Proposal | None:
    """The best next experiment between fitted sets of causes; None where nothing is left to separate.

    Of those that settle nearly all that any of them can settle, the one with the most gain per minute: half an answer
    that is cheap only asks for the next experiment.
    """
    found = ranked(problem, rivals, probability, job)
    most = max((each.gain for each in found), default=0.0)
    return next((each for each in found if each.gain >= _NEARLY * most), None)


def ranked(problem: Problem, rivals: Sequence[Fitted], probability: Floats, job: Job) -> list[Proposal]:
    """All experiments that are worth it, by gain per minute."""
    if len(rivals) < 2:
        return []
    names = _names(problem, rivals)
    found = []
    laid: dict[Any, _Laid | None] = {}
    for candidate in candidates(site_of(problem.bench)):
        if any(effect not in names for effect, *_ in candidate.knows):
            continue
        body = candidate.program.split("G54\n", 1)[-1]
        key = (body, candidate.cutting, candidate.started, "encoder" in candidate.channels, bool(candidate.knows))
        if key not in laid:
            laid[key] = _try(problem, candidate, rivals, job)
        here = laid[key]
        if here is None:
            continue
        gain = expected_gain(_odds(problem, rivals, candidate, here), probability)
        if gain > WORTH:
            found.append(Proposal(candidate, gain, names))
    return sorted(found, key=lambda each: -each.gain / each.candidate.minutes)


def expected_gain(apart: Floats, probability: Floats) -> float:
    """Expected fall of the entropy, bits. apart (r, r): chi-square by which rival j misses the mean log of rival i."""
    rng = np.random.default_rng(_SEED)
    after = 0.0
    for i, p in enumerate(probability):
        scatter = np.sqrt(apart[i]) * rng.standard_normal((_OUTCOME_DRAWS, len(probability)))
        logs = np.log(np.maximum(probability, 1e-12)) - (0.5 * apart[i] + scatter) / _TEMPERATURE
        weight = np.exp(logs - logs.max(axis=1, keepdims=True))
        after += p * float(np.mean([_entropy(w / w.sum()) for w in weight]))
    return max(_entropy(probability) - float(after), 0.0)


def _entropy(p: Floats) -> float:
    p = p[p > 1e-12]
    return float(-(p * np.log2(p)).sum())


def _names(problem: Problem, rivals: Sequence[Fitted]) -> tuple[str, ...]:
    sets = [set(f.members) for f in rivals]
    common = set.intersection(*sets)
    return tuple(dict.fromkeys(problem.columns.candidates[i].name for s in sets for i in sorted(s - common)))


# -- foreseeing ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class _Laid:
    """A candidate with every channel logged. Per kind of channel: white rows (w, r) of what each rival lets one expect, and
    white columns (w, k) of all that may differ; spread: covariance (k, k) of their amplitudes per rival.
    """

    signals: dict[str, Floats]
    columns: dict[str, Floats]
    spread: list[Floats]


def _try(problem: Problem, candidate: Candidate, rivals: Sequence[Fitted], job: Job) -> _Laid | None:
    try:
        return _lay(problem, candidate, rivals, job)
    except (CamcompError, ValueError):
        return None  # out of reach, or a force model that does not know the cut


def feasible(problem: Problem, candidate: Candidate, job: Job) -> bool:
    """Whether the machine can do a candidate, at a place where its model is to be trusted."""
    try:
        _on_bench(problem, candidate, job)
    except (CamcompError, ValueError):
        return False
    return True


def _on_bench(problem: Problem, candidate: Candidate, job: Job) -> Bench:
    run = _run(problem, candidate, job)
    low, high = np.array(job.machine.limits).T
    if (run.run_path.grid_rho < low).any() or (run.run_path.grid_rho > high).any():
        raise ValueError("out of the travel of an actuator")
    bench = Bench(problem.bench.twin, [run])
    if _transmission(bench) > _STRETCH * _transmission(problem.bench):
        raise ValueError("too near a singular pose for the model to be trusted")
    return bench


def _lay(problem: Problem, candidate: Candidate, rivals: Sequence[Fitted], job: Job) -> _Laid:
    bench = _on_bench(problem, candidate, job)
    nominal = bench.channels(0, bench.nominal[0])
    changes = [bench.channels(0, bench.read(0, problem.causes(f.members, f.theta, f.extra))) - nominal for f in rivals]
    alone = _whitened(problem, bench, np.stack(changes, axis=2))
    if not candidate.knows and all(
        not _seen(alone[k], i, j, alone[k][:, i] - alone[k][:, j]) for k in alone for i, j in _pairs(rivals)
    ):
        raise ValueError("nothing to see")
    shapes = {**problem.shapes, **{i: shape for f in rivals for i, shape in f.extra.items()}}
    columns = build(bench, problem.columns.candidates, shapes, problem.floor.tip_um)
    known = {name: i for i, name in enumerate(problem.columns.names)}
    mine = [i for i, name in enumerate(columns.names) if name in known]
    theirs = [known[columns.names[i]] for i in mine]
    block = columns.blocks[0]
    signals, spread = [], []
    for f, change in zip(rivals, changes, strict=True):
        index = problem.member_columns(f.members)
        mean, covariance = estimate(total(f.grams), problem.prior, index, f.factor)
        mean[index] = 0.0  # the members act through the twin itself
        size = np.diag(np.minimum(columns.prior.tolerance, 1.0) ** 2)
        # a fit is no better than the model it was made with
        own = np.zeros(len(mean))
        own[index] = (HIDDEN / LARGE * f.theta) ** 2
        size[np.ix_(mine, mine)] = (covariance + np.diag(own))[np.ix_(theirs, theirs)]
        signals.append(change + block[:, :, mine] @ mean[theirs])
        spread.append(size)
    return _Laid(_whitened(problem, bench, np.stack(signals, axis=2)), _whitened(problem, bench, block), spread)


def _pairs(rivals: Sequence[Fitted]) -> list[tuple[int, int]]:
    return list(combinations(range(len(rivals)), 2))


def _seen(signals: Floats, i: int, j: int, left: Floats) -> float:
    """Chi-square of white rows left (w,) beyond what no model gets right of signals (w, r), however many rows there are."""
    own = np.maximum(signals[:, i] ** 2, signals[:, j] ** 2) / LARGE**2
    return max(float((left**2).sum()) - HIDDEN**2 * (len(left) + float(own.sum())), 0.0)


def _transmission(bench: Bench) -> float:
    """Largest motion of the tip per motion of the drives."""
    return float(max(np.linalg.norm(bench.row_slopes(k), 2, axis=(1, 2)).max() for k in range(len(bench.runs))))


def _whitened(problem: Problem, bench: Bench, values: Floats) -> dict[str, Floats]:
    """White rows (w, k) of values (n, c, k), per kind of channel."""
    m = len(bench.actuators)
    known = np.isfinite(problem.noise.sigma)
    sigma = np.where(known, problem.noise.sigma, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
    usual = np.repeat(np.array(_USUAL_NOISE), [3, m, m, 3])
    noise = replace(problem.noise, sigma=np.where(known.any(axis=0), sigma, usual)[None, :])
    inflate = np.sqrt(1.0 + (inflation(bench)[0] / noise.sigma) ** 2)
    time = bench.runs[0].run_path.time
    ends = np.cumsum((0, 3, m, m, 3))
    present = {k: np.isfinite(inflate[:, a:b]).any() for k, a, b in zip(CHANNELS, ends[:-1], ends[1:], strict=True)}
    return {
        k: noise.rows(0, values[:, a:b], inflate, time, a)
        for k, a, b in zip(CHANNELS, ends[:-1], ends[1:], strict=True)
        if present[k]
    }


def _odds(problem: Problem, rivals: Sequence[Fitted], candidate: Candidate, laid: _Laid) -> Floats:
    """Chi-square (r, r) by which rival j misses what rival i lets one expect, after all that may differ anyway."""
    kinds = [k for k in candidate.channels if k in laid.signals]
    columns = np.concatenate([laid.columns[k] for k in kinds])
    signals = np.concatenate([laid.signals[k] for k in kinds])
    ends = np.cumsum([0, *(len(laid.signals[k]) for k in kinds)])
    out = np.zeros((len(rivals), len(rivals)))
    for j in range(len(rivals)):
        half = _root(laid.spread[j])
        D = columns @ half
        M = D.T @ D + np.eye(D.shape[1])
        for i in range(len(rivals)):
            if i == j:
                continue
            gap = signals[:, i] - signals[:, j]
            move = np.linalg.solve(M, D.T @ gap)
            left = gap - D @ move
            seen = [_seen(signals[a:b], i, j, left[a:b]) for a, b in pairwise(ends)]
            out[i, j] = sum(seen) + float(move @ move)
            out[i, j] += _by_other_means(problem, rivals[i], rivals[j], candidate)
    return out


def _root(covariance: Floats) -> Floats:
    """A square root (k, k) of a covariance that may be singular."""
    size = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    value, vector = np.linalg.eigh(covariance / size[:, None] / size)
    return np.asarray(size[:, None] * vector * np.sqrt(np.maximum(value, 0.0)), float)


def _by_other_means(problem: Problem, truth: Fitted, other: Fitted, candidate: Candidate) -> float:
    """Chi-square between the values that two rivals give a parameter that the candidate measures directly."""
    out = 0.0
    for effect, name, deviation in candidate.knows:
        values = [
            sum(c.values.get(name, 0.0) for c in problem.causes(f.members, f.theta, f.extra) if c.name == effect)
            for f in (truth, other)
        ]
        out += ((values[0] - values[1]) / deviation) ** 2
    return out


def _run(problem: Problem, candidate: Candidate, job: Job) -> Run:
    """The candidate on the bench with every channel that it could log; what it does log is picked later."""
    twin = problem.bench.twin
    path = read_program(candidate.program.encode(), name="candidate").path
    timeline = schedule(path, job.config.control.acceleration_mm_per_s2)
    last = timeline.end + candidate.stay_s
    steps = [float(np.median(np.diff(t))) for t in problem.times if len(t) > 1]
    usual = float(np.median(steps)) if steps else 0.02
    time = np.arange(0.0, last, max(usual, last / _ROWS))
    conditions = job.conditions if candidate.cutting else replace(job.conditions, model=None)
    run_path = path_of_program(
        "candidate", timeline, lay_track(path, conditions), time, started=candidate.started, to_machine=twin.to_machine,
        vectors=job.frame.vectors, inverse=twin.inverse, temperature=_temperature(problem, candidate.started + time),
    )  # fmt: skip
    n, m = len(time), len(twin.actuators)
    nan = np.full(n, np.nan)
    encoder = run_path.row_rho if "encoder" in candidate.channels else np.full((n, m), np.nan)
    measured = Measured(
        time, nan, np.zeros((n, 3)), np.full((n, m), np.nan), encoder, np.zeros((n, m)), np.zeros((n, 3)), nan,
        np.full((n, 3), np.nan),
    )  # fmt: skip
    return Run("candidate", run_path, measured, None, None)


def _temperature(problem: Problem, common: Floats) -> Floats | None:
    """Temperatures (n,) expected at common times, s: the drift so far goes on, but not by more than some kelvin."""
    courses = [run.run_path for run in problem.bench.runs]
    if any(c.temperature is None for c in courses):
        return None
    t = np.concatenate([c.started + c.time for c in courses])
    warm = np.concatenate([c.temperature for c in courses if c.temperature is not None])
    slope = np.polyfit(t - t.mean(), warm, 1)[0] if np.ptp(t) > 0 else 0.0
    out: Floats | None = warm[int(np.argmax(t))] + np.clip(slope * (common - t.max()), -_WARMS_K, _WARMS_K)
    return out
