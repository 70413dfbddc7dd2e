"""The model of the diagnosis on recorded motions: its tip is the plant's, where nothing is wrong and nothing is measured badly."""

import json

import numpy as np
import pytest

from camcomp.diagnosis.experiment.open_experiment import open_experiment
from camcomp.diagnosis.fit.bench import Bench
from camcomp.diagnosis.fit.columns import build
from tests.validation.recorded.experiment import Plan, row_times
from tests.validation.recorded.faults import Faults
from tests.validation.recorded.machines import MACHINES
from tests.validation.recorded.plant import Character, Run, observe
from tests.validation.recorded.sensors import Sensors, table, write_log
from tests.validation.recordings import recording

PERFECT = Sensors(
    tip_mm=0.0, encoder_step_mm=0.0, drive_N=0.0, dyno_N=0.0, temperature_K=0.0, lost_rows=0.0, lost_tips=0.0, jitter_s=0.0
)  # fmt: skip
AIR_UM = 1.0  # most that model and plant may differ
CUT_UM = 1.0  # most away from jumps of the force: on which side of them a row was taken nobody knows


def cases():
    """Every machine in the air and in the cut."""
    for name in MACHINES:
        for path, cutting in (("ramp-100um", False), ("override-blended", True)):
            yield pytest.param(name, path, cutting, id=f"{name}-{path}")


def logged(folder, machine, run, state):
    """The experiment of one run, with perfect sensors, opened."""
    (folder / "p.nc").write_text(run.recording.program)
    write_log(folder / "l.csv", table(state, PERFECT, "full", machine, np.random.default_rng(1)))
    one = {"name": "one", "program": "p.nc", "log": "l.csv", "cutting": run.cutting, "started_s": run.started_s}
    (folder / "e.yaml").write_text(json.dumps({"config": [str(machine.config)], "runs": [one]}))
    return open_experiment(folder / "e.yaml")


@pytest.mark.parametrize(("name", "path", "cutting"), list(cases()))
def test_model_and_plant_are_at_the_same_place(name, path, cutting, tmp_path):
    machine, run = MACHINES[name], Run(recording.load(path), cutting, 100.0)
    t = row_times(run, Plan(0, rows=150), True, np.random.default_rng(1))
    state = observe(machine, run, Faults(), Character(ripple=0.0), t)
    opened = logged(tmp_path, machine, run, state)
    bench = Bench(twin=opened.twin, runs=opened.runs)
    off = 1e3 * np.linalg.norm(bench.nominal[0].tip - state.tip, axis=1)
    sure = state.steady & ~opened.runs[0].run_path.jumping
    assert sure.mean() > 0.6
    assert off[sure].max() < (CUT_UM if cutting else AIR_UM)


@pytest.mark.parametrize(("path", "cutting"), [("circles-exact", True), ("zigzag-10um", False), ("zigzag-10um", True)])
def test_minutes_of_cutting_are_those_of_the_plant(path, cutting, tmp_path):
    """Runs in the air and rapids outside of the log wear no tool."""
    machine, run = MACHINES["orthoglide"], Run(recording.load(path), cutting, 100.0)
    t = row_times(run, Plan(0, rows=200), False, np.random.default_rng(1))
    opened = logged(tmp_path, machine, run, observe(machine, run, Faults(), Character(), t))
    assert opened.runs[0].run_path.cut_min == pytest.approx(run.cuts.sum() * recording.STEP_S / 60, abs=0.15 / 60)


def test_where_a_guide_holds_its_carriage_when_a_log_begins_is_not_known(tmp_path):
    """Friction of 150 N winds the drives of the router up by 25 to 50 um, and pulls at them until they have moved: either way."""
    machine, run = MACHINES["router"], Run(recording.load("zigzag-10um"), True, 100.0)
    t = row_times(run, Plan(0, rows=150), False, np.random.default_rng(1))
    opened = logged(tmp_path, machine, run, observe(machine, run, Faults(), Character(), t))
    columns = build(Bench(twin=opened.twin, runs=opened.runs), [], {}, 3.0)
    within = dict(zip(columns.names, columns.prior.tolerance, strict=True))
    assert within["start.one.x"] > 0.05
    assert within["held.one.x"] > 150.0
