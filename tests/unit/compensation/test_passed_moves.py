"""Every command says which feed moves it leaves uncorrected, for short and for long programs."""

import json

import pytest

from camcomp.terminal.cli import run
from tests.commandline import ROOT

CONFIG = ROOT / "config/cartesian.yaml"
LINES = "".join(f"G1 X{10 + k % 2} Y{k % 40}\n" for k in range(80))
SHARED = "G0 X0 Y0\nG1 X5 F100\nG1 Y5\nG0 Z1\n" + LINES + "M30\nG1 X3\n"


def warned(capfd, *words):
    assert run([*map(str, words)]) == 0
    return [each for each in capfd.readouterr().err.splitlines() if "[CC146]" in each]


@pytest.mark.parametrize("longest", [0, 1 << 16])
def test_a_share_of_the_moves(tmp_path, monkeypatch, capfd, longest):
    monkeypatch.setattr("camcomp.compensation.file_to_file.LONG", longest)
    program, summary = tmp_path / "p.nc", tmp_path / "s.json"
    program.write_text(SHARED)
    found = warned(capfd, "compensate", program, "--config", CONFIG, "--summary", summary)
    assert [each.partition("p.nc:")[2].partition(" [")[0] for each in found] == [
        "2: 2 of 82 feed moves come before X, Y and Z have all been commanded, and pass uncorrected",
        "86: lines with moves behind the end of the program (1) are not run, and pass uncorrected",
    ]
    assert ("interpolation" in json.loads(summary.read_text())) == (longest == 0)


@pytest.mark.parametrize("longest", [0, 1 << 16])
def test_corrections_below_the_step_of_the_output(tmp_path, monkeypatch, capfd, longest):
    monkeypatch.setattr("camcomp.compensation.file_to_file.LONG", longest)
    program = tmp_path / "p.nc"
    program.write_text("G0 X0 Y0 Z1\nF100\n" + LINES + "M30\n")
    configs = ("--config", CONFIG, "--config", ROOT / "config/no-force.yaml")
    (warning,) = warned(capfd, "compensate", program, *configs, "--summary", tmp_path / "s.json")
    assert "p.nc: all 80 feed moves pass uncorrected: by the model" in warning
    assert warned(capfd, "compensate", program, "--config", CONFIG, "--summary", tmp_path / "s.json") == []


def test_the_other_commands(tmp_path, capfd):
    program, out = tmp_path / "p.nc", tmp_path / "out.nc"
    program.write_text("T1 M6\nG1 X1 Y1 F1000\nG1 X20\n")
    both = (program, "--config", CONFIG)
    for words in (
        ("compensate", *both, "-o", out), ("verify", out, "--against", *both), ("simulate", *both, "-o", tmp_path / "l.csv"),
        ("validate", program), ("canon", program), ("batch", *both, "--output-dir", tmp_path / "all", "--jobs", 1),
        ("place", *both, "--x-mm", 0, 10, "--y-mm", 0, 10),
    ):  # fmt: skip
        found = warned(capfd, *words)
        assert len(found) == 1 and "p.nc:2: 2 of 2 feed moves" in found[0], words
