"""Programs in ABB's language: read, written with the same bytes, refused where they are not clear."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from camcomp.gcode.interpret import read_program
from camcomp.gcode.output import Output
from camcomp.gcode.rewrite import rewrite
from camcomp.gcode.robot_frames import RobotFrames
from camcomp.gcode.setup import Setup
from camcomp.ground.datatypes import ARC, LINE, RAPID
from camcomp.ground.errors import ProgramError
from camcomp.ground.orientation import TURN, quaternions_of, rotations_of, rotations_of_quaternions
from tests.rewritten import written_poses

AXES = "[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]"
HEAD = f"MODULE m\nCONST robtarget p1:=[[5,0,0],[1,0,0,0],{AXES}];\nPROC main()\nMoveJ [[0,0,9],[1,0,0,0],{AXES}],v50,fine,tool0;\n"
END = "ENDPROC\nENDMODULE\n"


def test_quaternions_are_those_of_scipy():
    R = Rotation.random(200, random_state=3).as_matrix()
    np.testing.assert_allclose(rotations_of_quaternions(quaternions_of(R)), R, atol=1e-14)
    other = np.roll(Rotation.from_matrix(R).as_quat(), 1, axis=1)
    assert np.abs(np.abs(np.sum(quaternions_of(R) * other, axis=1)) - 1.0).max() < 1e-12


def test_what_is_not_changed_keeps_its_bytes():
    text = (
        HEAD + f"MoveL p1, v20, z1, tool0; ! left\nMoveL [[9,0,0],[1,0,0,0],{AXES}],v20,z5,tool0\\WObj:=wobj0;\n" + END
    ).encode()
    program = read_program(text, name="m.mod")
    assert program.path.end.tolist() == [[0, 0, 9], [5, 0, 0], [9, 0, 0]]
    np.testing.assert_allclose(program.path.feed[1:], 1200)
    written = rewrite(program, Output.same(program.path), resolution_mm=1e-4, version="1").data
    lines = written.splitlines(keepends=True)
    assert b"camcomp" in lines.pop(1) and b"".join(lines) == text


BAD = [
    ('MoveL p1,v20,[[1],0.3],tool0;', 14, 'CC144'),
    ('MoveL p1,v20,[FALSE],tool0;', 14, 'CC144'),
    ('MoveL [[1e400,0,0],[1,0,0,0],AXES],v20,z1,tool0;', 7, 'CC144'),
    ('MoveL [[1,0,0],[1,0,0,0],conf,[9E9,9E9,9E9,9E9,9E9,9E9]],v20,z1,tool0;', 26, 'CC144'),
    ('MoveL Offs(p1,0,0,5),v20,z1,tool0;', 7, 'CC144'),
    ('MoveL p1,v20\\V:=20,z1,tool0;', 13, 'CC144'),
    ('MoveL p1,v20,z1\\Inpos:=inpos50,tool0;', 16, 'CC144'),
    ('MoveL\\Conc,p1,v20,z1,tool0;', 1, 'CC144'),
    ('MoveL p1,v20,z1,tool0; MoveL p1,v20,z1,tool0;', 22, 'CC144'),
    ('MoveL [[0,0,0],[1,0,0,0],', 1, 'CC144'),
    ('MoveL p9,v20,z1,tool0;', 7, 'CC144'),
    ('MoveL p1,v20,z1,mill;', 17, 'CC145'),
    ('MoveL p1,v20,tool0;', 1, 'CC144'),
    ('MoveL p1,v20,z1,tool0,1;', 1, 'CC144'),
    ('MoveL p1,fast,z1,tool0;', 10, 'CC144'),
    ('MoveL p1,v20,zz,tool0;', 14, 'CC144'),
    ('MoveL p1,v20,z1,tool0\\WObj:=table;', 17, 'CC145'),
    ('MoveL p1,v20,z1,tool0\\Corr;', 17, 'CC144'),
    ('MoveL p1,v20,z1,tool0', 1, 'CC144'),
    ('MoveL Offs(p1,1,0,0),v20,z1,tool0;', 7, 'CC144'),
    ('MoveL RelTool(p1,1,0,0),v20,z1,tool0;', 7, 'CC144'),
    ('MoveL [[5,0],[1,0,0,0],AXES],v20,z1,tool0;', 7, 'CC144'),
    ('MoveL [[5,0,0,0],[1,0,0,0],AXES],v20,z1,tool0;', 7, 'CC144'),
    ('MoveL [[5,0,0],[1,0,0],AXES],v20,z1,tool0;', 7, 'CC144'),
    ('MoveL [[5,0,0],[1,1,0,0],AXES],v20,z1,tool0;', 7, 'CC144'),
    ('MoveL [[5,0,0],[0,0,0,0],AXES],v20,z1,tool0;', 7, 'CC144'),
    ('MoveL [[5,x,0],[1,0,0,0],AXES],v20,z1,tool0;', 7, 'CC144'),
    ('MoveL [[1e9,0,0],[1,0,0,0],AXES],v20,z1,tool0;', 1, 'CC138'),
    ('MoveL [[5,0,0],[1,0,0,0]],v20,z1,tool0;', 7, 'CC144'),
    ('MoveL [[5,0,0],[1,0,0,0],AXES,v20,z1,tool0;', 1, 'CC144'),
    ('MoveL [[5,0,0],[1,0,0,0],[0,0,0,0],[x,9E9,9E9,9E9,9E9,9E9]],v20,z1,tool0;', 7, 'CC144'),
    ('MoveL [[0,0,9],[0.9998477,0,0,0.0174524],AXES],v20,z1,tool0;', 1, 'CC115'),
    ('MoveL [[5,0,0],[0.70710678,0,0.70710678,0],AXES],v20,z1,tool0;', 1, 'CC115'),
    ('MoveL [[5,0,0],[1,0,0,0],[0,0,0,0],[5,9E9,9E9,9E9,9E9,9E9]],v20,z1,tool0;', 1, 'CC115'),
    ('MoveC p1,v20,z1,tool0;', 1, 'CC144'),
    ('MoveC p1,p9,v20,z1,tool0;', 10, 'CC144'),
    ('MoveC [[5,0,9],[1,0,0,0],AXES],[[9,0,9],[1,0,0,0],AXES],v20,z1,tool0;', 1, 'CC112'),
    ('MoveAbsJ p1,v50,fine,tool0;', 10, 'CC144'),
    ('MoveAbsJ [[0,0,x,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v50,fine,tool0;', 10, 'CC144'),
    ('MoveLDO p1,v20,z1,tool0,do1,1;', 1, 'CC144'),
    ('MoveCSync p1,p1,v20,z1,tool0,"a";', 1, 'CC144'),
    ('TriggL p1,v20,t1,z1,tool0;', 1, 'CC144'),
    ('SearchL di1,p1,p1,v20,tool0;', 1, 'CC144'),
    ('ArcL p1,v20,seam1,weld1,fine,tool0;', 1, 'CC144'),
    ('IF TRUE THEN', 1, 'CC144'),
    ('FOR i FROM 1 TO 3 DO', 1, 'CC144'),
    ('WHILE TRUE DO', 1, 'CC144'),
    ('TEST reg1', 1, 'CC144'),
    ('GOTO again;', 1, 'CC144'),
    ('RETURN;', 1, 'CC144'),
    ('x:=5;', 1, 'CC144'),
    ('p1.trans.x:=5;', 1, 'CC144'),
    ('WaitTime t;', 1, 'CC131'),
    ('VelSet 50,500;', 1, 'CC144'),
    ('SingArea \\Wrist;', 1, 'CC144'),
    ('PDispOn p1,tool0;', 1, 'CC144'),
    ('EOffsOn p1;', 1, 'CC144'),
    ('CirPathMode \\PathFrame;', 1, 'CC144'),
    ('PROC other()', 1, 'CC144'),
    ('MoveL p1,[x],z1,tool0;', 10, 'CC110'),
    ('MoveL p1,v0,z1,tool0;', 1, 'CC110'),
    ('G1 X5 F100', 1, 'CC144'),
]  # fmt: skip


@pytest.mark.parametrize(("line", "column", "rule"), BAD)
def test_malformed_programs_are_refused_with_their_place(line, column, rule):
    with pytest.raises(ProgramError) as caught:
        read_program((HEAD + line.replace("AXES", AXES) + "\n" + END).encode(), name="m.mod")
    error = caught.value
    assert (error.rule, error.at.line, error.at.column) == (rule, 5, column), str(error)
    assert error.hint


def test_configuration_and_external_axes_may_be_named():
    named = "PERS confdata ahead:=[0,-1,0,1];\nPERS extjoint none:=[9E9,9E9,9E9,9E9,9E9,9E9];\n"
    text = HEAD.replace("PROC", named + "PROC") + "MoveL [[9,0,0],[1,0,0,0],ahead,none],v20,z5,tool0;\n" + END
    program = read_program(text.encode(), name="m.mod")
    same, n = Output.same(program.path), len(program.path)
    moved = Output(
        motion=same.motion, kind=same.kind, end=same.end + [0.0, 0.0, 0.1], centre=same.centre, angle=np.zeros(n), feed=same.feed,
        joining=np.zeros(n, bool), words=program.path.orientation.end, rest=np.zeros(n, bool),
    )  # fmt: skip
    written = rewrite(program, moved, resolution_mm=1e-4, version="1").data
    assert b"[[9,0,0.1],[1,0,0,0],ahead,none]" in written.replace(b" ", b"")


def test_there_are_forty_malformed_programs():
    assert len(BAD) >= 40


# the forms of public posts: header lines, speed and zone data of their own, declared targets, a comment behind a move
POSTED = """%%%
  VERSION:1
  LANGUAGE:ENGLISH
%%%
MODULE MILL
  ! posted by hand
  PERS tooldata spindle := [TRUE,[[10.5,-3,248],[0.99904822,0,0.04361939,0]],[12,[0,0,120],[1,0,0,0],0,0,0]];
  TASK PERS wobjdata plate := [FALSE,TRUE,"",[[1500,20,700],[0.99619470,0,0,0.08715574]],[[5,6,7],[1,0,0,0]]];
  LOCAL CONST speeddata vCut := [12.5,500,5000,1000];
  CONST zonedata zCut := [FALSE,0.3,0.45,0.45,0.045,0.45,0.045];
  CONST robtarget pStart := [[0,0,30],[0,0,1,0],[0,-1,0,1],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pIn := [[0,0,-1.5],[0,0.00872654,0.99996192,0],[0,-1,0,1],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  PROC main()
    ConfL\\Off;
    ConfJ\\Off;
    SingArea\\Off;
    SetDO doSpindle,1;
    WaitTime 2;
    MoveJ pStart,v200,fine,spindle\\WObj:=plate;
    MoveL pIn, vCut, zCut, spindle \\WObj:=plate; ! in
    MoveL [[40,0,-1.5],[0,0.00872654,0.99996192,0],[0,-1,0,1],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]],vCut,zCut,spindle\\WObj:=plate;
    MoveC [[50,-10,-1.5],[0,0,1,0],[0,-1,0,1],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]],[[60,0,-1.5],[0,0,1,0],[0,-1,0,1],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]],vCut,z1,spindle\\WObj:=plate;
    moveL pIn,v20,fine,spindle\\WObj:=plate;
    MoveL pStart,v100,fine,spindle\\WObj:=plate;
  ENDPROC
ENDMODULE
"""
FRAMES = {"tip": np.array([10.5, -3.0, 248.0]), "flange": np.diag([-1.0, 1.0, -1.0])}


def posted(text):
    setup = Setup(orients=True, frames=lambda: RobotFrames(**FRAMES))
    return read_program(text, name="m.mod", setup=setup)


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_a_posted_module_keeps_its_bytes(end):
    text = POSTED.replace("\n", end).encode()
    program = posted(text)
    assert program.path.kind.tolist() == [RAPID, LINE, LINE, ARC, LINE, LINE] and program.dwelt_s == 2.0
    np.testing.assert_allclose(program.path.feed[1:], [750, 750, 750, 1200, 6000])
    written = rewrite(program, Output.same(program.path), resolution_mm=1e-4, version="1").data
    lines = written.splitlines(keepends=True)
    assert b"camcomp" in lines.pop(5) and b"".join(lines) == text


def test_frames_and_quaternions_are_those_of_scipy():
    path = posted(POSTED.encode()).path
    user, tool = (Rotation.from_quat(q) for q in ([0, 0, 0.08715574, 0.99619470], [0, 0.04361939, 0, 0.99904822]))
    target = Rotation.from_quat([0.00872654, 0.99996192, 0, 0])
    np.testing.assert_allclose(path.end[1], user.apply([5, 6, 5.5]) + [1500, 20, 700], atol=1e-9)
    platform = user * target * tool.inv() * Rotation.from_matrix(FRAMES["flange"]).inv()
    np.testing.assert_allclose(rotations_of(TURN, path.orientation.end)[1], platform.as_matrix(), atol=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_written_poses_read_as_what_was_wanted(seed):
    data = written_poses(posted(POSTED.encode()), posted, seed, turned=1e-8)
    assert data.count(b"CONST robtarget") == 2 and data.count(b"! in") == 1
