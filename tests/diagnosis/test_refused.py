"""Logs that cannot belong to an arm's program are refused, with their likely mistake."""

import shutil

import numpy as np
import pytest

from camcomp.diagnosis.experiment.open_experiment import open_experiment
from camcomp.ground.errors import ConfigError
from tests.validation.recorded.experiment import Bench, Made, Plan, character, row_times, schedule, write

PLAN = Plan(5, machine="kuka-kr210", channels="no-forces", rows=90, runs=2, stated=True, paths=("circles-blended",))
JOINTS = [f"A{i}_rad" for i in range(1, 7)]
ENCODERS, SETPOINTS, TIP = [f"act_{j}" for j in JOINTS], [f"cmd_{j}" for j in JOINTS], ["x_mm", "y_mm", "z_mm"]


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    """The folder of an arm without errors."""
    rng = np.random.default_rng(PLAN.seed)
    ways = character(rng, False)
    runs = schedule(PLAN, rng)
    bench = Bench(PLAN, runs, ways)
    times = [row_times(run, PLAN, True, rng) for run in runs]
    return write(
        Made(runs, bench.see((), times), {"runs": [{} for _ in runs]}), PLAN, tmp_path_factory.mktemp("arm")
    ).parent


def scaled(names, factor):
    """Those columns times a factor."""

    def change(rows):
        at = [rows[0].index(name) for name in names]
        return [rows[0], *([f"{float(c) * factor:.9f}" if j in at and c else c for j, c in enumerate(row)] for row in rows[1:])]  # fmt: skip

    return change


def shifted(names, by):
    """Those columns of the row that lies behind by so many."""

    def change(rows):
        at, body = [rows[0].index(name) for name in names], rows[1:]
        source = np.clip(np.arange(len(body)) + by, 0, len(body) - 1)
        return [rows[0], *([body[k][j] if j in at else c for j, c in enumerate(row)] for k, row in zip(source, body, strict=True))]  # fmt: skip

    return change


def exchanged(*pairs):
    """Headers of columns exchanged."""
    other = {a: b for pair in pairs for a, b in (pair, pair[::-1])}
    return lambda rows: [[other.get(name, name) for name in rows[0]], *rows[1:]]


def later_lines(by):
    """Line numbers of a program with more lines at its head."""
    return lambda rows: [rows[0], *([row[0], str(int(float(row[1])) + by if float(row[1]) > 0 else 0), *row[2:]] for row in rows[1:])]  # fmt: skip


@pytest.mark.parametrize(
    ("change", "rule", "said"),
    [
        pytest.param(
            scaled(ENCODERS, 180 / np.pi), "CC407", "encoders look as if logged in degrees", marks=pytest.mark.campaign
        ),
        (scaled(SETPOINTS + ENCODERS, 180 / np.pi), "CC407", "setpoints look as if logged in degrees"),
        (exchanged(("act_A2_rad", "act_A3_rad")), "CC408", "right with A2 and A3 exchanged"),
        (scaled(["act_A2_rad"], -1.0), "CC408", "right with A2 reversed"),
        (shifted(ENCODERS, 1), "CC412", "encoders look 1 row ahead of the set-points"),
        (shifted(TIP, -1), "CC412", "tip looks 1 row behind the set-points"),
        (shifted(SETPOINTS + ENCODERS, 2), "CC412", "tip looks 2 rows behind the set-points"),
        (later_lines(2), "CC406", "from the lines that they name"),
        (later_lines(200), "CC406", "lines that the program does not move on"),
    ],
)
def test_what_cannot_be_is_refused_with_what_it_looks_like(sound, tmp_path, change, rule, said):
    folder = tmp_path / "experiment"
    shutil.copytree(sound, folder)
    for log in folder.glob("log-*.csv"):
        rows = change([line.split(",") for line in log.read_text().splitlines()])
        log.write_text("\n".join(",".join(row) for row in rows) + "\n")
    with pytest.raises(ConfigError) as caught:
        open_experiment(folder / "experiment.yaml")
    assert caught.value.rule == rule and said in caught.value.message


@pytest.mark.parametrize("rows", [-7, 7])
def test_line_numbers_that_lead_or_lag_are_put_right_and_said(sound, tmp_path, rows):
    folder = tmp_path / "experiment"
    shutil.copytree(sound, folder)
    for log in folder.glob("log-*.csv"):
        table = [line.split(",") for line in log.read_text().splitlines()]
        log.write_text("\n".join(",".join(row) for row in shifted(["line"], rows)(table)) + "\n")
    way = "early" if rows > 0 else "late"
    found = open_experiment(folder / "experiment.yaml")
    assert all(f"line numbers are 7 rows {way}" in note for note in found.notes) and len(found.notes) == 2
