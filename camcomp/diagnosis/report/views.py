"""Data of a diagnosis for its report: gap of every run before and after, and what a law explains."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import PurePath
from typing import TYPE_CHECKING

import numpy as np

from camcomp.diagnosis.experiment.open_experiment import OpenExperiment
from camcomp.diagnosis.fit.bench import Bench, thinned
from camcomp.diagnosis.fit.gap import main_channels
from camcomp.diagnosis.fit.measured import channel_names
from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.law.answer import LawAnswer, rms_um, term_bench
from camcomp.diagnosis.law.bench_terms import Spot
from camcomp.diagnosis.report.law_section import LawView
from camcomp.diagnosis.report.page import diagnosis_html
from camcomp.diagnosis.report.run_view import RunView
from camcomp.diagnosis.result.types import DiagnosisResult
from camcomp.ground.files import read_bytes
from camcomp.model.config.load import ExperimentFile
from camcomp.model.effect import Cause
from camcomp.report.inputs import Input
from camcomp.report.page import Listing

if TYPE_CHECKING:
    from camcomp.diagnosis.diagnose import Diagnosis


def report_of(
    file: ExperimentFile,
    result: DiagnosisResult,
    done: Diagnosis | None,
    opened: OpenExperiment | None,
    next_program: Listing | None = None,
) -> bytes:
    """The report of an experiment file. Without `done` (studies of logs that have no program) it has no plots of runs.

    next_program: file of the proposed experiment.
    """
    experiment = file.experiment
    inputs = [Input("experiment", file.path, read_bytes(file.path))]
    inputs += [Input("configuration", each, read_bytes(each)) for each in experiment.config]
    for run in experiment.runs:
        if run.program is not None:
            inputs.append(Input(f"program of {run.name}", run.program, read_bytes(run.program)))
        inputs.append(Input(f"log of {run.name}", run.log, read_bytes(run.log)))
    views = views_of(done) if done is not None and opened is not None else []
    return diagnosis_html(
        result, views, title=PurePath(file.path).name, machine=file.config.robot.name, inputs=inputs,
        notes=opened.notes if opened is not None else (), next_program=next_program,
        law=_law_view(done.problem, done.law) if done is not None and done.law is not None else None,
    )  # fmt: skip


def views_of(done: Diagnosis) -> list[RunView]:
    """Runs that were withheld, behind those of the fit; else every run with causes chosen and fitted without it."""
    problem, unseen = done.problem, done.result.shrinkage is not None
    judged = [
        _view(problem, done.judged, k, list(each.values()), held_out=unseen) for k, each in enumerate(done.chosen)
    ]
    if done.judged is problem.bench:
        return judged
    fitted = range(len(problem.bench.runs))
    return [*(_view(problem, problem.bench, k, done.causes, held_out=False) for k in fitted), *judged]


def _view(problem: Problem, bench: Bench, k: int, causes: Sequence[Cause], *, held_out: bool) -> RunView:
    part, run = main_channels(problem), bench.runs[k]
    before = bench.gap(k)
    after = bench.gap(k, causes) if causes else before
    return RunView(
        name=run.name,
        held_out=held_out,
        time=thinned(run.run_path.time, run.thin),
        position=thinned(bench.nominal[k].tip, run.thin),
        before=1e3 * before[:, part],
        after=1e3 * after[:, part],
        channels=("along the path", "across the path", "normal to both")
        if run.turn is not None and part.start == 0
        else tuple(each.replace("_", " ") for each in channel_names(bench.actuators)[part]),
        commanded=thinned(run.commanded(bench.twin), run.thin),
        program=run.program,
        cutting=bool(np.any(run.run_path.row_force)),
    )


def _law_view(problem: Problem, answer: LawAnswer) -> LawView:
    """Residuals over the first covariate of the law, along the axis of the tip with its largest effect."""
    bench, part = problem.bench, answer.law.parts[0]
    spot = Spot("structure", 0) if part.target is None else Spot(part.stage, bench.actuators.index(part.target))
    covariate = next(iter(part.envelope))
    axis = int(np.argmax(np.sum([np.sum(s**2, axis=0) for s in answer.signal], axis=0)))
    runs, sizes = [], []
    every = zip(bench.runs, term_bench(problem).rows(spot), answer.before, answer.gaps, answer.signal, strict=True)
    for run, own, before, gap, signal in every:
        x = thinned(own[covariate], run.thin)
        runs.append((run.name, x, 1e3 * gap[:, axis], 1e3 * signal[:, axis]))
        sizes.append((rms_um([before]), rms_um([gap], [signal])))
    return LawView(covariate, "xyz"[axis], tuple(runs), np.array(sizes))
