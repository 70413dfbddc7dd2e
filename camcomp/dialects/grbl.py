"""Grbl 1.1 and related firmware: RS274 without expressions, cycles, tool table and turns of arcs."""

from camcomp.gcode.dialect import Dialect

DIALECT = Dialect(
    name="grbl",
    title="Grbl 1.1",
    marks=((r"\bgrbl\b", 8), (r"^[ \t]*+\$[A-Z]", 6), (r"universal ?gcode ?sender|carbide|easel", 3)),
    without=frozenset((520, 730, 740, 810, 820, 830, 840, 850, 860, 870, 880, 890, 950, 591, 592, 593, 922, 923, 901)),
    initial_motion=0,
    turns=False,
    writes_turns=False,
    idle_letters="DNT",
)
