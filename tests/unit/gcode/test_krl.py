"""Programs in KUKA's language: read as the control reads them, written with the same bytes, refused where it is not clear."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from camcomp.gcode.interpret import read_program
from camcomp.gcode.output import Output
from camcomp.gcode.rewrite import rewrite
from camcomp.gcode.robot_frames import CoordinateFrame, RobotFrames, zyx_rotations
from camcomp.gcode.setup import Setup
from camcomp.ground.datatypes import ARC, LINE, RAPID
from camcomp.ground.errors import ProgramError
from camcomp.ground.orientation import TURN, rotations_of

HEAD = "DEF p ( )\n$VEL.CP = 0.02\nPTP {X 0,Y 0,Z 10,A 0,B 0,C 0}\n"


def read(text, **frames):
    setup = Setup(orients=True, frames=lambda: RobotFrames(**frames)) if frames else Setup()
    return read_program(text.encode(), name="p.src", setup=setup)


def test_angles_are_z_y_x():
    angles = np.random.default_rng(1).uniform(-170, 170, (100, 3))
    np.testing.assert_allclose(
        zyx_rotations(angles), Rotation.from_euler("ZYX", angles, degrees=True).as_matrix(), atol=1e-14
    )


def test_missing_components_keep_their_value_and_speed_is_in_metres_per_second():
    path = read(HEAD + "LIN {Z 0}\nLIN {X 20,C 2} C_DIS\n$VEL = {CP 0.1,ORI1 200}\nLIN {Y -5.5}\nEND\n").path
    assert path.kind.tolist() == [RAPID, LINE, LINE, LINE]
    assert path.end.tolist() == [[0, 0, 10], [0, 0, 0], [20, 0, 0], [20, -5.5, 0]]
    np.testing.assert_allclose(path.feed[1:], [1200, 1200, 6000])
    np.testing.assert_allclose(path.orientation.end[:, 0], [0, 0, 2, 2])  # C turns about x


POSTED = """DEF posted ( )
DECL INT I
SIGNAL SPINDLE $OUT[5]
BAS (#INITMOV,0)
BAS (#TOOL,0)
BAS (#BASE,0)
BASE_DATA[3] = {FRAME: X 100,Y 0,Z 0,A 90,B 0,C 0}
$BASE = BASE_DATA[3]
$TOOL = {FRAME: X 0,Y 0,Z 250,A 0,B 0,C 0}
$VEL.CP = 0.01
SPINDLE = TRUE
PTP {E6POS: X 0, Y 0, Z 20, A 0, B 180, C 0, E1 0, S 'B 010', T 'B 100011'} C_PTP
LIN {E6POS: X 40, Y 0, Z 20, A 0, B 180, C 0, E1 0} C_DIS
END
\x1a"""


def test_modules_of_other_writers_are_read():
    """Frames by BASE_DATA[n] = ..., tool 0 in the header, signals, numbers in bits, the end of file of DOS."""
    program = read(POSTED, tip=np.array([0.0, 0.0, 250.0]), flange=np.diag([-1.0, 1.0, -1.0]))
    np.testing.assert_allclose(program.path.end, [[100, 0, 20], [100, 40, 20]], atol=1e-9)
    written = rewrite(program, Output.same(program.path), resolution_mm=1e-4, version="1").data.decode()
    lines = written.splitlines(keepends=True)
    assert lines.pop(1).startswith(";camcomp") and "".join(lines) == POSTED
    with pytest.raises(ProgramError, match="lies 250") as caught:
        read(POSTED.replace("$TOOL = {", "; {"), tip=np.array([0.0, 0.0, 250.0]), flange=np.diag([-1.0, 1.0, -1.0]))
    assert (caught.value.rule, caught.value.at.line) == ("CC145", 5)


def test_a_circle_goes_through_its_auxiliary_point():
    text = (
        HEAD
        + "CIRC {X 10,Y -10},{X 20,Y 0} C_DIS\nCIRC {X 10,Y 10},{X 0,Y 0},CA 360\nCIRC {X 20,Y 0,Z 20},{X 20,Y 0,Z 30},CA -90\nEND\n"
    )
    with pytest.raises(ProgramError, match="are not known here"):
        read(text)
    path = read(
        text.replace("{X 20,Y 0,Z 20},{X 20,Y 0,Z 30}", "{X 25,Y 0,Z 15,A 0,B 0,C 0},{X 30,Y 0,Z 10,A 0,B 0,C 0}")
    ).path
    assert path.kind.tolist() == [RAPID, ARC, ARC, ARC]
    np.testing.assert_allclose(path.centre[1:], [[10, 0, 10], [10, 0, 10], [25, 0, 10]], atol=1e-12)
    np.testing.assert_allclose(path.angle[1:3], [math.pi, 2 * math.pi], atol=1e-12)
    np.testing.assert_allclose(path.end[2], [20, 0, 10], atol=1e-12)
    # from X20 over X25 Z15 to X30, the other way round by 90 deg: below
    np.testing.assert_allclose(path.end[3], [25, 0, 5], atol=1e-12)


def test_poses_go_through_base_tool_flange_and_program_frame():
    rng = np.random.default_rng(4)
    base, tool, held, flange, program = (Rotation.random(random_state=k) for k in range(5))
    origin, at, tip = rng.uniform(-500, 500, (3, 3))
    abc = base.as_euler("ZYX", degrees=True)
    tool_abc = tool.as_euler("ZYX", degrees=True)
    said = dict(zip("XYZABC", (*origin, *abc), strict=True))
    told = dict(zip("XYZABC", (*tip, *tool_abc), strict=True))
    pose = dict(zip("XYZABC", (10.0, -20.0, 30.0, 12.0, 34.0, -56.0), strict=True))

    def spelled(values):
        return "{" + ",".join(f"{k} {v:.12f}" for k, v in values.items()) + "}"

    text = f"DEF p()\n$BASE={spelled(said)}\n$TOOL={spelled(told)}\nPTP {spelled(pose)}\nEND\n"
    path = read(
        text,
        program=CoordinateFrame(program.as_matrix(), at),
        held=held.as_matrix(),
        flange=flange.as_matrix(),
        tip=tip,
    ).path
    tip_machine = origin + base.apply([10, -20, 30])
    np.testing.assert_allclose(path.end[0], program.inv().apply(tip_machine - at), atol=1e-9)
    tcp = base * Rotation.from_euler("ZYX", [12, 34, -56], degrees=True)
    platform = tcp * tool.inv() * flange.inv()
    D = program.inv() * platform * held.inv() * program
    np.testing.assert_allclose(rotations_of(TURN, path.orientation.end)[0], D.as_matrix(), atol=1e-10)


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_what_is_not_changed_keeps_its_bytes(end):
    text = (
        "&ACCESS RVP\n&REL 23\nDEF  part( )\n;FOLD INI;%{PE}\n  BAS(#INITMOV,0 )\nINTERRUPT ON 3 ;\n;ENDFOLD (INI)\n"
        "$BASE={FRAME: X 1,Y 2,Z 3,A 0,B 0,C 0}\n$OUT[3]=TRUE ; spindle; on\nWAIT SEC 2.0\n$VEL.CP=.02\nptp {a1 0,a2 -90,a3 90,a4 0,a5 0,a6 0,e1 0}\n"
        "PTP  { E6POS: X 0.0, Y 0.0 ,Z 10, A 0,B 0,C 0, S 'B110', T 35, E1 0.0 }  C_PTP\nlin {x 1.50,y 2} c_dis ;left\n"
        "CIRC {X 5,Y 5},{X 9,Y 2},CA 180.0 C_VEL\nLIN {X 9,Y 2,Z 10,A 0,B 0,C 0}\nPTP $POS_ACT\nHALT\nEND\n"
    ).replace("\n", end).encode()  # fmt: skip
    program = read_program(text, name="p.src")
    written = rewrite(program, Output.same(program.path), resolution_mm=1e-4, version="1")
    stamp = next(line for line in written.data.split(end.encode()) if b"camcomp" in line)
    assert written.data.replace(stamp + end.encode(), b"", 1) == text
    assert written.data.index(stamp) > written.data.index(b"part(")
    assert written.line.tolist() == (program.path.line + 1).tolist()


@pytest.mark.parametrize("seed", range(5))
def test_written_poses_read_as_what_was_wanted(seed):
    frames = {
        "program": CoordinateFrame.of([1500.0, 20.0, 800.0], [3.0, 0.0, 0.0]), "held": Rotation.from_euler("ZYX", [20, 1, 2], degrees=True).as_matrix(),
        "flange": np.diag([-1.0, 1.0, -1.0]), "tip": np.array([0.0, 0.0, 250.0]), "bases": {3: CoordinateFrame.of([1400.0, 0.0, 700.0], [10.0, 1.0, 0.0])},
    }  # fmt: skip
    text = (
        "DEF p()\n$BASE=BASE_DATA[3]\n$TOOL={X 0,Y 0,Z 250,A 15,B 2,C 0}\n$VEL.CP=0.01\nPTP {X 0,Y 0,Z 9,A 0,B 170,C 0}\nLIN {Z 1} C_DIS\n"
        "LIN {X 20,A 4} ; on\nCIRC {X 30,Y 10},{X 40,Y 0} C_DIS\nLIN {X 60,B 172} C_VEL\nPTP {Z 30}\nEND\n"
    )  # fmt: skip
    program = read(text, **frames)
    rng, same = np.random.default_rng(seed), Output.same(program.path)
    rows = np.repeat(np.arange(len(program.path)), rng.integers(1, 4, len(program.path)))
    rows = np.delete(rows, np.flatnonzero((np.diff(rows, prepend=-1) == 0) & (program.path.kind[rows] == RAPID)))
    words = program.path.orientation.end[rows] + rng.uniform(-0.1, 0.1, (len(rows), 3))
    kind = np.where(program.path.kind[rows] == ARC, LINE, program.path.kind[rows]).astype(np.int8)
    out = Output(
        motion=rows, kind=kind, end=same.end[rows] + rng.uniform(-1, 1, (len(rows), 3)), centre=np.full((len(rows), 3), np.nan),
        angle=np.zeros(len(rows)), feed=same.feed[rows], joining=rng.random(len(rows)) < 0.3, words=words, rest=rng.random(len(rows)) < 0.3,
    )  # fmt: skip
    written = rewrite(program, out, resolution_mm=1e-4, version="1")
    again = read(written.data.decode(), **frames)
    np.testing.assert_allclose(again.path.end, out.end, atol=1e-4)
    np.testing.assert_allclose(again.path.end, written.end, atol=1e-9)
    off = rotations_of(TURN, again.path.orientation.end) - rotations_of(TURN, words)
    assert np.abs(off).max() < 5e-8
    np.testing.assert_allclose(again.path.orientation.end, written.words, atol=1e-9)
    assert again.path.line.tolist() == written.line.tolist()
    assert written.data.count(b"; on") == 1 and written.data.count(b"PTP {") == 2


BAD = [
    ("LIN {X 1,Y}", 4, 10, "CC144"), ("LIN {X 1 Y 2}", 4, 6, "CC144"), ("LIN {X 1,Q 2}", 4, 12, "CC144"), ("LIN {X 1,X 2}", 4, 10, "CC144"),
    ("LIN {X 1", 4, 1, "CC144"), ("LIN X 1}", 4, 1, "CC144"), ("LIN", 4, 1, "CC144"), ("LIN {}", 4, 1, "CC144"), ("LIN {X 1,5}", 4, 10, "CC144"),
    ("LIN {X 1..5}", 4, 8, "CC144"), ("LIN {X FOO}", 4, 8, "CC144"), ("LIN P1", 4, 1, "CC144"), ("LIN P1 C_DIS", 4, 1, "CC144"), ("PTP HOME", 4, 1, "CC144"),
    ("LIN {X 1} C_FOO", 4, 11, "CC144"), ("LIN {A1 0,A2 0,A3 0,A4 0,A5 0,A6 0}", 4, 1, "CC144"), ("PTP {A1 5}", 4, 1, "CC144"), ("LIN {X 1,A1 2}", 4, 13, "CC144"),
    ("CIRC {X 1,Y 1}", 4, 1, "CC112"), ("CIRC {X 1},{X 2}", 4, 1, "CC112"), ("CIRC {X 1,Y 1},{X 2,Y 0},CB 90", 4, 25, "CC144"),
    ("CIRC {X 1,Y 1},{X 2,Y 0,A 5},CA 90", 4, 1, "CC115"), ("LIN_REL {X 1}", 4, 1, "CC144"), ("PTP_REL {A1 1}", 4, 1, "CC144"), ("SPLINE", 4, 1, "CC119"),
    ("SLIN {X 1}", 4, 1, "CC119"), ("SPTP {X 1}", 4, 1, "CC119"), ("FOR I=1 TO 3", 4, 1, "CC144"), ("IF $IN[1] THEN", 4, 1, "CC144"), ("LOOP", 4, 1, "CC144"),
    ("WHILE TRUE", 4, 1, "CC144"), ("GOTO L1", 4, 1, "CC144"), ("RETURN", 4, 1, "CC144"), ("I = 5", 4, 1, "CC144"), ("XP1 = {X 1}", 4, 1, "CC144"),
    ("$VEL.CP = 1200", 4, 11, "CC110"), ("$VEL.CP = V", 4, 11, "CC144"), ("$VEL.CP = 0", 4, 11, "CC110"), ("$BASE = BASE_DATA[7]", 4, 9, "CC145"),
    ("$BASE = TOOL_DATA[1]", 4, 9, "CC145"), ("$BASE = MYBASE", 4, 9, "CC145"), ("$TOOL = {X 1}", 4, 9, "CC145"), ("$ORI_TYPE = #JOINT", 4, 13, "CC115"),
    ("$CIRC_TYPE = #PATH", 4, 14, "CC115"), ("$IPO_MODE = #TCP", 4, 13, "CC115"), ("TRIGGER WHEN DISTANCE=0 DELAY=0 DO $OUT[1]=TRUE", 4, 1, "CC144"),
    ("WAIT SEC T", 4, 1, "CC131"), ("LIN {A 5}", 4, 1, "CC115"), ("LIN {B 90,X 5}", 4, 1, "CC115"), ("LIN {X 1e9}", 4, 1, "CC138"), ("BAS (#CP_DAT)", 4, 1, "CC144"),
    ("FDAT_ACT=FHOME", 4, 10, "CC144"), ("FDAT_ACT={TOOL_NO A}", 4, 19, "CC144"), ("LIN {X 1e400}", 4, 8, "CC144"), ("SIGNAL", 4, 1, "CC144"), ("BASE_DATA[1]={X 1}", 4, 14, "CC145"), ("DEF q()", 4, 1, "CC144"), ("END\nLIN {X 1}", 5, 1, "CC144"), ("G1 X5 F100", 4, 1, "CC144"), ("LIN {X 1,E1 5}\nLIN {X 2,E1 6}", 5, 13, "CC115"),
]  # fmt: skip


@pytest.mark.parametrize(("line", "row", "column", "rule"), BAD)
def test_malformed_programs_are_refused_with_their_place(line, row, column, rule):
    with pytest.raises(ProgramError) as caught:
        read(HEAD + line + "\nEND\n")
    error = caught.value
    assert (error.rule, error.at.line, error.at.column) == (rule, row, column), str(error)
    assert error.hint


def test_there_are_forty_malformed_programs():
    assert len(BAD) >= 40


@pytest.mark.parametrize(
    ("text", "rule"), [("LIN {X 1}\n", "CC144"), ("DEF p()\nEND\n", "CC100"), ("DEF p()\nLIN {X 0,Y 0,Z 0,A 0,B 0,C 0}\nEND\n", "CC110"),
                       ("DEF p(N:IN)\nEND\n", "CC144"), ("DEFDAT p\nENDDAT\n", "CC144")],
)  # fmt: skip
def test_modules_without_a_clear_start_are_refused(text, rule):
    with pytest.raises(ProgramError) as caught:
        read(text)
    assert caught.value.rule == rule


def test_every_mistake_is_told_at_once():
    with pytest.raises(ProgramError) as caught:
        read(HEAD + "LIN P1\nLIN P2\nEND\n")
    assert [each.at.line for each in caught.value.others] == [5]
