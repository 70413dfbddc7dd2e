"""A program that sets modes and moves nothing comes out as it is, with all tables, and a warning."""

import pytest

from tests.commandline import ROOT, camcomp

PLAY = "effects: [{effect: backlash, target: x, width_mm: 0.02}, {effect: servo_lag, time_constant_ms: 5}]\n"


@pytest.mark.parametrize("machine, more", [("orthoglide", ""), ("cartesian", PLAY), ("hexapod", "")])
def test_settings_alone_are_a_program(tmp_path, machine, more):
    (tmp_path / "p.nc").write_text("G21 G90\nG17\n")
    (tmp_path / "more.yaml").write_text(more or "tool: {length_mm: 50}\n")
    machines = ("--config", ROOT / "config" / f"{machine}.yaml", "--config", tmp_path / "more.yaml")
    tables = ("--joints", "j.csv", "--paths", "q.csv", "--summary", "s.json", "--report", "r.html")
    done = camcomp("compensate", "p.nc", *map(str, machines), "-o", "made.nc", *tables, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert b"warning: the program moves nothing" in done.stderr
    assert (tmp_path / "made.nc").read_text().split("\n")[-3:] == ["G21 G90", "G17", ""]
    assert len((tmp_path / "j.csv").read_text().splitlines()) == 1
    checked = camcomp("verify", "made.nc", "--against", "p.nc", *map(str, machines), cwd=tmp_path)
    assert checked.returncode == 0, checked.stderr
