"""Laws that every dialect on the shelf keeps."""

import re

import numpy as np
import pytest

from camcomp.gcode.codes import CANCELS, code_name
from camcomp.gcode.detect import dialect_of
from camcomp.gcode.dialect import Dialect
from camcomp.gcode.interpret import read_program
from camcomp.gcode.output import Output
from camcomp.gcode.rewrite import rewrite
from camcomp.gcode.stamp import is_stamped
from camcomp.gcode.text import Text
from camcomp.ground.errors import ProgramError
from camcomp.ground.shelf import load, members

NAMES = members("dialects")
# What all controls have in common, and how each writes an arc by its radius.
RADIUS = {"sinumerik": "CR=5"}
COMMON = "N10 G17 G90 G94\nN20 G0 X0 Y0 Z5\nN30 G1 Z0 F200\nN40 X10\nN50 G3 X20 Y0 I5 J0\nN60 G2 X10 Y0 {radius}\nN70 G0 Z5\nN80 M30\n"


ROBOTS = [name for name in NAMES if load("dialects", name).DIALECT.robot is not None]  # read no words of NC blocks


@pytest.fixture(params=[name for name in NAMES if name not in ROBOTS])
def dialect(request):
    return load("dialects", request.param).DIALECT


def text_of(dialect):
    return COMMON.format(radius=RADIUS.get(dialect.name, "R5."))


@pytest.mark.parametrize("name", NAMES)
def test_record_is_complete(name):
    dialect = load("dialects", name).DIALECT
    assert isinstance(dialect, Dialect)
    assert dialect.name in NAMES and dialect.title
    for pattern, weight in dialect.marks:
        re.compile(pattern)
        assert weight > 0
    assert set(dialect.more).isdisjoint(dialect.without)
    assert set(dialect.more).isdisjoint(dialect.passed)


def test_same_part_has_the_same_path(dialect):
    path = read_program(text_of(dialect).encode(), name="x", dialect=dialect.name).path
    other = read_program(COMMON.format(radius="R5").encode(), name="x", dialect="rs274").path
    for field in ("line", "kind", "start", "end", "centre", "angle", "feed"):
        assert np.allclose(getattr(path, field), getattr(other, field), atol=1e-9, equal_nan=True), field


def test_zero_correction_gives_the_same_bytes(dialect):
    data = text_of(dialect).replace("\n", "\r\n").encode()
    program = read_program(data, name="x", dialect=dialect.name)
    written = rewrite(program, Output.same(program.path), resolution_mm=1e-3, version="1").data
    stamp, rest = written.split(b"\r\n", 1)
    assert rest == data
    assert stamp.decode().startswith(dialect.comment[0] + "camcomp")
    assert is_stamped(written)
    # The stamp is a comment in this dialect.
    assert len(read_program(written, name="x", dialect=dialect.name).path) == len(program.path)


def test_written_program_reads_as_what_was_wanted(dialect):
    program = read_program(text_of(dialect).encode(), name="x", dialect=dialect.name)
    rows = np.repeat(np.arange(len(program.path)), [1, 1, 3, 1, 1, 1])
    same = Output.same(program.path)
    end = same.end[rows] + np.array([0.1234, -0.2345, 0.0567])
    end[2:4, 0] = 4.0, 7.0
    out = Output(
        motion=rows, kind=same.kind[rows], end=end, centre=same.centre[rows] + np.array([0.1234, -0.2345, 0.0567]),
        angle=same.angle[rows], feed=same.feed[rows], joining=same.joining[rows],
    )  # fmt: skip
    written = rewrite(program, out, resolution_mm=1e-3, version="1")
    path = read_program(written.data, name="x", dialect=dialect.name).path
    assert np.allclose(path.end, end, atol=0.51e-3)
    assert np.allclose(path.end, written.end, atol=1e-9)
    assert (path.line == written.line).all()
    assert np.allclose(path.angle, out.angle, atol=1e-3)


def test_what_it_refuses_it_refuses(dialect):
    for code in sorted(dialect.refused):
        if code in dialect.passed or code in CANCELS:
            continue
        with pytest.raises(ProgramError) as caught:
            read_program(f"{code_name(code)} X1 Y1\n".encode(), name="x", dialect=dialect.name)
        assert caught.value.rule.startswith("CC1")


def test_codes_that_it_does_not_have_are_unknown(dialect):
    for code in sorted(dialect.without):
        with pytest.raises(ProgramError) as caught:
            read_program(f"G0 X1\n{code_name(code)}\n".encode(), name="x", dialect=dialect.name)
        assert caught.value.rule == "CC106"


SAMPLES = {
    "rs274": "o<hole> sub\nG0 X#1\no<hole> endsub\no<hole> call [3]\nM2\n",
    "grbl": "; made for grbl 1.1\nG21 G90\nG0 X1 Y1\n",
    "fanuc": "%\nO1234 (BRACKET)\nG90 G54 G0 X0. Y0.\nG43 Z25. H1\nG91 G28 Z0.\nM30\n%\n",
    "sinumerik": "%_N_PLATE_MPF\nN10 G17 G90\nN20 G2 X10 Y0 CR=5\nM30\n",
    "rapid": "MODULE part\nPROC main()\nMoveL p1,v20,z1,tool0;\nENDPROC\nENDMODULE\n",
    "fanuc_ls": "/PROG  PART\n/ATTR\nLINE_COUNT = 1;\n/MN\n   1:L P[1] 20mm/sec FINE    ;\n/POS\n/END\n",
    "krl": "&ACCESS RVP\nDEF part ( )\nLIN {X 1,Y 2,Z 3}\nEND\n",
}


def test_detection_and_its_override():
    assert set(SAMPLES) == set(NAMES)
    for name, sample in SAMPLES.items():
        assert dialect_of(Text.read(sample.encode(), "x")).name == name
        for other in NAMES:
            assert dialect_of(Text.read(sample.encode(), "x"), other).name == other
    assert dialect_of(Text.read(b"G21 G90\nG0 X1 Y2 Z3\nM30\n", "x")).name == "rs274"


@pytest.mark.parametrize(
    ("text", "name"),
    [
        # Headers as CAM posts write them: a word in a comment is no statement.
        (
            "(T1  D=6. CR=0. TAPER=118deg - ZMIN=-2.5 - flat end mill)\nG90 G94\n(2D Pocket1)\n(R1=5, CYCLE81)\nG0 X1\n",
            "rs274",
        ),
        ('(T="MILL", MSG(A))\nG0 X1\n', "rs274"),
        ("%\n(O2201);\nN3 G00 G91 G28 Z0.0;\nG00 G90 G54 X0.5 Y-2.25;\n", "fanuc"),
        ("G0 X1 Y2\nG3 X2 Y3 CR=5\n", "sinumerik"),
        ('MSG("POCKET")\nG0 X=IC(1) ; (note)\n', "sinumerik"),
    ],
)
def test_detection(text, name):
    assert dialect_of(Text.read(text.encode(), "x"), None).name == name
