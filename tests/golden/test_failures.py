"""Failures of other tools that rewrite G-code, each failure class once (F1 to F16).

Classes: applied twice, arcs mangled, planes mixed, rapids forgotten, unknown start, machine moves changed, feeds turned
into moves, wrong speed, long lines bent, units lost, silence, wrong sign, lost moves, rounding, bytes changed, order.
"""

import json
import math
import re

import numpy as np
import pytest

from camcomp.gcode.interpret import read_program
from camcomp.gcode.output import Output
from camcomp.gcode.rewrite import rewrite
from camcomp.gcode.stamp import is_stamped
from camcomp.ground.datatypes import ARC
from camcomp.terminal.cli import run

CARTESIAN = "config/cartesian.yaml"
ORTHOGLIDE = "config/orthoglide-1deg.yaml"
GROOVE = "G21 G90 G17 G94\nG0 X25 Y0 Z5\nG1 Z0 F300\nG3 X25 Y0 I-25 J0 F600\nG1 Z5\nM30\n"


@pytest.fixture
def compensate(tmp_path, capsys):
    """Run `camcomp compensate` on a text; exit code, program written, summary, messages."""

    def call(text, config=ORTHOGLIDE, code=0):
        data = text if isinstance(text, bytes) else text.encode()
        (tmp_path / "in.nc").write_bytes(data)
        out, summary = tmp_path / "out.nc", tmp_path / "summary.json"
        out.unlink(missing_ok=True)
        args = ["compensate", str(tmp_path / "in.nc"), "--config", config, "-o", str(out), "--summary", str(summary)]
        result = run(args)
        messages = capsys.readouterr().err
        assert result == code, messages
        if not out.exists():
            return None, None, messages
        return out.read_bytes(), json.loads(summary.read_text()), messages

    return call


def moved(text, shift=(0.1, -0.2, 0.3), resolution=1e-3, **options):
    """The program rewritten with every point shifted, and both paths."""
    program = read_program(text.encode(), name="in.nc", **options)
    same = Output.same(program.path)
    free = (program.path.known & ~program.path.machine)[:, None]
    out = Output(
        motion=same.motion, kind=same.kind, end=same.end + shift * free, centre=same.centre + shift,
        angle=same.angle, feed=same.feed, joining=same.joining,
    )  # fmt: skip
    written = rewrite(program, out, resolution_mm=resolution, version="0")
    return written, program, read_program(written.data, name="out.nc", **options)


def test_f01_applied_twice(compensate):
    once, _, _ = compensate(GROOVE)
    assert is_stamped(once)
    nothing, _, messages = compensate(once, code=1)
    assert nothing is None and "compensated before" in messages


def test_f02_arc_left_half_changed(compensate):
    data, _, _ = compensate("G21 G90\nG0 X10 Y0 Z5\nG1 Z0 F200\nG2 X0 Y-10 R10\nX10 Y0 R-10\nG1 X10 Y5\nM2\n")
    for line in data.decode().splitlines():
        if re.search(r"\bG1\b", line):
            assert not re.search(r"[IJKR][-+.\d]", line), line
    path = read_program(data, name="out.nc").path
    assert len(path) > 10


@pytest.mark.parametrize(("plane", "words"), [("G17", "X-20 I-10"), ("G18", "X-20 I-10"), ("G19", "Y-20 J-10")])
def test_f03_arcs_outside_xy(plane, words):
    _, before, after = moved(f"G21 G90\nG0 X0 Y0 Z0\n{plane} G3 {words} F100\nM2\n")
    assert np.allclose(after.path.end - before.path.end, (0.1, -0.2, 0.3), atol=6e-4)
    assert np.allclose(after.path.axis, before.path.axis)
    assert np.allclose(after.path.angle, before.path.angle, atol=1e-3)


def test_f04_rapids_are_corrected_and_continuous(compensate):
    data, _, _ = compensate(GROOVE)
    path = read_program(data, name="out.nc").path
    assert abs(path.end[0, 0] - 25.0) > 0.1  # chain errors of 1 degree move the rapid's end, too
    # Nothing but the announced joining lines: no jump between the rapid and the plunge.
    assert np.linalg.norm((path.end[1] - path.end[0])[:2]) < 0.05


def test_f05_unknown_start_passes_unchanged(compensate):
    data, _, _ = compensate("G21 G90\nG0 X10 Y5\nG0 Z5\nG1 Z0 F100\nX20\nM2\n")
    assert b"\nG0 X10 Y5\n" in data
    known = read_program(data, name="out.nc").path.known
    assert known.tolist()[:2] == [False, True]


def test_f06_machine_moves_are_not_touched(compensate):
    data, _, _ = compensate("G21 G90\nG0 X5 Y5 Z5\nG53 G0 Z40\nG28 X0\nG1 X8 Y5 Z0 F100\nM2\n")
    assert b"\nG53 G0 Z40\nG28 X0\n" in data


def test_f07_feed_alone_is_no_move(compensate):
    text = "G21 G90\nG0 X5 Y5 Z5\nG1 F250\nF300\nM8\nG4 P0.5\nX8\nM2\n"
    data, _, _ = compensate(text)
    assert b"\nG1 F250\nF300\nM8\nG4 P0.5\n" in data
    assert len(read_program(text.encode(), name="in.nc").path) == 2


@pytest.mark.parametrize("mode", ["G94", "G93", "G95"])
def test_f08_tip_speed_is_kept_after_splitting(mode):
    feed = {"G94": "F600", "G93": "F60", "G95": "F0.5"}[mode]
    text = f"G21 G90 S1200 M3\nG0 X0 Y0 Z0\n{mode} G1 X10 {feed}\nX20 {feed}\nM2\n"
    program = read_program(text.encode(), name="in.nc")
    rows = np.repeat([0, 1, 2], [1, 4, 4])
    end = np.zeros((9, 3))
    end[1:, 0] = np.arange(1, 9) * 2.5
    out = Output.lines(rows, end)
    out = Output(
        motion=rows, kind=np.r_[0, np.ones(8)].astype(np.int8), end=end, centre=out.centre, angle=out.angle,
        feed=out.feed, joining=out.joining,
    )  # fmt: skip
    written = rewrite(program, out, resolution_mm=1e-3, version="0")
    after = read_program(written.data, name="out.nc").path
    assert len(after) == 9
    assert np.allclose(after.feed[1:], 600.0, rtol=1e-3)


def test_f09_long_lines_are_divided(compensate):
    data, summary, _ = compensate("G21 G90\nG0 X-60 Y10 Z0\nG1 X60 Y12 F500\nM2\n")
    assert len(read_program(data, name="out.nc").path) > 4
    assert summary["after"]["max_um"] <= 1.0


@pytest.mark.parametrize(
    "head", ["G20", "G55", "G92 X3 Y1", "G52 X-4", "G10 L2 P1 X7", "G43 H1", "G91", "G20 G91", "G55 G92.1"]
)
def test_f10_units_and_offsets_are_kept(head):
    text = f"G21 G90\nG0 X0 Y0 Z0\nG10 L2 P2 X100 Y5\n{head}\nG1 X3 Y2 Z1 F100\nX4 Y1\nG3 I1 J0\nM2\n"
    written, before, after = moved(text)
    assert after.dialect == before.dialect
    assert f"\n{head}\n" in written.data.decode() or head.startswith("G92 ")
    assert np.allclose(after.path.end[2:] - before.path.end[2:], (0.1, -0.2, 0.3), atol=6e-4)
    assert np.allclose(after.path.end, written.end, atol=1e-6)


def test_f11_silence_is_reported(compensate):
    _, summary, _ = compensate(GROOVE, CARTESIAN)
    assert summary["before"]["max_um"] > 0.0
    assert {"points", "segments_in", "lines_out", "actuator_change_max_mm"} <= set(summary)


def test_f12_sign_is_proved_on_the_output(compensate):
    # The loaded tip of the written program is where it was programmed; a wrong sign would double the error.
    _, summary, _ = compensate(GROOVE)
    assert summary["before"]["max_um"] > 500.0
    assert summary["after"]["max_um"] <= 1.0


@pytest.mark.parametrize(
    ("text", "end"),
    [
        ("G54 G90 X2 Y2 Z2 G0\n", (2, 2, 2)),
        ("G0 X1 Y1 Z1\nX2 G91\n", (3, 1, 1)),
        ("G0 X1 Y1 Z1\nG81 X5 Y5 Z-1 R2 F100\nG0 G80\nX8\n", (8, 5, 2)),
        ("G0 X1 Y1 Z1\nX2 G20 Y1\n", (50.8, 25.4, 1)),
    ],
)
def test_f13_modes_and_axis_words_in_one_block(text, end):
    assert read_program(text.encode(), name="in.nc").path.end[-1] == pytest.approx(end)


def test_f14_a_tiny_arc_does_not_become_a_circle():
    text = "G21 G90\nG0 X0 Y0 Z0\nG1 X10 F100\nG2 X10.0004 Y0.0004 I0.0004 J0\nX20\nM2\n".replace("X20", "G1 X20")
    written, _, after = moved(text, shift=(0.1, 0.1, 0.0))
    arcs = after.path.kind == ARC
    assert (np.abs(after.path.angle[arcs]) < math.pi).all()
    assert np.allclose(after.path.end[-1], (20.1, 0.1, 0.0), atol=6e-4), written.data


def test_f14_a_full_circle_does_not_become_a_tiny_arc():
    # Start and end round apart when they are given by different sums.
    program = read_program(b"G21 G91\nG0 X0.1 Y0 Z0\nG3 X0 Y0 I-5 F100\nM2\n", name="in.nc")
    same = Output.same(program.path)
    end = same.end + np.array([[0.0004, 0, 0], [0.0016, 0, 0]])
    out = Output(
        motion=same.motion, kind=same.kind, end=end, centre=same.centre, angle=same.angle, feed=same.feed,
        joining=same.joining,
    )  # fmt: skip
    after = read_program(rewrite(program, out, resolution_mm=1e-3, version="0").data, name="out.nc").path
    assert np.abs(after.angle).sum() == pytest.approx(2 * math.pi, abs=1e-3)


def test_f14_numbers_are_plain():
    written, _, _ = moved("G21 G90\nG0 X12345.6785 Y-0.1 Z0.00004\nG1 X-0.1 F100\nM2\n", shift=(0.1, 0.1, 0.0))
    text = written.data.decode().split("\n", 1)[1]
    assert "e" not in text and "-0.0 " not in text and "X12345.779 " in text.replace("X12345.778 ", "X12345.779 ")


ENCODED = {
    "crlf": b"%\r\nO0001 (X)\r\nG21 G90\r\nG0 X1 Y2 Z3\r\nM30\r\n%\r\n",
    "cr": b"G21 G90\rG0 X1 Y2 Z3\r; end\rM30\r",
    "mixed": b"G21 G90\r\nG0 X1 Y2 Z3\n(a)\rM30",
    "cp1252": "G21\n(Fräser Ø10, 5°)\nG0 X1 Y2 Z3\nM30\n".encode("cp1252"),
    "utf-8": "G21\n(Fräser Ø10, 5°)\nG0 X1 Y2 Z3\nM30\n".encode(),
    "utf-8-bom": b"\xef\xbb\xbfG21\nG0 X1 Y2 Z3\nM30\n",
    "utf-16-le": b"\xff\xfe" + "G21\r\n(Ø)\r\nG0 X1 Y2 Z3\r\nM30\r\n".encode("utf-16-le"),
    "utf-16-be": b"\xfe\xff" + "G21\n(Ø)\nG0 X1 Y2 Z3\nM30\n".encode("utf-16-be"),
    "nul": b"\0\0\0%\nG21\nG0 X1 Y2 Z3\nM30\n%\n\0\0\0",
    "nested": b"G21 (a (b) c)\nG0 X1 Y2 Z3 (open\nM30\ntrailing text, untouched\n",
    "packed": b"n10g21g90\nn20g0x+1.y2z.5m8\n/n30g1x2f100\nm2\n",
    "tabs": b"G21\tG90\n\tG0\tX1\tY2\tZ3\t; tab\n\n\nM30",
}


@pytest.mark.parametrize("name", ENCODED)
def test_f15_every_other_byte_is_kept(name):
    data = ENCODED[name]
    program = read_program(data, name=name)
    written = rewrite(program, Output.same(program.path), resolution_mm=1e-3, version="0")
    codec = {b"\xff\xfe": "utf-16-le", b"\xfe\xff": "utf-16-be"}.get(data[:2], "latin-1")
    before, after = data.decode(codec), written.data.decode(codec)
    at = after.index("(camcomp")
    line = re.match(r"[^\r\n]*(\r\n|\r|\n)", after[at:])[0]
    assert (after[:at] + after[at + len(line) :]).encode(codec) == before.encode(codec) == data
    assert is_stamped(written.data)


def test_f16_order_of_corrections_is_one(compensate):
    # Target, chain errors and force act in one equilibrium, not as stacked layers: both corrections at once are not the
    # sum of the two alone, and what is left is small all the same.
    _, both, _ = compensate(GROOVE)
    _, force, _ = compensate(GROOVE, "config/orthoglide.yaml")
    assert both["after"]["max_um"] <= 1.0 and force["after"]["max_um"] <= 1.0
    assert both["before"]["max_um"] != pytest.approx(force["before"]["max_um"], rel=0.05)
