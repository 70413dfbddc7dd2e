"""Where on the table a program is cut best, against a screw whose error grows in closed form with the place."""

import json
import re

import numpy as np
import pytest

from camcomp.api.compensation import compensate
from camcomp.api.machine import Job, load_machine
from camcomp.api.placing import MachineTable, place
from camcomp.compensation.placing.search import placed, start_postures
from camcomp.terminal.cli import run
from tests.commandline import ROOT

CARTESIAN, KUKA = ROOT / "config/cartesian.yaml", ROOT / "config/kuka-kr210.yaml"
LINE = b"G21 G90\nG0 X-5 Y0 Z0\nG1 X5 F600\nX-5\nM2\n"
PITCH = "effects: [{effect: screw_pitch, target: x, error_ppm: PPM}]\nworkpiece: {origin_mm: [100, 0, 0]}\n"


def machine(folder, ppm="100"):
    (folder / "pitch.yaml").write_text(PITCH.replace("PPM", ppm))
    return load_machine(CARTESIAN, ROOT / "config/no-force.yaml", folder / "pitch.yaml")


def test_what_is_left_follows_the_error_of_the_screw_and_the_best_place_is_at_its_home(tmp_path):
    found = place(LINE, machine(tmp_path), MachineTable((-200.0, 200.0), (0.0, 0.0), 5, (0.0,))).result
    assert found.judged_by == "before" and found.motions == (3, 3)
    for each in found.placements:
        assert each.judged_um == pytest.approx(
            0.1 * (abs(each.x_mm) + 5.0), abs=0.06
        )  # 100 ppm, decimals of the program
    assert (found.best.x_mm, found.stated.x_mm) == (0.0, 100.0)


def test_a_turned_program_keeps_off_the_axis_that_errs(tmp_path):
    found = place(LINE, machine(tmp_path), MachineTable((0.0, 0.0), (0.0, 0.0), 1, (0.0, 90.0))).result
    assert found.best.turn_deg == 90.0 and found.best.judged_um < 0.06
    assert {each.turn_deg: round(each.judged_um, 1) for each in found.placements[1:]} == {0.0: 0.5, 90.0: 0.0}


def test_uncertain_numbers_are_judged_by_their_band(tmp_path):
    found = place(
        LINE, machine(tmp_path, "{value: 100, sd: 10}"), MachineTable((0.0, 400.0), (0.0, 0.0), 2, (0.0,))
    ).result
    near, far = (next(e for e in found.placements if e.x_mm == x) for x in (0.0, 400.0))
    assert found.judged_by == "band" and found.best.x_mm == 0.0
    # p95 of |10 ppm N(0, 1)| over a stroke about X400, 1.96 deviations
    assert far.band_p95_um == pytest.approx(1.96 * 10e-3 * 400.0, rel=0.15) and near.band_p95_um < 0.2


def test_places_beyond_the_travel_are_none(tmp_path):
    found = place(LINE, machine(tmp_path), MachineTable((9900.0, 10100.0), (0.0, 0.0), 3, (0.0,))).result
    why = {each.x_mm: each.why for each in found.placements if each.posture == "stated"}
    assert why[9900.0] == "" and "leaves its travel" in why[10000.0] and "leaves its travel" in why[10100.0]


def test_of_long_programs_single_motions_are_judged_the_outermost_included(tmp_path):
    x = 20.0 * np.sin(np.arange(500) / 7.0)
    x[123] = 80.0
    text = "G21 G90\nG0 X0 Y0 Z0\n" + "".join(f"G1 X{each:.4f} F600\n" for each in x) + "M2\n"
    found = place(text.encode(), machine(tmp_path), MachineTable((0.0, 0.0), (0.0, 0.0), 1, (0.0,))).result
    assert found.motions[0] < 80 < found.motions[1]
    assert found.best.judged_um == pytest.approx(8.0, abs=0.1)


def test_other_postures_reach_the_same_points_with_other_angles():
    job = load_machine(KUKA)
    starts = start_postures(job)
    assert "wrist flipped" in starts and len(starts) <= 7
    sides = []
    for posture in ("stated", "wrist flipped"):
        joints = compensate(LINE, Job(placed(job.config, (1550.0, 0.0, 0.0, posture), starts))).joints
        sides.append(joints.array("act_A1_nominal_rad", "act_A5_nominal_rad"))
    assert sides[0][:, 0] == pytest.approx(sides[1][:, 0]) and sides[0][:, 1] == pytest.approx(-sides[1][:, 1])
    assert abs(sides[0][:, 1]).min() > 1.0


def test_every_posture_holds_the_platform_at_its_start_pose(tmp_path):
    """Against the product of the DH matrices of the machine file."""
    (tmp_path / "free.yaml").write_text(re.sub(r"limits_deg: \[.*?\],", "", KUKA.read_text()))
    job = load_machine(tmp_path / "free.yaml")
    stated = {name: each.start_deg for name, each in job.config.robot.actuators.items()}
    starts = start_postures(job)
    assert {"elbow flipped", "shoulder flipped", "shoulder and elbow and wrist flipped"} <= set(starts)
    wanted = tip_of(stated.values())
    for angles in starts.values():
        assert tip_of(angles.values()) == pytest.approx(wanted, abs=1e-6)


def tip_of(angles):
    """Pose (4, 4) of the flange of the KUKA from its joint angles (deg), DH table of the machine file."""
    table = [
        (350, -90, 449.4, 0),
        (1150, 0, 0, 0),
        (41, -90, 0, 90),
        (0, 90, -1200, 0),
        (0, -90, 0, 0),
        (0, 180, -420, 180),
    ]
    pose = np.eye(4)
    for (a, alpha, d, theta), angle in zip(table, angles, strict=True):
        c, s, ca, sa = (f(np.radians(v)) for v in (theta + angle, alpha) for f in (np.cos, np.sin))
        pose = pose @ [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]]
    return pose


def test_the_verb_writes_result_and_map_and_says_where(tmp_path, capfd):
    machine(tmp_path)
    (tmp_path / "part.nc").write_bytes(LINE)
    words = ["place", str(tmp_path / "part.nc"), "--config", str(CARTESIAN), "--config", str(tmp_path / "pitch.yaml")]
    (tmp_path / "far.yaml").write_text("workpiece: {origin_mm: [20000, 0, 0]}\n")
    words += ["--x-mm", "-100", "100", "--y-mm", "0", "0", "--steps", "3", "--turn-deg", "0"]
    out, page = tmp_path / "out.json", tmp_path / "out.html"
    assert run([*words, "--json", str(out), "--report", str(page)]) == 0
    assert "write: workpiece: {origin_mm: [0, 0, 0], rotation_deg: 0}" in capfd.readouterr().err
    assert json.loads(out.read_text())["best"]["x_mm"] == 0.0
    assert "Map of the table" in page.read_text(encoding="utf-8")
    assert run([*words, "--config", str(tmp_path / "far.yaml"), "--x-mm", "20000", "30000"]) == 1
    assert "CC610" in capfd.readouterr().err
