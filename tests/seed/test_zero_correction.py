"""A program without deflection keeps its bytes: arcs stay arcs."""

import pytest

from camcomp.terminal.cli import run

RIGID = ["--config", "config/cartesian.yaml", "--config", "config/no-force.yaml"]


@pytest.mark.parametrize("name", ["groove-circle-50", "groove-circle-2"])
def test_a_machine_that_does_not_bend_changes_no_byte_but_the_stamp(tmp_path, name):
    program, out = f"samples/{name}.nc", tmp_path / "out.nc"
    assert run(["compensate", program, *RIGID, "-o", str(out)]) == 0
    with open(program, "rb") as stream:
        original = stream.read().splitlines(keepends=True)
    written = out.read_bytes().splitlines(keepends=True)
    stamps = [line for line in written if b"camcomp" in line and b"sha256:" in line]
    assert len(stamps) == 1
    written.remove(stamps[0])
    assert written == original


def test_verify_counts_the_effects_of_the_config(tmp_path, capsys):
    (tmp_path / "e.yaml").write_text("effects: [{effect: joint_offset, target: y, offset_mm: 0.1}]\n")
    program, out = "samples/groove-circle-2.nc", str(tmp_path / "out.nc")
    machine = ["--config", "config/orthoglide.yaml"]
    offset = [*machine, "--config", str(tmp_path / "e.yaml")]
    assert run(["compensate", program, *offset, "-o", out]) == 0
    assert run(["verify", out, "--against", program, *offset]) == 0
    assert run(["verify", out, "--against", program, *machine]) == 1
    assert "CC601" in capsys.readouterr().err
