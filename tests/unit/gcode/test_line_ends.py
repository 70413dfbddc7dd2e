"""Every mixture of ends of line: each block stands on a line of its own that ends as the lines around it do."""

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from camcomp.gcode.interpret import read_program
from camcomp.gcode.output import Output
from camcomp.gcode.rewrite import rewrite
from camcomp.gcode.text import Text
from tests.commandline import camcomp

ENDS = ["\n", "\r\n", "\r", "\r\r\n", "\r\r\r\n"]
LINES = ["G21 G90 G17", "G0 X0 Y0 Z5", "G1 Z-1 F100", "G3 X10 Y0 I5 J0 F300", "G1 X20 Y10", "X30", "G0 Z5", "M2"]


def cut(data):
    """(line, end of line), by a reading independent of Text: CRs belong to the LF behind them, three at most."""
    out, line, k = [], b"", 0
    while k < len(data):
        end = next((each.encode() for each in sorted(ENDS, key=len)[::-1] if data.startswith(each.encode(), k)), b"")
        if end:
            out.append((line, end))
            line, k = b"", k + len(end)
        else:
            line, k = line + data[k : k + 1], k + 1
    return [*out, (line, b"")] if line else out


def divided(program):
    """The arc in four chords, everything shifted."""
    same = Output.same(program.path)
    rows = np.repeat(np.arange(len(program.path)), np.where(program.path.kind == 2, 4, 1))
    end = same.end[rows] + [0.01, -0.02, 0.03]
    arc = np.flatnonzero(program.path.kind[rows] == 2)
    end[arc, 0] = np.linspace(2.5, 10.0, len(arc))
    kind = np.where(program.path.kind[rows] == 2, 1, program.path.kind[rows]).astype(np.int8)
    return Output(
        motion=rows, kind=kind, end=end, centre=np.full((len(rows), 3), np.nan), angle=np.zeros(len(rows)), feed=same.feed[rows],
        joining=same.joining[rows],
    )  # fmt: skip


@settings(max_examples=60, deadline=None)
@given(st.lists(st.sampled_from(ENDS), min_size=len(LINES), max_size=len(LINES)), st.booleans(), st.booleans())
def test_new_lines_end_as_their_own_does(ends, tape, open_end):
    lines = (["%"] if tape else []) + LINES
    ends = ends[:1] * tape + ends
    text = "".join(line + end for line, end in zip(lines, ends, strict=True))
    data = (text.removesuffix(ends[-1]) if open_end else text).encode()
    read = read_program(data, name="in.nc", dialect="rs274")
    assert [int(each) for each in read.path.line - tape] == [2, 3, 4, 5, 6, 7]
    written = rewrite(read, divided(read), resolution_mm=1e-3, version="1").data
    blocks = cut(written)
    assert all(len(re.findall(rb"[GM]\d", line)) <= 1 or line == b"G21 G90 G17" for line, _ in blocks)
    stamp = next(k for k, (line, _) in enumerate(blocks) if b"camcomp" in line)
    assert stamp == tape and blocks[stamp][0].startswith(b"(camcomp ") and blocks[stamp][0].endswith(b")")
    chords = [end for line, end in blocks if line.startswith((b"G1 X2.5", b"X5", b"X7.5", b"X10"))]
    assert chords == [ends[tape + 3].encode()] * 4
    again = read_program(written, name="out.nc", dialect="rs274")
    assert np.allclose(again.path.end, divided(read).end, atol=1e-3)
    assert len(blocks) == len(lines) + 1 + 3


def test_more_than_three_carriage_returns_are_lines_of_their_own():
    assert [Text.read(b"a\r\r\r\r\nb", "x").line(k) for k in range(3)] == ["a", "", "b"]


@pytest.mark.parametrize("end", ENDS)
def test_a_program_of_any_line_end_is_corrected_line_by_line(tmp_path, end):
    (tmp_path / "in.nc").write_bytes("".join(line + end for line in LINES).encode())
    out = tmp_path / "out.nc"
    done = camcomp("compensate", tmp_path / "in.nc", "--config", "config/cartesian.yaml", "-o", out)
    assert done.returncode == 0, done.stderr
    blocks = cut(out.read_bytes())
    assert {each for _, each in blocks} == {end.encode()}
    assert all(b"\r" not in line for line, _ in blocks) and len(blocks) > len(LINES)
