"""G74, G76, G84 and G87: the motions that the controls' manuals draw, and LinuxCNC for those that it has."""

import pytest

from camcomp.gcode.flatten import flatten
from camcomp.gcode.interpret import read_program
from camcomp.ground.errors import ProgramError
from tests.oracles import rs274
from tests.oracles.compare import difference

HEAD = "G21 G90 G17\nG0 X0. Y0. Z5.\nM3 S500\n"


def read(text, dialect="fanuc"):
    return read_program(text.encode(), name="in.nc", dialect=dialect)


def motions(block, dialect="fanuc"):
    """(cuts, X, Y, Z) of what lines 4 and on do."""
    path = read(f"{HEAD}{block}\nG80\nM30\n", dialect).path
    on = path.line >= 4
    return [(int(kind > 0), *end) for kind, end in zip(path.kind[on], path.end[on].tolist(), strict=True)]


@rs274.needs_rs274
@pytest.mark.parametrize("code", ["G74", "G84"])
@pytest.mark.parametrize("retract", ["G98", "G99"])
@pytest.mark.parametrize("words", ["", "P0.5"])
def test_tapping_is_that_of_linuxcnc(code, retract, words):
    spindle = "M4" if code == "G74" else "M3"
    text = f"G21 G90 G17\nG0 X0 Y0 Z5\n{spindle} S500\n{retract} {code} X5 Y5 Z-2 R1 {words} F500\nX6\nY9\nG80\nG0 Z5\nM2\n"
    run = rs274.run(text)
    assert not run.error
    assert difference(read(text, "rs274"), run) == ""


@rs274.needs_rs274
@pytest.mark.parametrize("line", ["G74 X5 Y5 Z-2 F500", "G84 X5 Y5 Z-2 R1 F500", "M5\nG74 X5 Y5 Z-2 R1 F500"])
def test_what_linuxcnc_refuses_of_tapping_is_refused(line):
    text = f"G21 G90 G17\nG0 X0 Y0 Z5\nM4 S500\n{line}\nG80\nM2\n"
    assert rs274.run(text).error
    with pytest.raises(ProgramError) as caught:
        read(text, "rs274")
    assert caught.value.rule == "CC132"


@pytest.mark.parametrize(("code", "sense"), [("G74", "M4"), ("G84", "M3")])
def test_tapping_on_fanuc_cuts_in_and_out_to_r(code, sense):
    assert motions(f"{sense}\nG98 {code} X5. Y6. Z-2. R1. P500 F500.") == [
        (0, 5, 6, 5), (0, 5, 6, 1), (1, 5, 6, -2), (1, 5, 6, 1), (0, 5, 6, 5),
    ]  # fmt: skip


def test_words_of_a_cycle_hold_for_the_cycles_behind_it():
    found = motions("M4\nG99 G81 X5. Y5. Z-2. R1. F500.\nG74 X6. Y9.\nX7.")
    down_and_out = [(0, 6, 9, 1), (1, 6, 9, -2), (1, 6, 9, 1), (0, 7, 9, 1), (1, 7, 9, -2), (1, 7, 9, 1)]
    assert found[4:] == down_and_out


@pytest.mark.parametrize(
    "block",
    [
        "G74 X5. Y5. Z-2. F500.",
        "G81 X5. Y5. Z-2. R1. F500.\nG80\nG74 X6.",
        "G84 X5. Z-2. R1. Q1. F500.",
        "G76 X5. Z-2. R1. F99.",
    ],
)
def test_a_cycle_without_what_it_needs_is_refused(block):
    with pytest.raises(ProgramError) as caught:
        motions(block)
    assert caught.value.rule == "CC132"


@pytest.mark.parametrize("code", ["G74", "G84", "G76"])
def test_no_straight_moves_replace_a_tap_or_an_oriented_spindle(code):
    program = read(f"{HEAD}{code} X5. Y5. Z-2. R1. {'Q.5' if code == 'G76' else ''} F500.\nG80\nM30\n")
    with pytest.raises(ProgramError) as caught:
        flatten(program, 1e-3)
    assert caught.value.rule == "CC137"


def test_fine_boring_leaves_the_wall_before_it_comes_up():
    shifted = [(0, 5, 6, 5), (0, 5, 6, 1), (1, 5, 6, -2), (0, 5.5, 6, -2), (0, 5.5, 6, 5), (0, 5, 6, 5)]
    assert motions("G98 G76 X5. Y6. Z-2. R1. Q.5 P200 F100.") == shifted
    by_words = [(0, 5, 6, 5), (0, 5, 6, 1), (1, 5, 6, -2), (0, 5.25, 5.5, -2), (0, 5.25, 5.5, 1), (0, 5, 6, 1)]
    assert motions("G99 G76 X5. Y6. Z-2. R1. I.25 J-.5 F100.") == by_words


def test_back_boring_cuts_upwards_from_below_the_hole():
    expected = [
        (0, 5, 6, 5), (0, 5.5, 6, 5), (0, 5.5, 6, -20), (0, 5, 6, -20), (1, 5, 6, -12), (0, 5.5, 6, -12), (0, 5.5, 6, 5), (0, 5, 6, 5),
    ]  # fmt: skip
    assert motions("G98 G87 X5. Y6. Z-12. R-20. Q.5 P1000 F100.") == expected
    with pytest.raises(ProgramError) as caught:
        motions("G98 G87 X5. Y6. Z-12. R1. Q.5 F100.")
    assert caught.value.rule == "CC132"


def test_boring_with_its_shift_in_words_is_written_out():
    program = read(f"{HEAD}G98 G76 X5. Y6. Z-2. R1. I.5 F100.\nG80\nM30\n")
    flat = flatten(program, 1e-3)
    assert [tuple(each) for each in flat.path.end.tolist()] == [tuple(each) for each in program.path.end.tolist()]
    assert "M19" in flat.text.string


@pytest.mark.parametrize("dialect", ["fanuc", "rs274"])
def test_a_program_may_begin_with_a_cycle(dialect):
    path = read("G21 G90 F100.\nG81 X1. Y1. Z-1. R1.\nX2.\nM2\n", dialect).path
    assert path.end[:3].tolist() == [[0, 0, 1], [1, 1, 1], [1, 1, -1]] and path.end[-1].tolist() == [2, 1, 1]
