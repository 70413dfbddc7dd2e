"""Which statements of robot languages are read, and which are refused?

Every cell is the result of reading a short program, as in `controls_reference`. Sources: KUKA System Software 8.3, operating and
programming instructions; ABB, RAPID technical reference manual; Fanuc, R-30iB operator's manual.
"""

from camcomp.gcode.robot_frames import IDENTITY, RobotFrames
from camcomp.gcode.setup import Setup
from camcomp.terminal.controls_reference import ProbedStatement

ROBOT_CONTROLS = {"krl": "KUKA KRL"}
_SETUP = Setup(orients=True, frames=lambda: RobotFrames(bases={1: IDENTITY}, tools={1: IDENTITY}))


def _krl(text: str) -> str:
    return f"!DEF p()\n$VEL.CP=0.02\nPTP {{X 0,Y 0,Z 5,A 0,B 0,C 0}}\n{text}\nEND\n"


def _probe(title: str, krl: str) -> ProbedStatement:
    return ProbedStatement(title, "", {"krl": _krl(krl)}, setup=_SETUP)


ROBOT_STATEMENTS = (
    _probe("lines, missing components keep their value", "LIN {X 10,A 2} C_DIS"),
    _probe("circles by an auxiliary point", "CIRC {X 5,Y 5},{X 10,Y 0}"),
    _probe("circles with a sweep, CA", "CIRC {X 5,Y 5},{X 10,Y 0},CA 360"),
    _probe("joint angles", "PTP {A1 0,A2 -90,A3 90,A4 0,A5 40,A6 0,E1 0}"),
    _probe("bases and tools as numbers", "$BASE={X 1,Y 2,Z 3,A 0,B 0,C 0}\nLIN {X 1,Y 0,Z 0,A 0,B 0,C 0}"),
    _probe("bases and tools of the machine file", "$BASE=BASE_DATA[1]\nLIN {X 1,Y 0,Z 0,A 0,B 0,C 0}"),
    _probe("headers, folds, outputs, waits", ";FOLD INI\n$OUT[1]=TRUE\nWAIT SEC 1\n;ENDFOLD\nLIN {X 1}"),
    _probe("calls of other routines, passed with a warning", "SPINDLE_ON()\nLIN {X 1}"),
    _probe("external axes that stand during cuts", "LIN {X 1,E1 5}\nLIN {X 2,E1 5}"),
    _probe("external axes that move during cuts", "LIN {X 1,E1 5}\nLIN {X 2,E1 6}"),
    _probe("positions declared elsewhere", "LIN P1"),
    _probe("variables", "I=5"),
    _probe("relative moves", "LIN_REL {X 1}"),
    _probe("splines", "SLIN {X 1}"),
    _probe("loops, branches, jumps", "FOR I=1 TO 3"),
    _probe("switching on the path", "TRIGGER WHEN DISTANCE=0 DELAY=0 DO $OUT[1]=TRUE"),
    _probe("the tool held still, the part moved", "$IPO_MODE=#TCP"),
    _probe("orientation by joints, along the path", "$ORI_TYPE=#JOINT"),
)


def robot_rows() -> list[tuple[str, ...]]:
    """Title and one result per language, for every statement."""
    return [(each.title, *(each.result(dialect) for dialect in ROBOT_CONTROLS)) for each in ROBOT_STATEMENTS]
