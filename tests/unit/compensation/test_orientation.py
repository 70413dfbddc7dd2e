"""Words of orientation: read as the controls read them, corrected with the tip, and played into machines written apart."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from camcomp.gcode.interpret import read_program
from camcomp.gcode.output import Output
from camcomp.gcode.rewrite import rewrite
from camcomp.gcode.setup import Setup
from camcomp.ground.errors import ProgramError
from camcomp.ground.orientation import RPY, VECTOR, between, rotations_of, words_of
from tests.commandline import camcomp, compensated
from tests.validation.plants import kuka, serial

ORIGIN = {"kuka-kr210": (1550.0, 0.0, 800.0), "hexapod": (0.0, 0.0, -800.0)}
TURNING = "G21 G90 G17\nS8000 M3\nG0 X0 Y0 Z20 A0 B0 C0\nG1 Z0 F500\nX20 A2 B1\nG3 X40 Y0 I10 J0 C5\nG1 X45\nG91 X5 B-1\nG90 G0 Z20 A0 B0 C0\nM2\n"
VECTORS = (
    "G17 G90 G54 G94\nTRAORI\nORIWKS\nS8000 M3\nG0 X0 Y0 Z20 A3=0 B3=0 C3=1\nG1 Z0 F500\nX20 A3=0.05 B3=0.02 C3=1\nY10\n"
    "G0 Z20 A3=0 B3=0 C3=1\nTRAFOOF\nM30\n"
)  # fmt: skip


def turned(a, b, c):
    """Rz(C) Ry(B) Rx(A) of degrees (n,), by scipy."""
    return Rotation.from_euler("ZYX", np.column_stack((c, b, a)), degrees=True).as_matrix()


def read(text, **setup):
    return read_program(text.encode(), name="in.nc", setup=Setup(orients=True, **setup))


def test_words_are_roll_pitch_and_yaw():
    words = np.random.default_rng(1).uniform([-170, -85, -170], [170, 85, 170], (200, 3))
    R = rotations_of(RPY, words)
    np.testing.assert_allclose(R, turned(*words.T), atol=1e-14)
    np.testing.assert_allclose(words_of(RPY, R, words), words, atol=1e-10)
    over = words + [360.0, 0.0, -360.0]
    np.testing.assert_allclose(words_of(RPY, R, over), over, atol=1e-10)


def test_a_direction_turns_on_a_great_circle():
    one, other = np.array([0.0, 0.0, 1.0]), np.array([0.6, -0.48, 0.64])
    between_both = Rotation.align_vectors(other[None], one[None])[0]
    u = np.linspace(0, 1, 7)
    expected = Slerp([0, 1], Rotation.concatenate([Rotation.identity(), between_both]))(u).apply(one)
    found = between(VECTOR, np.tile(one, (7, 1)), np.tile(other, (7, 1)), u)
    np.testing.assert_allclose(found, expected, atol=1e-12)
    np.testing.assert_allclose(rotations_of(VECTOR, found) @ one, found, atol=1e-12)


def test_words_go_linearly_with_the_way():
    turn = read(TURNING).path.orientation
    assert turn.end.tolist() == [[0, 0, 0], [0, 0, 0], [2, 1, 0], [2, 1, 5], [2, 1, 5], [2, 0, 5], [0, 0, 0]]
    assert turn.words(np.array([3]), np.array([0.5])).tolist() == [[2, 1, 2.5]]


@pytest.mark.parametrize(
    ("line", "words"),
    [("G1 A5 F100", "only turns"), ("G0 B89.5", "pole"), ("G92 A5", "may only turn alone"), ("G53 G0 Z0 A5", "turns while"),
     ("G81 X1 Z-1 R1 A3 F9", "turns while"), ("G0 X1 U5", "does not have")],
)  # fmt: skip
def test_words_without_a_clear_meaning_are_refused(line, words):
    with pytest.raises(ProgramError) as caught:
        read(f"G21 G90\nG0 X0 Y0 Z0\n{line}\nM2\n")
    assert caught.value.rule == "CC115" and caught.value.at.line == 3


@pytest.mark.parametrize(
    "line", ["G1 X1 A3=0 B3=0 C3=1", "TRAORI\nG1 X1 A3=1 B3=0", "TRAORI\nORIAXES", "TRAORI\nG1 X1 A2=5", "G1 X1 A5"]
)
def test_directions_without_their_transformation_are_refused(line):
    with pytest.raises(ProgramError) as caught:
        read_program(f"G17 G90\nG0 X0 Y0 Z0 F100\n{line}\nM30\n".encode(), name="in.mpf", setup=Setup(orients=True))
    assert caught.value.rule == "CC115"


def test_three_axes_and_tables_do_not_turn_tools():
    with pytest.raises(ProgramError):
        read_program(TURNING.encode(), name="in.nc")
    assert read("G0 X1 Y1 Z1\nG0 A90\nM2\n", table_axes=frozenset("A")).path.orientation is None


@pytest.mark.parametrize(("text", "name"), [(TURNING, "in.nc"), (VECTORS, "in.mpf")])
def test_what_is_not_changed_keeps_its_bytes(text, name):
    program = read_program(text.encode(), name=name, setup=Setup(orients=True))
    written = rewrite(program, Output.same(program.path), resolution_mm=1e-4, version="1").data
    assert written.split(b"\n", 1)[1] == text.encode()


@pytest.mark.parametrize("seed", range(5))
def test_written_words_read_as_what_was_wanted(seed):
    program = read(TURNING)
    rng, same = np.random.default_rng(seed), Output.same(program.path)
    rows = np.repeat(np.arange(len(program.path)), rng.integers(1, 4, len(program.path)))
    words = program.path.orientation.end[rows] + rng.uniform(-0.1, 0.1, (len(rows), 3))
    kind = np.where(program.path.kind[rows] == 2, 1, program.path.kind[rows]).astype(np.int8)
    out = Output(
        motion=rows, kind=kind, end=same.end[rows] + rng.uniform(-1, 1, (len(rows), 3)), centre=np.full((len(rows), 3), np.nan),
        angle=np.zeros(len(rows)), feed=same.feed[rows], joining=same.joining[rows], words=words,
    )  # fmt: skip
    written = rewrite(program, out, resolution_mm=1e-4, version="1")
    again = read(written.data.decode()).path
    np.testing.assert_allclose(again.orientation.end, words, atol=0.51e-6)
    np.testing.assert_allclose(again.orientation.end, written.words, atol=1e-9)
    np.testing.assert_allclose(again.end, written.end, atol=1e-9)


def outputs(folder, machine, text, name="part.nc", words=False):
    (folder / name).write_text(text)
    (folder / "abc.yaml").write_text("control: {orientation_words: ABC}\n")
    configs = [f"config/{machine}.yaml"] + [str(folder / "abc.yaml")] * words
    done, joints, _, summary, data = compensated(folder, folder / name, configs)
    assert done.returncode == 0, done.stderr
    return joints, summary, data.decode()


def columns(joints, *names):
    return np.column_stack([joints[name] for name in names])


PLAIN = "G21 G90 G17\nS8000 M3\nG0 X25 Y0 Z5\nG1 Z0 F300\nG3 X0 Y25 I-25 J0\nG1 X-20 Y30\nG0 Z5\nM2\n"


@pytest.mark.parametrize(
    ("text", "words", "name"), [(PLAIN, True, "p.nc"), (TURNING, False, "t.nc"), (VECTORS, False, "v.mpf")]
)
def test_an_arm_that_is_told_the_joints_holds_tip_and_orientation(tmp_path, text, words, name):
    joints, summary, _ = outputs(tmp_path, "kuka-kr210", text, name, words)
    assert summary["tilt_after_mrad"] < 0.01 and summary["after"]["max_um"] <= 1.0
    q, force = columns(joints, *(f"act_A{k}_rad" for k in range(1, 7))), columns(joints, "fx_N", "fy_N", "fz_N")
    # the control's own inverse: without load and weight the arm is where the text says
    rigid = serial.settle(kuka.arm(weights=False), q, np.zeros(3))
    told = columns(joints, "xc_mm", "yc_mm", "zc_mm") + ORIGIN["kuka-kr210"]
    assert np.abs(rigid.tip - told).max() < 1e-4
    np.testing.assert_allclose(
        rigid.orientation, turned(joints["ac_deg"], joints["bc_deg"], joints["cc_deg"]), atol=1e-8
    )
    # under load it is where the program wants it: half a resolution, and what a division of the line shares
    loaded = serial.settle(kuka.arm(), q, force)
    wanted = columns(joints, "x_mm", "y_mm", "z_mm") + ORIGIN["kuka-kr210"]
    assert np.abs(loaded.tip - wanted).max() < 1.2e-3
    axes = turned(joints["a_deg"], joints["b_deg"], joints["c_deg"])
    off = np.cross(loaded.orientation[:, :, 2], axes[:, :, 2]) if name.endswith("mpf") else loaded.orientation - axes
    assert np.abs(off).max() < 1e-5


def test_orientation_is_held_with_effects_too(tmp_path):
    """A joint that stands 1 mrad off turns the tool, and the words turn it back."""
    (tmp_path / "off.yaml").write_text("effects: [{effect: joint_offset, target: A2, offset_rad: 0.001}]\n")
    (tmp_path / "part.nc").write_text(TURNING)
    done, joints, _, summary, _ = compensated(
        tmp_path, tmp_path / "part.nc", ["config/kuka-kr210.yaml", str(tmp_path / "off.yaml")]
    )
    assert done.returncode == 0 and summary["tilt_after_mrad"] < 0.01
    q = columns(joints, *(f"act_A{k}_rad" for k in range(1, 7))) + [0.0, 0.001, 0.0, 0.0, 0.0, 0.0]
    loaded = serial.settle(kuka.arm(), q, columns(joints, "fx_N", "fy_N", "fz_N"))
    wanted = columns(joints, "x_mm", "y_mm", "z_mm") + ORIGIN["kuka-kr210"]
    assert np.abs(loaded.tip - wanted).max() < 1.2e-3
    axes = turned(joints["a_deg"], joints["b_deg"], joints["c_deg"])
    assert np.abs(loaded.orientation - axes).max() < 1e-5


def test_a_joint_table_in_parquet_has_the_columns_too(tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    (tmp_path / "part.nc").write_text(TURNING)
    done = camcomp(
        "compensate", tmp_path / "part.nc", "--config", "config/hexapod.yaml", "--joints", tmp_path / "j.parquet"
    )
    assert done.returncode == 0, done.stderr
    assert parquet.read_table(tmp_path / "j.parquet").column_names[-6:] == [
        "a_deg",
        "b_deg",
        "c_deg",
        "ac_deg",
        "bc_deg",
        "cc_deg",
    ]


BASE = 25.4 * np.array([(-22.95, 13.25), (22.95, 13.25), (22.95, 13.25), (0.0, -26.5), (0.0, -26.5), (-22.95, 13.25)])
PLATFORM = 25.4 * np.array(
    [(-1.0, 11.5), (1.0, 11.5), (10.459, -4.884), (9.459, -6.616), (-9.459, -6.616), (-10.459, -4.884)]
)


def test_legs_are_those_of_genhexkins(tmp_path):
    """LinuxCNC, genhexkins.c: the length of a strut is |R p + t - b|, with its default joints."""
    joints, summary, _ = outputs(tmp_path, "hexapod", TURNING)
    assert summary["tilt_after_mrad"] < 0.01 and summary["after"]["max_um"] <= 1.0
    R = turned(joints["ac_deg"], joints["bc_deg"], joints["cc_deg"])
    tip = columns(joints, "xc_mm", "yc_mm", "zc_mm") + ORIGIN["hexapod"]
    t = tip + R @ np.array([0.0, 0.0, 100.0])
    struts = [name for name in joints if name.startswith("act_") and name.endswith("_mm") and "nominal" not in name]
    assert len(struts) == 6
    for name, base, platform in zip(struts, BASE, PLATFORM, strict=True):
        length = np.linalg.norm(R @ np.append(platform, 0.0) + t - np.append(base, 0.0), axis=1)
        assert np.abs(joints[name] - length).max() < 2e-4, name  # the joints are rounded in the machine file


def test_a_corrected_program_is_verified_from_its_text(tmp_path):
    outputs(tmp_path, "kuka-kr210", TURNING)
    done = camcomp(
        "verify", tmp_path / "out.nc", "--against", tmp_path / "part.nc", "--config", "config/kuka-kr210.yaml"
    )
    assert done.returncode == 0, done.stderr
    (tmp_path / "out.nc").write_text((tmp_path / "out.nc").read_text().replace(" C0.", " C1."))
    done = camcomp(
        "verify", tmp_path / "out.nc", "--against", tmp_path / "part.nc", "--config", "config/kuka-kr210.yaml"
    )
    assert done.returncode == 1


def test_surfaces_do_not_follow_orientation_and_say_so(tmp_path):
    (tmp_path / "part.nc").write_text(TURNING)
    words = ["--config", "config/kuka-kr210.yaml", "--surface", tmp_path / "left.stl"]
    done = camcomp("simulate", tmp_path / "part.nc", *words)
    assert done.returncode == 3 and b"CC115" in done.stderr and b"part.nc:5:" in done.stderr


@pytest.mark.parametrize("machine", ["orthoglide", "cartesian"])
def test_machines_of_three_actuators_have_no_words_of_orientation(tmp_path, machine):
    (tmp_path / "part.nc").write_text(PLAIN)
    (tmp_path / "abc.yaml").write_text("control: {orientation_words: ABC}\n")
    done = camcomp(
        "compensate", tmp_path / "part.nc", "--config", f"config/{machine}.yaml", "--config", tmp_path / "abc.yaml"
    )
    assert done.returncode == 2 and b"six actuators" in done.stderr
