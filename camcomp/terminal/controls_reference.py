"""Table of statements per controller: read, or refused with a rule id.

Every cell of the table is the result of reading a short program in that dialect: `read`, or the rule id of the refusal.
Sources of the programs: LinuxCNC 2.9 user manual, Fanuc 30i operator's manual, Siemens 840D fundamentals, Grbl 1.1 wiki.
"""

from __future__ import annotations

from collections.abc import Iterator

from camcomp.gcode.codes import GROUPS, REFUSED, code_name
from camcomp.gcode.dialect import Dialect
from camcomp.gcode.interpret import read_program
from camcomp.gcode.setup import Setup
from camcomp.ground import shelf
from camcomp.ground.errors import ProgramError
from camcomp.ground.records import dataclass, field

CONTROLS = {"rs274": "LinuxCNC, RS274", "fanuc": "Fanuc, Haas, Mazak EIA", "sinumerik": "Sinumerik", "grbl": "Grbl"}
READ, NOT_THERE = "read", "-"
_START = "G90\nG17\nG94\nG0 X0 Y0 Z5\nF600\n"


@dataclass(frozen=True)
class ProbedStatement:
    """A statement of NC programs: a text for all dialects, other texts for some; None: the dialect has no such statement."""

    title: str
    text: str
    other: dict[str, str | None] = field(default_factory=dict)
    setup: Setup = field(default_factory=Setup)
    first_screen: bool = False  # also in the table of the README

    def result(self, dialect: str) -> str:
        """`read`, the rule id of the refusal, or `-` for a controller without such a statement."""
        text = self.other.get(dialect, self.text)
        if text is None:
            return NOT_THERE
        program = text.removeprefix("!") if text.startswith("!") else f"{_START}{text}\nM30\n"
        try:
            read_program(program.encode(), name="<statement>", dialect=dialect, setup=self.setup)
        except ProgramError as error:
            return error.rule
        return READ


STATEMENTS = (
    ProbedStatement("lines and arcs, G0 to G3, with I J K", "G1 X10\nG2 X20 Y0 I5 J0", first_screen=True),
    ProbedStatement("arcs by radius", "G2 X10 Y0 R5", {"sinumerik": "G2 X10 Y0 CR=5"}, first_screen=True),
    ProbedStatement("helices", "G2 X10 Y0 Z3 I5 J0"),
    ProbedStatement("several turns of an arc", "G2 X10 Y0 Z3 I5 J0 P2",
              {"sinumerik": "G2 X10 Y0 Z3 I5 J0 TURN=2", "fanuc": None, "grbl": None}),
    ProbedStatement("planes, inches, incremental", "G18\nG20\nG91 G1 X1", {"sinumerik": "G18\nG70\nG91 G1 X1"}),
    ProbedStatement("feed per minute, inverse time", "G93 G1 X10 F60"),
    ProbedStatement("feed per revolution", "S1000 M3\nG95 G1 X10 F0.1", {"grbl": None}),
    ProbedStatement("dwell", "G4 P1\nG1 X10", {"sinumerik": "G4 F1\nG1 X10"}),
    ProbedStatement("work offsets G54 to G59", "G55\nG1 X10", {"sinumerik": "G55\nG1 X10"}, first_screen=True),
    ProbedStatement("further work offsets", "G59.3\nG1 X10",
              {"fanuc": "G54.1 P3\nG1 X10", "sinumerik": "G505\nG1 X10", "grbl": None}),
    ProbedStatement("offsets set by the program", "G10 L2 P2 X5 Y0 Z0\nG55\nG1 X10", {"sinumerik": None}),
    ProbedStatement("local zero G52, G92; TRANS", "G92 X5 Y0 Z5\nG1 X10", {"sinumerik": "TRANS X5\nG1 X10"}),
    ProbedStatement("tool length from the tool table", "T1 M6\nG43 H1\nG1 X10",
              {"sinumerik": "T1 D1 M6\nG1 X10", "grbl": "G43.1 Z5\nG1 X10"}, setup=Setup(tools={1: 50.0}), first_screen=True),
    ProbedStatement("machine coordinates, G53", "G53 G0 X0 Y0 Z0\nG1 X10"),
    ProbedStatement("reference points, G28 and G30; G74, G75", "G28 Z0\nG1 X10", {"sinumerik": "G74 Z0\nG1 X10"}),
    ProbedStatement("drilling cycles G81 to G89", "G81 X10 Y0 Z-5 R2", {"sinumerik": "MCALL CYCLE81(5,0,2,-5)\nX10", "grbl": None}, first_screen=True),
    ProbedStatement("peck drilling G73, G83", "G83 X10 Y0 Z-5 R2 Q1", {"sinumerik": "MCALL CYCLE83(5,0,2,-5)\nX10", "grbl": None}),
    ProbedStatement("tapping G84", "S500 M3\nG84 X10 Y0 Z-5 R2", {"sinumerik": None, "grbl": None}),
    ProbedStatement("subprograms in the same file", "!o100 sub\nG1 X10 F600\no100 endsub\nG0 X0 Y0 Z5\no100 call\nM2\n",
              {"fanuc": "!O1\nG0 X0 Y0 Z5\nM98 P2\nM30\nO2\nG1 X10 F600\nM99\n", "sinumerik": "L100", "grbl": None}, first_screen=True),
    ProbedStatement("subprograms in other files", "o<other> call", {"fanuc": "M98 P4711", "sinumerik": "EXTERN OTHER\nOTHER", "grbl": None}),
    ProbedStatement("parameters and expressions", "#1=5\nG1 X[#1*2]", {"sinumerik": "R1=5\nG1 X=R1*2", "grbl": None}, first_screen=True),
    ProbedStatement("loops", "o1 repeat [2]\nG91 G1 X1\no1 endrepeat",
              {"fanuc": "#1=0\nWHILE [#1 LT 2] DO1\nG91 G1 X1\n#1=#1+1\nEND1", "sinumerik": "REPEAT\nG91 G1 X1\nUNTIL R1>1", "grbl": None}, first_screen=True),
    ProbedStatement("jumps", "o1 if [1 GT 0]\nG1 X1\no1 endif",
              {"fanuc": "IF [1 GT 0] GOTO 10\nG1 X5\nN10 G1 X1", "sinumerik": "GOTOF END\nG1 X5\nEND: G1 X1", "grbl": None}, first_screen=True),
    ProbedStatement("exact stop and continuous path, G61, G64", "G61\nG1 X10\nG64", {"sinumerik": "G60\nG1 X10\nG64"}, first_screen=True),
    ProbedStatement("path tolerance of G64", "G64 P0.01\nG1 X10", {"fanuc": None, "sinumerik": "G642\nG1 X10", "grbl": None}),
    ProbedStatement("rotary axes that position a table", "G0 A90\nG1 X10", {"sinumerik": "G0 A90\nG1 X10"}, setup=Setup(table_axes=frozenset("A")), first_screen=True),
    ProbedStatement("rotary axes while X, Y, Z move", "G1 X10 A90", setup=Setup(table_axes=frozenset("A")), first_screen=True),
    ProbedStatement("cutter radius compensation G41, G42", "G41 D1\nG1 X10", {"sinumerik": "G41\nG1 X10"}, first_screen=True),
    ProbedStatement("tool centre point control G43.4; TRAORI", "G43.4 H1\nG1 X10", {"sinumerik": "TRAORI\nG1 X10", "rs274": None, "grbl": None}, first_screen=True),
    ProbedStatement("rotated coordinates, G68, G10 R; ROT", "G68 X0 Y0 R30\nG1 X10",
              {"rs274": "G10 L2 P1 R30\nG1 X10", "sinumerik": "ROT RPL=30\nG1 X10", "grbl": None}, first_screen=True),
    ProbedStatement("scaling, mirroring G51; SCALE", "G51 X0 Y0 Z0 P2\nG1 X10", {"sinumerik": "SCALE X2\nG1 X10", "rs274": None, "grbl": None}, first_screen=True),
    ProbedStatement("polar coordinates G16; G111", "G16\nG1 X10 Y30", {"sinumerik": "G111 X0 Y0\nG1 AP=30 RP=10", "rs274": "G1 @10 ^30", "grbl": None}),
    ProbedStatement("splines", "G5 X10 Y0 I5 J5 P5 Q5", {"fanuc": "G6.2 X10", "sinumerik": "BSPLINE\nG1 X10", "grbl": None}, first_screen=True),
    ProbedStatement("threading, rigid tapping G33", "S500 M3\nG33 Z-5 K1", {"grbl": None}, first_screen=True),
    ProbedStatement("probing G31, G38", "G38.2 Z-5", {"fanuc": "G31 Z-5", "sinumerik": "MEAS=1 G1 X10"}, first_screen=True),
)  # fmt: skip


def statement_rows() -> list[tuple[str, ...]]:
    """Title and one result per controller, for every statement."""
    return [(each.title, *(each.result(dialect) for dialect in CONTROLS)) for each in STATEMENTS]


def first_rows() -> list[tuple[str, ...]]:
    """Rows of the statements that the README shows."""
    return [row for row, each in zip(statement_rows(), STATEMENTS, strict=True) if each.first_screen]


def code_rows() -> Iterator[tuple[str, ...]]:
    """Every G code of any dialect, with its treatment for each controller: read, passed on, refused, unknown."""
    dialects = [_record(name) for name in CONTROLS]
    codes = {*GROUPS, *REFUSED, *(code for each in dialects for code in (*each.more, *each.passed))}
    for code in sorted(codes):
        yield (f"`{code_name(code)}`", *(_fate(each, code) for each in dialects))


def _fate(dialect: Dialect, code: int) -> str:
    if code in dialect.passed:
        return "passed on"
    if code in dialect.refused:
        return dialect.refused[code][0]
    return READ if code in dialect.groups else "CC106"


def _record(name: str) -> Dialect:
    member = shelf.load("dialects", name)
    record: Dialect = getattr(member, "DIALECT", member)
    return record
