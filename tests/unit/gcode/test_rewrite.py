"""How lines are changed: words, feeds, motion codes, new lines, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

from camcomp.gcode.interpret import read_program
from camcomp.gcode.output import Output
from camcomp.gcode.rewrite import Writer, rewrite
from camcomp.ground.datatypes import LINE, RAPID
from camcomp.ground.errors import ProgramError


def written(text, rows, resolution=1e-3, dialect="rs274"):
    """Lines of the output without stamp; rows: (motion, kind, end, feed, joining)."""
    program = read_program(text.encode(), name="in.nc", dialect=dialect)
    n = len(rows)
    out = Output(
        motion=np.array([row[0] for row in rows]),
        kind=np.array([row[1] for row in rows], np.int8),
        end=np.array([row[2] for row in rows], float),
        centre=np.full((n, 3), np.nan),
        angle=np.zeros(n),
        feed=np.array([row[3] if len(row) > 3 else np.nan for row in rows], float),
        joining=np.array([row[4] if len(row) > 4 else False for row in rows]),
    )
    result = rewrite(program, out, resolution_mm=resolution, version="1")
    again = read_program(result.data, name="out.nc", dialect=dialect).path
    last = {int(line): k for k, line in enumerate(again.line)}
    assert np.allclose(again.end[[last[int(line)] for line in result.line]], result.end, atol=1e-7)
    lines = result.data.decode().splitlines()
    return [line for line in lines if "camcomp" not in line]


START = (0, RAPID, (0, 0, 0))


def test_only_the_words_that_differ_are_replaced():
    text = "G0 X0 Y0 Z0\nN7 G1  X10.000 (a)  Y+2 F100 M8 ; b\n"
    assert written(text, [START, (1, LINE, (10.0004, 2.5, 0))])[1] == "N7 G1  X10.000 (a)  Y2.5 F100 M8 ; b"


def test_words_that_are_missing_come_behind_the_last_one():
    text = "G0 X0 Y0 Z0\nG1 X10 F100 M8\nG1X11M9\n"
    rows = [START, (1, LINE, (10, 0, 0.5)), (2, LINE, (11, 0.25, 0.5))]
    assert written(text, rows)[1:] == ["G1 X10 Z0.5 F100 M8", "G1X11Y0.25M9"]


def test_a_displaced_axis_is_brought_back():
    text = "G0 X0 Y0 Z0\nG1 X10 F100\nX20\n"
    rows = [START, (1, LINE, (10, 1, 0)), (2, LINE, (20, 0, 0))]
    assert written(text, rows)[1:] == ["G1 X10 Y1.0 F100", "X20 Y0.0"]


def test_new_lines_follow_without_number_and_modal():
    text = "G0 X0 Y0 Z0\r\nN20 G01 X10 F100\r\nN30 X20\r\n"
    rows = [START, (1, LINE, (5, 0, 0)), (1, LINE, (7, 1, 0)), (1, LINE, (10, 0, 0)), (2, LINE, (20, 0, 0))]
    assert written(text, rows)[1:] == ["N20 G01 X5.0 F100", "X7.0 Y1.0", "X10.0 Y0.0", "N30 X20"]


def test_joining_rows_come_first_with_their_own_code_and_feed():
    text = "G0 X0 Y0 Z0\nG1 X10 F100\nG0 Z5\n"
    rows = [START, (1, LINE, (0.1, 0, 0), 50, True), (1, LINE, (10, 0, 0)), (1, LINE, (10.1, 0, 0), 100, True)]
    assert written(text, [*rows, (2, RAPID, (10.1, 0, 5))])[1:] == ["G1 X0.1 F50", "G1 X10 F100", "X10.1", "G0 Z5"]


def test_feed_is_restored_for_the_next_line_that_relies_on_it():
    text = "G0 X0 Y0 Z0\nG1 X10 F100\nX20\nX30\n"
    rows = [START, (1, LINE, (10, 0, 0), 80), (2, LINE, (20, 0, 0)), (3, LINE, (30, 0, 0), 100.05)]
    assert written(text, rows)[1:] == ["G1 X10 F80", "X20 F100", "X30"]


def test_feed_stated_on_a_line_of_its_own_is_known():
    text = "G0 X0 Y0 Z0\nF100\nG0 X1\nG1 X10\n"
    rows = [START, (1, RAPID, (1, 0, 0)), (2, LINE, (10, 0, 0.5))]
    assert written(text, rows)[3] == "G1 X10 Z0.5"


def test_an_arc_that_becomes_lines_leaves_nothing_behind():
    text = "G0 X0 Y0 Z0\nG03 X10 Y0 I5 J0 F100\nX20 I5\nG1 X30\n"
    rows = [START, (1, LINE, (5, -5, 0)), (1, LINE, (10, 0, 0)), (2, LINE, (15, -5, 0)), (2, LINE, (20, 0, 0))]
    lines = written(text, [*rows, (3, LINE, (30, 0, 0))])
    assert lines[1:] == ["G01 X5.0 Y-5.0 F100", "X10.0 Y0.0", "X15.0 Y-5.0", "X20.0 Y0.0", "G1 X30"]


def test_modal_arc_after_lines_gets_its_code_back():
    text = "G0 X0 Y0 Z0\nG3 X10 Y0 I5 J0 F100\nX20 I5\n"
    program = read_program(text.encode(), name="in.nc")
    same = Output.same(program.path)
    out = Output(
        motion=np.array([0, 1, 1, 2]), kind=np.array([0, 1, 1, 2], np.int8),
        end=np.array([(0, 0, 0), (5, -5, 0), (10, 0, 0), (20, 0, 0)], float), centre=same.centre[[0, 1, 1, 2]],
        angle=same.angle[[0, 1, 1, 2]], feed=same.feed[[0, 1, 1, 2]], joining=np.zeros(4, bool),
    )  # fmt: skip
    data = rewrite(program, out, resolution_mm=1e-3, version="1").data
    assert data.decode().splitlines()[-1] == "G3 X20 I5"
    assert read_program(data, name="out.nc").path.angle[-1] == pytest.approx(program.path.angle[-1])


def test_relative_rounding_does_not_add_up():
    n = 300
    text = "G0 X0 Y0 Z0\nG91 F100\n" + "G1 X0.1\n" * n
    step = 0.1 + 0.00037
    rows = [START] + [(k, LINE, (k * step, 0, 0)) for k in range(1, n + 1)]
    lines = written(text, rows)
    total = sum(float(line.split("X")[1]) for line in lines if line.startswith("G1 X"))
    assert total == pytest.approx(n * step, abs=0.51e-3)


def test_a_stop_stays_behind_all_that_its_line_does():
    text = "G0 X0 Y0 Z0\nG1 X10 F100 M0\nX20\n"
    rows = [START, (1, LINE, (5, 0, 0)), (1, LINE, (10, 1, 0)), (2, LINE, (20, 1, 0))]
    assert written(text, rows)[1:] == ["G1 X5.0 F100", "X10 Y1.0 F100 M0".replace("X10", "G1 X10"), "X20"]


def test_rows_before_a_line_that_changes_modes_come_behind_its_modes():
    text = "G0 X0 Y0 Z0\nN5 G91 G1 X10 F100 (note)\nX1\n"
    rows = [START, (1, LINE, (0.5, 0, 0), 100, True), (1, LINE, (10, 0, 0)), (2, LINE, (11, 0, 0))]
    assert written(text, rows)[1:] == ["N5 G91 F100 (note)", "G1 X0.5", "X9.5", "X1"]


def test_g92_states_where_the_tool_stands_now():
    text = "G0 X10 Y0 Z0\nG92 X0 Y5\nG0 X1\n"
    rows = [(0, RAPID, (10.25, 0, 0)), (1, RAPID, (11, 0, 0))]
    assert written(text, rows) == ["G0 X10.25 Y0 Z0", "G92 X0.25 Y5", "G0 X1"]


def test_lines_that_may_be_skipped_are_skipped_together():
    text = "G0 X0 Y0 Z0\n/G1 X10 F100\nG0 X0\n"
    rows = [START, (1, LINE, (5, 0, 0)), (1, LINE, (10, 1, 0)), (2, RAPID, (0, 0, 0))]
    assert written(text, rows)[1:] == ["/G1 X5.0 F100", "/X10.0 Y1.0", "G0 X0 Y0.0"]


def test_lower_case_and_packed_lines_keep_their_look():
    text = "g0x0y0z0\ng1x10f100\n"
    rows = [START, (1, LINE, (5, 0, 0)), (1, LINE, (10, 1, 0))]
    assert written(text, rows)[1:] == ["g1x5.0f100", "x10.0y1.0"]


def test_inch_words_have_finer_decimals():
    text = "G20 G0 X0 Y0 Z0\nG1 X1 F10\n"
    rows = [START, (1, LINE, (25.4321, 0, 0))]
    assert written(text, rows, resolution=1e-3)[1] == "G1 X1.00126 F10"


def test_last_line_without_end_of_line():
    assert written("G0 X0 Y0 Z0\nG1 X9 F1", [START, (1, LINE, (5, 0, 0)), (1, LINE, (9, 0, 0))])[1:] == [
        "G1 X5.0 F1",
        "X9.0",
    ]


@pytest.mark.parametrize(
    ("text", "moves"),
    [
        ("G0 X0 Y0 Z0\nG91 G1 X10 F100 M0\n", [(1, LINE, (1, 0, 0), 100, True), (1, LINE, (10, 0, 0))]),
        ("G0 X0 Y0 Z0\nG1 X10 F100\nG28.1\n", [(1, LINE, (10, 1, 0))]),
    ],
)
def test_what_cannot_be_rewritten_is_refused(text, moves):
    with pytest.raises(ProgramError) as caught:
        written(text, [START, *moves])
    assert caught.value.rule == "CC137" and caught.value.at.line > 1


def test_tapping_passes_unchanged_and_is_not_replaced():
    text = "G0 X0 Y0 Z5\nM3 S100 F100\nG84 X1 Y1 Z-2 R1\nM2\n"
    program = read_program(text.encode(), name="in.nc")
    same = Output.same(program.path)
    assert rewrite(program, same, resolution_mm=1e-3, version="1").data.endswith(text.encode())
    out = Output(
        motion=same.motion, kind=same.kind, end=same.end + 0.1, centre=same.centre, angle=same.angle, feed=same.feed,
        joining=same.joining,
    )  # fmt: skip
    with pytest.raises(ProgramError, match="tapping"):
        rewrite(program, out, resolution_mm=1e-3, version="1")


def test_a_motion_without_a_row_is_a_mistake_of_the_caller():
    with pytest.raises(ValueError, match="no row for motion 1"):
        written("G0 X0 Y0 Z0\nG1 X1 F1\nX2\n", [(0, RAPID, (1, 0, 0)), (2, LINE, (2, 0, 0))])


def test_a_cut_in_the_place_of_a_rapid_needs_a_feed():
    with pytest.raises(ValueError, match="needs a feed"):
        written("G0 X0 Y0 Z0\nG0 X5\n", [START, (1, LINE, (5, 1, 0))])


def test_inverse_time_feed_counts_the_arc_that_the_control_makes():
    program = read_program(b"G0 X1 Y0 Z0\nG93 G3 X0 Y1 I-1 J0 F100\n", name="in.nc")
    same = Output.same(program.path)
    late = np.array([(np.cos(0.05), np.sin(0.05), 0), (0, 1, 0)])  # the arc is not begun where it was programmed
    out = Output(
        motion=same.motion, kind=same.kind, end=late, centre=same.centre, angle=same.angle, feed=same.feed,
        joining=same.joining,
    )  # fmt: skip
    after = read_program(rewrite(program, out, resolution_mm=1e-2, version="1").data, name="out.nc").path
    assert after.kind[1] == 2 and after.angle[1] == pytest.approx(np.pi / 2 - 0.05, abs=1e-3)
    assert after.feed[1] == pytest.approx(program.path.feed[1], rel=2e-3)


def test_a_program_without_motions_passes_and_one_without_statements_does_not():
    text = b"G21 G90\nT1 M6 (drill)\nS1000 M3\nG10 L2 P1 X1\nM30\n"
    program = read_program(text, name="in.nc")
    assert len(program.path) == 0 and program.warnings == ("the program moves nothing",)
    assert rewrite(program, Output.same(program.path), resolution_mm=1e-3, version="1").data.endswith(text)
    for nothing in (b"", b"%\n(no more)\nN10 M30\n%\n", b"o100 sub\nG1 X1 F100\no100 endsub\nM2\n", b"T1\nM2\nG0 X1\n"):
        with pytest.raises(ProgramError) as caught:
            read_program(nothing, name="in.nc")
        assert caught.value.rule == "CC100"


def test_an_offset_stated_where_the_tool_stands_keeps_decimals_that_the_resolution_has_not():
    """The program stands at X10.0004, the corrected one, in micrometres, at X10.5; what follows must not move by 0.4 um."""
    text = "G0 X0 Y0 Z0\nG1 X10.0004 F100\nG92 X0\nG1 X5\n"
    rows = [START, (1, LINE, (10.5, 0, 0)), (2, LINE, (15.0004, 0, 0))]
    assert written(text, rows)[2] == "G92 X0.4996"


@pytest.mark.parametrize(
    ("unit", "arc"),
    [
        ("G21", "G3 X20 Y0 I5.01 J0 F100"),  # 20 um between its radii, where a control takes 28
        ("G20", "G3 X0.8 Y0 I0.401 J0 F10"),  # 0.002 in; 0.0028
    ],
)
def test_an_arc_that_a_control_takes_as_it_is_stays_when_something_else_is_moved(unit, arc):
    text = f"{unit} G17\nG0 X{'10' if unit == 'G21' else '0'} Y0 Z0\n{arc}\nG1 X1 Y1\n"
    program = read_program(text.encode(), name="in.nc", dialect="rs274")
    end = program.path.end.copy()
    end[2:] += 0.5
    out = replace(Output.same(program.path), end=end)
    result = rewrite(program, out, resolution_mm=1e-3, version="1")
    lines = [line for line in result.data.decode().splitlines() if "camcomp" not in line]
    assert lines[:3] == text.splitlines()[:3]
    assert lines[3].startswith("G1 ") and lines[3] != "G1 X1 Y1"
    assert np.allclose(result.centre[1], program.path.centre[1], equal_nan=True)


def rewritten(text, ends, **more):
    """Program and result where every motion has one row that ends at `ends` (n, 3)."""
    program = read_program(text.encode(), name="in.nc")
    out = replace(Output.same(program.path), end=np.array(ends, float), **more)
    return program, rewrite(program, out, resolution_mm=1e-3, version="1")


def test_a_feed_per_turn_is_given_in_mm_per_minute():
    _, result = rewritten("G0 X0 Y0 Z0\nS2000 M3\nG95 G1 X10 F0.1\n", [(0, 0, 0), (10, 0.5, 0)])
    assert result.feed[1] == pytest.approx(200.0)


def test_the_way_point_of_g28_is_relative_in_g91():
    """From a displaced start the way point is displaced as much; home is home."""
    text = "G0 X0 Y0 Z0\nG1 X10 Z-1 F100\nG91 G28 Z3\nG90 G1 X20 Y0 Z0\n"
    program = read_program(text.encode(), name="in.nc")
    ends = program.path.end.copy()
    ends[1] += (0.0, 0.0, -0.25)
    _, result = rewritten(text, ends)
    again = read_program(result.data, name="out.nc").path
    way_point = 2
    assert program.path.end[way_point, 2] == pytest.approx(2.0)
    np.testing.assert_allclose(result.end, again.end, atol=1e-9)
    assert result.end[way_point, 2] == pytest.approx(1.75)


def test_an_exact_stop_is_said_once_for_rows_in_a_row_and_taken_back_behind_them():
    text = "G64 P0.01\nG0 X0 Y0 Z0\nG1 X1 F100\nX2\nX3\nX4\n"
    ends = [(x, 0.1 * (x > 0), 0) for x in range(5)]
    _, result = rewritten(text, ends, rest=np.array([False, True, True, True, False]))
    codes = [line for line in result.data.decode().splitlines() if line.startswith(("G61", "G64"))]
    assert codes == ["G64 P0.01", "G61", "G64 P0.01"]


def test_a_cycle_that_begins_elsewhere_than_programmed_is_refused():
    """Its words lead from where it stands: the retract height of G98 is where the tool was."""
    program = read_program(b"G0 X0 Y0 Z5\nG1 X1 F100\nG91 G81 X1 Z-2 R-3 F50\n", name="in.nc")
    same = Output.same(program.path)
    moved = same.end.copy()
    moved[1] += (0.0, 0.25, 0.0)
    Writer(program, same, 1e-3).run()
    with pytest.raises(ProgramError, match="several motions stand in this line"):
        Writer(program, replace(same, end=moved), 1e-3).run()
