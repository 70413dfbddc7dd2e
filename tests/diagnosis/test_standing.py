"""A tool that stands in a cut between two of its lines: its control executes the line or not, and nobody logs which."""

from types import SimpleNamespace

import numpy as np
import pytest

from camcomp.diagnosis.experiment.driven_run import _idle_or_not
from camcomp.diagnosis.experiment.open_experiment import open_experiment
from camcomp.diagnosis.fit.bench import Bench
from camcomp.terminal.cli import run
from tests.commandline import ROOT

PROGRAM = """G21 G90 G17 G94
S8000 M3
G0 X10 Y0 Z2
G1 Z0 F300
G3 X10 Y0 I-10 J0 F1200
G3 X10 Y0 I-10 J0 F1200
G1 Z2 F1000
M30
"""
ROWS = 15  # inserted, 0.04 s each


@pytest.fixture
def stood(tmp_path):
    """Log of two circles with ROWS at standstill between them in which no drive bears a force; first of these rows."""
    (tmp_path / "p.nc").write_text(PROGRAM)
    config = ROOT / "config/cartesian.yaml"
    words = [
        "simulate",
        str(tmp_path / "p.nc"),
        "--config",
        str(config),
        "--step-s",
        "0.04",
        "-o",
        str(tmp_path / "raw.csv"),
    ]
    assert run(words) == 0
    head, *rows = [line.split(",") for line in (tmp_path / "raw.csv").read_text().splitlines()]
    t, line = np.array([[float(v) for v in row[:2]] for row in rows]).T
    first = int(np.flatnonzero(line == 6)[0])
    row = dict(zip(head, rows[first], strict=True))
    rest = {"x_mm": "10", "y_mm": "0", "z_mm": "0", "cmd_x_mm": "10", "cmd_y_mm": "0", "cmd_z_mm": "0"}
    rest |= {"act_x_mm": "10", "act_y_mm": "0", "act_z_mm": "0", "act_x_N": "0", "act_y_N": "0", "act_z_N": "0"}
    out = [[*each] for each in rows[:first]]
    out += [[{**row, **rest}[name] for name in head] for _ in range(ROWS)]
    out += [[*each] for each in rows[first:]]
    times = np.concatenate([t[:first], t[first] + 0.04 * np.arange(ROWS), t[first:] + 0.04 * ROWS])
    kept = [k for k, name in enumerate(head) if name not in ("t_s", "line") and name[0] != "f"]
    text = [",".join(["t_s", *(head[k] for k in kept)])]
    text += [",".join([f"{at:.4f}", *(each[k] for k in kept)]) for at, each in zip(times, out, strict=True)]
    (tmp_path / "log.csv").write_text("\n".join(text) + "\n")
    (tmp_path / "e.yaml").write_text(
        f"config: [{config}]\nruns: [{{name: a, program: p.nc, log: log.csv, cutting: true, started_s: 0}}]\n"
    )
    return tmp_path / "e.yaml", first


def test_its_drives_say_nothing_of_its_force(stood):
    path, first = stood
    opened = open_experiment(path)
    bench = Bench(twin=opened.twin, runs=opened.runs)
    drives = slice(6, 9)
    there = bench.observed(0)[first + 1 : first + ROWS - 1, drives]
    assert np.isnan(there).all()
    assert np.isfinite(bench.observed(0)[first + 2 * ROWS :, drives]).mean() > 0.5


@pytest.mark.parametrize("line", [0, 1])
def test_it_stands_where_one_line_ends_and_the_next_begins(line):
    """A place that two lines share is matched with either."""
    path = SimpleNamespace(start=np.array([[0, 0, 0], [5, 0, 0]]), end=np.array([[5, 0, 0], [5, 5, 0]]))
    tip = np.array([[4.0, 0, 0], *[[5.0, 0, 0]] * 6, [5.0, 1, 0]])
    motion = np.array([0, *[line] * 6, 1])
    words = SimpleNamespace(cutting=np.ones(8, bool)), SimpleNamespace(motion=motion)
    found = _idle_or_not(*words, SimpleNamespace(track=SimpleNamespace(path=path)), tip, 0.04 * np.arange(8))
    np.testing.assert_array_equal(np.flatnonzero(found), [2, 3, 4, 5])


@pytest.mark.parametrize("by", ["cmd", "tip"])
@pytest.mark.parametrize("where", ["before", "behind"])
def test_where_a_machine_waits_for_long_says_nothing_of_its_program(tmp_path, by, where):
    """At home before the program, and where its last rapid has led: off the lines that cut, in three quarters of the rows."""
    (tmp_path / "p.nc").write_text(PROGRAM.replace("G1 Z2 F1000", "G0 Z30"))
    config = ROOT / "config/cartesian.yaml"
    assert run(["simulate", str(tmp_path / "p.nc"), "--config", str(config), "-o", str(tmp_path / "raw.csv")]) == 0
    head, *rows = [line.split(",") for line in (tmp_path / "raw.csv").read_text().splitlines()]
    names = [name for name in head if name in ("x_mm", "y_mm", "z_mm") or name.startswith(by)]
    rows = [[row[head.index(name)] for name in names] for row in rows]
    place = {"before": ("40", "30", "20"), "behind": ("10", "0", "30")}[where] * (len(names) // 3)
    waits = 3 * len(rows) * [place]
    rows = waits + rows if where == "before" else rows + waits
    text = [",".join(["t_s", *names]), *(",".join([f"{0.02 * i:.2f}", *row]) for i, row in enumerate(rows))]
    (tmp_path / "log.csv").write_text("\n".join(text) + "\n")
    (tmp_path / "e.yaml").write_text(
        f"config: [{config}]\nruns: [{{name: a, program: p.nc, log: log.csv, cutting: true}}]\n"
    )
    (opened,) = open_experiment(tmp_path / "e.yaml").runs
    assert len(opened.run_path.time) == len(rows)
