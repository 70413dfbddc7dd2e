"""A control in inches reads four decimals, and a feed without a point in other units: what is written keeps to both."""

import re

import numpy as np
import pytest

from camcomp.gcode.interpret import read_program
from camcomp.gcode.output import Output
from camcomp.gcode.rewrite import rewrite
from tests.oracles import rs274

STEP_MM = 25.4e-4
HEAD = "%\nO0001 (TEST)\nG20 G90 G17 G40 G80\nT1 M6\nM3 S2000\nG0 X0. Y0. Z2.\nG1 Z0. F10.\n"
CUTS = "X0.3 F15.\nY0.5\nG2 X0.6 Y0.8 I0.3 J0.\nG91 G1 X.1 Y.0333\nG90 X1. F20.\nG0 Z1.\n"
PECKS = "G83 X1. Y1. Z-0.5 R0.1 Q0.13 F5.\nX1.2\nG80\nG73 X1. Y1. Z-0.5 R0.1 Q0.17 F5.\nG80\n"
LOOP = "#1=0\nWHILE [#1 LT 3] DO1\nG1 X[#1*0.33333] Y[1/7+#1] F15.\n#1=#1+1\nEND1\n"
TAIL = "M30\n%\n"
NUMBER = re.compile(r"([A-Z])(-?\d+\.?\d*|-?\.\d+)")


@pytest.mark.parametrize("body", [CUTS, PECKS, CUTS + PECKS, CUTS + LOOP, LOOP + PECKS])
def test_what_is_written_is_read_again(body):
    program = read_program((HEAD + body + TAIL).encode(), name="p.nc", dialect="fanuc")
    free = (program.path.kind > 0)[:, None] & program.path.known[:, None]
    away = np.where(free, [0.1234567, -0.0765432, 0.0333333], 0.0)
    end = program.path.end + away
    out = Output.same(program.path)
    out = Output(
        motion=out.motion,
        kind=out.kind,
        end=end,
        centre=out.centre + away,
        angle=out.angle,
        feed=program.path.feed * 1.037,
        joining=out.joining,
    )
    result = rewrite(program, out, resolution_mm=1e-4, version="1")
    text = result.data.decode()
    for line in text.splitlines()[3:]:
        for letter, number in NUMBER.findall(re.sub(r"\(.*?\)", "", line)):
            if letter in "XYZIJKRQ":
                assert len(number.partition(".")[2]) <= 4, line
            if letter == "F":
                assert "." in number, line
    again = read_program(result.data, name="c.nc", dialect="fanuc")
    np.testing.assert_allclose(again.path.end, result.end, rtol=0, atol=1e-9)
    assert np.abs(result.end - end).max() <= 0.5 * STEP_MM * (1 + 1e-6)
    if rs274.binary():
        seen = rs274.run(
            "".join(line for line in text.splitlines(keepends=True) if not line.startswith("O")), tools={1: 0.0}
        )
        assert seen.error == ""
        ends = 25.4 * np.array([each.end for each in seen.motions])
        np.testing.assert_allclose(ends[-1], result.end[-1], atol=25.4e-4)


def test_a_feed_has_a_point_where_the_input_has_one():
    for feed, expected in (("F15.", "F30.0"), ("F15", "F30")):
        program = read_program(f"O0001\nG20 G90\nG0 X0. Y0. Z0.\nG1 X1. {feed}\nM30\n".encode(), name="p.nc")
        out = Output.same(program.path)
        twice = Output(
            motion=out.motion,
            kind=out.kind,
            end=out.end,
            centre=out.centre,
            angle=out.angle,
            feed=2.0 * program.path.feed,
            joining=out.joining,
        )
        assert f"X1. {expected}\n" in rewrite(program, twice, resolution_mm=1e-4, version="1").data.decode()
