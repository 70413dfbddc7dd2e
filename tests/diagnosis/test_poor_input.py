"""Logs as they come: what cannot be right is refused with the place and the rule, the rest gets the best honest answer."""

import csv
import json
import re
import shutil

import pytest

from tests.diagnosis.conftest import plan_of
from tests.validation import runner

PLAN = plan_of(("backlash", "x"), design="both-ways", seed=39, samples=80)
TIP, ENCODERS = ("x_mm", "y_mm", "z_mm"), ("act_x_mm", "act_y_mm", "act_z_mm")
SETPOINTS, DRIVES = ("cmd_x_mm", "cmd_y_mm", "cmd_z_mm"), ("act_x_N", "act_y_N", "act_z_N")
FORCES = ("fx_N", "fy_N", "fz_N")


def each(change):
    """Changes the rows (header first) of every log."""

    def spoil(folder):
        for path in folder.glob("log-*.csv"):
            rows = list(csv.reader(path.read_text().splitlines()))
            path.write_text("\n".join(",".join(row) for row in change(rows)) + "\n")

    return spoil


def cells(names, change):
    """Changes the values of some columns."""

    def spoil(rows):
        index = [rows[0].index(name) for name in names]
        return [rows[0], *([change(c) if j in index and c else c for j, c in enumerate(row)] for row in rows[1:])]

    return each(spoil)


def times(factor):
    return lambda cell: f"{float(cell) * factor:.7f}"


def without(*names):
    def spoil(rows):
        kept = [j for j, name in enumerate(rows[0]) if name not in names]
        return [[row[j] for j in kept] for row in rows]

    return each(spoil)


def renamed(**names):
    return each(lambda rows: [[names.get(name, name) for name in rows[0]], *rows[1:]])


def cell(row, column, text):
    def spoil(rows):
        rows[row][column] = text
        return rows

    return each(spoil)


def text(content):
    return lambda folder: (folder / "log-1.csv").write_bytes(content)


def experiment(change):
    def spoil(folder):
        path = folder / "experiment.yaml"
        path.write_text(change(path.read_text()))

    return spoil


def other_program(folder):
    path = folder / "program-1.nc"
    path.write_text(re.sub(r"G([23]) X.*", r"G1 X-20 Y-10 F500", path.read_text()))


def exchanged(folder):
    first, second = folder / "log-1.csv", folder / "log-2.csv"
    a, b = first.read_bytes(), second.read_bytes()
    first.write_bytes(b)
    second.write_bytes(a)


REFUSED = {  # what happened, rule, place (a regular expression; file:line:column)
    "empty": (text(b""), "CC400", r"log-1.csv:1:1"),
    "header only": (text(b"t_s,line,x_mm,y_mm,z_mm\n"), "CC400", r"log-1.csv:1:1"),
    "semicolons": (each(lambda rows: [[";".join(row)] for row in rows]), "CC400", r"log-1.csv:1:1"),
    "not a text": (text(bytes(range(256)) * 20), "CC40[0-3]", r"log-1.csv:\d+:\d+"),
    "no time": (without("t_s"), "CC401", r"log-1.csv:1:1"),
    "a time that is none": (cell(5, 0, "nan"), "CC401", r"log-1.csv:6:1"),
    "a column twice": (
        each(lambda rows: [[*rows[0], "x_mm"], *([*r, "0"] for r in rows[1:])]),
        "CC401",
        r"log-1.csv:1:\d\d+",
    ),
    "text in a number": (cell(5, 3, "abc"), "CC403", r"log-1.csv:6:\d+"),
    "infinity": (cell(5, 3, "inf"), "CC403", r"log-1.csv:6:\d+"),
    "a cell too many": (each(lambda rows: [*rows[:5], [*rows[5], "1"], *rows[6:]]), "CC403", r"log-1.csv:6:\d\d+"),
    "nothing measured": (without(*TIP, *SETPOINTS, *ENCODERS, *DRIVES, *FORCES), "CC404", r"log-1.csv:1:1"),
    "two rows at one time": (
        each(lambda rows: [*rows[:10], [rows[9][0], *rows[5][1:]], *rows[10:]]),
        "CC405",
        r"log-1.csv:1[12]:1",
    ),
    "lines of another program": (cells(["line"], lambda c: "77"), "CC406", r"log-1.csv:1:1"),
    "another program": (other_program, "CC406", r"log-1.csv:1:1"),
    "logs exchanged": (exchanged, "CC40[68]", r"log-[12].csv:1:1"),
    "a machine that stands": (cells(TIP, lambda c: "0.0"), "CC406", r"log-1.csv:1:1"),
    "metres": (cells(TIP, times(1e-3)), "CC407", r"log-1.csv:1:1"),
    "inches": (cells(TIP, times(1 / 25.4)), "CC407", r"log-1.csv:1:1"),
    "encoders in metres": (cells(ENCODERS, times(1e-3)), "CC407", r"log-1.csv:1:1"),
    "kilonewtons": (cells(FORCES, times(1e-3)), "CC407", r"log-1.csv:1:1"),
    "drives in kilonewtons": (cells(DRIVES, times(1e-3)), "CC407", r"log-1.csv:1:1"),
    "milliseconds": (cells(["t_s"], times(1e3)), "CC407", r"log-1.csv:1:1"),
    "kelvin": (cells(["temp_C"], lambda c: str(float(c) + 273.15)), "CC407", r"log-1.csv:1:1"),
    "axes swapped": (renamed(x_mm="y_mm", y_mm="x_mm"), "CC408", r"log-1.csv:1:1"),
    "an axis reversed": (cells(["x_mm"], times(-1.0)), "CC408", r"log-1.csv:1:1"),
    "encoders swapped": (renamed(act_x_mm="act_y_mm", act_y_mm="act_x_mm"), "CC408", r"log-1.csv:1:1"),
    "two rows": (each(lambda rows: rows[:3]), "CC409", r"log-1.csv:3:1"),
    "holdout unknown": (experiment(lambda t: t + "holdout: [nobody]\n"), "CC205", r"experiment.yaml:\d+:\d+"),
    "no runs": (experiment(lambda t: t.split("runs:")[0] + "runs: []\n"), "CC205", r"experiment.yaml:3:\d+"),
}


@pytest.fixture
def spoilt(workshop, tmp_path):
    def make(how):
        folder = tmp_path / "experiment"
        shutil.copytree(workshop.made(PLAN)[0].parent, folder)
        how(folder)
        return folder

    return make


def ask(folder):
    code, said = runner.invoke(["diagnose", str(folder / "experiment.yaml"), "--json", str(folder / "result.json")])
    result = json.loads((folder / "result.json").read_text()) if code == 0 else None
    return code, said, result


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_right_is_refused_with_the_place(spoilt, name):
    how, rule, place = REFUSED[name]
    code, said, _ = ask(spoilt(how))
    assert code == 2, said
    assert re.search(rf"{place}: error\[{rule}\]: .+", said), said
    assert "hint: " in said


def test_a_log_that_is_not_there_is_an_error_of_its_file(spoilt):
    code, said, _ = ask(spoilt(lambda folder: (folder / "log-1.csv").unlink()))
    assert code == 5 and "CC500" in said and "log-1.csv" in said


def one_run(folder):
    experiment(lambda t: "\n".join(line for line in t.splitlines() if "run-2" not in line) + "\n")(folder)


HONEST = {
    "encoders only": without(*TIP, *DRIVES, *FORCES, "temp_C"),
    "no y of the tip": without("y_mm"),
    "one run": one_run,
    "names that are not read": renamed(x_mm="X", y_mm="Y", z_mm="Z"),
}


@pytest.mark.parametrize(
    "name", [pytest.param(k, marks=pytest.mark.campaign) if k == "no y of the tip" else k for k in HONEST]
)
def test_what_is_left_gets_an_honest_answer(spoilt, name):
    """The play sits behind the encoders: without a tip nobody can see it; with less of the tip nobody may name another cause alone."""
    code, said, result = ask(spoilt(HONEST[name]))
    assert code == 0, said
    found = [(c["effect"], c["target"]) for c in result["causes"]]
    if name == "encoders only":
        assert result["verdict"] == "none"
    elif result["verdict"] == "identified":
        assert found == [("backlash", "x")]
    if name == "names that are not read":
        assert "column X is not read; did you mean x_mm?" in said
