"""Subprograms, Fanuc macros and Sinumerik lines beyond the golden programs."""

import numpy as np
import pytest

from camcomp.gcode.interpret import read_program
from camcomp.gcode.output import Output
from camcomp.gcode.rewrite import rewrite
from camcomp.gcode.setup import Setup
from camcomp.ground.datatypes import LINE, RAPID
from camcomp.ground.errors import ProgramError


def ends(text, dialect="fanuc", **setup):
    path = read_program(text.encode(), name="x", dialect=dialect, setup=Setup(**setup)).path
    return [tuple(round(float(each), 6) for each in point) for point in path.end]


def refused(text, dialect="fanuc"):
    with pytest.raises(ProgramError) as caught:
        read_program(text.encode(), name="x", dialect=dialect)
    return caught.value.rule


def test_repeats_in_both_spellings():
    new = "G91 G0 X0\nM98 P100 L3\nM30\nO100\nX1.\nM99\n"
    old = "G91 G0 X0\nM98 P30100\nM30\nO100\nX1.\nM99\n"
    assert ends(new) == ends(old) == [(0, 0, 0), (1, 0, 0), (2, 0, 0), (3, 0, 0)]


def test_a_subprogram_calls_another():
    text = "G91 G0 X0\nM98 P1\nM30\nO1\nX1.\nM98 P2\nM99\nO2\nY1.\nM99\n"
    assert ends(text)[-1] == (1, 1, 0)


def test_jumps_forwards_and_backwards():
    text = "#1=0\nG91 G0\nN10 X1.\n#1=#1+1\nIF[#1LT3]GOTO10\nGOTO30\nX100.\nN30 Y1.\nM30\n"
    assert ends(text)[-1] == (3, 1, 0)


def test_if_then_sets():
    assert ends("#1=5\nIF[#1GT3]THEN #1=1.5\nIF[#1GT3]THEN #1=9\nG0 X#1\n") == [(1.5, 0, 0)]


def test_loops_nest():
    text = "G91 G0\n#1=0\nWHILE[#1LT2]DO1\n#2=0\nWHILE[#2LT3]DO2\nX1.\n#2=#2+1\nEND2\nY1.\n#1=#1+1\nEND1\n"
    assert ends(text)[-1] == (6, 2, 0)


def test_macro_arguments_are_local():
    text = "#1=7\nG65 P9 A2. X3. I4.\nG0 Y#1\nM30\nO9\nG0 X[#1+#24+#4]\n#1=0\nM99\n"
    assert ends(text) == [(9, 0, 0), (9, 7, 0)]


def test_a_vacant_variable_drops_its_word():
    assert ends("G0 X5. Y5.\nX#9 Y1.\n") == [(5, 5, 0), (5, 1, 0)]


def test_increments_count_where_there_is_no_point():
    text = "G21 G0 X1000 Y1. Z-500\nG1 X#1 Y2000 F100\nG20 X10000\n"
    assert ends("#1=2\n" + text, increment_mm=0.001) == [(1, 1, -0.5), (2, 2, -0.5), (25.4, 2, -0.5)]
    assert ends("G21 G0 X1000\n") == [(1000, 0, 0)]


def test_a_later_program_that_ends_is_another_program():
    assert refused("O1\nG0 X1.\nM30\nO2\nG0 X2.\nM30\n") == "CC136"
    assert ends("O1\nG0 X1.\nM30\nO2\nX2.\nM99\n") == [(1, 0, 0)]


def test_control_state_can_be_read():
    assert ends("G54 G0 X5. Y6. Z7.\n#1=#5041\nG0 X[#1+#5042]\n") == [(5, 6, 7), (11, 6, 7)]


@pytest.mark.parametrize(
    ("text", "rule"),
    [
        ("G0 X1.\nM98\n", "CC124"), ("G0 X1.\nM98 P5 X3.\n", "CC124"), ("IF[1EQ1]X3.\n", "CC124"), ("M97 P5\n", "CC124"),
        ("WHILE[1EQ1]DO\n", "CC124"), ("WHILE[1EQ1]DO1\nG0 X1.\n#1=0\n", None), ("GOTO[1/0]\n", "CC123"),
        ("N1 GOTO1\n", "CC126"), ("M98 P1\nO1\nM98 P1\nM99\n", "CC126"), ("G0 X#3001\n", "CC123"),
        ("#1=[1 OR 2]\nG0 X#1\n", "CC123"),
    ],
)  # fmt: skip
def test_what_cannot_be_followed_is_refused(text, rule):
    if rule is None:
        assert ends(text)  # DO without END is met only when the loop ends
    else:
        assert refused(text) == rule


def test_home_beside_a_motion_code():
    assert ends("G90 G0 X5. Y5. Z5.\nG0 G28 G91 Z0.\nX1.\n")[1:] == [(5, 5, 5), (5, 5, 0), (6, 5, 0)]


def test_only_the_rotary_axis_goes_home():
    assert ends("G0 X5. Y5. Z5.\nG28 A0\nX1.\n") == [(5, 5, 5), (1, 5, 5)]


def test_a_zero_for_the_third_centre_letter_is_taken():
    assert ends("G0 X0 Y0 Z0\nG2 X10 Y0 I5 J0 K0 F100\n", "rs274")[-1] == (10, 0, 0)
    assert refused("G2 X10 Y0 I5 J0 K1 F100\n", "rs274") == "CC109"


def siemens(text):
    return ends(text, "sinumerik")


def test_absolute_and_relative_words():
    assert siemens("G90 G0 X5 Y5\nX=IC(2) Y=AC(1)\nG91 X=AC(10) Y2\n") == [(5, 5, 0), (7, 1, 0), (10, 3, 0)]


def test_parameters_and_quotes():
    assert siemens('R1=2\nR2=R1*3 R4=1\nMSG("X99 ; no (comment)")\nG0 X=R2 Y=-R1 T="D10" ; X5\n') == [(6, -2, 0)]


def test_dwell_does_not_set_the_feed():
    path = read_program(b"G1 X1 F100\nG4 F3\nX2\n", name="x", dialect="sinumerik").path
    assert path.feed.tolist() == [100, 100]


def test_work_offsets():
    setup = Setup(offsets={"G54": (10.0, 0.0, 0.0), "G505": (15.0, 0.0, 0.0), "G500": (0.0, 0.0, 0.0)})
    path = read_program(b"G0 X1\nG505 X1\nG500 X1\n", name="x", dialect="sinumerik", setup=setup).path
    assert path.end[:, 0].tolist() == [1, 6, -9]


@pytest.mark.parametrize(
    ("text", "rule"),
    [
        ("TRANS X10\nG0 X1\n", "CC118"), ("CYCLE81(5,0,2,-3)\n", "CC132"), ("MCALL CYCLE81(5,0,2,-3)\n", "CC132"),
        ("G0 X1,5\n", "CC101"), ("IF R1==1 GOTOF A\n", "CC124"), ("DEF REAL A\n", "CC124"), ("L100 P2\n", "CC125"),
        ("G0 AP=30 RP=5\n", "CC116"), ("SCALE X2\n", "CC117"), ("G1 X=FOO F1\n", "CC123"), ('MSG("a"\n', "CC123"),
        ("G2 X1 Y1 AR=90\n", "CC112"), ("G0 X=AC(1\n", "CC123"), ("CYCLE800(1,2)\n", "CC118"), ("G0 X Y\n", "CC103"),
        ("R1=2 R2=R1\nG0 X1\n", "CC123"), ("R1=2 X=R1 G0\n", "CC123"),
    ],
)  # fmt: skip
def test_sinumerik_refusals(text, rule):
    assert refused(text, "sinumerik") == rule


def test_g80_leaves_the_motion_code_from_before_the_cycle():
    text = "O1\nG90 G0 X0 Y0 Z50. F100\nG1 Z20.\nG99 G81 X5. Z-3. R2.\nX10.\nG80 Z25.\nG0 Z30.\nM30\n"
    program = read_program(text.encode(), name="in.nc", dialect="fanuc")
    last = program.path
    assert last.kind[-2:].tolist() == [LINE, RAPID] and last.end[-2].tolist() == [10.0, 0.0, 25.0]
    same = Output.same(last)
    moved = Output(
        motion=same.motion, kind=same.kind, end=same.end + 0.01, centre=same.centre, angle=same.angle, feed=same.feed,
        joining=same.joining,
    )  # fmt: skip
    written = rewrite(program, moved, resolution_mm=1e-3, version="1")
    after = read_program(written.data, name="out.nc", dialect="fanuc").path
    assert after.kind.tolist() == last.kind.tolist()
    np.testing.assert_allclose(after.end, last.end + 0.01, atol=1e-9)
    with pytest.raises(ProgramError, match="without a motion code"):
        read_program(text.replace("O1\n", "").encode(), name="in.ngc", dialect="rs274")


def ends_of(text, dialect="fanuc"):
    return read_program(text.encode(), name="in.nc", dialect=dialect).path.end[:, 0].tolist()


CALLED = "O7\nG21 G90\nG0 X0. Y0. Z0.\n{}\nM30\nO12\nG1 X50. F100.\nN50 G1 X2. F100.\nX3.\nM99\n"


def test_q_of_m98_is_where_the_subprogram_begins():
    assert ends_of(CALLED.format("M98 P12 Q50")) == [0, 2, 3]
    assert ends_of(CALLED.format("M98 P12 Q50 L2")) == [0, 2, 3, 2, 3]
    assert ends_of(CALLED.format("M98 P12")) == [0, 50, 2, 3]


@pytest.mark.parametrize(
    "call", ["M98 P12 Q51", "M98 P12 Q5.5", "M98 P12 L1.5", "M98 Q50", "M97 P51", "M97 L2", "M97 P50.5"]
)
def test_a_call_to_a_place_that_is_not_there_is_refused(call):
    with pytest.raises(ProgramError) as caught:
        ends_of(CALLED.format(call))
    assert (caught.value.rule, caught.value.at.line) == ("CC124", 4)


def test_m97_executes_a_part_of_its_own_program():
    text = "%\n:7 (HAAS)\nG21 G90\nG0 X0. Y0. Z0.\nM97 P100 L2\nM97 P200\nM30\nN100 G91 G0 X1.\nG90\nM99\nN200 X9.\nM99\n%\n"
    assert ends_of(text) == [0, 1, 2, 9]


@pytest.mark.parametrize("dialect", ["rs274", "grbl", "sinumerik"])
@pytest.mark.parametrize("call", ["M97 P12", "M98 P12 Q50", "M96 P50", "M198 P12"])
def test_calls_that_a_dialect_does_not_have_are_refused(dialect, call):
    with pytest.raises(ProgramError) as caught:
        ends_of(f"G90\nG0 X0 Y0 Z0\n{call}\nG0 X1\nM30\n", dialect)
    assert (caught.value.rule, caught.value.at.line) == ("CC124", 3)


def test_every_call_of_g65_begins_with_its_arguments():
    text = "O1\nG21 G90\nG0 X0. Y0. Z0.\nG65 P2 L3 A1.\nM30\nO2\nG91 G0 X#1\n#1=#1+1\nG90\nM99\n"
    assert ends_of(text) == [0, 1, 2, 3]


@pytest.mark.parametrize("dialect", ["rs274", "fanuc", "grbl", "sinumerik"])
def test_a_program_number_may_begin_with_a_colon(dialect):
    assert ends_of(":1234\nG90 G0 X1 Y0 Z0\nM30\n", dialect) == [1]
