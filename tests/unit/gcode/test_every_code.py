"""Every G code from 0 to 99.9 in every dialect, in a block with X, Y and Z after a cut: followed as the control does, or refused.

The tables hold what the controls' manuals say of a block `Gn X5 Y6 Z-2` behind G1; they share nothing with camcomp's.
"""

import pytest

from camcomp.gcode.interpret import read_program
from camcomp.ground.errors import ProgramError
from camcomp.ground.shelf import members

HEAD = {"sinumerik": "G17 G90 G71\nG0 X1 Y1 Z5\nS500 M3\nG1 X2 F100\n"}
HEAD_ISO = "G17 G90 G21\nG0 X1. Y1. Z5.\nS500 M3\nG1 X2. F100.\n"
TARGET, BEFORE = (5.0, 6.0, -2.0), (2.0, 1.0, 5.0)
# Modes and offsets (all zero here) that leave the motion in force to the axis words of their block.
MODES = {
    "rs274": "1 8 15 17 18 19 21 40 43 49 53 54 55 56 57 58 59 59.1 59.2 59.3 61 61.1 64 69 69.1 90 90.1 91.1 94 97 98 99",
    "grbl": "1 8 15 17 18 19 21 40 43 49 53 54 55 56 57 58 59 61 61.1 64 69 69.1 90 91.1 94 97 98 99",
    "fanuc": "1 9 15 17 18 19 21 40 43 49 54 55 56 57 58 59 61 62 63 64 69 69.1 80 90 94 97 98 99",
    "sinumerik": "1 9 17 18 19 40 53 54 55 56 57 60 64 71 90 94 97",
}
# Other meanings: the end points of the block, and whether it cuts.
OWN = {
    "0": [(0, TARGET)],
    "91": [(1, (7.0, 7.0, 3.0))],
    "inch": [(1, tuple(round(25.4 * each, 9) for each in TARGET))],
    "home": [(0, TARGET), (0, (0.0, 0.0, 0.0))],
    "straight home": [(0, (0.0, 0.0, 0.0))],
    "offset": [],
    "rapid": [(0, TARGET)],
}
MEANINGS = {
    "rs274": {"0": "0", "91": "91", "20": "inch", "28": "home", "30": "home", "43.1": "offset", "52": "offset", "92": "offset"},
    "grbl": {"0": "0", "91": "91", "20": "inch", "28": "home", "30": "home", "43.1": "offset", "92": "offset"},
    "fanuc": {"0": "0", "91": "91", "20": "inch", "28": "home", "30": "home", "52": "offset", "53": "rapid", "92": "offset"},
    "sinumerik": {"0": "0", "91": "91", "70": "inch", "74": "straight home", "75": "straight home"},
}  # fmt: skip
CODES = [f"{tenths // 10}" if tenths % 10 == 0 else f"{tenths / 10:.1f}" for tenths in range(1000)]


def motions(dialect, block):
    head = HEAD.get(dialect, HEAD_ISO)
    path = read_program(f"{head}{block}\nM30\n".encode(), name="in", dialect=dialect).path
    here = path.line == head.count("\n") + 1
    return [
        (int(kind), tuple(round(each, 9) for each in end))
        for kind, end in zip(path.kind[here], path.end[here].tolist(), strict=True)
    ]


@pytest.mark.parametrize("dialect", ["fanuc", "grbl", "rs274", "sinumerik"])
def test_a_code_moves_as_its_control_does_or_is_refused(dialect):
    point = "" if dialect == "sinumerik" else "."
    modes, meanings = MODES[dialect].split(), MEANINGS[dialect]
    for code in CODES:
        block = f"G{code} X5{point} Y6{point} Z-2{point}"
        try:
            found = motions(dialect, block)
        except ProgramError as error:
            assert error.rule.startswith("CC1") and error.at.line == 5
            assert code not in modes and code not in meanings, f"G{code} is refused: {error}"
            continue
        if code in meanings:
            assert found == OWN[meanings[code]], f"G{code}"
        else:
            assert code in modes and found == [(1, TARGET)], f"G{code} is read as {found}"


def test_the_tables_cover_the_shelf():
    assert set(MODES) == set(members("dialects")) - {"fanuc_ls", "krl", "rapid"}  # robot languages have no codes


@pytest.mark.parametrize("block", ["G5.1 Q1", "G8 P1", "G187 P1", "G23", "G67", "G11", "G5 P10000", "G113"])
def test_codes_of_look_ahead_are_passed_alone_and_refused_with_axis_words(block):
    assert motions("fanuc", block) == []
    with pytest.raises(ProgramError) as caught:
        motions("fanuc", f"{block} X5.")
    assert caught.value.rule == "CC108"


@pytest.mark.parametrize("code", ["G60", "G66 P1", "G70", "G12", "G44 H1", "G45 D1", "G84.2", "G7"])
def test_what_fanuc_and_its_kin_do_with_a_code_stands_in_the_message(code):
    with pytest.raises(ProgramError) as caught:
        motions("fanuc", f"{code} X5. Y6.")
    assert caught.value.rule in ("CC106", "CC120", "CC124") and "turning" not in str(caught.value)


@pytest.mark.parametrize("code", ["G31", "G38", "G38.2"])
def test_sinumerik_has_no_code_of_probing(code):
    with pytest.raises(ProgramError, match="is not a code that Siemens Sinumerik") as caught:
        motions("sinumerik", f"{code} X5 Y6 Z-2")
    assert caught.value.rule == "CC106"
