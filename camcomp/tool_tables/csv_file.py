"""A CSV file with a row per tool: `number` and any keys of `tools:`, e.g. `number,diameter_mm,type,teeth,length_mm`.

`length_mm` is the length offset of G43, `name` and `comment` are for readers. Semicolons with decimal commas are read, too.
"""

from collections.abc import Iterator
from difflib import get_close_matches

from camcomp.ground.csv_table import CsvTable, TableRules, read_csv
from camcomp.model.config.cutting_tool import Cutter
from camcomp.model.config.tool_table import TabledTool, ToolFile, refused
from camcomp.model.config.yaml_tree import Node

TITLE = "CSV file with a row per tool (.csv)"
SUFFIXES = (".csv",)
STATES_UNIT = True
_WORDS = ("type", "source")
_WHOLE = ("teeth",)
_PASSED = ("name", "comment")
_RULES = TableRules("CC299", "CC299", "CC299")


def read(file: ToolFile) -> Iterator[TabledTool]:
    """The tools row by row; empty cells are not stated."""
    table = read_csv(file.data, file.name, _RULES, spreadsheet=True)
    table.refuse_twice()
    known = ("number", *(key for key in Cutter.yaml_keys()), "length_mm", *_PASSED)
    for k, name in enumerate(table.header):
        if name not in known:
            close = get_close_matches(name, known, n=1)
            hint = f"did you mean '{close[0]}'? " if close else ""
            raise refused(f"unknown column '{name}'", table.at(-1, k), f"{hint}columns: {', '.join(known)}")
    if "number" not in table.header:
        raise refused("there is no column 'number'", table.at(-1), "it holds the T number of every tool")
    for row in range(len(table.rows)):
        yield _tool(table, row)


def _tool(table: CsvTable, row: int) -> TabledTool:
    cells = {
        name: _cell(table, row, k)
        for k, name in enumerate(table.header)
        if name not in _PASSED and table.text(row, k).lower() not in ("", "nan")
    }
    number = cells.pop("number", None)
    if number is None or number.value != int(number.value) or not number.value >= 0:
        at = table.at(row, table.header.index("number"))
        raise refused("the row has no T number", at, "a T number is a whole number from 0")
    length = cells.pop("length_mm", None)
    return TabledTool(number=int(number.value), at=table.at(row), keys=cells, length=length)


def _cell(table: CsvTable, row: int, column: int) -> Node:
    at, name = table.at(row, column), table.header[column]
    if name in _WORDS:
        return Node(table.text(row, column), at)
    value = table.value(row, column)
    return Node(int(value) if name in _WHOLE and value == int(value) else value, at)
