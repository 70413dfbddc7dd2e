"""How long a compensation takes by the length of the program: processor time of whole processes, start-up included."""

from __future__ import annotations

import math
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from camcomp.ground.files import shipped
from tests.benchmarks.programs import write
from tests.benchmarks.spent import spent
from tests.validation import store

LENGTHS = (10, 30, 100, 300, 1000, 3000, 5000, 10_000, 25_000, 60_000, 100_000, 300_000, 1_000_000, 10_000_000)
READ_WHOLE = 100_000  # lines up to which pygcode reads the program; the time of a longer one is a multiple
MACHINE = ("--config", str(shipped("config/orthoglide-1deg.yaml")))
PYGCODE = """
import sys
from pygcode import Line, Machine
machine = Machine()
for text in open(sys.argv[1]):
    if not text.startswith("%"):
        machine.process_block(Line(text).block)
"""
PAGE = """# Speed

Processor time of `camcomp compensate` by the length of the program: straight moves of 0.12 mm in a pocketed groove,
`config/orthoglide-1deg.yaml`, start-up included, compiled code, interpolated cubes and the checked machine file on disk. Each
program was also read by pygcode, which does nothing else with it, in the same run; a program of more than {most} lines counts as a multiple of one of
that length. Code `{commit}` of {date}; `python -m tests.validation run speed` measures anew.

| lines | processor time | per line | memory | pygcode reads it in | times faster |
|---|---|---|---|---|---|
{rows}

![time per line](speed.svg)
"""
WIDE, HIGH, LEFT, TOP = 640, 320, 70, 20
Row = dict[str, float]


def measure(times: int) -> None:
    """Measure every length, the least of so many times, and store the rows."""
    result, rows = store.opened("speed", None), []
    with TemporaryDirectory() as folder:
        program, reader, out = (Path(folder, name) for name in ("p.nc", "reader.py", "out.nc"))
        reader.write_text(PYGCODE)
        for lines in LENGTHS:
            write(str(program), lines)
            words = ("-m", "camcomp", "compensate", program, "--quiet", *MACHINE, "-o", out)
            if lines == LENGTHS[0]:
                spent(*words)
            repeats = times if lines <= READ_WHOLE else 1
            own = min((spent(*words) for _ in range(repeats)), key=lambda each: each[1])
            if lines <= READ_WHOLE:
                per_line = min(float(spent(reader, program)[1]) for _ in range(repeats)) / lines
            rows.append(
                {"lines": lines, "seconds": float(own[1]), "memory_mb": float(own[2]), "pygcode_s": per_line * lines}
            )
            store.save({**result, "rows": rows})


def page(result: dict[str, Any]) -> str:
    """The page of a result."""
    least = min(
        each["memory_mb"] for each in result["rows"]
    )  # that of the measuring process, which a child begins with
    rows = [
        f"| {each['lines']:,} | {each['seconds']:.2f} s | {_three_digits(_per_line(each))} µs | {_memory(each, least)} | "
        f"{_three_digits(each['pygcode_s'])} s | {each['pygcode_s'] / each['seconds']:.2f} |".replace(",", " ")
        for each in result["rows"]
    ]
    return PAGE.format(
        commit=result["commit"],
        date=result["date"][:10],
        rows="\n".join(rows),
        most=f"{READ_WHOLE:,}".replace(",", " "),
    )


def _three_digits(value: float) -> str:
    return f"{value:,.0f}" if value >= 100.0 else f"{value:.3g}"


def _memory(row: Row, least: float) -> str:
    return f"{'up to ' if row['memory_mb'] <= least else ''}{row['memory_mb']:.0f} MB"


def _per_line(row: Row) -> float:
    return 1e6 * row["seconds"] / row["lines"]


def plot(result: dict[str, Any]) -> str:
    """An SVG of the time per line over the number of lines, both logarithmic."""
    rows = result["rows"]
    pygcode = [(each["lines"], 1e6 * each["pygcode_s"] / each["lines"]) for each in rows]
    own = [(each["lines"], _per_line(each)) for each in rows]
    low = math.floor(math.log10(min(y for _, y in own + pygcode)))
    high = math.ceil(math.log10(max(y for _, y in own + pygcode)))
    first, last = (math.log10(rows[k]["lines"]) for k in (0, -1))

    def at(lines: float, microseconds: float) -> str:
        x = LEFT + (WIDE - LEFT - 20) * (math.log10(lines) - first) / max(last - first, 1.0)
        y = TOP + (HIGH - TOP - 50) * (high - math.log10(microseconds)) / (high - low)
        return f"{x:.1f},{y:.1f}"

    out = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDE} {HIGH}" font-family="sans-serif" font-size="11">'
    ]
    out.append(f'<rect width="{WIDE}" height="{HIGH}" fill="white"/>')
    for decade in range(low, high + 1):
        x, y = at(rows[0]["lines"], 10.0**decade).split(",")
        out.append(f'<line x1="{x}" x2="{WIDE - 20}" y1="{y}" y2="{y}" stroke="#ccc"/>')
        out.append(f'<text x="{LEFT - 8}" y="{float(y) + 4:.1f}" text-anchor="end">{10.0**decade:g} µs</text>')
    for decade in range(math.ceil(first), math.floor(last) + 1):
        x = at(10.0**decade, 10.0**low).split(",")[0]
        out.append(f'<text x="{x}" y="{HIGH - 32}" text-anchor="middle">{10**decade:,}</text>'.replace(",", " "))
    for k, (name, colour, points) in enumerate(
        (("camcomp compensate", "#0072b2", own), ("pygcode reads", "#d55e00", pygcode))
    ):
        out.append(
            f'<polyline fill="none" stroke="{colour}" stroke-width="2" points="{" ".join(at(*each) for each in points)}"/>'
        )
        out.append(f'<text x="{LEFT + 200 * k}" y="{HIGH - 10}" fill="{colour}">{name}, per line</text>')
    return "\n".join([*out, "</svg>", ""])
