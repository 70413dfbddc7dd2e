"""--dialect: the language of programs on the command line, for every verb that reads them."""

import json
from pathlib import Path

import pytest

from camcomp.terminal.cli import run

# `G4 F2` dwells on Sinumerik; RS274, as which the text counts by itself, refuses it.
TEXT = "G17 G90\nG0 X0 Y0 Z5\nG4 F2\nG1 X5 F100\nM30\n"
CONFIG = ("--config", "config/cartesian.yaml")


@pytest.fixture
def program(tmp_path):
    path = tmp_path / "part.nc"
    path.write_text(TEXT)
    return path


def calls(program, folder):
    out = folder / "out.nc"
    return {
        "canon": ["canon", program],
        "canon with a machine": ["canon", program, *CONFIG],
        "validate": ["validate", program],
        "compensate": ["compensate", program, *CONFIG, "-o", out],
        "simulate": ["simulate", program, *CONFIG, "-o", folder / "log.csv"],
        "batch": ["batch", program, *CONFIG, "--output-dir", folder / "tree", "--jobs", "1"],
        "verify": ["verify", out, "--against", program, *CONFIG],
    }


def test_every_verb_that_reads_programs_takes_it(program, tmp_path, capsys):
    for name, words in calls(program, tmp_path).items():
        words = list(map(str, words))
        if name != "verify":  # which needs what compensate wrote
            assert run(words) == 3, name
        assert run([*words, "--dialect", "sinumerik"]) == 0, (name, capsys.readouterr().err)
        assert run(words) == 3, name  # it holds for its own command line alone


def test_it_beats_the_machine_file(program, tmp_path, capsys):
    (tmp_path / "grbl.yaml").write_text("control: {dialect: grbl}\n")
    words = ["canon", str(program), *CONFIG, "--config", str(tmp_path / "grbl.yaml")]
    assert run(words) == 3
    assert run([*words, "--dialect", "sinumerik"]) == 0 and "sinumerik" in capsys.readouterr().out


def test_programs_of_an_experiment_are_read_in_it(program, tmp_path, capsys):
    words = ["simulate", str(program), *CONFIG, "-o", str(tmp_path / "log.csv"), "--dialect", "sinumerik"]
    assert run(words) == 0
    runs = [{"name": "a", "program": "part.nc", "log": "log.csv", "cutting": False, "started_s": 0}]
    config = str(Path("config/cartesian.yaml").resolve())
    (tmp_path / "experiment.yaml").write_text(json.dumps({"config": [config], "runs": runs}))
    call = ["diagnose", str(tmp_path / "experiment.yaml"), "--json", str(tmp_path / "out.json")]
    assert run(call) == 3
    capsys.readouterr()
    assert run([*call, "--dialect", "sinumerik"]) == 0, capsys.readouterr().err


def test_an_unknown_name_is_refused_with_those_that_there_are(program, capsys):
    assert run(["canon", str(program), "--dialect", "klartext"]) == 2
    said = capsys.readouterr().err
    assert "CC213" in said and "sinumerik" in said
