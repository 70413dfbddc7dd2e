"""Two tables of one program side by side: how far apart are they, column by column, and where most?

Rows are aligned by source line and path length, by time, or one to one; between two rows of B its values are taken to
run straight. Where values jump (several rows at one place) the rows of A and B are paired in their order.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import pairwise

import numpy as np

from camcomp.ground.csv_table import TableRules, read_csv
from camcomp.ground.datatypes import Floats, Ints
from camcomp.ground.errors import ConfigError
from camcomp.ground.files import display_name, read_bytes
from camcomp.ground.result import Result, Size

Columns = Mapping[str, Floats]
KEYS = ("line", "s_mm", "t_s")
SAME = 2e-6  # mm or s: places that a table with six decimals cannot tell apart


class Difference(Result):
    """A minus B of one column, or the distance of two points, over the rows that have both.

    line and place: where the difference is largest; a and b the values there (NaN for distances).
    """

    column: str
    rows: int
    most: float
    rms: float
    mean: float
    line: int | None
    place: Size
    a: Size
    b: Size


class Comparison(Result):
    """by: s_mm, t_s or row. rows: those of A; of these, unmatched have no counterpart in B and interpolated lie between two.

    Between two rows of B a curved column, e.g. an actuator's along a straight line of the tip, shows the chord's error.
    """

    by: str
    rows: int
    unmatched: int
    interpolated: int
    differences: list[Difference]
    only_a: list[str]
    only_b: list[str]


def read_columns(path: str) -> Columns:
    """Columns (n,) by name; empty cells are NaN. Raises ConfigError CC450, FileError CC500."""
    table = read_csv(read_bytes(path), display_name(path), TableRules("CC450", "CC450", "CC450"))
    table.refuse_twice()
    for i, row in enumerate(table.rows):
        if len(row) < len(table.header):
            message = f"{len(row)} cells under {len(table.header)} column names"
            raise ConfigError("CC450", message, at=table.at(i))
    return dict(zip(table.header, table.values().T, strict=True))


def default_key(a: Columns, b: Columns) -> str:
    """s_mm where both tables have it, else t_s, else row."""
    return next((key for key in ("s_mm", "t_s") if key in a and key in b), "row")


def compare(a: Columns, b: Columns, by: str | None = None) -> Comparison:
    """Every column that both tables have. Raises ValueError when they cannot be aligned."""
    by = by or default_key(a, b)
    if by != "row" and not (by in a and by in b):
        raise ValueError(f"column {by} is not in both tables")
    names = [name for name in a if name in b and name not in KEYS]
    if not names:
        raise ValueError("the tables have no column in common")
    n = len(next(iter(a.values())))
    other = {name: np.full(n, np.nan) for name in names}
    matched = np.zeros(n, np.bool_)
    between = 0
    for rows_a, rows_b in _blocks(a, b, by):
        left, right, weight, found = _pair(a, b, by, rows_a, rows_b)
        matched[rows_a[found]] = True
        between += int((found & (weight > 0.0) & (weight < 1.0)).sum())
        for name in names:
            values = b[name]
            low, high = values[left], values[right]
            # Where the weight is all on one side the other may be empty.
            mixed = np.where(weight <= 0.0, low, np.where(weight >= 1.0, high, low + weight * (high - low)))
            other[name][rows_a[found]] = mixed[found]
    place = a[by] if by != "row" else np.arange(n, dtype=float)
    line = a.get("line")
    out = [
        _difference(column=name, gap=a[name] - other[name], line=line, place=place, a=a[name], b=other[name])
        for name in names
    ]
    for prefix in ("", "c"):
        trio = [f"{axis}{prefix}_mm" for axis in "xyz"]
        if all(name in names for name in trio):
            gap = np.sqrt(sum((a[name] - other[name]) ** 2 for name in trio))
            empty = np.full(n, np.nan)
            out.append(
                _difference(column=f"distance({','.join(trio)})", gap=gap, line=line, place=place, a=empty, b=empty)
            )
    only_a, only_b = ([each for each in one if each not in two] for one, two in ((a, b), (b, a)))
    return Comparison(
        by=by, rows=n, unmatched=int((~matched).sum()), interpolated=between, differences=out, only_a=only_a,
        only_b=only_b,
    )  # fmt: skip


def _difference(column: str, gap: Floats, line: Floats | None, place: Floats, a: Floats, b: Floats) -> Difference:
    known = np.flatnonzero(np.isfinite(gap))
    if not len(known):
        return Difference(
            column=column, rows=0, most=0.0, rms=0.0, mean=0.0, line=None, place=np.nan, a=np.nan, b=np.nan
        )
    values = gap[known]
    at = int(known[np.argmax(np.abs(values))])
    number = int(line[at]) if line is not None and np.isfinite(line[at]) else None
    return Difference(
        column=column, rows=len(known), most=float(np.abs(values).max()), rms=float(np.sqrt(np.mean(values**2))),
        mean=float(values.mean()), line=number, place=float(place[at]), a=float(a[at]), b=float(b[at]),
    )  # fmt: skip


def _blocks(a: Columns, b: Columns, by: str) -> Iterator[tuple[Ints, Ints]]:
    """Rows of A and B that belong together: runs of one source line along a path, everything otherwise.

    Raises ValueError when the tables run through different source lines.
    """
    n, m = len(next(iter(a.values()))), len(next(iter(b.values())))
    if by != "s_mm" or not ("line" in a and "line" in b):
        yield np.arange(n), np.arange(m)
        return
    runs_a, runs_b = _runs(a["line"]), _runs(b["line"])
    lines_a = [int(a["line"][first]) for first, _ in runs_a]
    lines_b = [int(b["line"][first]) for first, _ in runs_b]
    if lines_a != lines_b:
        k = next(
            (k for k, (p, q) in enumerate(zip(lines_a, lines_b, strict=False)) if p != q),
            min(len(lines_a), len(lines_b)),
        )
        told = [str(lines[k]) if k < len(lines) else "the end" for lines in (lines_a, lines_b)]
        raise ValueError(
            f"the tables are not of one program: after {k} runs of lines A has line {told[0]}, B {told[1]}"
        )
    for (first_a, last_a), (first_b, last_b) in zip(runs_a, runs_b, strict=True):
        # The move into a line starts where the line before it ended.
        begin = first_b - 1 if first_b and b["s_mm"][first_b] > b["s_mm"][first_b - 1] + SAME else first_b
        yield np.arange(first_a, last_a), np.arange(begin, last_b)


def _runs(line: Floats) -> list[tuple[int, int]]:
    cuts = np.flatnonzero(np.diff(line) != 0) + 1
    bounds = [0, *cuts.tolist(), len(line)]
    return list(pairwise(bounds))


def _pair(a: Columns, b: Columns, by: str, rows_a: Ints, rows_b: Ints) -> tuple[Ints, Ints, Floats, np.ndarray]:
    """For each row of A the rows of B around it, the weight of the second, and whether there are any."""
    if by == "row":
        index = np.minimum(rows_a, len(rows_b) - 1)
        return index, index, np.zeros(len(rows_a)), rows_a < len(rows_b)
    key_a, key_b = a[by][rows_a], b[by][rows_b]
    if (np.diff(key_b) < -SAME).any() or not (np.isfinite(key_b).all() and np.isfinite(key_a).all()):
        raise ValueError(f"column {by} has gaps or runs backwards")
    after = np.searchsorted(key_b, key_a - SAME, "left")  # first row of B here or later
    last = np.searchsorted(key_b, key_a + SAME, "right") - 1  # last row of B here
    here = last >= after
    # Several rows of A at one place meet those of B in their order.
    first_here = np.searchsorted(key_a, key_a - SAME, "left")
    nth = np.minimum(after + np.arange(len(key_a)) - first_here, last)
    high = np.clip(np.where(here, nth, after), 0, len(key_b) - 1)
    low = np.where(here, high, np.clip(after - 1, 0, len(key_b) - 1))
    span = key_b[high] - key_b[low]
    weight = np.divide(key_a - key_b[low], span, out=np.zeros(len(key_a)), where=span > 0.0)
    inside = here | ((after > 0) & (after < len(key_b)))
    return rows_b[low], rows_b[high], weight, inside
