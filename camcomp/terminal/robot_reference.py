"""Which statements of robot languages are read, and which are refused?

Every cell is the result of reading a short program, as in `controls_reference`. Sources: KUKA System Software 8.3, operating and
programming instructions; ABB, RAPID technical reference manual; Fanuc, R-30iB operator's manual.
"""

from camcomp.gcode.robot_frames import IDENTITY, RobotFrames
from camcomp.gcode.setup import Setup
from camcomp.terminal.controls_reference import ProbedStatement

ROBOT_CONTROLS = {"krl": "KUKA KRL", "rapid": "ABB RAPID", "fanuc_ls": "Fanuc LS"}
_SETUP = Setup(orients=True, frames=lambda: RobotFrames(bases={1: IDENTITY}, tools={1: IDENTITY}))


def _krl(text: str) -> str:
    return f"!DEF p()\n$VEL.CP=0.02\nPTP {{X 0,Y 0,Z 5,A 0,B 0,C 0}}\n{text}\nEND\n"


def _target(x: int, y: int = 0, z: int = 5, external: str = "9E9") -> str:
    return f"[[{x},{y},{z}],[1,0,0,0],[0,0,0,0],[{external},9E9,9E9,9E9,9E9,9E9]]"


def _rapid(text: str) -> str:
    data = (
        f"CONST robtarget p1:={_target(9)};\nPERS tooldata mill:=[TRUE,[[0,0,9],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];\n"
        'PERS wobjdata table:=[FALSE,TRUE,"",[[1,2,3],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];'
    )
    return f"!MODULE m\n{data}\nPROC main()\nMoveJ {_target(0)},v50,fine,tool0;\n{text}\nENDPROC\nENDMODULE\n"


def _move(target: str, kind: str = "MoveL", frames: str = "tool0") -> str:
    return f"{kind} {target},v20,z1,{frames};"


def _ls(text: str) -> str:
    places = [(0, 0, 5), (10, 0, 5), (5, 5, 5)]
    rows = [
        f"P[{k + 1}]{{\n   GP1:\n\tUF : F, UT : F,\n\tX = {x} mm, Y = {y} mm, Z = {z} mm,\n\tW = 0 deg, P = 0 deg, R = 0 deg\n}};"
        for k, (x, y, z) in enumerate(places)
    ]
    return "!/PROG P\n/MN\n  1:J P[1] 50% FINE ;\n" + text + "\n/POS\n" + "\n".join(rows) + "\n/END\n"


def _probe(title: str, krl: str | None, rapid: str | None, ls: str | None = None) -> ProbedStatement:
    texts = {
        "fanuc_ls": None if ls is None else _ls(ls),
        "krl": None if krl is None else _krl(krl),
        "rapid": None if rapid is None else _rapid(rapid),
    }
    return ProbedStatement(title, "", texts, setup=_SETUP)


ROBOT_STATEMENTS = (
    _probe("lines", "LIN {X 10,A 2} C_DIS", _move(_target(10)), "  2:L P[2] 20mm/sec CNT10 ;"),
    _probe("missing components keep their value", "LIN {X 10}", None),
    _probe("circles by an auxiliary point", "CIRC {X 5,Y 5},{X 10,Y 0}", _move(f"{_target(5, 5)},{_target(10)}", "MoveC"), "  2:C P[3]\n   :  P[2] 20mm/sec FINE ;"),
    _probe("circles with a sweep, CA", "CIRC {X 5,Y 5},{X 10,Y 0},CA 360", None),
    _probe("joint angles", "PTP {A1 0,A2 -90,A3 90,A4 0,A5 40,A6 0,E1 0}",
           "MoveAbsJ [[0,0,0,0,40,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v50,fine,tool0;"),
    _probe("bases and tools as numbers", "$BASE={X 1,Y 2,Z 3,A 0,B 0,C 0}\nLIN {X 1,Y 0,Z 0,A 0,B 0,C 0}",
           _move(_target(1), frames="mill\\WObj:=table")),
    _probe("bases and tools of the machine file", "$BASE=BASE_DATA[1]\nLIN {X 1,Y 0,Z 0,A 0,B 0,C 0}", None, "  2:  UFRAME_NUM=1 ;\n  3:L P[2] 20mm/sec FINE ;"),
    _probe("tools and work objects declared elsewhere", None, _move(_target(1), frames="other")),
    _probe("outputs, waits", "$OUT[1]=TRUE\nWAIT SEC 1\nLIN {X 1}", f"SetDO do1,1;\nWaitTime 1;\n{_move(_target(1))}", "  2:  DO[1]=ON ;\n  3:  WAIT   1.00(sec) ;\n  4:L P[2] 20mm/sec FINE ;"),
    _probe("calls of other routines, passed with a warning", "SPINDLE_ON()\nLIN {X 1}", f"SpindleOn;\n{_move(_target(1))}", "  2:  CALL SPINDLE ;\n  3:L P[2] 20mm/sec FINE ;"),
    _probe("external axes that stand during cuts", "LIN {X 1,E1 5}\nLIN {X 2,E1 5}", _move(_target(1))),
    _probe("external axes that move during cuts", "LIN {X 1,E1 5}\nLIN {X 2,E1 6}",
           f"{_move(_target(1))}\n{_move(_target(2, external='6'))}"),
    _probe("positions declared in the module", None, _move("p1"), "  2:L P[2] 20mm/sec FINE ;"),
    _probe("positions declared elsewhere", "LIN P1", _move("p2"), "  2:L PR[1] 20mm/sec FINE ;"),
    _probe("variables", "I=5", "i:=5;", "  2:  R[1]=5 ;"),
    _probe("relative moves", "LIN_REL {X 1}", _move("Offs(p1,1,0,0)"), "  2:L P[2] 20mm/sec FINE INC ;"),
    _probe("splines", "SLIN {X 1}", None),
    _probe("loops, branches, jumps", "FOR I=1 TO 3", "FOR i FROM 1 TO 3 DO", "  2:  FOR R[1]=1 TO 3 ;"),
    _probe("switching on the path", "TRIGGER WHEN DISTANCE=0 DELAY=0 DO $OUT[1]=TRUE", "TriggL p1,v20,t1,z1,tool0;", "  2:L P[2] 20mm/sec FINE TA .10sec,DO[1]=ON ;"),
    _probe("the tool held still, the part moved", "$IPO_MODE=#TCP", None),
    _probe("orientation by joints, along the path", "$ORI_TYPE=#JOINT", "SingArea \\Wrist;", "  2:L P[2] 20mm/sec FINE Wjnt ;"),
)  # fmt: skip


def robot_rows() -> list[tuple[str, ...]]:
    """Title and one result per language, for every statement."""
    return [(each.title, *(each.result(dialect) for dialect in ROBOT_CONTROLS)) for each in ROBOT_STATEMENTS]
