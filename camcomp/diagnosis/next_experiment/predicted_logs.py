"""Predicted logs of an experiment: the twin runs its program for every rival set of causes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from camcomp.diagnosis.experiment.driven_run import axes_along
from camcomp.diagnosis.fit.bench import MOST_ROWS, Bench, Run
from camcomp.diagnosis.fit.cause_sets import Fitted
from camcomp.diagnosis.fit.columns import build
from camcomp.diagnosis.fit.measured import Measured
from camcomp.diagnosis.fit.noise import inflation
from camcomp.diagnosis.fit.patterns import KINDS
from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.model.classes import HIDDEN, LARGE
from camcomp.diagnosis.next_experiment.candidates import Candidate
from camcomp.diagnosis.next_experiment.site import Site, site_of
from camcomp.diagnosis.result.types import NamedCause
from camcomp.diagnosis.statistics.evidence import estimate, posterior
from camcomp.gcode.interpret import read_program
from camcomp.ground.datatypes import Floats, Ints
from camcomp.ground.errors import CamcompError
from camcomp.model.cutting.track import lay_track
from camcomp.model.job import Job
from camcomp.model.motion.run_path import path_of_program
from camcomp.model.motion.timeline import schedule

ONLY_NOISE = "nothing but noise"  # the name of an empty set of causes
WARMS_K = 5.0  # largest further drift of a temperature
USUAL_NOISE = (0.002, 0.0005, 1.0, 2.0)  # mm, mm, N, N: default for unmeasured tip, encoders, drives, dynamometer


@dataclass(frozen=True, eq=False)
class Question:
    """The question for the experiment: which of the rivals, fitted sets of causes with probability (r,), and how large."""

    problem: Problem
    rivals: Sequence[Fitted]
    probability: Floats
    job: Job

    @cached_property
    def members(self) -> tuple[int, ...]:
        """Candidates that are in any rival."""
        return tuple(sorted({i for f in self.rivals for i in f.members}))

    @cached_property
    def beliefs(self) -> tuple[tuple[Floats, Floats], ...]:
        """Posterior of the amplitudes of all columns of the problem per rival: mean (k,) and covariance (k, k).

        The means of its members are zero, because they act through the twin itself. The covariance includes the model
        discrepancy.
        """
        out = []
        for f in self.rivals:
            index = self.problem.member_columns(f.members)
            mean = estimate(f.data, self.problem.prior, index)[0]
            covariance = posterior(f.data, self.problem.prior, index).across(np.arange(len(mean)))
            mean[index] = 0.0
            covariance[index, index] += (HIDDEN / LARGE * f.theta) ** 2
            out.append((mean, covariance))
        return tuple(out)

    @cached_property
    def names(self) -> list[str]:
        """The rivals in words."""
        every = self.problem.columns.candidates
        named = [
            [NamedCause(effect=every[i].name, target=every[i].target).label for i in f.members] for f in self.rivals
        ]
        return [" and ".join(each) or ONLY_NOISE for each in named]

    @cached_property
    def separates(self) -> tuple[str, ...]:
        """Effects in some rivals but not in all; of a single set all of its effects."""
        sets = [set(f.members) for f in self.rivals]
        common = set.intersection(*sets) if len(sets) > 1 else set()
        return tuple(dict.fromkeys(self.problem.columns.candidates[i].name for s in sets for i in sorted(s - common)))

    @cached_property
    def site(self) -> Site:
        """The regions of the runs and of feasible experiments."""
        return site_of(self.problem.bench, self.job)

    @cached_property
    def weight(self) -> Floats:
        """Mean over all rows (k, k) of tip' tip, mm2, for the effect of every column of a cause on the tip in the runs' programs.

        Errors of the drives count with their displacement of the tip; workpiece frame and clock are no errors of the machine.
        """
        machine = self.problem.columns.candidate >= 0
        for i, each in enumerate(self.problem.columns.candidates):
            if each.effect.STAGE in ("workpiece", "sensor"):
                machine[self.problem.columns.of(i)] = False
        return np.asarray(self.problem.tip_gram * np.outer(machine, machine))

    @cached_property
    def shapes(self) -> dict[int, dict[str, float]]:
        """Shape parameters by candidate."""
        own = {i: dict(shape) for f in self.rivals for i, shape in f.extra.items()}
        return {**self.problem.shapes, **own}


@dataclass(frozen=True, eq=False, kw_only=True)
class PredictedLogs:
    """Predicted logs of a candidate.

    signals: white prediction (w, r) of each rival; columns: white derivatives (w, k) by uncertain amplitudes; kinds (w,): of
    channel of every row; reach: per rival a square root (k, k) of the amplitudes' covariance; mine, theirs: indices of common columns
    here and in the problem; size: standard deviation of a kind's rows, mm or N.
    """

    signals: Floats
    columns: Floats
    kinds: NDArray[np.str_]
    reach: list[Floats]
    mine: Ints
    theirs: Ints
    size: dict[str, float]


def predict_logs(question: Question, candidate: Candidate) -> PredictedLogs | None:
    """Predicted logs of a candidate; None if it is infeasible, its cut is unknown, or the rivals are equal there."""
    try:
        return _lay(question, candidate)
    except (CamcompError, ValueError):
        return None


def _lay(question: Question, candidate: Candidate) -> PredictedLogs:
    problem, rivals = question.problem, question.rivals
    bench = Bench(twin=problem.bench.twin, runs=[_run(problem, candidate, question.job)])
    nominal = bench.channels(0, bench.nominal[0])
    changes = [bench.channels(0, bench.read(0, problem.causes(f.members, f.theta, f.extra))) - nominal for f in rivals]
    alone, kinds = _whitened(problem, bench, np.stack(changes, axis=2))
    parts = [alone[kinds == kind] for kind in np.unique(kinds)]
    if len(rivals) > 1 and not candidate.knows and all(
        not seen_apart(each[:, [i, j]], each[:, i] - each[:, j])
        for each in parts for i, j in combinations(range(len(rivals)), 2)
    ):  # fmt: skip
        raise ValueError("nothing to see")
    every, some = problem.columns.candidates, question.members
    shapes = {n: question.shapes[i] for n, i in enumerate(some) if i in question.shapes}
    columns = build(bench, [every[i] for i in some], shapes, problem.floor.tip_um)
    known = {name: i for i, name in enumerate(problem.columns.names)}
    mine = np.array([i for i, name in enumerate(columns.names) if name in known], int)
    theirs = np.array([known[columns.names[i]] for i in mine], int)
    block = columns.blocks[0].dense()
    tolerance = np.minimum(columns.prior.tolerance, 1.0)
    signals, reach = [], []
    for (mean, covariance), change in zip(question.beliefs, changes, strict=True):
        size = np.diag(tolerance)
        size[np.ix_(mine, mine)] = _root(covariance[np.ix_(theirs, theirs)])
        signals.append(change + block[:, :, mine] @ mean[theirs])
        reach.append(size)
    sigma = _noise(problem)
    size_of = {kind: float(np.sqrt(np.mean(sigma[problem.channels_of(kind)] ** 2))) for kind in KINDS}
    return PredictedLogs(
        signals=_whitened(problem, bench, np.stack(signals, axis=2))[0], columns=_whitened(problem, bench, block)[0],
        kinds=kinds, reach=reach, mine=mine, theirs=theirs, size=size_of,
    )  # fmt: skip


def _root(covariance: Floats) -> Floats:
    """A square root (k, k) of a covariance that may be singular."""
    size = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    value, vector = np.linalg.eigh(covariance / size[:, None] / size)
    return np.asarray(size[:, None] * vector * np.sqrt(np.maximum(value, 0.0)), float)


def _noise(problem: Problem) -> Floats:
    """Standard deviation (c,) of every channel, mean of the runs; USUAL_NOISE for unmeasured channels."""
    m = len(problem.bench.actuators)
    known = np.isfinite(problem.noise.sigma)
    sigma = np.where(known, problem.noise.sigma, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
    return np.where(known.any(axis=0), sigma, np.repeat(np.array(USUAL_NOISE), [3, m, m, 3]))


def _whitened(problem: Problem, bench: Bench, values: Floats) -> tuple[Floats, NDArray[np.str_]]:
    """White rows (w, k) of values (n, c, k), and the kind of channel (w,) of each."""
    sigma, time = _noise(problem)[None, :], [bench.runs[0].run_path.time]
    inflate = np.sqrt(1.0 + (inflation(bench)[0] / sigma) ** 2)
    noise = replace(problem.noise, sigma=sigma, inflate=[inflate], time=time)
    kinds = np.array([problem.kind_of(c) for c in range(inflate.shape[1])])
    return noise.rows(0, values), kinds[np.nonzero(np.isfinite(inflate).T)[0]]


def _run(problem: Problem, candidate: Candidate, job: Job) -> Run:
    """The candidate as a run with its channels."""
    twin = problem.bench.twin
    path = read_program(candidate.program.encode(), name="candidate", dialect="rs274").path
    timeline = schedule(path, job.config.control.acceleration_mm_per_s2)
    last = timeline.end + candidate.design.dwell_s
    steps = [float(np.median(np.diff(t))) for t in problem.times if len(t) > 1]
    usual = float(np.median(steps)) if steps else 0.02
    time = np.arange(0.0, last, max(usual, last / MOST_ROWS))
    conditions = job.conditions if candidate.cutting else replace(job.conditions, model=None)
    run_path = path_of_program(
        twin, "candidate", timeline, lay_track(path, conditions), time, started=candidate.started,
        temperature=_temperature(problem, candidate.started + time),
    )  # fmt: skip
    n, m = len(time), len(twin.actuators)
    nan, logged = np.full(n, np.nan), dict.fromkeys(candidate.channels, 0.0)
    tip, encoder, drive, dyno = (
        logged.get(kind, np.nan) + np.zeros((n, 3 if kind in ("tip", "dyno") else m)) for kind in KINDS
    )
    measured = Measured(
        time=time, line=nan, tip=tip, setpoint=np.full((n, m), np.nan), encoder=encoder + run_path.row_rho,
        drive=drive, load=np.full((n, m), np.nan), dyno=dyno, temperature=nan, tip_sd=np.full((n, 3), np.nan),
    )  # fmt: skip
    by = _motion(problem, candidate)
    tips = twin.to_program(run_path.row_place.of(run_path.node_tip))
    return Run(
        name="candidate", run_path=run_path, measured=measured, clamping=None, clock=None, by=by,
        turn=_across(tips) if by == "tip" else None,
    )  # fmt: skip


def _motion(problem: Problem, candidate: Candidate) -> str:
    """The channel of the motion: as in the runs, or the set-points logged together with new encoders."""
    runs = problem.bench.runs
    known = {run.by for run in runs}
    added = "encoder" in candidate.channels and not any(run.measured.has("encoder") for run in runs)
    return "setpoint" if added or "setpoint" in known else "encoder" if "encoder" in known else "tip"


def _across(tips: Floats) -> Floats:
    """Axes (n, 3, 3) along the path of tips (n, 3) and across it."""
    step = np.gradient(tips, axis=0)
    moving = np.linalg.norm(step, axis=1) > 0.0
    last = np.maximum.accumulate(np.where(moving, np.arange(len(tips)), int(np.argmax(moving))))
    along = step[last] / np.maximum(np.linalg.norm(step[last], axis=1, keepdims=True), 1e-12)
    return axes_along(along)


def _temperature(problem: Problem, common: Floats) -> Floats | None:
    """Expected temperatures (n,) at common times, s: the past drift continues by at most WARMS_K."""
    courses = [run.run_path for run in problem.bench.runs]
    if any(c.temperature is None for c in courses):
        return None
    t = np.concatenate([c.started + c.time for c in courses])
    warm = np.concatenate([c.temperature for c in courses if c.temperature is not None])
    slope = np.polyfit(t - t.mean(), warm, 1)[0] if np.ptp(t) > 0 else 0.0
    out: Floats | None = warm[int(np.argmax(t))] + np.clip(slope * (common - t.max()), -WARMS_K, WARMS_K)
    return out


def seen_apart(signals: Floats, left: Floats) -> float:
    """Chi-square of white rows `left` (w,) beyond the model error of signals (w, 2), for any number of rows: HIDDEN, in units
    of the noise, of signals LARGE times the noise.
    """
    own = np.max(signals**2, axis=1) / LARGE**2
    return max(float((left**2).sum()) - HIDDEN**2 * (len(left) + float(own.sum())), 0.0)
