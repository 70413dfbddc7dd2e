"""Bytes, lines and places."""

import pytest

from camcomp.gcode.text import Text, count_lines
from camcomp.ground.errors import ProgramError


@pytest.mark.parametrize(
    "data",
    [b"", b"a", b"a\n", b"a\nb", b"a\r\nb\r\n", b"a\rb", b"\n\n", b"a\r\n\rb\n", bytes(range(256)), b"\xef\xbb\xbfa\n"]
    + ["a\r\nØ\n".encode("utf-16"), b"\xfe\xff" + "ab\n".encode("utf-16-be")],
)
def test_writing_back_gives_the_same_bytes(data):
    text = Text.read(data, "x")
    assert text.encode(text.string) == data
    assert "".join(text.string[text.starts[k] : text.nexts[k]] for k in range(len(text))) == text.string


@pytest.mark.parametrize(
    ("data", "lines"),
    [
        (b"a\nb\n", ["a", "b"]),
        (b"a\r\nb", ["a", "b"]),
        (b"a\rb\r", ["a", "b"]),
        (b"a\n\r\nb", ["a", "", "b"]),
        (b"", [""]),
    ],
)
def test_lines(data, lines):
    text = Text.read(data, "x")
    assert [text.line(k) for k in range(len(text))] == lines


@pytest.mark.parametrize("end", [b"\n", b"\r\n", b"\r", b"\r\r\n"])
def test_lines_are_counted_by_their_ends(end):
    assert count_lines(b"a" + end + b"b" + end + end + b"c") == 3


def test_end_of_line_of_the_last_line_is_that_of_the_one_before():
    text = Text.read(b"a\r\nb", "x")
    assert text.end_of_line(0) == text.end_of_line(1) == "\r\n"
    assert Text.read(b"a", "x").end_of_line(0) == "\n"


@pytest.mark.parametrize("codec", ["utf-8", "cp1252", "utf-16"])
def test_columns_count_characters_as_a_person_does(codec):
    text = Text.read("(Ø10 mm)G0 X1,5\n".encode(codec), "x")
    line = text.line(0)
    place = text.place(0, line.index("X"))
    assert (place.line, place.column) == (1, 12)
    assert place.source == "(Ø10 mm)G0 X1,5"


def test_broken_utf_16_is_refused():
    with pytest.raises(ProgramError) as caught:
        Text.read(b"\xff\xfea", "x")
    assert caught.value.rule == "CC128"
