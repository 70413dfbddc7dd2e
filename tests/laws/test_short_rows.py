"""Arrays of points have many rows of three numbers; numpy is slow along such rows, and with lists of them.

One call of `values.max(axis=1)` costs a long program as much as thirty sums of two columns. The modules that every line
of a program goes through have `sizes`, `largest` and `shifted` of ground/vectors.py for that.
"""

import re

from tests.commandline import ROOT

EVERY_LINE = (
    "compensation/long/answers.py",
    "compensation/program/compensate.py",
    "compensation/program/corrected_rows.py",
    "compensation/program/judged_points.py",
    "compensation/program/moves.py",
    "compensation/program/totals.py",
    "compensation/program/under_control.py",
    "gcode/linear_writer.py",
    "model/cutting/track.py",
    "model/job.py",
    "model/trajectory/plan.py",
    "model/trajectory/segments.py",
)
ALONG_ROWS = re.compile(r"\.(?:max|min|any|all|sum)\(axis=-?1\b|np\.linalg\.norm\(.*axis=1")


def test_nothing_that_every_line_goes_through_is_reduced_along_short_rows():
    found = []
    for name in EVERY_LINE:
        lines = (ROOT / "camcomp" / name).read_text().splitlines()
        found += [f"{name}:{n}: {line.strip()}" for n, line in enumerate(lines, 1) if ALONG_ROWS.search(line)]
    assert found == []
