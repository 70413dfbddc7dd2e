"""The one CSV reader: every spelling of a table means the same, and what is none is refused where it stands."""

import numpy as np
import pytest

from camcomp.ground import csv_table
from camcomp.ground.csv_table import TableRules, read_csv
from camcomp.ground.errors import ConfigError

RULES = TableRules(table="CC400", column="CC401", cell="CC403")
VALUES = [[1.0, 2.5], [np.nan, -3e-3]]


@pytest.mark.parametrize(
    "data",
    [
        b"a,b\n1,2.5\n,-3e-3\n",
        b"\xef\xbb\xbfa,b\n1,2.5\n,-3e-3",
        b"a,b\r\n1,2.5\r\n,-3e-3\r\n",
        b"a,b\r1,2.5\r,-3e-3\r",
        b"\na, b\n\n 1 , 2.5,\n , \nnan,-3e-3\n\n",
        b'"a","b"\n"1", "2.5"\n"",-3e-3\n',
    ],
    ids=["plain", "mark at the start", "CR LF", "CR", "blanks", "quotes"],
)
def test_every_spelling_is_one_table(data):
    table = read_csv(data, "t.csv", RULES)
    assert table.header == ("a", "b")
    np.testing.assert_array_equal(table.values(), VALUES)


@pytest.mark.parametrize("mark", [";", "\t"])
def test_semicolons_and_decimal_commas_are_for_spreadsheets(mark):
    text = mark.join("ab") + "\r\n" + mark.join(('"1,0"', "2,5")) + "\r\n" + mark.join(("", "-3e-3")) + "\r\n"
    np.testing.assert_array_equal(read_csv(text, "t.csv", RULES, spreadsheet=True).values(), VALUES)
    with pytest.raises(ConfigError):
        read_csv(text, "t.csv", RULES).values()


def test_a_row_that_ends_early_has_empty_cells():
    np.testing.assert_array_equal(read_csv("a,b\n1\n", "t.csv", RULES).values(), [[1.0, np.nan]])


@pytest.mark.parametrize(
    ("text", "rule", "line", "column", "told"),
    [
        ("", "CC400", 1, 1, "empty"),
        ("\n \n", "CC400", 1, 1, "empty"),
        ("\na,b\n", "CC400", 2, 1, "no rows"),
        ("a;b\n1;2\n", "CC400", 1, 1, "not by semicolons"),
        ('a,b\n1,2\n3,"4\n5,6\n', "CC400", 3, 1, "no table"),
        ("a,b,a\n1,2,3\n", "CC401", 1, 5, "column a stands there twice"),
        ('"a,1",b,b\n1,2,3\n', "CC401", 1, 9, "column b stands there twice"),
        ('a,"b, mm"\n1,2\n\n"3",x\n', "CC403", 4, 5, "'x' in column b, mm is not a number"),
        ('"a,1",b\n"4",inf\n', "CC403", 2, 5, "'inf' in column b is not a number"),
        ("a,b\r1,2\r3,1_0\r", "CC403", 3, 3, "'1_0'"),
        ("a,b\n1,2,\n3,4,5\n", "CC403", 3, 5, "3 cells under 2"),
    ],
)
def test_what_is_no_table_is_refused_where_it_stands(text, rule, line, column, told):
    with pytest.raises(ConfigError, match=told) as caught:
        table = read_csv(text, "t.csv", RULES)
        table.refuse_twice()
        table.values()
    at = caught.value.at
    assert (caught.value.rule, at.file, at.line, at.column) == (rule, "t.csv", line, column)


def test_a_table_beyond_all_patience_is_refused_before_it_is_read(monkeypatch):
    monkeypatch.setattr(csv_table, "MOST_TABLE_ROWS", 3)
    for data in (b"a\n1\n2\n3\n4\n", b"a\r1\r2\r3\r4\r"):
        with pytest.raises(ConfigError) as caught:
            read_csv(data, "log.csv", RULES)
        assert caught.value.rule == "CC425"


@pytest.mark.parametrize("cell", ["1e308", "-1e19", "1_0", "\uff11", "infinity"])
def test_a_cell_is_a_number_of_this_world(cell):
    with pytest.raises(ConfigError) as caught:
        read_csv(f"a,b\n1,{cell}\n", "log.csv", RULES).values()
    assert caught.value.at.line == 2 and caught.value.at.column == 3
