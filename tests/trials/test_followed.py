"""The model of the diagnosis on recorded motions: its tip is the plant's, where nothing is wrong and nothing is measured badly."""

import json

import numpy as np
import pytest

from camcomp.diagnosis.experiment.open_experiment import open_experiment
from tests.recordings import recording
from tests.trials.experiment import Plan, row_times
from tests.trials.faults import Faults
from tests.trials.machines import MACHINES
from tests.trials.plant import Character, Run, observe
from tests.trials.sensors import Sensors, table, write_log

PERFECT = Sensors(
    tip_mm=0.0, encoder_step_mm=0.0, drive_N=0.0, dyno_N=0.0, temperature_K=0.0, lost_rows=0.0, lost_tips=0.0, jitter_s=0.0
)  # fmt: skip
AIR_UM = 1.0  # most that model and plant may differ
CUT_UM = 5.0  # most for nine tenths of the rows: which line is executed beside a corner is known to a row only
FAILS = {
    ("router", True): "its chips are those of the programmed feed, not of the feed that was driven: 270 um",
}


def cases():
    """Every machine in the air and in the cut."""
    for name in MACHINES:
        for path, cutting in (("ramp-100um", False), ("override-blended", True)):
            reason = FAILS.get((name, cutting))
            marks = pytest.mark.xfail(strict=True, reason=reason) if reason else ()
            yield pytest.param(name, path, cutting, marks=marks, id=f"{name}-{path}")


@pytest.mark.parametrize(("name", "path", "cutting"), list(cases()))
def test_model_and_plant_are_at_the_same_place(name, path, cutting, tmp_path):
    machine, run = MACHINES[name], Run(recording.load(path), cutting, 100.0)
    t = row_times(run, Plan(0, rows=150), True, np.random.default_rng(1))
    state = observe(machine, run, Faults(), Character(ripple=0.0), t)
    (tmp_path / "p.nc").write_text(run.recording.program)
    write_log(tmp_path / "l.csv", table(state, PERFECT, "full", machine, np.random.default_rng(1)))
    one = {"name": "one", "program": "p.nc", "log": "l.csv", "cutting": cutting, "started_s": 100.0}
    (tmp_path / "e.yaml").write_text(json.dumps({"config": [str(machine.config)], "runs": [one]}))
    opened = open_experiment(tmp_path / "e.yaml")
    tip = opened.twin.sense(opened.runs[0].run_path)[0].tip
    off = 1e3 * np.linalg.norm(tip - state.tip, axis=1)[state.steady]
    assert np.quantile(off, 0.9) < CUT_UM if cutting else off.max() < AIR_UM
