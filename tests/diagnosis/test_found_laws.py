"""Laws that act in one run alone, and effects that no form can express: found as what it is, or a map that an unseen run confirms."""

from types import SimpleNamespace

import numpy as np
import pytest

from camcomp.diagnosis.diagnose import diagnose
from camcomp.diagnosis.experiment.open_experiment import open_experiment
from camcomp.diagnosis.fit.bench import Bench, CandidateCause
from camcomp.diagnosis.fit.open_problem import open_problem
from camcomp.diagnosis.law.answer import _base, answer_law, fit_needed, term_bench, with_law
from camcomp.diagnosis.law.bench_terms import Spot, Term
from camcomp.diagnosis.law.forms import at_tip
from camcomp.diagnosis.law.library import LearnedLaw
from camcomp.diagnosis.law.shapes import Shapes
from camcomp.diagnosis.statistics.folds import usual_split
from camcomp.ground import shelf
from camcomp.model.effect import Cause
from camcomp.model.law.covariates import AT_DRIVE
from camcomp.model.law.expression import parse
from tests.validation.recorded.experiment import Made, Plan, row_times, write
from tests.validation.recorded.faults import Fault, Faults
from tests.validation.recorded.hidden_laws import Experiment
from tests.validation.recorded.machines import MACHINES
from tests.validation.recorded.plant import Character, Run, observe
from tests.validation.recordings import recording


def opened(folder, *how):
    made = Experiment(*how)
    made.write(folder)
    return made, open_experiment(folder / "experiment.yaml")


@pytest.mark.campaign  # forces have some in the plain run
def test_what_acts_in_one_run_alone_is_a_while_on_its_drive(tmp_path):
    made, files = opened(tmp_path, "disturbed_drive", "x", "router", 910021, 10.0, 130)
    done = diagnose(files.job, files.twin, files.runs, without=("disturbance",), stated_mm=0.003)
    law, problem = done.result.law, done.problem
    truth = made.fault.parameters
    (part,) = law.parts
    assert (law.on, part.target) == ("drive", "x") and set(part.envelope) == {"common_s"}
    gaps = [
        problem.bench.gap(k)[:, 0] for k in range(len(made.runs))
    ]  # none where the force jumps: these rows tell nothing
    clock = np.concatenate(
        [run.started_s + t[np.isfinite(g)] for run, t, g in zip(made.runs, problem.times, gaps, strict=True)]
    )
    acts = (clock >= truth["when_s"]) & (clock < truth["when_s"] + truth["last_s"])
    said = parse(part.formula, dict.fromkeys(AT_DRIVE))({"common_s": clock}, len(clock)) != 0.0
    assert acts.sum() > 10 and (acts != said).sum() <= 1  # both ends between the rows that they fall
    assert abs(law.terms[0].value - 0.06 * made.size) < 0.1 * 0.06 * made.size
    assert law.after_rms_um < 0.25 * law.before_rms_um


def driven(folder, machine, wrong):
    """A machine and the opened experiment of three runs of it, minutes apart, with one thing wrong."""
    plan, runs = Plan(1, machine=machine, rows=80, stated=True), []
    for i, name in enumerate(("circles-exact", "zigzag-blended", "pocket-10um")):
        runs.append(Run(recording.load(name), True, (0.0, 300.0, 731.0)[i]))
    rng, truth = np.random.default_rng(1), MACHINES[machine]
    states = [observe(truth, r, Faults((wrong,)), Character(), row_times(r, plan, True, rng)) for r in runs]
    return truth, open_experiment(write(Made(runs, states, {"runs": [{} for _ in runs]}), plan, folder))


@pytest.mark.parametrize(
    ("machine", "target", "size", "term", "unit"),
    [
        ("orthoglide", "x", 1.2, "load_y_N", "mm/N"),
        pytest.param("kuka-kr210", "A3", 7.0, "load_A4_Nmm", "rad/N mm", marks=pytest.mark.campaign),
    ],
)
def test_a_drive_that_another_drives_load_moves_is_told_so_and_its_spring_not_blamed(
    tmp_path, machine, target, size, term, unit
):
    truth, files = driven(tmp_path, machine, Fault("crosstalk", target, {"size": size, "place_mm": 0.0}))
    causes = [CandidateCause("drive_stiffness", at, shelf.load("effects", "drive_stiffness")) for at in truth.actuators]
    problem = open_problem(Bench(twin=files.twin, runs=files.runs), causes, 0.003)
    answer = answer_law(problem, fit_needed(problem, (truth.actuators.index(target),)), "tip")
    assert answer.fit.members == ()  # the law tells it better than the spring
    (found,) = answer.law.terms
    assert (found.term, found.unit) == (f"drive {target}: {term}", unit)
    # what the structure exerts on a drive is the opposite of what the drive exerts
    assert found.value == pytest.approx(-2e-4 * size / truth.reach**2, rel=0.03)
    assert answer.law.after_rms_um < 0.2 * answer.law.before_rms_um


def test_a_swing_in_time_is_told_by_how_many_turns_it_does_between_runs(tmp_path):
    swing = {"size": 1.0, "place_mm": 0.0, "period_mm": 20.0, "phase": 0.4, "period_s": 27.1}
    _, files = driven(tmp_path, "router", Fault("breathing", "x", swing))
    problem = open_problem(Bench(twin=files.twin, runs=files.runs), [], 0.003)
    bench, spot = term_bench(problem), Spot("structure", 0)
    step = _base(problem, None, bench, "tip")(usual_split(len(files.runs)), False)
    waves = [f for f in at_tip(bench.sizes(spot)) if (f.family, f.about) == ("wave", ("common_s",))]
    near = min(waves, key=lambda f: abs(1.0 / f.shape[0] - 1.0 / 31.0))  # a run of 15 s hardly knows it from 27.1
    found = Shapes(bench).followed(step, Term(spot, near))
    assert found.form.shape[0] == pytest.approx(swing["period_s"], rel=2e-3)


@pytest.mark.campaign
def test_a_cause_that_followed_a_law_goes_once_it_is_known_and_another_stays(tmp_path):
    made = Experiment("creep", "x", "router", 970024, 3.0, 100)
    pitch = Fault("screw_pitch", "y", {"error_ppm": 300.0})
    made.base = (*made.base, pitch)
    made.write(tmp_path)
    files = open_experiment(tmp_path / "experiment.yaml")
    causes = [
        CandidateCause(name, at, shelf.load("effects", name))
        for name, at in [("thermal_growth", "x"), ("screw_pitch", "y")]
    ]
    problem = open_problem(Bench(twin=files.twin, runs=files.runs), causes, 0.003)
    assert fit_needed(problem, (0, 1)).members == (0, 1)
    bench, spot = term_bench(problem), Spot("structure", 0)
    forms = [f for f in at_tip(bench.sizes(spot)) if f.family == "settling" and "force_N" in f.about]
    white = bench.white(spot, bench.values(spot, forms[1]))
    law = SimpleNamespace(precision=np.full(2, 1.0), columns=(white,), terms=(Term(spot, forms[1]),))
    f = fit_needed(with_law(problem, law), (0, 1))
    assert f.members == (1,)
    (cause,) = problem.causes(f.members, f.theta, f.extra)
    assert cause.values["error_ppm"] == pytest.approx(300.0, abs=30.0)


@pytest.mark.campaign  # test_hidden_laws has one in the plain run
def test_what_no_form_expresses_is_better_on_an_unseen_run_than_nothing(tmp_path):
    _, files = opened(tmp_path, "tangle", "x", "router", 910022, 10.0, 130)
    unseen = files.runs[2]
    law = diagnose(files.job, files.twin, files.runs, holdout=[unseen.name], stated_mm=0.003).result.law
    bench = Bench(twin=files.twin, runs=[unseen])
    before = rms(bench.gap(0))
    assert before > 30.0
    learned = LearnedLaw("found", "router", law)
    found = learned.candidate(files.twin.actuators)

    def with_it(size):
        cause = Cause("found", found.effect, None, {p.name: size for p in found.parameters})
        return rms(bench.gap(0, [cause]))

    assert with_it(1.0) < before < with_it(-1.0)


def rms(gap):
    return 1e3 * float(np.sqrt(np.nanmean(np.nansum(gap[:, :3] ** 2, axis=1))))
