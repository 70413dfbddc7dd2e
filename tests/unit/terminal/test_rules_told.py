"""Rule ids that no other test meets, each asked for through the command line: the exit code and what is said."""

import io
import sys

import pytest

from camcomp.terminal.cli import run
from tests.commandline import ROOT

ORTHOGLIDE, CARTESIAN = (str(ROOT / "config" / f"{name}.yaml") for name in ("orthoglide", "cartesian"))
PROGRAM = "G21 G90 G17 G94\nG0 X0 Y0 Z0\nG1 X10 F600\nG1 X10 Y10\nM2\n"
TABLE = "t_s,line,x_mm,y_mm,z_mm\n" + "".join(f"{0.1 * k},3,{k},0,0\n" for k in range(20))


@pytest.fixture
def told(tmp_path, monkeypatch, capsys):
    """(exit code, standard error) of a command line in a folder with a program, a table of tips and strong forces."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "part.nc").write_text(PROGRAM)
    (tmp_path / "tip.csv").write_text(TABLE)

    def call(*words, **force):
        parts = ", ".join(f"{each}_N: {force.get(each, 0.0)}" for each in ("Fr", "Ft", "Fz"))
        (tmp_path / "force.yaml").write_text(f"process: {{force: {{model: constant, {parts}}}}}\n")
        return run(list(words)), capsys.readouterr().err

    return call


@pytest.mark.parametrize(("rule", "force"), [("CC301", {"Fz": -1e6}), ("CC304", {"Fz": 2e4})])
def test_a_load_that_the_machine_does_not_bear(rule, force, told):
    code, said = told(
        "compensate", "part.nc", "--config", ORTHOGLIDE, "--config", "force.yaml", "-o", "out.nc", **force
    )
    assert code == 4 and f"part.nc:3:4: error[{rule}]" in said, said


def test_a_run_that_cannot_be_simulated(told):
    code, said = told("simulate", "part.nc", "--config", ORTHOGLIDE, "--config", "force.yaml", Fr=1e9)
    assert code == 4 and "error[CC411]: run 'simulation', tip [0.0, 0.0, 0.0]" in said


def test_a_set_point_out_of_reach(told, tmp_path):
    (tmp_path / "far.nc").write_text(PROGRAM.replace("X10 F", "X900 F"))
    code, said = told("simulate", "far.nc", "--config", ORTHOGLIDE)
    assert code == 4 and "error[CC410]" in said and "out of reach" in said


def test_a_rule_that_is_none(told):
    code, said = told("explain", "CC999")
    assert code == 2 and "error[CC214]: there is no rule 'CC999'" in said


def test_a_package_that_is_not_installed(told, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    code, said = told("compensate", "part.nc", "--config", CARTESIAN, "-o", "out.nc", "--joints", "joints.parquet")
    assert code == 2 and "error[CC216]" in said and "camcomp[parquet]" in said


def test_a_run_without_a_program(told, tmp_path):
    (tmp_path / "experiment.yaml").write_text(
        f"config: [{CARTESIAN}]\nruns: [{{name: r, log: tip.csv, cutting: true, started_s: 0}}]\n"
    )
    code, said = told("diagnose", "experiment.yaml")
    assert code == 2 and "error[CC402]: run 'r' has neither a program nor set-points" in said


def test_tables_without_a_column_in_common(told):
    code, said = told("compare", "tip.csv", "tip.csv", "--column", "nothing_mm")
    assert code == 2 and "error[CC451]: no column nothing_mm" in said and "x_mm" in said


def test_a_program_made_from_another_one(told, tmp_path):
    assert told("compensate", "part.nc", "--config", CARTESIAN, "-o", "out.nc")[0] == 0
    (tmp_path / "other.nc").write_text(PROGRAM.replace("Y10", "Y20").replace("X10 F", "X9 F"))
    code, said = told("verify", "out.nc", "--against", "other.nc", "--config", CARTESIAN)
    assert code == 1 and "error[CC604]" in said


def test_a_stream_with_a_line_in_error(told, monkeypatch):
    line = b"0,0,0,0,0,0\nnonsense\n"
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(line)))
    code, said = told("stream", "--config", CARTESIAN)
    assert code == 1 and "error[CC605]: 1 of the set-points" in said, said
