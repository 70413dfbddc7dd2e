"""Programs in ABB's language: read, written with the same bytes, refused where they are not clear."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from camcomp.gcode.interpret import read_program
from camcomp.gcode.output import Output
from camcomp.gcode.rewrite import rewrite
from camcomp.ground.errors import ProgramError
from camcomp.ground.orientation import quaternions_of, rotations_of_quaternions

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


@pytest.mark.parametrize(
    ("line", "rule"),
    [("MoveL p9,v20,z1,tool0;", "CC144"), ("MoveL p1,v20,z1,mill;", "CC145"), ("IF TRUE THEN", "CC144"), ("MoveL p1,v20,tool0;", "CC144"),
     ("x:=5;", "CC144"), ("TriggL p1,v20,t1,z1,tool0;", "CC144"), ("MoveL Offs(p1,1,0,0),v20,z1,tool0;", "CC144"), ("WaitTime t;", "CC131")],
)  # fmt: skip
def test_malformed_programs_are_refused_with_their_place(line, rule):
    with pytest.raises(ProgramError) as caught:
        read_program((HEAD + line + "\n" + END).encode(), name="m.mod")
    assert (caught.value.rule, caught.value.at.line) == (rule, 5) and caught.value.hint
