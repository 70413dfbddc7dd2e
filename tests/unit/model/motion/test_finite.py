"""NaN and infinity from effects, force models and tables are errors with a name, whatever verb meets them first."""

import io
import sys

import numpy as np
import pytest

from camcomp.compensation import file_to_file
from camcomp.effects import backlash, tool_deflection
from camcomp.forces import constant
from camcomp.ground.files import shipped
from camcomp.terminal.cli import run

LINES = "G21 G90 G17\nG0 X0 Y0 Z5\nG1 Z0 F300\nG1 X9 F600\nG1 Y5\nG1 Z5\nM30\n"
EFFECTS = (
    "effects:\n  - {effect: tool_deflection, compliance_mm_per_N: 1.0e-4}\n"
    "  - {effect: backlash, target: x, width_mm: 0.01}\n"
)


@pytest.fixture
def study(tmp_path, capsys):
    """A folder with a program, its correction and a log, and the words that every verb takes there."""
    (tmp_path / "in.nc").write_text(LINES)
    (tmp_path / "effects.yaml").write_text(EFFECTS)
    config = ["--config", str(shipped("config/cartesian.yaml"))]
    bent = [*config, "--config", str(tmp_path / "effects.yaml")]
    program, corrected, log = (str(tmp_path / each) for each in ("in.nc", "right.nc", "log.csv"))
    assert run(["compensate", program, *config, "-o", corrected]) == 0
    assert run(["simulate", program, *config, "-o", log]) == 0
    (tmp_path / "experiment.yaml").write_text(
        f"config: [{shipped('config/cartesian.yaml')}, effects.yaml]\n"
        "runs: [{name: one, program: in.nc, log: log.csv, cutting: true}]\n"
    )
    capsys.readouterr()
    out = str(tmp_path / "out")
    return {
        "simulate": ["simulate", program, *bent, "-o", out],
        "compensate": ["compensate", program, *bent, "-o", out],
        "verify": ["verify", corrected, "--against", program, *bent, "--json", out],
        "diagnose": ["diagnose", str(tmp_path / "experiment.yaml"), "--json", out],
    }


def said_of(words, capsys):
    code = run(words)
    return code, capsys.readouterr().err


@pytest.mark.parametrize("value", [np.nan, np.inf])
@pytest.mark.parametrize("module, hook", [(tool_deflection, "on_pose"), (backlash, "on_drive")])
def test_a_hook_is_named(monkeypatch, study, capsys, tmp_path, value, module, hook):
    monkeypatch.setattr(module, hook, lambda given, *_: given + value)
    for words in study.values():
        code, said = said_of(words, capsys)
        name = module.__name__.rsplit(".")[-1]
        assert code == 4 and f"effect '{name}'" in said and "effects.yaml:" in said and "CC306" in said, (words, said)
        assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_force_model_is_named_with_the_line(monkeypatch, study, capsys, tmp_path, value):
    right = constant.force
    monkeypatch.setattr(
        constant, "force", lambda cut, params: np.where(cut.line[:, None] == 5, value, right(cut, params))
    )
    for verb, words in study.items():
        for long in (False, True) if verb == "compensate" else (False,):
            monkeypatch.setattr(file_to_file, "LONG", 1 if long else 1 << 20)
            code, said = said_of(words if not long else [*words[:4], *words[6:]], capsys)
            assert code == 4 and "force model 'constant'" in said and "line 5" in said and "cartesian.yaml:" in said, (
                said
            )
            assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("cell", ["nan", "inf", "1e400", "1_0", "1e300"])
def test_a_table_is_refused_at_its_cell(study, capsys, tmp_path, cell):
    (tmp_path / "table.csv").write_text(f"line,fx_N,fy_N,fz_N\n4,1,2,3\n5,1,{cell},3\n")
    (tmp_path / "effects.yaml").write_text("process: {force: {model: table, file: table.csv}}\n")
    for words in study.values():
        code, said = said_of(words, capsys)
        assert code == 2 and "table.csv:3:" in said and "CC262" in said, (words, said)


def test_a_stream_goes_on_behind_it(monkeypatch, study):
    monkeypatch.setattr(tool_deflection, "on_pose", lambda tip, *_: np.where(tip > 1.0, np.nan, tip))
    saved = sys.stdin, sys.stdout
    sys.stdin, sys.stdout = io.TextIOWrapper(io.BytesIO(b"2,0,0,9,0,0\n0,0,0,9,0,0\n")), io.TextIOWrapper(io.BytesIO())
    try:
        words = study["simulate"][2:-2]
        assert run(["stream", *words]) == 1
        _, bad, good = sys.stdout.buffer.getvalue().decode().splitlines()
    finally:
        sys.stdin, sys.stdout = saved
    assert "CC306 effect 'tool_deflection'" in bad and good.endswith(",")
