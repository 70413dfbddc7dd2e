import numpy as np
import pytest

from camcomp.ground.errors import ConfigError
from camcomp.model.cutting.forcetable import look_up, parse_table

JUMP = "s_mm,Fr_N,Ft_N,Fz_N,note\n0,0,0,0,air\n10,0,0,0,entry\n10,200,-10,-20,\n20,100,-10,-30,\n"


def test_linear_between_rows_and_a_jump_where_a_place_is_repeated() -> None:
    table = parse_table(JUMP, "f.csv")
    s = np.array([0.0, 9.99, 10.001, 15.0, 20.0])
    force = look_up(table, s, np.zeros(5, int), np.zeros(5, bool))
    np.testing.assert_allclose(force[:, 0], [0, 0, 200, 150, 100], atol=1e-9)
    np.testing.assert_allclose(force[3], [150, -10, -25])


@pytest.mark.parametrize("off", [-4e-7, 0.0, 4e-7])
def test_at_a_jump_the_end_of_a_motion_and_the_start_of_the_next_differ(off: float) -> None:
    table = parse_table(JUMP, "f.csv")
    force = look_up(table, np.full(2, 10.0 + off), np.array([7, 8]), np.array([True, False]))
    np.testing.assert_array_equal(force[:, 0], [0, 200])


def test_a_line_column_settles_which_side_of_a_jump_is_meant() -> None:
    rows = "line,s_mm,Fr_N,Ft_N,Fz_N\n7,0,0,0,0\n7,10,0,0,0\n8,10,200,0,0\n8,20,100,0,0\n9,20,0,0,0\n9,30,0,0,0\n"
    table = parse_table(rows, "joints.csv")
    s, line = np.array([10.0, 10.0, 20.0, 20.0, 15.0, 25.0]), np.array([7, 8, 8, 9, 8, 9])
    for ends in (True, False):
        force = look_up(table, s, line, np.full(6, ends))
        np.testing.assert_array_equal(force[:, 0], [0, 200, 100, 0, 150, 0])


def test_rows_closer_than_a_micrometre_are_no_jump() -> None:
    s = np.arange(0, 0.01, 0.0004)
    text = "s_mm,Fr_N,Ft_N,Fz_N\n" + "".join(f"{each:.4f},{1000 * each:.3f},0,0\n" for each in s)
    at = np.array([0.001, 0.0031, 0.0077])
    force = look_up(parse_table(text, "f.csv"), at, np.zeros(3, int), np.array([True, False, True]))
    np.testing.assert_allclose(force[:, 0], 1000 * at, atol=1e-9)


def test_rows_of_a_line_are_averaged_and_empty_cells_of_a_log_skipped() -> None:
    text = "t_s,line,fx_N,fy_N,fz_N\r\n0,7,10,0,1\r\n0.1,7,20,0,3\r\n0.2,7,,,\r\n0.3,5,-4,1,0\r\n"
    table = parse_table(text, "log.csv")
    assert table.in_machine and not table.by_length
    np.testing.assert_allclose(
        look_up(table, np.zeros(3), np.array([7, 5, 7]), np.zeros(3, bool)), [[15, 0, 2], [-4, 1, 0], [15, 0, 2]]
    )


def test_a_mark_at_the_start_of_the_file_and_blank_lines_do_no_harm() -> None:
    table = parse_table("\ufeffs_mm, Fr_N, Ft_N, Fz_N\n\n0, 1, 2, 3\n", "f.csv")
    np.testing.assert_array_equal(table.force, [[1, 2, 3]])


@pytest.mark.parametrize(
    ("text", "rule", "line", "column", "part"),
    [
        ("", "CC260", 1, 1, ""),
        ("s_mm,Fr_N,Ft_N,Fz_N\n", "CC260", 1, 1, ""),
        ("s_mm,Fr_N,Ft_N,Fz_N\n1,,,\n", "CC260", 1, 1, "no row"),
        ("x_mm,Fr_N,Ft_N,Fz_N\n1,2,3,4\n", "CC261", 1, 1, "s_mm or line"),
        ("s_mm,Fr_N,Ft,Fz_N\n1,2,3,4\n", "CC261", 1, 11, "'Ft'"),
        ("s_mm,fx_N,Fy_N,Fz_N\n1,2,3,4\n", "CC261", 1, 11, "Fy_N"),
        ("s_mm,Fr_N,Ft_N\n1,2,3\n", "CC261", 1, 1, "not all"),
        ("s_mm,Fr_N,Ft_N,Fz_N\n1,2,3,4\n2,2,x,4\n", "CC262", 3, 5, "'x'"),
        ("s_mm,Fr_N,Ft_N,Fz_N\n1,2,3,nan\n", "CC262", 2, 7, "nan"),
        ("s_mm,Fr_N,Ft_N,Fz_N\n1,2,3\n", "CC262", 2, 6, "empty"),
        ("s_mm,Fr_N,Ft_N,Fz_N\n1,2,3,4\n0.5,2,3,4\n", "CC263", 3, 1, "falls"),
    ],
)
def test_errors_say_where(text: str, rule: str, line: int, column: int, part: str) -> None:
    with pytest.raises(ConfigError) as caught:
        parse_table(text, "f.csv")
    error = caught.value
    assert error.at is not None
    assert (error.rule, error.at.file, error.at.line, error.at.column) == (rule, "f.csv", line, column)
    assert part in error.message


def test_all_bad_cells_are_reported_together() -> None:
    with pytest.raises(ConfigError) as caught:
        parse_table("s_mm,Fr_N,Ft_N,Fz_N\na,2,3,4\n1,b,3,c\n", "f.csv")
    assert [each.at and (each.at.line, each.at.column) for each in caught.value.all()] == [(2, 1), (3, 3), (3, 7)]


@pytest.mark.parametrize(
    ("text", "s", "line"), [(JUMP, 20.5, 3), (JUMP, -0.1, 3), ("line,Fr_N,Ft_N,Fz_N\n5,1,2,3\n", 0.0, 6)]
)
def test_a_point_that_the_table_does_not_cover_is_refused(text: str, s: float, line: int) -> None:
    with pytest.raises(ConfigError) as caught:
        look_up(parse_table(text, "f.csv"), np.array([s]), np.array([line]), np.array([False]))
    assert caught.value.rule == "CC264" and f"line {line}" in caught.value.message


def test_inside_a_line_the_motion_decides_about_a_jump_and_rows_without_force_do_not_count() -> None:
    text = "line,s_mm,Fr_N,Ft_N,Fz_N\n7,0,0,0,0\n7,5,,,\n7,10,0,0,0\n7,10,200,0,0\n7,20,100,0,0\n"
    ends = np.array([True, False, False])
    force = look_up(parse_table(text, "f.csv"), np.array([10.0, 10.0, 5.0]), np.array([7, 7, 7]), ends)
    np.testing.assert_array_equal(force[:, 0], [0, 200, 0])
