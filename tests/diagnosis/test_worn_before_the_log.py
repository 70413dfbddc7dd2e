"""A log that begins while the tool cuts: the minutes that it missed have worn the tool."""

import numpy as np
import pytest

from camcomp.diagnosis.experiment.open_experiment import open_experiment
from camcomp.terminal.cli import run as camcomp
from tests.validation import runner

PROGRAM = "G21 G90 G17 G94\nS8000 M3\nG0 X0 Y0 Z4\nG1 Z0 F300\nG1 X30 F400\nG1 Y20\nG3 X20 Y30 I-10\nG1 X-10\nG0 Z20\nM5\nM30\n"


def opened(folder, missed, cutting="true", without=(), ahead=()):
    """Two runs of the program, of the first a share of the log missed; ahead: where the tip was before."""
    folder.mkdir()
    (folder / "p.nc").write_text(PROGRAM)
    assert camcomp(["simulate", str(folder / "p.nc"), "--config", str(runner.CONFIG), "-o", str(folder / "l.csv")]) == 0
    names, *rows = [line.split(",") for line in (folder / "l.csv").read_text().splitlines()]
    kept = [i for i, name in enumerate(names) if not name.startswith(without or ("none",))]
    for name, first in (("a", int(missed * len(rows))), ("b", 0)):
        waited = [names.index(x) for x in ("x_mm", "y_mm", "z_mm")]
        early = [list(rows[0]) for _ in ahead]
        for k, (row, place) in enumerate(zip(early, ahead, strict=True)):
            row[0], row[1] = f"{0.02 * (k - len(ahead)):.6f}", "0"
            for i, value in zip(waited, place, strict=True):
                row[i] = f"{value:.6f}"
        lines = [",".join(row[i] for i in kept) for row in (names, *early, *rows[first:])]
        (folder / f"{name}.csv").write_text("\n".join(lines) + "\n")
    (folder / "experiment.yaml").write_text(
        f"config: [{runner.CONFIG}]\nruns:\n"
        f"  - {{name: a, program: p.nc, log: a.csv, cutting: {cutting}, started_s: 0}}\n"
        "  - {name: b, program: p.nc, log: b.csv, cutting: true, started_s: 100}\n"
    )
    return [run.run_path for run in open_experiment(folder / "experiment.yaml").runs]


@pytest.mark.parametrize("without", [(), ("cmd_", "act_"), ("line",)])
def test_what_the_program_cut_before_its_log_begins_counts(tmp_path, without):
    whole, after = opened(tmp_path / "whole", 0.0, without=without)
    late, after_late = opened(tmp_path / "late", 0.6, without=without)
    assert whole.cut_ahead_min == pytest.approx(0.0, abs=2e-3) and late.cut_min < 0.5 * whole.cut_min
    assert late.cut_ahead_min + late.cut_min == pytest.approx(whole.cut_min, rel=0.03)
    assert after_late.cut_before_min == pytest.approx(after.cut_before_min, rel=0.03)


def test_in_the_air_nothing_wears(tmp_path):
    late, after = opened(tmp_path / "air", 0.6, cutting="false")
    assert (late.cut_ahead_min, after.cut_before_min) == (0.0, 0.0)


def test_a_log_that_begins_where_the_program_ends_misses_nothing(tmp_path):
    """Above the end of the last cut, then over to the first one in a rapid."""
    over = np.linspace((-10.0, 30.0, 20.0), (0.0, 0.0, 4.0), 30)
    ahead = [*([(-10.0, 30.0, 20.0)] * 15), *map(tuple, over)]
    run, after = opened(tmp_path / "ahead", 0.0, without=("cmd_", "act_"), ahead=ahead)
    assert run.cut_ahead_min == pytest.approx(0.0, abs=2e-3)
    assert after.cut_before_min == pytest.approx(run.cut_min, rel=0.03)
