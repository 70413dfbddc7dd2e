"""Compiled reading and writing of plain lines: the same as the interpreter and the writer of whole programs."""

from functools import partial

import numpy as np
import pytest

from camcomp.gcode.interpret import read_program
from camcomp.gcode.linear_lines import MORE, NOT_LINEAR, LinearMotions, scan
from camcomp.gcode.linear_rows import MAX_ROW_BYTES, put_decimal, put_feed, write_rows
from camcomp.gcode.numbers import decimals, plain, significant
from camcomp.gcode.output import Output
from camcomp.gcode.rewrite import rewrite
from camcomp.gcode.text import Text
from camcomp.ground.datatypes import LINE, RAPID
from camcomp.ground.linked_code import dispatcher

HEAD = "G21 G90 G94\nG0 X1 Y2 Z3 F500\n"
RESOLUTION = 0.001


def scanned(
    text,
    *,
    code=0,
    feed=500.0,
    position=(1.0, 2.0, 3.0),
    unit=1.0,
    offset=(0.0, 0.0, 0.0),
    pointed=False,
    last=True,
):
    """(motions, rows, index, reason, code, feed, ...) and the arrays of a scan."""
    data = np.frombuffer(text.encode("latin-1"), np.uint8)
    room = LinearMotions.room(1000)
    place = np.array(position)
    found = scan(data, 0, len(data), last, code, feed, False, False, place, unit, np.array(offset), pointed, room, 1000)
    return found, room.take(0, found[0])


def random_lines(rng, count):
    """Plain lines in many spellings."""
    for _ in range(count):
        words = []
        if rng.random() < 0.4:
            words.append(rng.choice(["G0", "G1", "G00", "G01", "g1"]))
        for letter in rng.permutation(list("XYZ"))[: rng.integers(0, 4)]:
            number = rng.choice(["{:.4f}", "{:.1f}", "{:.0f}", "{:+.3f}", "{:.0f}."]).format(rng.uniform(-50, 50))
            words.append(f"{letter}{number}")
        if rng.random() < 0.3:
            words.insert(rng.integers(0, len(words) + 1), f"F{rng.uniform(10, 900):.1f}")
        gap = rng.choice(["", " ", "  ", "\t"])
        text = gap.join(words)
        if rng.random() < 0.3:
            text = f"N{rng.integers(1, 9999)} {text}"
        if rng.random() < 0.2:
            text = text.lower()
        yield rng.choice(["", " "]) + text


def program(lines, eol="\n"):
    return read_program((HEAD + eol.join(lines) + eol).encode(), name="p.nc", dialect="rs274")


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("eol", ["\n", "\r\n", "\r", "\r\r\n", "\r\r\r\n"])
def test_plain_lines_are_read_as_the_interpreter_reads_them(seed, eol):
    lines = list(random_lines(np.random.default_rng(seed), 60))
    path = program(lines, eol).path
    (n, rows, _, _, *_), read = scanned(eol.join(lines) + eol)
    assert (n, rows) == (len(path) - 1, 60)
    np.testing.assert_array_equal(read.row + 3, path.line[1:])
    np.testing.assert_array_equal(read.kind, path.kind[1:])
    np.testing.assert_array_equal(read.start, path.start[1:])
    np.testing.assert_array_equal(read.end, path.end[1:])
    cuts = read.kind == LINE
    np.testing.assert_array_equal(read.feed[cuts], path.feed[1:][cuts])


def test_inches_and_offsets():
    (_, _, _, _, _, feed, *_), read = scanned("G1 X1 Y0.1 F10\n", unit=25.4, offset=(5.0, 6.0, 7.0))
    assert read.end[0] == pytest.approx([30.4, 8.54, 3.0]) and feed == pytest.approx(254.0)


@pytest.mark.parametrize(
    "line",
    [
        "G2 X1 Y1 I1", "G1 X1 (why)", "G1 X1 ; why", "M5", "G1.1 X1", "G90", "X1,5", "X1.2.3", "X1 0", "X 1", "X-", "X", "1", "X1 X2",
        "G0 G1 X1", "/G1 X1", "%", "X#1", "X[1]", "X1e3", "F0 X1", "F-5", "X1 N5", "N1.5 X1", "N-1", "X=1", "G1 A1", "X1 +2", "G-1",
        "X99999999", "X1.2345678901234567", "O100", "S100", "T1", "G91 X1", "X1 \u00e9",
    ],
)  # fmt: skip
def test_everything_else_is_odd(line):
    (n, rows, at, why, *_), _ = scanned(f"G1 X2\n{line}\nX3\n")
    assert (n, rows, at, why) == (1, 1, 6, NOT_LINEAR)


def test_odd_without_a_motion_code_or_a_feed():
    assert scanned("X1\n", code=-1)[0][3] == NOT_LINEAR
    assert scanned("G1 X1\n", feed=0.0)[0][3] == NOT_LINEAR
    assert scanned("G0 X1\n", feed=0.0)[0][0] == 1


def test_numbers_without_a_point_can_be_odd():
    assert scanned("X1.\nX0\nX5\n", pointed=True)[0][:4] == (2, 2, 7, NOT_LINEAR)


@pytest.mark.parametrize("cut", range(1, 12))
def test_a_line_cut_off_by_the_buffer_is_left_for_the_next_one(cut):
    text = "G1 X2\nX3.25 Y4"
    found, read = scanned(text[: 6 + cut], last=False)
    assert found[:4] == (1, 1, 6, MORE) if cut else True
    assert scanned(text, last=True)[0][0] == 2 and read.end[0, 0] == 2.0


# --- numbers ----------------------------------------------------------------------------------------------------------


compiled_anew = partial(dispatcher, allocates=False)  # with what it calls, which kernels from the disk leave uncompiled


@compiled_anew
def decimal(out, value, digits):
    return put_decimal(out, 0, value, digits, True)


@compiled_anew
def feed(out, value):
    return put_feed(out, 0, value, False)


@pytest.mark.parametrize("digits", [0, 1, 3, 4, 6])
def test_numbers_are_written_as_the_writer_writes_them(digits):
    rng = np.random.default_rng(digits)
    for value in [0.0, -0.0, 1.0, -1.5, 100.0, 0.00004, -0.00004, 12345.6789, *rng.uniform(-2000, 2000, 200)]:
        value = round(value, digits)
        out = np.zeros(64, np.uint8)
        assert out[: decimal(out, value, digits)].tobytes().decode() == plain(value, digits)


def test_feeds_are_written_as_the_writer_writes_them():
    rng = np.random.default_rng(1)
    for value in [600.0, 0.5, 1234.5, 99999.94, 1e-3, *10.0 ** rng.uniform(-2, 5, 200)]:
        out = np.zeros(64, np.uint8)
        assert out[: feed(out, value)].tobytes().decode() == significant(value)


# --- writing ----------------------------------------------------------------------------------------------------------


def random_output(rng, path, first):
    """Rows for motions from `first` on: moved end points, joining lines, divisions, other feeds."""
    motion, end, joining, feed = [], [], [], []
    for k in range(first, len(path)):
        cut = path.kind[k] == LINE
        before, more, after = (int(each) for each in (rng.random(3) < 0.15) & cut)
        for what in ["join"] * before + ["own"] * (1 + more) + ["join"] * after:
            motion.append(k)
            end.append(path.end[k] + rng.choice([0.0, 0.0004, 0.01, 1.0]) * rng.uniform(-1, 1, 3))
            joining.append(what == "join")
            feed.append(path.feed[k] * rng.choice([1.0, 1.0005, 1.2]) if cut and rng.random() < 0.7 else np.nan)
    return np.array(motion), np.array(end), np.array(joining), np.array(feed)


@pytest.mark.parametrize("seed", range(25))
def test_lines_are_written_as_the_writer_of_whole_programs_writes_them(seed):
    rng = np.random.default_rng(seed)
    eol = ["\n", "\r\n", "\r\r\n"][seed % 3]
    lines = ["N5 G1 X1.5 F300", *random_lines(rng, 40), "G1 X7.5 F20"]
    text = HEAD + eol.join(lines) + (eol if seed % 5 else "")
    whole = read_program(text.encode(), name="p.nc", dialect="rs274")
    path = whole.path
    motion, end, joining, feed = random_output(rng, path, 1)
    kind = np.where(path.kind[motion] == RAPID, RAPID, LINE)
    one = Output(
        motion=np.append(0, motion), kind=np.append(RAPID, kind), end=np.vstack((path.end[:1], end)),
        centre=np.full((len(end) + 1, 3), np.nan), angle=np.zeros(len(end) + 1), feed=np.append(np.nan, feed),
        joining=np.append(False, joining),
    )  # fmt: skip
    expected = rewrite(whole, one, resolution_mm=RESOLUTION, version="1")

    body = text[len(HEAD) :]
    _, read = scanned(body)
    data = np.frombuffer(body.encode(), np.uint8)
    out = np.empty(len(data) + MAX_ROW_BYTES * len(motion), np.uint8)
    written, held = np.empty((len(motion), 3)), np.empty(len(motion))
    first = np.searchsorted(motion - 1, np.arange(len(read.row) + 1))
    position, state = np.array([1.0, 2.0, 3.0]), np.array([0.0, 500.0])
    text_of = Text.read(body.encode(), "p.nc")
    lines_at = np.stack((text_of.starts, text_of.ends, text_of.nexts), axis=1)[read.row]
    size = write_rows(
        data, 0, len(data), lines_at, read.begin, read.finish, read.kind, read.end, read.code_stated, read.feed_stated,
        read.feed, first, joining, end, feed, position, state, 1.0, np.zeros(3), decimals(RESOLUTION, 1.0),
        0.5 * RESOLUTION * (1 + 1e-9), False, out, written, held,
    )  # fmt: skip
    text_out = out[:size].tobytes().decode()
    reference = expected.data.decode()
    assert reference.endswith(text_out), _first_difference(reference, text_out)
    assert reference[: -len(text_out)].count("\n") == 3  # the head and the stamp
    np.testing.assert_allclose(written, expected.end[1:], rtol=0, atol=1e-12)
    np.testing.assert_allclose(position, expected.end[-1], atol=1e-12)
    cuts = np.isfinite(expected.feed[1:])
    np.testing.assert_array_equal(held[cuts], expected.feed[1:][cuts])


def _first_difference(reference, text):
    ours, theirs = text.splitlines(), reference.splitlines()[3:]
    return next(((a, b) for a, b in zip(ours, theirs, strict=False) if a != b), "lengths differ")
