"""The figures of compensate and verify keep to the printed schemas, for every kind of machine and program."""

import json

import pytest

from camcomp.compensation.program.result import ErrorSize, Interpolation
from camcomp.terminal.cli import run
from tests.commandline import ROOT
from tests.schemas import check, validator

CIRCLE = ROOT / "samples/groove-circle-2.nc"


def ran(*words):
    assert run([*map(str, words), "-q"]) == 0


def test_compensate_and_verify(tmp_path):
    config = ROOT / "config/cartesian.yaml"
    out, summary, checked = (tmp_path / name for name in ("out.nc", "s.json", "v.json"))
    ran("compensate", CIRCLE, "--config", config, "-o", out, "--summary", summary)
    ran("verify", out, "--against", CIRCLE, "--config", config, "--json", checked)
    figures, residual = json.loads(summary.read_text()), json.loads(checked.read_text())
    check("summary", figures)
    check("verify", residual)
    assert "actuator_change_max_rad" not in figures and "interpolation" not in figures
    assert residual["lines"] and list(residual["lines"][0])[:3] == ["line", "moves", "residual_um"]
    assert summary.read_text() == json.dumps(figures, indent=2) + "\n"


def test_a_long_program(tmp_path, monkeypatch):
    monkeypatch.setattr("camcomp.compensation.file_to_file.LONG", 0)
    summary = tmp_path / "s.json"
    ran("compensate", CIRCLE, "--config", ROOT / "config/cartesian.yaml", "--summary", summary)
    figures = json.loads(summary.read_text())
    check("summary", figures)
    assert list(figures)[-2:] == ["interpolation", "warnings"]


def test_what_is_not_finite_is_null():
    told = Interpolation(
        bound_um=0.05, checked=3, worst_um=float("inf"), worst_drive_force=1.0, tiles=1, exact_solutions=9
    )
    assert told.as_json()["worst_um"] is None and told.as_json()["worst_drive_force"] == 1.0
    assert json.loads(ErrorSize(rms_um=float("nan"), max_um=1.0).to_json()) == {"rms_um": None, "max_um": 1.0}


@pytest.mark.parametrize("wrong", [{"points": 1.5}, {"before": {"rms_um": 1.0}}, {"more": 1}])
def test_the_schema_refuses_other_figures(tmp_path, wrong):
    summary = tmp_path / "s.json"
    ran("compensate", CIRCLE, "--config", ROOT / "config/cartesian.yaml", "--summary", summary)
    assert not validator("summary").is_valid({**json.loads(summary.read_text()), **wrong})
