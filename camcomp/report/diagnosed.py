"""From a diagnosis to what its report draws: the gap of every run before and after, and the signals of rival causes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import PurePath
from typing import Any

from camcomp.bench import Bench, Run, thinned
from camcomp.campaign import Campaign
from camcomp.config import load_config, load_experiment
from camcomp.datatypes import Floats
from camcomp.diagnose import Diagnosis, _theta_without
from camcomp.files import read_bytes
from camcomp.gap.observation import channel_names
from camcomp.gap.search import Fitted
from camcomp.inquiry import Inquiry
from camcomp.locate import main_channels
from camcomp.report.answer import cause_name
from camcomp.report.diagnosis import diagnosis_html
from camcomp.report.inputs import Input
from camcomp.report.runview import Rival, RunView
from camcomp.twin import Twin

MICRO = 1e3  # mm -> um


def report_of(path: str, result: dict[str, Any], done: Diagnosis | None, campaign: Campaign | None) -> bytes:
    """The report of an experiment file. Without `done` (studies of logs that have no program) no runs are drawn."""
    experiment = load_experiment(path)
    inputs = [Input("experiment", str(path), read_bytes(path))]
    inputs += [Input("configuration", each, read_bytes(each)) for each in experiment.config]
    for run in experiment.runs:
        if run.program is not None:
            inputs.append(Input(f"program of {run.name}", run.program, read_bytes(run.program)))
        inputs.append(Input(f"log of {run.name}", run.log, read_bytes(run.log)))
    views: list[RunView] = []
    rivals: list[Rival] = []
    if done is not None and campaign is not None:
        views = views_of(done, campaign.twin, campaign.runs, experiment.holdout)
        rivals = rivals_of(done)
    return diagnosis_html(
        result,
        views,
        title=PurePath(path).name,
        machine=load_config(experiment.config).robot.name,
        inputs=inputs,
        notes=campaign.notes if campaign is not None else (),
        rivals=rivals,
    )


def views_of(done: Diagnosis, twin: Twin, runs: Sequence[Run], holdout: Sequence[str]) -> list[RunView]:
    """Runs of the fit in their order, then those named in `holdout`.

    Without names every run is judged with causes fitted without it.
    """
    inquiry = done.inquiry
    best = done.survey.fits[done.survey.verdict.best]
    out = []
    for k in range(len(inquiry.bench.runs)):
        theta = best.theta if holdout else _theta_without(inquiry, best, k)
        out.append(_view(inquiry, inquiry.bench, k, best, theta, held_out=not holdout and len(inquiry.bench.runs) > 1))
    unseen = [run for run in runs if run.name in holdout and run.name not in {each.name for each in inquiry.bench.runs}]
    if unseen:
        bench = Bench(twin, unseen)
        out += [_view(inquiry, bench, k, best, best.theta, held_out=True) for k in range(len(unseen))]
    return out


def rivals_of(done: Diagnosis) -> list[Rival]:
    """Sets of causes that the data cannot tell apart, the best one first; none when there is only one."""
    found, inquiry = done.survey, done.inquiry
    if done.result["verdict"] != "ambiguous":
        return []
    part = main_channels(inquiry)
    out = []
    for fit in (found.fits[found.verdict.best], *(found.fits[j] for j in found.verdict.rivals)):
        causes = inquiry.causes(fit.members, fit.theta, fit.extra)
        names = [cause_name({"effect": each.name, "target": each.target}) for each in causes]
        signals = tuple(
            MICRO * (inquiry.bench.gap(k) - inquiry.bench.gap(k, causes))[:, part] for k in range(len(inquiry.bench.runs))
        )
        out.append(Rival(" and ".join(names), signals))
    return out


def _view(inquiry: Inquiry, bench: Bench, k: int, fit: Fitted, theta: Floats, *, held_out: bool) -> RunView:
    part, run = main_channels(inquiry), bench.runs[k]
    causes = inquiry.causes(fit.members, theta, fit.extra)
    before = bench.gap(k)
    after = bench.gap(k, causes) if causes else before
    return RunView(
        run.name,
        held_out,
        thinned(run.course.time[:, None], run.thin)[:, 0],
        thinned(run.measured.line[:, None], run.thin)[:, 0],
        thinned(bench.nominal[k].tip, run.thin),
        MICRO * before[:, part],
        MICRO * after[:, part],
        tuple(each.replace("_", " ") for each in channel_names(bench.actuators)[part]),
    )
