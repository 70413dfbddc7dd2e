"""Robot programs against what shares no code with their reader: NC programs of the same part, an energy plant, a public grammar."""

import json
import os
import re
import shutil
import subprocess
import sys
from importlib.util import find_spec
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from camcomp.diagnosis.experiment.open_experiment import open_experiment
from tests.commandline import ROOT, camcomp, compensated, table
from tests.validation.plants import kuka, serial

ORIGIN = np.array([1550.0, 0.0, 800.0])
KUKA = ROOT / "config" / "kuka-kr210.yaml"
SLOT, CONTROL = ROOT / "samples" / "robot" / "slot.src", ROOT / "samples" / "robot" / "control.yaml"
AXES = [f"A{k}" for k in range(1, 7)]
# x, y, z mm, roll, pitch, yaw deg; one angle at a time, so that both controls turn the tool about one axis
PART = [
    (0, 0, 20, 0, 0, 0),
    (0, 0, 0, 0, 0, 0),
    (20, 0, 0, 2, 0, 0),
    (20, 15, 0, 2, 0, 3),
    (40, 15, 0, 2, 1, 3),
    (60, 0, 0, 2, 1, 3),
    (60, 0, 20, 2, 1, 3),
]


def as_nc(part):
    words = [f"X{x} Y{y} Z{z} A{a} B{b} C{c}" for x, y, z, a, b, c in part]
    return f"G21 G90 G17\nS8000 M3\nG0 {words[0]}\n" + "".join(f"G1 {each} F600\n" for each in words[1:]) + "M2\n"


def as_krl(part):
    """The tool frame has the axes of the flange: z along the tool to the work, so that half a turn about x lies between."""
    lines = []
    for k, (x, y, z, a, b, c) in enumerate(part):
        tcp = Rotation.from_euler("ZYX", [c, b, a], degrees=True) * Rotation.from_euler("Y", 180, degrees=True)
        A, B, C = tcp.as_euler("ZYX", degrees=True)
        lines.append(f"{'LIN' if k else 'PTP'} {{X {x},Y {y},Z {z},A {A:.12f},B {B:.12f},C {C:.12f}}}\n")
    head = "DEF part ( )\n$BASE = BASE_DATA[1]\n$TOOL = TOOL_DATA[1]\n$VEL.CP = 0.01\n"
    return head + "".join(lines) + "END\n"


def as_rapid(part):
    """A robtarget inline per move; quaternions by scipy."""
    lines = []
    for k, (x, y, z, a, b, c) in enumerate(part):
        tcp = Rotation.from_euler("ZYX", [c, b, a], degrees=True) * Rotation.from_euler("Y", 180, degrees=True)
        q = ",".join(f"{each:.12f}" for each in np.roll(tcp.as_quat(), 1))
        at = f"[[{x},{y},{z}],[{q}],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"
        lines.append(f"    {'MoveL' if k else 'MoveJ'} {at},v10,fine,mill\\WObj:=table;\n")
    head = (
        "MODULE part\n  PERS tooldata mill:=[TRUE,[[0,0,250],[1,0,0,0]],[9,[0,0,99],[1,0,0,0],0,0,0]];\n"
        '  PERS wobjdata table:=[FALSE,TRUE,"",[[1550,0,800],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];\n  PROC main()\n'
    )
    return head + "".join(lines) + "  ENDPROC\nENDMODULE\n"


def as_ls(part):
    """Positions with W, P, R, which turn about the fixed axes x, y, z."""
    moves, positions = [], []
    for k, (x, y, z, a, b, c) in enumerate(part):
        tcp = Rotation.from_euler("ZYX", [c, b, a], degrees=True) * Rotation.from_euler("Y", 180, degrees=True)
        w, p, r = tcp.as_euler("xyz", degrees=True)
        moves.append(f"   {k + 3}:{'L' if k else 'J'} P[{k + 1}] {'10mm/sec' if k else '50%'} FINE    ;\n")
        at = f"X = {x} mm, Y = {y} mm, Z = {z} mm,\n\tW = {w:.12f} deg, P = {p:.12f} deg, R = {r:.12f} deg"
        positions.append(f"P[{k + 1}]{{\n   GP1:\n\tUF : 1, UT : 1,\t\tCONFIG : 'N U T, 0, 0, 0',\n\t{at}\n}};\n")
    head = "/PROG  PART\n/ATTR\nDEFAULT_GROUP\t= 1,*,*,*,*;\n/MN\n   1:  UFRAME_NUM=1 ;\n   2:  UTOOL_NUM=1 ;\n"
    return head + "".join(moves) + "/POS\n" + "".join(positions) + "/END\n"


def actuators(joints, which=""):
    return np.column_stack([joints[f"act_{a}{which}_rad"] for a in AXES])


def at_programmed_ends(joints, part):
    """Rows of the joint table that stand where the part has its points."""
    xyz = np.column_stack([joints[f"{axis}_mm"] for axis in "xyz"])
    rows = [np.flatnonzero(np.abs(xyz - point[:3]).max(axis=1) < 1e-9) for point in part]
    return [each[-1] for each in rows]


def joints_of(folder, name, text, *configs):
    (folder / name).write_text(text)
    out = folder / (name + ".csv")
    configs = [word for each in configs for word in ("--config", each)]
    done = camcomp("compensate", folder / name, *configs, "--joints", out)
    assert done.returncode == 0, done.stderr
    return table(out)


@pytest.mark.parametrize(("name", "spelled"), [("part.src", as_krl), ("part.mod", as_rapid), ("part.ls", as_ls)])
def test_one_part_in_nc_and_in_a_robot_language_has_one_actuator_path(tmp_path, name, spelled):
    fine = tmp_path / "fine.yaml"
    fine.write_text("control: {resolution_mm: 0.000001}\n")
    nc = joints_of(tmp_path, "part.nc", as_nc(PART), KUKA, fine)
    robot = joints_of(tmp_path, name, spelled(PART), KUKA, CONTROL, fine)
    one, other = at_programmed_ends(nc, PART), at_programmed_ends(robot, PART)
    assert np.abs(actuators(nc, "_nominal")[one] - actuators(robot, "_nominal")[other]).max() < 1e-8
    tips = [kuka_tips(actuators(each)[rows]) for each, rows in ((nc, one), (robot, other))]
    assert np.abs(tips[0] - tips[1]).max() < 1e-5  # mm
    # words of six decimals, rounded about other axes, turn joints by some 1e-8 rad
    assert np.abs(actuators(nc)[one] - actuators(robot)[other]).max() < 1e-8


def kuka_tips(q):
    return serial.settle(kuka.arm(weights=False), q, np.zeros(3)).tip


@pytest.mark.parametrize(
    ("name", "text"), [("slot.src", SLOT.read_text()), ("part.mod", as_rapid(PART)), ("part.ls", as_ls(PART))]
)
def test_an_output_holds_tip_and_orientation_on_an_arm_of_its_own(tmp_path, name, text):
    source = tmp_path / name
    source.write_text(text)
    done, joints, _, summary, data = compensated(tmp_path, source, [KUKA, CONTROL])
    assert done.returncode == 0 and summary["after"]["max_um"] <= 1.0 and summary["tilt_after_mrad"] < 0.01
    q, force = actuators(joints), np.column_stack([joints[f"f{axis}_N"] for axis in "xyz"])
    loaded = serial.settle(kuka.arm(), q, force)
    wanted = np.column_stack([joints[f"{axis}_mm"] for axis in "xyz"])
    assert np.abs(loaded.tip - wanted - ORIGIN).max() < 1.2e-3
    turned = Rotation.from_euler("ZYX", np.column_stack([joints[f"{each}_deg"] for each in "cba"]), degrees=True)
    assert np.abs(loaded.orientation - turned.as_matrix()).max() < 1e-5
    # what the text says, read by hand, is where the unloaded arm stands with these joints
    points, rotations = said_by(data.decode(), source.suffix)
    rigid = serial.settle(kuka.arm(weights=False), q, np.zeros(3))
    assert len(points) == len(q)
    assert np.abs(rigid.tip - points - ORIGIN).max() < 1e-4
    flange = rigid.orientation @ np.diag([-1.0, 1.0, -1.0])
    np.testing.assert_allclose(flange, rotations.as_matrix(), atol=2e-8)
    out = tmp_path / ("out" + source.suffix)
    out.write_bytes(data)
    words = ["--against", source, "--config", KUKA, "--config", CONTROL]
    assert camcomp("verify", out, *words).returncode == 0
    again = camcomp("compensate", out, *words[2:])
    assert again.returncode == 1 and b"CC603" in again.stderr


def said_by(text, ending):
    """Points (n, 3) and rotations of a program without arcs."""
    if ending == ".src":
        poses = said_by_krl(text)
        return poses[:, :3], Rotation.from_euler("ZYX", poses[:, 3:], degrees=True)
    if ending == ".mod":
        found = re.findall(r"Move[LJ] \[\[(.*?)\],\[(.*?)\]", text)
        at, q = (np.array([each[k].split(",") for each in found], float) for k in (0, 1))
        return at, Rotation.from_quat(np.roll(q, -1, axis=1))
    moves, positions = text.split("/POS")
    known = {
        number: re.findall(r"\b[XYZWPR] = (\S+)", body)
        for number, body in re.findall(r"P\[(\d+)\]\{(.*?)\}", positions, re.DOTALL)
    }
    poses = np.array([known[each] for each in re.findall(r":[JL] P\[(\d+)\]", moves)], float)
    return poses[:, :3], Rotation.from_euler("xyz", poses[:, 3:], degrees=True)


def said_by_krl(text):
    """Poses (n, 6); values that a statement omits stay."""
    held, out = dict.fromkeys("XYZABC", 0.0), []
    for line in text.splitlines():
        if re.match(r"(PTP|LIN) \{", line):
            held.update((k, float(v)) for k, v in re.findall(r"([XYZABC]) (-?[\d.]+)", line.split("}")[0]))
            out.append([held[each] for each in "XYZABC"])
    return np.array(out)


@pytest.mark.parametrize(("name", "spelled", "line"), [("part.mod", as_rapid, 8), ("part.ls", as_ls, 10)])
def test_a_log_of_a_turning_tool_is_that_of_an_arm_of_its_own(tmp_path, name, spelled, line):
    (tmp_path / name).write_text(spelled(PART))
    log = tmp_path / "log.csv"
    words = ["--config", KUKA, "--config", CONTROL, "--step-s", "0.3"]
    done = camcomp("simulate", tmp_path / name, *words, "-o", log)
    assert done.returncode == 0, done.stderr
    rows = table(log)
    q = np.column_stack([rows[f"cmd_{a}_rad"] for a in AXES])
    force = np.column_stack([rows[f"f{axis}_N"] for axis in "xyz"])
    loaded = serial.settle(kuka.arm(), q, force)  # the digits of a log are worth 0.5 urad a joint, 2 um together
    assert np.abs(loaded.tip - np.column_stack([rows[f"{axis}_mm"] for axis in "xyz"]) - ORIGIN).max() < 2e-3
    assert np.abs(loaded.drive - np.column_stack([rows[f"act_{a}_Nmm"] for a in AXES])).max() < 1500.0
    # where the unloaded arm stands is on the line of the program, with the orientation of that place
    rigid = serial.settle(kuka.arm(weights=False), q, np.zeros(3))
    tip = rigid.tip - ORIGIN
    on = np.flatnonzero(rows["line"] == line)  # the move that turns by 3 deg about Z while Y goes from 0 to 15
    share = tip[on, 1] / 15.0
    wanted = Rotation.from_euler("ZYX", np.column_stack((3 * share, 0 * share, 2 + 0 * share)), degrees=True)
    assert len(on) > 1 and np.abs(rigid.orientation[on] - wanted.as_matrix()).max() < 3e-6


def test_diagnosis_knows_where_a_turning_tool_is(tmp_path):
    """The log is the plant's: the twin predicts its tips from the logged set-points."""
    joints = joints_of(tmp_path, "part.src", as_krl(PART), KUKA, CONTROL)
    at = at_programmed_ends(joints, PART)
    ends = actuators(joints, "_nominal")[at]
    q = np.concatenate([a + np.linspace(0, 1, 40)[:, None] * (b - a) for a, b in pairwise(ends[1:])])
    tip = serial.settle(kuka.arm(), q, np.zeros(3)).tip - ORIGIN
    names = [f"cmd_{a}_rad" for a in AXES]
    rows = np.column_stack((0.05 * np.arange(len(q)), tip, q))
    head = ",".join(["t_s", "x_mm", "y_mm", "z_mm", *names])
    np.savetxt(tmp_path / "log.csv", rows, fmt="%.9f", delimiter=",", header=head, comments="")
    (tmp_path / "experiment.yaml").write_text(
        f"config: [{KUKA}, {CONTROL}]\nruns: [{{name: air, program: part.src, log: log.csv, cutting: false}}]\n"
    )
    opened = open_experiment(tmp_path / "experiment.yaml")
    sensed = opened.twin.sense(opened.runs[0].run_path)[0].tip
    assert np.abs(sensed - tip).max() < 2e-4


def test_the_length_of_the_tool_scatters_along_the_tool(tmp_path):
    spread = tmp_path / "spread.yaml"
    spread.write_text("tool: {length_mm: {value: 250, sd: 0.05}}\nprocess: {force: {model: none}}\n")
    done, joints, _, summary, data = compensated(tmp_path, SLOT, [KUKA, CONTROL, spread])
    assert done.returncode == 0
    assert abs(summary["expected"]["rms_um"] - 50.0) < 0.1 and summary["band"][0]["share"] > 0.999
    np.testing.assert_allclose(joints["band_um"][1:], 50.0 * 1.959964, rtol=0.01)
    (tmp_path / "out.src").write_bytes(data)
    words = ["--against", SLOT, *(word for each in (KUKA, CONTROL, spread) for word in ("--config", each))]
    found = camcomp("verify", tmp_path / "out.src", *words, "--json", "-")
    assert abs(json.loads(found.stdout)["expected"]["rms_um"] - 50.0) < 0.1


PARSE = """
import sys
from antlr4 import CommonTokenStream, InputStream
from krlLexer import krlLexer
from krlParser import krlParser
for name in sys.argv[1:]:
    parser = krlParser(CommonTokenStream(krlLexer(InputStream(open(name, newline="").read()))))
    parser.module()
    print(parser.getNumberOfSyntaxErrors())
"""


def errors_by_grammar(folder, texts):
    """How many errors the parser finds that ANTLR makes of the grammar that CAMCOMP_KRL_GRAMMAR names."""
    grammar = os.environ.get("CAMCOMP_KRL_GRAMMAR")
    if not grammar:
        pytest.skip("CAMCOMP_KRL_GRAMMAR does not name the public grammar krl.g4")
    tool = os.environ.get("CAMCOMP_ANTLR") or shutil.which("antlr4")
    if not tool or find_spec("antlr4") is None:
        pytest.skip("the tool antlr4 (in the path, or CAMCOMP_ANTLR) or its Python runtime is missing")
    shutil.copy(grammar, folder / "krl.g4")
    subprocess.run([tool, "-Dlanguage=Python3", "krl.g4"], cwd=folder, check=True, timeout=120)
    (folder / "parse.py").write_text(PARSE)
    for k, text in enumerate(texts):
        (folder / f"{k}.txt").write_bytes(text.encode())
    names = [f"{k}.txt" for k in range(len(texts))]
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "parse.py", *names], cwd=folder, check=True, capture_output=True
    )
    return [int(each) for each in done.stdout.split()]


def test_the_public_grammar_accepts_what_is_written(tmp_path):
    source = SLOT.read_text()
    joints = "PTP {A1 0,A2 -90,A3 90,A4 0,A5 40,A6 0,E1 0.0}\n"
    axes = source.replace("PTP {X", joints + "PTP {X").replace("END\n", joints + "END\n")
    texts = [source, axes.replace("\n", "\r\n")]
    for k, text in enumerate(texts[:]):
        folder = tmp_path / str(k)
        folder.mkdir()
        (folder / "in.src").write_bytes(text.encode())
        texts.append(compensated(folder, folder / "in.src", [KUKA, CONTROL])[4].decode())
    broken = source.replace("LIN {Z 0}", "LIN {Z 0")
    *found, wrong = errors_by_grammar(tmp_path, [*texts, broken])
    assert found == [0, 0, 0, 0]
    assert wrong > 0


def test_accuracy_is_asked_for_and_leaves_only_compliance(tmp_path):
    extra = tmp_path / "off.yaml"
    extra.write_text("effects: [{effect: joint_offset, target: A2, offset_rad: 0.001}]\n")
    accurate = tmp_path / "accurate.yaml"
    accurate.write_text("control: {absolute_accuracy: true}\n")
    plain = joints_of(tmp_path, "a.src", SLOT.read_text(), KUKA, CONTROL)
    off = joints_of(tmp_path, "b.src", SLOT.read_text(), KUKA, CONTROL, extra)
    both = joints_of(tmp_path, "c.src", SLOT.read_text(), KUKA, CONTROL, extra, accurate)
    assert np.abs(actuators(plain)[-1] - actuators(off)[-1]).max() > 9e-4
    assert np.abs(actuators(plain) - actuators(both)).max() == 0.0
    unstated = tmp_path / "unstated.yaml"
    unstated.write_text(Path(CONTROL).read_text().replace("  absolute_accuracy: false\n", ""))
    done = camcomp("compensate", SLOT, "--config", KUKA, "--config", unstated, "--dry-run")
    assert b"absolute_accuracy is not stated" in done.stderr
