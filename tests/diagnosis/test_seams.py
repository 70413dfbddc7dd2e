"""Clocks of logs are not exact, and where the force jumps a millisecond is half a millimetre of the tip."""

from dataclasses import replace

import numpy as np
import pytest

from camcomp.api.diagnosis import diagnose
from camcomp.diagnosis.experiment.open_experiment import open_experiment
from camcomp.diagnosis.fit.bench import Bench
from camcomp.terminal.cli import run as camcomp
from tests.diagnosis.conftest import plan_of
from tests.validation import runner
from tests.validation.plants.experiments import make, write

SOON_S, EARLY_S = 0.008, 0.0002
START = "G21 G90 G17 G94\nS8000 M3\nG0 X0 Y0 Z4\nG1 Z0 F300\n"


def stamped_early(made):
    """The experiment with every row that is taken just after a stop stamped as if it were taken just before it."""
    count, states = 0, []
    for run, state in zip(made.runs, made.states, strict=True):
        t = state.t.copy()
        for stop in run.timeline.begin[1:]:
            i = int(np.searchsorted(t, stop))
            if 0 < i < len(t) and t[i] < stop + SOON_S and t[i - 1] < stop - EARLY_S:
                t[i] = stop - EARLY_S
                count += 1
        states.append(replace(state, t=t))
    return replace(made, states=states), count


@pytest.mark.campaign  # the one below is in the plain run
@pytest.mark.parametrize(
    "cause",
    [
        ("time_sync", None),
        ("chain_error", "z"),
        ("gravity", None),
    ],
)
def test_rows_on_the_wrong_side_of_a_corner_change_no_answer(tmp_path, cause):
    plan = plan_of(cause, design="six", samples=250, ratio=10.0)
    made, count = stamped_early(make(plan))
    assert count
    result = diagnose(write(made, plan, tmp_path / "e", runner.CONFIG)).result.as_json()
    assert result["verdict"] == "identified"
    assert [(each["effect"], each["target"]) for each in result["causes"]] == [cause]
    assert result["gap"]["max_um"] < 8 * result["gap"]["rms_um"]


def missing(folder, moves):
    """Share of the rows of a run whose tip does not count."""
    folder.mkdir()
    (folder / "p.nc").write_text(START + "\n".join(moves) + "\nG0 Z20\nM5\nM30\n")
    assert camcomp(["simulate", str(folder / "p.nc"), "--config", str(runner.CONFIG), "-o", str(folder / "l.csv")]) == 0
    names, *rows = [line.split(",") for line in (folder / "l.csv").read_text().splitlines()]
    rng = np.random.default_rng(3)
    noisy = [[v if n in ("t_s", "line") or not v else f"{float(v) + rng.normal(0, 0.002):.4f}" for n, v in zip(names, row, strict=True)]
             for row in rows]  # fmt: skip
    (folder / "l.csv").write_text("\n".join(",".join(row) for row in [names, *noisy]) + "\n")
    text = (
        f"config: [{runner.CONFIG}]\nruns:\n  - {{name: a, program: p.nc, log: l.csv, cutting: true, started_s: 0}}\n"
    )
    (folder / "experiment.yaml").write_text(text)
    opened = open_experiment(folder / "experiment.yaml")
    return float(np.isnan(Bench(twin=opened.twin, runs=opened.runs).observed(0)[:, 0]).mean())


def test_rows_beside_corners_do_not_count_unless_there_are_hardly_others(tmp_path):
    assert 0.0 < missing(tmp_path / "long", ["G1 X20 F800", "G1 Y20", "G1 X0"]) < 0.05
    stairs = [f"G1 {'X' if k % 2 else 'Y'}{0.1 * (k + 1) / 2:.2f} F2400" for k in range(400)]
    assert missing(tmp_path / "stairs", stairs) < 0.1
