"""Programs of Fanuc robots: read, written with the same bytes, refused where they are not clear."""

import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from camcomp.gcode.interpret import read_program
from camcomp.gcode.output import Output
from camcomp.gcode.rewrite import rewrite
from camcomp.gcode.robot_frames import CoordinateFrame, RobotFrames
from camcomp.gcode.setup import Setup
from camcomp.gcode.stamp import is_stamped, stamped_model
from camcomp.ground.datatypes import ARC, LINE, RAPID
from camcomp.ground.errors import ProgramError
from camcomp.ground.orientation import TURN, rotations_of
from tests.rewritten import written_poses

# the forms of public files: tabs, a name and group of positions, remarks, empty statements
HEAD = """/PROG  PART
/ATTR
OWNER\t\t= MNEDITOR;
COMMENT\t\t= "";
LINE_COUNT\t= 14;
TCD:  STACK_SIZE\t= 0,
      TASK_PRIORITY\t= 50;
DEFAULT_GROUP\t= 1,*,*,*,*;
/MN
   1:  UFRAME_NUM=1 ;
   2:  UTOOL_NUM=2 ;
   3:   ;
   4:J P[1] 50% FINE    ;
"""
MOVES = """   5:  !down ;
   6:  DO[1]=ON ;
   7:  WAIT   1.50(sec) ;
   8:L P[2:in] 20mm/sec CNT10    ;
   9:L P[3] 120cm/min CNT100 ACC80    ;
  10:C P[4]
    :  P[5] 20mm/sec FINE    ;
  11:L P[2:in] 20mm/sec FINE    ;
  12:L P[1] 100mm/sec FINE    ;
  13:  CALL SPINDLE_OFF ;
"""
AT = {
    1: (0, 0, 20, 180, 0, 0),
    2: (0, 0, -2, 180, 0, 1),
    3: (40, 0, -2, 178, 1, 1),
    4: (50, -10, -2, 178, 1, 1),
    5: (60, 0, -2, 178, 1, 1),
}


def position(number, values):
    name = '"in"' if number == 2 else ""
    x, y, z, w, p, r = (f"{each:.3f}" for each in values)
    return (
        f"P[{number}{':' + name if name else ''}]{{\n   GP1:\n\tUF : 1, UT : 2,\t\tCONFIG : 'N U T, 0, 0, 0',\n"
        f"\tX =\t{x}  mm,\tY = {y}  mm,\tZ = {z} mm,\n\tW = {w} deg,\tP = {p} deg,\tR = {r} deg\n}};\n"
    )


TAIL = "/POS\n" + "".join(position(*each) for each in AT.items()) + "/END\n"
BASE, TOOL = CoordinateFrame.of([1500, 20, 700], [3, 0, 0]), CoordinateFrame.of([1, 2, 250], [10, 5, 0])
FRAMES = {
    "bases": {1: BASE},
    "tools": {2: TOOL},
    "tip": np.array([1.0, 2.0, 250.0]),
    "flange": np.diag([-1.0, 1.0, -1.0]),
}


def read(text):
    setup = Setup(orients=True, frames=lambda: RobotFrames(**FRAMES))
    return read_program(text if isinstance(text, bytes) else text.encode(), name="p.ls", setup=setup)


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_what_is_not_changed_keeps_its_bytes(end):
    text = (HEAD + MOVES + TAIL).replace("\n", end).encode()
    program = read(text)
    assert program.path.kind.tolist() == [RAPID, LINE, LINE, ARC, LINE, LINE] and program.dwelt_s == 1.5
    np.testing.assert_allclose(program.path.feed[1:], [1200, 1200, 1200, 1200, 6000])
    written = rewrite(
        program, Output.same(program.path), resolution_mm=1e-4, version="1", model="0123456789abcdef"
    ).data
    lines = written.splitlines(keepends=True)
    remarks = [lines.pop(9).decode() for _ in range(4)]
    assert "camcomp" in remarks[0] and b"".join(lines) == text
    assert all(len(each.split("!")[1].split(" ;")[0]) <= 32 and each.endswith(" ;" + end) for each in remarks)
    assert is_stamped(written) and stamped_model(written) == "0123456789abcdef"
    loaded = re.sub(rb"(?m)^   :(?=  !)", b"   9:", written)  # as the control numbers them
    assert is_stamped(loaded) and stamped_model(loaded) == "0123456789abcdef"
    assert not is_stamped(written.replace(remarks[2].encode(), b""))
    assert len(read(written).path) == 6


def test_forms_of_other_writers_are_read():
    """Small letters, statements over two lines, lines that are commented out, a wait for inputs, inches."""
    wait = "   6:  $WAITTMOUT=100 ;\n   7:  WAIT DI[1:the spindle turns]=ON\n    :  TIMEOUT,LBL[1] ;\n   8:  //L P[9] 20mm/sec FINE ;\n"
    text = (HEAD + wait + MOVES + TAIL).replace("UFRAME_NUM=1", "UFRAME_NUM[GP1]=1")
    text = text.replace("L P[3] 120cm/min", "l p[3] 10inch/min")
    program = read(text)
    assert len(program.path) == 6 and program.path.feed[2] == 254.0
    lines = rewrite(program, Output.same(program.path), resolution_mm=1e-4, version="1").data.decode().splitlines()
    assert lines[:9] + lines[12:] == text.splitlines()


def test_frames_and_angles_are_those_of_scipy():
    path = read(HEAD + MOVES + TAIL).path
    base, tool = (
        Rotation.from_euler("ZYX", [3, 0, 0], degrees=True),
        Rotation.from_euler("ZYX", [10, 5, 0], degrees=True),
    )
    np.testing.assert_allclose(path.end[2], base.apply([40, 0, -2]) + [1500, 20, 700], atol=1e-9)
    target = Rotation.from_euler("xyz", [178, 1, 1], degrees=True)
    platform = base * target * tool.inv() * Rotation.from_matrix(FRAMES["flange"]).inv()
    np.testing.assert_allclose(rotations_of(TURN, path.orientation.end)[2], platform.as_matrix(), atol=1e-12)
    assert np.abs(np.linalg.norm(path.end[2:4] - path.centre[3], axis=1) - 10.0).max() < 1e-9


@pytest.mark.parametrize("seed", range(4))
def test_written_poses_read_as_what_was_wanted(seed):
    """P[1] and P[2] are used twice: their changes may not move the other use."""
    written_poses(read(HEAD + MOVES + TAIL), read, seed, turned=5e-8)


BAD = [
    ("  14:L P[9] 20mm/sec FINE ;", 14, 8, "CC144"), ("  14:L P[1] FINE ;", 14, 13, "CC110"), ("  14:L P[1] 20mm/sec ;", 14, 21, "CC144"),
    ("  14:L P[1] 20% FINE ;", 14, 13, "CC144"), ("  14:J P[1] 20mm/sec FINE ;", 14, 13, "CC144"), ("  14:L P[1] 20deg/sec FINE ;", 14, 13, "CC144"),
    ("  14:L P[1] R[1]mm/sec FINE ;", 14, 13, "CC144"), ("  14:L P[1] 20mm/sec CNTR[1] ;", 14, 22, "CC144"),
    ("  14:L P[1] 20mm/sec CR10mm ;", 14, 22, "CC144"), ("  14:L P[1] 20mm/sec FINE Offset,PR[1] ;", 14, 27, "CC144"),
    ("  14:L P[1] 20mm/sec FINE INC ;", 14, 27, "CC144"), ("  14:L P[1] 20mm/sec FINE Skip,LBL[1] ;", 14, 27, "CC144"),
    ("  14:L P[1] 20mm/sec FINE Tool_Offset,PR[2] ;", 14, 27, "CC144"), ("  14:L P[1] 20mm/sec FINE TA .10sec,DO[1]=ON ;", 14, 27, "CC144"),
    ("  14:L P[1] 20mm/sec FINE Wjnt ;", 14, 27, "CC144"), ("  14:L PR[1] 20mm/sec FINE ;", 14, 6, "CC144"),
    ("  14:L P[R[1]] 20mm/sec FINE ;", 14, 6, "CC144"), ("  14:L P[x] 20mm/sec FINE ;", 14, 6, "CC144"),
    ("  14:L P[1] 0mm/sec FINE ;", 14, 6, "CC110"), ("  14:L P[1] 20mm/sec FINE", 14, 3, "CC144"), ("  14 L P[1] 20mm/sec FINE ;", 14, 3, "CC144"),
    ("L P[1] 20mm/sec FINE ;", 14, 1, "CC144"), ("  14:A P[1] 20mm/sec FINE ;", 14, 6, "CC144"), ("  14:S P[1] 20mm/sec FINE ;", 14, 6, "CC144"),
    ("  14:C P[4] ;", 14, 6, "CC144"), ("  14:C P[4] 20mm/sec FINE ;", 14, 6, "CC144"), ("  14:C P[9]\n    :  P[5] 20mm/sec FINE ;", 14, 8, "CC144"),
    ("  14:C P[4]\n    :  P[9] 20mm/sec FINE ;", 15, 8, "CC144"), ("  14:C P[4]\n    :  P[5] FINE ;", 15, 13, "CC110"),
    ("  14:C P[1]\n    :  P[1] 20mm/sec FINE ;", 14, 6, "CC112"), ("  14:  UFRAME_NUM=7 ;", 14, 8, "CC145"), ("  14:  UTOOL_NUM=7 ;", 14, 8, "CC145"),
    ("  14:  UFRAME_NUM=R[1] ;", 14, 8, "CC144"), ("  14:  UTOOL_NUM=0 ;\n  15:L P[3:] 20mm/sec FINE ;", 15, 8, "CC145"), ("  14:L P[3]\n    :  20mm/sec FINE ;", 14, 3, "CC144"),
    ("  14:  UFRAME_NUM=0 ;\n  15:L P[3] 20mm/sec FINE ;", 15, 8, "CC145"), ("  14:  R[1]=5 ;", 14, 8, "CC144"),
    ("  14:  PR[1]=LPOS ;", 14, 8, "CC144"), ("  14:  P[1]=LPOS ;", 14, 8, "CC144"), ("  14:  JMP LBL[1] ;", 14, 8, "CC144"),
    ("  14:  IF R[1]=1,JMP LBL[1] ;", 14, 8, "CC144"), ("  14:  FOR R[1]=1 TO 3 ;", 14, 8, "CC144"), ("  14:  SELECT R[1]=1,CALL A ;", 14, 8, "CC144"),
    ("  14:  OFFSET CONDITION PR[1] ;", 14, 8, "CC144"), ("  14:  SKIP CONDITION DI[1]=ON ;", 14, 8, "CC144"),
    ("  14:  UFRAME[1]=PR[1] ;", 14, 8, "CC144"), ("  14:  Weave Sine[1] ;", 14, 8, "CC144"), ("  14:  Arc Start[1] ;", 14, 8, "CC144"),
    ("G1 X5 F100", 14, 1, "CC144"),
]  # fmt: skip


@pytest.mark.parametrize(("line", "row", "column", "rule"), BAD)
def test_malformed_programs_are_refused_with_their_place(line, row, column, rule):
    with pytest.raises(ProgramError) as caught:
        read(HEAD + line + "\n" + TAIL)
    error = caught.value
    assert (error.rule, error.at.line, error.at.column) == (rule, row, column), str(error)
    assert error.hint


def test_there_are_forty_malformed_programs():
    assert len(BAD) >= 40


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("X =\t40.000  mm", "X = ********  mm"),
        ("UF : 1, UT : 2,\t\tCONFIG", "UF : 3, UT : 2,\t\tCONFIG"),
        ("GP1:", "GP2:"),
        ("/POS\n", ""),
        ("P[3]{", "P[2]{"),
    ],
)
def test_positions_that_are_not_clear_are_refused(old, new):
    text = (HEAD + MOVES + TAIL).replace(old, new)
    with pytest.raises(ProgramError) as caught:
        read(text)
    assert caught.value.at.line >= 1 and caught.value.hint


def test_a_cut_from_joint_angles_is_refused():
    joints = (
        "P[6]{\n   GP1:\n\tUF : 1, UT : 2,\n" + "".join(f"\tJ{k}= 10.000 deg,\n" for k in range(1, 7)) + "};\n/END\n"
    )
    text = HEAD.replace("P[1] 50", "P[6] 50") + MOVES + TAIL.replace("/END\n", joints)
    with pytest.raises(ProgramError, match="count J3"):
        read(text)
    assert len(read(text.replace("   5:  !down", "   5:J P[1] 10% FINE    ;\n   5:  !down")).path) == 6
