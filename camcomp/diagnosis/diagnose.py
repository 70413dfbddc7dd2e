"""Where logs and model differ, which effect is the cause, how far the gap shrinks with it, and what to measure next.

Reads like the question: put the runs on the bench, open the problem, search_causes the causes, look at what is left, try the
answer on runs it has not seen.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from camcomp.diagnosis.answer.held_out import causes_without, shrinkage_of
from camcomp.diagnosis.fit.bench import Bench, Run, thinned
from camcomp.diagnosis.fit.cause_sets import Fitted
from camcomp.diagnosis.fit.columns import candidate_causes, working_causes
from camcomp.diagnosis.fit.gap import floor_um, gap_sizes, main_channels
from camcomp.diagnosis.fit.intervals import joint_covariance
from camcomp.diagnosis.fit.lookalikes import without_lookalikes, without_twins
from camcomp.diagnosis.fit.open_problem import open_problem
from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.law.answer import LawAnswer, answer_law
from camcomp.diagnosis.law.library import LearnedLaw
from camcomp.diagnosis.model.calibration import calibration_of
from camcomp.diagnosis.model.classes import MOST_SETS
from camcomp.diagnosis.model.noise import HEALTHY, MINOR, REPEATABILITY_MM
from camcomp.diagnosis.next_experiment.designed import Proposal, explore, propose
from camcomp.diagnosis.result.floor_rule import within_floor
from camcomp.diagnosis.result.types import (
    MOST_LISTED,
    SOMETHING_UNKNOWN,
    DiagnosisResult,
    Driver,
    Estimate,
    Floor,
    FoundCause,
    GapSize,
    MinorEffect,
    NamedCause,
    NextExperiment,
    Outlier,
    UnknownCause,
    Where,
)
from camcomp.diagnosis.search.cause_search import CauseSearch, search_causes
from camcomp.diagnosis.search.indistinguishable import classes
from camcomp.diagnosis.search.unexplained import worst
from camcomp.diagnosis.search.unknown import residual_tests
from camcomp.diagnosis.standards import of_runs
from camcomp.diagnosis.statistics import places
from camcomp.diagnosis.statistics.evidence import estimate
from camcomp.diagnosis.statistics.noise_model import effective_rows
from camcomp.diagnosis.statistics.periods import frequencies
from camcomp.diagnosis.statistics.probability import EVEN, probability_of_chance
from camcomp.ground.datatypes import Floats
from camcomp.ground.progress import part as part_of_work
from camcomp.model.effect import Cause
from camcomp.model.job import Job
from camcomp.model.motion.twin import Twin

ROWS_OF_AN_INSTANT = 2.0  # to both sides, between which something may have begun or ended
UNLOGGED_RISE = (0.3, 3.0)  # times the 10 K that are taken where no temperature is logged: by how much drives warm up


@dataclass(frozen=True, eq=False, kw_only=True)
class Diagnosis:
    """The result, and what a report draws: the fitted problem, search, proposal and law.

    causes: as the result has them. judged: the runs of the shrinkage; chosen: per such run the causes by candidate that were
    chosen and fitted without it.
    """

    result: DiagnosisResult
    problem: Problem
    search: CauseSearch
    proposal: Proposal | None
    causes: list[Cause]
    judged: Bench
    chosen: Sequence[Mapping[int, Cause]]
    law: LawAnswer | None = None


def diagnose(
    job: Job,
    twin: Twin,
    runs: Sequence[Run],
    *,
    holdout: Sequence[str] = (),
    without: Sequence[str] = (),
    stated_mm: float | None = None,
    learned: Sequence[LearnedLaw] = (),
) -> Diagnosis:
    """The diagnosis of an experiment; `without` names excluded effects, `learned` holds laws of earlier diagnoses."""
    used = [run for run in runs if run.name not in holdout] or list(runs)
    bench = Bench(twin=twin, runs=used)
    laws = [each.candidate(twin.actuators) for each in learned if each.name not in without]
    found_before = [each for each in laws if each is not None]
    offered = [*candidate_causes(twin.robot, without), *found_before]
    causes = without_twins(bench, without_lookalikes(bench, working_causes(bench, offered)))
    with part_of_work(0.0, 0.5):
        problem = open_problem(bench, causes, stated_mm)
    with part_of_work(0.5, 0.95):
        found = search_causes(problem)
    best = found.sets.best
    gap = GapSize.of(gap_sizes(problem, best), floor_um(problem))
    word = found.word
    law = answer_law(problem, best, found.unknown_in) if found.unknown_in else None
    stands = problem
    if law is not None:  # causes have the values that they have beside it; those that had only followed it are gone
        stands, best = law.problem, law.fit
    answer = stands.causes(best.members, best.theta, best.extra)
    if withheld := [run for run in runs if run not in used]:
        judged, chosen = Bench(twin=twin, runs=withheld), [dict(zip(best.members, answer, strict=True))] * len(withheld)
    else:  # every run is held out once, from the choice among the sets that were found, too, where the problem is still theirs
        judged, fits = stands.bench, found.sets.fits if law is None else ()
        chosen = causes_without(stands, best, fits, found.sets.probability[: len(fits)])
    unseen = bool(withheld) or (len(used) > 1 and not holdout)
    proposal = _next(problem, found, word, job)
    proposed = None if proposal is None else NextExperiment(
        action=proposal.candidate.action, separates=proposal.separates, gain=round(proposal.gain, 4),
        minutes=round(proposal.candidate.minutes, 1), outcomes=proposal.outcomes,
    )  # fmt: skip
    outliers = tuple(
        Outlier(run=run.name, row=int(row) + 1)
        for run, cells in zip(problem.bench.runs, problem.outliers, strict=True) for row in np.flatnonzero(cells.any(axis=1))
    )  # fmt: skip
    result = within_floor(DiagnosisResult(
        verdict=word, gap=gap, where=_where(problem, found, best, law),
        causes=_causes(stands, found, best, law),
        alternatives=_alternatives(problem, found) if word == "ambiguous" else (),
        shrinkage=shrinkage_of(stands, best, judged, chosen) if unseen else None,
        next_experiment=proposed, minor=_minor_effects(stands, best),
        outliers=outliers, floor=Floor(um=gap.noise_floor_um, source=problem.floor.source),
        equivalent=tuple(tuple(_named(problem, i) for i in group) for group in classes(problem)),
        standards=of_runs(twin, runs),
    ))  # fmt: skip
    return Diagnosis(
        result=result, problem=problem, search=found, proposal=None if result.next_experiment is None else proposal,
        causes=answer, judged=judged, chosen=chosen, law=None if result.law is None else law,
    )  # fmt: skip


def _next(problem: Problem, found: CauseSearch, word: str, job: Job) -> Proposal | None:
    """The experiment that separates the answer from its rivals: sets that explain as well, or else the next likely ones.

    Without a rival, the one that reduces the error by its uncertainty on the runs' programs.
    """
    if word == "none":
        return None
    if found.unknown_in:
        return explore(problem, found.left[found.unknown_in], job)
    sets = found.sets
    best = sets.first
    close = [best, *sets.rivals[: MOST_SETS - 1]]
    if len(close) == 1:
        close += [j for j in np.argsort(-sets.probability).tolist() if j != best][: MOST_SETS - 1]
    # rivals explain equally well: a low prior does not exclude them
    p = np.ones(len(close)) if sets.rivals else sets.probability[close]
    return propose(problem, [sets.fits[j] for j in close], p / p.sum(), job)


# -- causes -----------------------------------------------------------------------------------------------------------


def _energies(problem: Problem, f: Fitted) -> list[float]:
    """What each member moves the tip by, um squared."""
    return [problem.moved_um(f, (i,)) ** 2 for i in f.members]


def _unknown_energy(found: CauseSearch) -> float:
    """What unseen runs show beyond the floor, um squared; for a while only where it acts for a while."""
    if found.unknown_in is None:
        return 0.0
    each = found.beyond.get(found.unknown_in) or worst(found.beyond)
    return max(each.excess_um, 1e-3) ** 2


def _causes(problem: Problem, found: CauseSearch, best: Fitted, law: LawAnswer | None) -> tuple[FoundCause, ...]:
    """Causes by probability, the unknown one last: its probability is that of the chance of what is left."""
    energy = _energies(problem, best)
    left = _unknown_energy(found)
    whole = sum(energy) + left
    out: list[FoundCause] = []
    causes = problem.causes(best.members, best.theta, best.extra)
    covariance = joint_covariance(problem, best) if best.members else np.zeros((0, 0))
    for j, i in enumerate(best.members):
        candidate = problem.columns.candidates[i]
        out.append(
            FoundCause(
                effect=candidate.name,
                target=candidate.target,
                probability=found.stated.get(i, 0.0),
                share=round(energy[j] / whole, 4) if whole > 0 else 0.0,
                parameters=_parameters(problem, best, covariance, j, causes[j]),
            )
        )
    out.sort(key=lambda c: (-c.probability, -c.share))
    if found.unknown_in:
        shares = places.actuators(_run_gaps(problem, causes), problem.bench.actuators)
        target = next((name for name, share in shares.items() if share > EVEN), None)
        out.append(
            UnknownCause(
                target=target,
                probability=calibration_of("programs").calibrate(
                    probability_of_chance(worst(found.beyond).log10_chance)
                ),
                share=round(left / whole, 4) if whole > 0 else 1.0,
                law=None if law is None else law.law,
            )
        )
    return tuple(out)


def _parameters(problem: Problem, f: Fitted, covariance: Floats, j: int, cause: Cause) -> dict[str, Estimate]:
    """Parameter values with 95 % intervals; intervals of derived values follow by their slopes in the fitted
    coordinates.
    """
    idle, wide = _idle_shapes(problem, cause), 1.96 * calibration_of("programs").interval
    kinds = {p.name: p for p in cause.effect.PARAMETERS}
    d = len(f.theta)
    shapes = problem.shapes_of(f.members)

    def at(step: Floats) -> dict[str, float]:
        extra = {i: dict(values) for i, values in f.extra.items()}
        for (i, p), change in zip(shapes, step[d:], strict=True):
            extra[i][p.name] += change
        values = problem.causes(f.members, f.theta + step[:d], extra)[j].values
        return {name: float(np.log(value)) if kinds[name].log else value for name, value in values.items()}

    # small steps inwards: a parameter on its bound still has a slope
    steps = (
        1e-3 * np.sqrt(np.diag(covariance)) * np.concatenate([np.where(f.theta < 0, -1.0, 1.0), np.ones(len(shapes))])
    )
    here, out = at(np.zeros(len(steps))), dict[str, Estimate]()
    moved = [at(row) for row in np.diag(steps)]
    for name, value in cause.values.items():
        if name in idle:
            continue
        change = np.array([each[name] - here[name] for each in moved])
        if name == "phase_rad":
            change = np.angle(np.exp(1j * change))
        slope = change / steps
        half = wide * float(np.sqrt(slope @ covariance @ slope))
        if kinds[name].placed:
            half = ROWS_OF_AN_INSTANT * max(float(np.median(np.diff(t))) for t in problem.times if len(t) > 1)
        ends = [here[name] - half, here[name] + half]
        low, high = np.exp(ends) if kinds[name].log else ends
        if kinds[name].unit.endswith("/K") and not _heat_logged(problem):
            every = [end * k for end in (low, high) for k in UNLOGGED_RISE]
            low, high = min(every), max(every)
        if name != "phase_rad":
            low, high = max(low, kinds[name].low), min(high, kinds[name].high)
        out[name] = Estimate.stated(value, low, high)
    return out


def _idle_shapes(problem: Problem, cause: Cause) -> set[str]:
    """Shapes without information here: a warm-up time where temperatures are logged, a law that has its nominal
    value.
    """
    usual = {p.name for p in cause.effect.PARAMETERS if p.either and cause.values.get(p.name) == p.nominal}
    warming = {p.name for p in cause.effect.PARAMETERS if p.scan and p.unit == "s" and not p.placed}
    return usual | (warming if _heat_logged(problem) else set())


def _heat_logged(problem: Problem) -> bool:
    return all(run.run_path.temperature is not None for run in problem.bench.runs)


def _alternatives(problem: Problem, found: CauseSearch) -> tuple[tuple[NamedCause, ...], ...]:
    rivals = found.sets.rivals
    fits = [found.sets.fits[j] for j in (found.sets.first, *rivals[: MOST_SETS - 1])]
    named = tuple(tuple(_named(problem, i) for i in f.members) for f in fits)
    return named if rivals else (*named, (SOMETHING_UNKNOWN,))


def _named(problem: Problem, i: int) -> NamedCause:
    return NamedCause(effect=problem.columns.candidates[i].name, target=problem.columns.candidates[i].target)


def _minor_effects(problem: Problem, f: Fitted) -> tuple[MinorEffect, ...]:
    """Effects of a fit with shrinkage that are listed apart from the causes, because they are below MINOR, the largest first."""
    mean, _ = estimate(f.data, problem.prior, problem.member_columns(f.members))
    found = []
    for i, (candidate, columns) in enumerate(zip(problem.columns.candidates, problem.candidates.columns, strict=True)):
        if i in f.members or not columns:
            continue
        index = list(columns)
        size = problem.size_um(index, mean[index])
        if size > HEALTHY * problem.floor.tip_um:
            found.append(MinorEffect(effect=candidate.name, target=candidate.target, size_um=round(size, 3)))
    return tuple(sorted(found, key=lambda each: -each.size_um)[:MOST_LISTED])


# -- where ------------------------------------------------------------------------------------------------------------


def _where(problem: Problem, found: CauseSearch, best: Fitted, law: LawAnswer | None) -> Where:
    gaps = _run_gaps(problem)
    channels = ["x", "y", "z"] if main_channels(problem).start == 0 else list(problem.bench.actuators)
    at, heard = places.axes(gaps, channels), frequencies(gaps, channels)
    left = gaps  # what is unknown acts where the known causes leave something
    if found.unknown_in and best.members:
        left = _run_gaps(problem, problem.causes(best.members, best.theta, best.extra))
    return Where.model_validate({
        "stage": _stage(problem, best, found, law),
        "axes": {axis: at.get(axis, 0.0) for axis in "xyz"},
        "actuators": places.actuators(gaps, problem.bench.actuators),
        "lines": places.lines(gaps),
        "intervals": places.intervals(left),
        "drivers": _drivers(problem, found, heard),
        "frequencies": heard,
    })  # fmt: skip


def _run_gaps(problem: Problem, causes: Sequence[Cause] = ()) -> list[places.RunGap]:
    """Every run's gap, or what causes leave of it, in the main channels."""
    part = main_channels(problem)
    m = len(problem.bench.actuators)
    out = []
    for k, run in enumerate(problem.bench.runs):
        gap = problem.bench.gap(k, causes)[:, part]
        noise = problem.noise.sigma[k, part]
        thin = float(np.mean([1.0 / effective_rows(problem.noise, c, 1) for c in range(part.start, part.stop)]))
        line = thinned(run.measured.line, run.thin)
        if part.start == 0:
            slope = problem.bench.thin_slopes[k]
            clean = np.where(np.isfinite(gap), gap, 0.0)
            drives = np.einsum("nij,nj->ni", np.linalg.pinv(slope), clean)
        else:
            drives = gap if gap.shape[1] == m else np.zeros((len(gap), m))
        noise = np.where(np.isfinite(noise), np.hypot(noise, REPEATABILITY_MM if part.start == 0 else 0.0), 1.0)
        out.append(
            places.RunGap(
                name=run.name, gap=gap, noise=noise, thin=thin, time=problem.times[k], line=line, drives=drives
            )
        )
    return out


def _stage(problem: Problem, best: Fitted, found: CauseSearch, law: LawAnswer | None) -> str:
    """The stage of the largest cause; of an unknown one, that of its law, or else of the channel that shows it; without any, of the
    channels in which the gap is stated.
    """
    energy = _energies(problem, best)
    left = _unknown_energy(found)
    if found.unknown_in and left > max(energy, default=0.0):
        if law is not None:
            return law.law.on
        stage, labels = (
            {"encoder": "control", "dyno": "process"}.get(found.unknown_in),
            found.left[found.unknown_in],
        )
        return stage or ("structure" if labels and labels[0][0].startswith("force") else "drive")
    if energy:
        return str(problem.columns.candidates[best.members[int(np.argmax(energy))]].effect.STAGE)
    return "structure" if main_channels(problem).start == 0 else "control"


def _drivers(problem: Problem, found: CauseSearch, heard: Sequence[Mapping[str, Any]]) -> list[Driver]:
    """Covariates of the gap; with an unknown cause, covariates of the residual."""
    if found.unknown_in:
        # a vibration of one frequency depends on time alone
        lines = tuple((f"time:{line['axis']}", line["share"]) for line in heard)
        labels = tuple(sorted((*lines, *found.left[found.unknown_in]), key=lambda each: -each[1]))
    else:
        labels = next(iter(residual_tests(problem, problem.refit(())).values()), ())
    return [Driver(covariate=name, share=round(share, 4)) for name, share in labels[:MOST_LISTED] if share > MINOR**2]
