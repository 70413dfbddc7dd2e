"""Loops, subprograms, parameters and cycles written out."""

import numpy as np
import pytest

from camcomp.gcode.flatten import flatten
from camcomp.gcode.interpret import read_program
from camcomp.gcode.output import Output
from camcomp.gcode.rewrite import rewrite
from camcomp.ground.errors import ProgramError

PROGRAMS = {
    "loop": "G0 X0 Y0 Z0 (start)\n#1=0\no1 while [#1 LT 3] (three times)\nG1 X[#1*2] Y#1 F[50+#1]\n#1=[#1+1]\no1 endwhile\nM2\n",
    "subroutine": "o<a> sub\nN5 G1 X#1 (cut)\no<a> endsub\nG0 X0 Y0 Z0\nF100\no<a> call [3]\no<a> call [4]\nM2\n",
    "cycle": "G0 X0 Y0 Z5\nN10 G98 G81 X1 Z-1 R1 F50 M8 (hole)\nX2\nG80\nG0 X9\nM2\n",
    "relative cycle": "G0 X0 Y0 Z5\nF50\nG91 G83 X1 Z-2 R-4 Q0.7 L3\nG80\nG90 G0 X0\nM2\n",
    "inch cycle": "G20 G0 X0 Y0 Z1\nG82 X.5 Z-.1 R.1 P.2 F5\nM2\n",
    "subprogram": "G0 X0 Y0 Z0\nF100\nM98 P7 L2\nM30\nO7\nG91 G1 X1\nG90\nM99\n",
}


@pytest.mark.parametrize("name", PROGRAMS)
def test_motions_are_the_same(name):
    program = read_program(PROGRAMS[name].encode(), name=name)
    assert not program.straight
    flat = flatten(program, 1e-3)
    assert flat.straight
    for field in ("kind", "end", "centre", "angle", "feed", "speed", "tool"):
        assert np.allclose(getattr(flat.path, field), getattr(program.path, field), atol=1e-5, equal_nan=True), field


def test_comments_stay_and_statements_become_comments():
    lines = flatten(read_program(PROGRAMS["loop"].encode(), name="x"), 1e-3).data.decode().splitlines()
    assert lines[0] == "G0 X0 Y0 Z0 (start)"
    assert "(o1 while [#1 LT 3]) (three times)" in lines
    assert [line for line in lines if line.startswith("G1")] == [
        "G1 X0.0 Y0.0 F50",
        "G1 X2.0 Y1.0 F51",
        "G1 X4.0 Y2.0 F52",
    ]


def test_line_numbers_are_not_repeated():
    text = flatten(read_program(PROGRAMS["subroutine"].encode(), name="x"), 1e-3).data.decode()
    assert text.count("N5") == 1 and text.count("(cut)") == 2


def test_the_rest_of_a_cycle_line_stays():
    lines = flatten(read_program(PROGRAMS["cycle"].encode(), name="x"), 1e-3).data.decode().splitlines()
    assert lines[1] == "N10 F50 M8 (hole)"
    assert lines[2:6] == ["G0 X1.0", "G0 Z1.0", "G1 Z-1.0", "G0 Z5.0"]


@pytest.mark.parametrize("name", PROGRAMS)
def test_moved_and_unmoved(name):
    data = PROGRAMS[name].encode()
    program = read_program(data, name=name)
    same = Output.same(program.path)
    assert rewrite(program, same, resolution_mm=1e-3, version="1").data.endswith(data)
    out = Output(
        motion=same.motion, kind=same.kind, end=same.end + 0.123, centre=same.centre, angle=same.angle,
        feed=same.feed, joining=same.joining,
    )  # fmt: skip
    written = rewrite(program, out, resolution_mm=1e-3, version="1")
    after = read_program(written.data, name="out")
    assert np.abs(after.path.end - out.end).max() < 0.51e-3
    assert np.abs(after.path.end - written.end).max() < 1e-9


def test_a_program_that_would_end_elsewhere_by_ten_half_steps_is_refused(monkeypatch):
    """As if numbers were written with a digit too few: 1/3 is off by 3 um at a resolution of 1 um."""
    program = read_program(b"G0 X0 Y0 Z0\n#1=[1/3]\nG1 X#1 F100\nM2\n", name="x")
    flatten(program, 1e-3)
    monkeypatch.setattr("camcomp.gcode.flatten._SPARE_DIGITS", -1)
    with pytest.raises(ProgramError, match="cannot be written out"):
        flatten(program, 1e-3)
