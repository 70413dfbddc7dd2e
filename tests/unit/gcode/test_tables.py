"""Rotary words: refused without such an axis, passed where a table turns alone."""

import numpy as np
import pytest

from camcomp.gcode.interpret import read_program
from camcomp.gcode.setup import Setup
from camcomp.ground.errors import ProgramError
from camcomp.terminal.cli import run

HEAD = "G21 G90\nG0 X0 Y0 Z5\n"
INDEXED = HEAD + "G0 A90\nG1 X10 F100\nG0 Z5\nA180. (turn)\nG91 G0 A-30\nG90 G1 X0 A150\nG28 A0\nG0 A0\nM2\n"


def read(text, *tables):
    return read_program(text.encode(), name="in.nc", setup=Setup(table_axes=frozenset(tables)))


@pytest.mark.parametrize("letter", "ABCUVW")
def test_without_such_an_axis_the_word_is_refused(letter):
    with pytest.raises(ProgramError) as caught:
        read(f"{HEAD}G0 {letter}10\n")
    assert (caught.value.rule, caught.value.at.line, caught.value.at.column) == ("CC115", 3, 4)
    assert len(read(f"{HEAD}G0 X1 {letter}0\nM2\n").path) == 2  # it stays where it is


def test_a_table_that_turns_alone_passes():
    path = read(INDEXED, "A").path
    assert path.line.tolist() == [2, 4, 5, 8]
    np.testing.assert_array_equal(path.end, [(0, 0, 5), (10, 0, 5), (10, 0, 5), (0, 0, 5)])


@pytest.mark.parametrize(
    "line",
    [
        "G0 X1 A90",
        "G1 A90 Z0 F100",
        "G92 A45",
        "G91 G1 X1 A1 F100",
        "G3 X2 I1 A5 F9",
        "G81 X1 Z-1 R1 F100\nA7",
        "B90",
        "W5",
    ],
)
def test_a_table_that_turns_during_something_else_is_refused(line):
    with pytest.raises(ProgramError) as caught:
        read(HEAD + line + "\nM2\n", "A")
    assert caught.value.rule == "CC115"


def test_lines_of_the_table_keep_their_bytes(tmp_path, capsys):
    (tmp_path / "in.nc").write_text(INDEXED)
    (tmp_path / "table.yaml").write_text("control: {table_axes: [A]}\n")
    out = tmp_path / "out.nc"
    call = ["compensate", str(tmp_path / "in.nc"), "--config", "config/cartesian.yaml", "-o", str(out)]
    assert run(call) == 3 and "control.table_axes" in capsys.readouterr().err
    assert run([*call, "--config", str(tmp_path / "table.yaml")]) == 0
    lines = out.read_text().splitlines()
    for line in ("G0 A90", "A180. (turn)", "G28 A0", "G0 A0"):
        assert line in lines
    assert sum("A" in line.split("(")[0] for line in lines) == 6
