"""A measured force along a path, read from CSV text: one header row, plain numbers, each column named with its unit.

Columns used: `s_mm` (path length) or `line` (source line), and three forces on the tool, either `Fr_N, Ft_N, Fz_N` in
the path frame or `fx_N, fy_N, fz_N` in the machine frame. Other columns are ignored, so that a log or a joint table
can be used directly. With `s_mm` rows are in path order and may repeat a position, where the force jumps: the first row
holds for the motion that ends there, the last for the one that starts, and a `line` column distinguishes them.
With `line` alone the rows of a line are averaged. Rows without any force are skipped.
"""

from difflib import get_close_matches

import numpy as np

from camcomp.ground.csv_table import CsvTable, TableRules, read_csv
from camcomp.ground.datatypes import Bools, Floats, Ints
from camcomp.ground.errors import CamcompError, ConfigError, raise_all
from camcomp.ground.records import dataclass

PATH_COLUMNS = ("Fr_N", "Ft_N", "Fz_N")
MACHINE_COLUMNS = ("fx_N", "fy_N", "fz_N")

# Tolerance of equal path lengths: lengths of path and table are both rounded sums.
SAME_PLACE_MM = 1e-3


@dataclass(frozen=True, eq=False)
class ForceTable:
    """k rows; `key` is a path length in mm (`by_length`) or a source line, ascending."""

    key: Floats  # (k,)
    force: Floats  # (k, 3) N
    by_length: bool
    in_machine: bool  # frame of `force`: machine axes, or the path frame
    line: Floats | None = None  # (k,) source line of each row of a table by path length


def parse_table(text: str, name: str) -> ForceTable:
    """The table in `text`; `name` is the file's name for messages. Raises ConfigError CC260 to CC263, all at once."""
    table = read_csv(text, name, TableRules(table="CC260", column="CC261", cell="CC262"))
    table.refuse_twice()
    head = table.header
    key_name = next((each for each in ("s_mm", "line") if each in head), None)
    names = next((each for each in (PATH_COLUMNS, MACHINE_COLUMNS) if set(each) <= set(head)), None)
    if key_name is None:
        raise ConfigError("CC261", "no column says where: s_mm or line", at=table.at(-1))
    if names is None:
        raise _no_force(table)
    also = ("line",) if key_name == "s_mm" and "line" in head else ()
    columns = [head.index(each) for each in (key_name, *names, *also)]
    errors: list[CamcompError] = []
    found: list[list[float]] = []
    for row in range(len(table.rows)):
        if any(table.text(row, column) for column in columns[1:4]):
            found.append([table.required(row, column, errors) for column in columns])
            if key_name == "s_mm" and len(found) > 1 and found[-1][0] < found[-2][0]:
                text = f"s_mm falls from {found[-2][0]:g} to {found[-1][0]:g}"
                errors.append(ConfigError("CC263", text, at=table.at(row, columns[0])))
    raise_all(errors)
    if not found:
        raise ConfigError("CC260", "no row of the force table holds a force", at=table.at(-1))
    values = np.array(found)
    key, force = values[:, 0], values[:, 1:4]
    if key_name == "line":
        key, rows = np.unique(key, return_inverse=True)
        total = np.zeros((key.size, 3))
        np.add.at(total, rows, force)
        force = total / np.bincount(rows)[:, None]
    return ForceTable(key, force, key_name == "s_mm", names is MACHINE_COLUMNS, values[:, 4] if also else None)


def _no_force(table: CsvTable) -> ConfigError:
    wanted = (*PATH_COLUMNS, *MACHINE_COLUMNS)
    for column, name in enumerate(table.header):
        close = get_close_matches(name, wanted, n=1)
        if close and name not in wanted:
            text = f"column '{name}' is none of {', '.join(wanted)}"
            return ConfigError("CC261", text, at=table.at(-1, column), hint=f"did you mean '{close[0]}'?")
    text = "the three force columns Fr_N, Ft_N, Fz_N or fx_N, fy_N, fz_N are not all there"
    return ConfigError("CC261", text, at=table.at(-1))


def look_up(table: ForceTable, arc_length: Floats, line: Ints, ends: Bools) -> Floats:
    """Force (n, 3) in N, in the table's own frame: linear between rows, or that of the source line.

    ends (n,): the point ends a motion, so that the row before a jump holds. Raises ConfigError CC264 for a point outside
    the table.
    """
    if table.by_length:
        outside = (arc_length < table.key[0] - SAME_PLACE_MM) | (arc_length > table.key[-1] + SAME_PLACE_MM)
        value = _along(table, arc_length, line, ends)
        covered = f"s_mm = {table.key[0]:g} to {table.key[-1]:g}"
    else:
        rows = np.clip(np.searchsorted(table.key, line), 0, table.key.size - 1)
        outside = table.key[rows] != line
        value = table.force[rows]
        covered = f"{table.key.size} lines from {table.key[0]:g} to {table.key[-1]:g}"
    if outside.any():
        first = int(np.argmax(outside))
        text = f"program line {line[first]}, s_mm = {arc_length[first]:g}: the force table does not cover this point"
        raise ConfigError("CC264", f"{text}; it covers {covered}")
    return value


def _along(table: ForceTable, s: Floats, line: Ints, ends: Bools) -> Floats:
    key, force, last = table.key, table.force, table.key.size - 1
    high = np.clip(np.searchsorted(key, s, side="right"), 0, last)
    low = np.maximum(high - 1, 0)
    step = key[high] - key[low]
    share = np.clip((s - key[low]) / np.where(step > 0, step, 1.0), 0.0, 1.0)[:, None]
    between = force[low] + share * (force[high] - force[low])
    # A jump is one path length with several rows, from `first` to `final`.
    first = np.clip(np.searchsorted(key, s - SAME_PLACE_MM, side="left"), 0, last)
    final = np.maximum(np.searchsorted(key, s + SAME_PLACE_MM, side="right") - 1, 0)
    jump = (final > first) & (key[first] == key[final])
    before = ends
    if table.line is not None:
        own_first, own_final = table.line[first] == line, table.line[final] == line
        before = np.where(own_first == own_final, ends, own_first)
    at_jump = np.where(before[:, None], force[first], force[final])
    return np.where(jump[:, None], at_jump, between)
