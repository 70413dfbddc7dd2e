"""Every word that a dialect accepts in a block is used: another number changes what is read, or the word is refused."""

import string

import pytest

from camcomp.gcode.interpret import read_program
from camcomp.gcode.setup import Setup
from camcomp.ground.errors import ProgramError
from camcomp.ground.shelf import members

HEAD = {"sinumerik": "G17 G90 G71 G94\nG0 X0 Y0 Z5\nS500 M3\nF100\n"}
HEAD_ISO = "G17 G90 G21 G94\nG0 X0. Y0. Z5.\nS500 M3\nF100.\n"
SETUP = Setup(home_mm=(-1.0, -2.0, -3.0), second_home_mm=(-4.0, -5.0, -6.0), tools={1: 10.0, 2: 20.0, 3: 30.0},
              offsets={f"G54.1P{k}": (float(k), 0.0, 0.0) for k in (1, 2, 3)})  # fmt: skip
BLOCKS = [
    "G0 X5", "G1 X5", "X5", "G2 X5 Y0 I2.5", "G4 P1", "G28 X0", "G30 X0", "G53 G0 X5", "G43 H1", "G49", "G54", "G54.1 P1", "G61", "G64",
    "G9 X5", "G10 L2 P1 X1", "G52 X1", "G92 X1", "G73 X5 Z-2 R1 Q1", "G74 X5 Z-2 R1", "G76 X5 Z-2 R1 Q1", "G81 X5 Z-2 R1", "G82 X5 Z-2 R1 P1",
    "G83 X5 Z-2 R1 Q1", "G84 X5 Z-2 R1", "G85 X5 Z-2 R1", "G86 X5 Z-2 R1 P1", "G87 X5 Z-2 R-9 I1 J1 K1", "G89 X5 Z-2 R1 P1", "G80", "G91 X1",
    "G93 G1 X5 F1", "G95 G1 X5 F1", "G20 X5", "M3", "M5", "M6", "M8", "M98 P7", "M97 P7", "G65 P7", "G641 X5", "G75", "G500 X5", "G17",
]  # fmt: skip
ARGUMENTS = "+".join(f"#{number}" for number in (*range(1, 10), 11, 13, *range(17, 27)))  # of G65
# Words that do not reach the path, wherever they stand: line numbers, tool and radius numbers, speed and feed of other blocks.
ELSEWHERE = set("NDFSTO")
# Words of the sinumerik and grbl records that name a tool or its edge, and of M codes that move nothing.
IDLE = {("sinumerik", "H"), ("grbl", "T")}
# Fanuc keeps P and Q of a cycle for those behind it.
HELD = {("fanuc", letter, f"G{code}") for letter in "PQ" for code in (73, 74, 76, *range(81, 90))}


def outcome(dialect, block):
    """All that is read of a block and of a cut, an arc, a drilled hole and a second cut behind it."""
    head = HEAD.get(dialect, HEAD_ISO)
    tail = f"N9\nG90 G1 X7. Y1. F100.\nG0 X9.\nM30\nO7\nN50 G1 Y3. F100.\nN51 X[{ARGUMENTS}]\nN52 Y5.\nM99\n"
    if dialect == "sinumerik":
        tail = "G90 G1 X7 Y1 F100\nG0 X9\nM30\n"
    if dialect in ("grbl",):
        tail = "G90 G1 X7. Y1. F100.\nG0 X9.\nM30\n"
    text = f"{head}{block}\n{tail}"
    text = text if dialect == "fanuc" else text.replace(f"[{ARGUMENTS}]", "3.")
    program = read_program(text.encode(), name="in", dialect=dialect, setup=SETUP)
    path, sites = program.path, program.sites
    return [
        path.kind.tolist(), path.end.tolist(), path.centre.tolist(), path.feed.tolist(), path.speed.tolist(), path.tool.tolist(),
        sites.offset.tolist(), path.angle.tolist(), path.machine.tolist(), [mode.said(1.0) for mode in program.modes], program.dwelt_s, path.turn.tolist(),
    ]  # fmt: skip


def read(dialect, block):
    try:
        return str(outcome(dialect, block))
    except ProgramError:
        return None


@pytest.mark.parametrize("dialect", members("dialects"))
def test_words_are_used_or_refused(dialect):
    unused = []
    for block in BLOCKS:
        there = {word[0] for word in block.split()}
        if read(dialect, block) is None:
            continue
        for letter in sorted(set(string.ascii_uppercase) - there - ELSEWHERE - {"G", "M"}):
            if (dialect, letter) in IDLE or (dialect, letter, block.split()[0]) in HELD:
                continue
            found = [read(dialect, f"{block} {letter}{value}") for value in ("1", "2", "3", "0.5")]
            accepted = [each for each in found if each is not None]
            if len(accepted) > 1 and set(accepted) == {read(dialect, block)}:
                unused.append(f"{block} {letter}")
    assert not unused


def test_words_of_a_cycle_that_has_no_use_for_them_hold_for_the_next():
    path = outcome("fanuc", "G81 X5. Z-2. R1. Q1. P500\nG83 X6.\nG82 X7.")
    assert path[-2] == 0.5
    assert [6.0, 0.0, 0.0] in path[1] and [6.0, 0.0, -1.0] in path[1]  # pecks of 1 mm from R
