"""Singular lines, limits and branches of arms, reported with the source line they stand on."""

from pathlib import Path

import numpy as np
import pytest

from camcomp.compensation.program.posture import check_posture
from camcomp.gcode.interpret import read_program
from camcomp.ground.errors import PhysicsError
from camcomp.model.config.load import load_config
from camcomp.model.job import Job
from camcomp.model.statics.target import settle
from tests.commandline import camcomp

ARM = "config/kuka-kr210.yaml"


def run(tmp_path, program, override=""):
    file = tmp_path / "part.nc"
    file.write_text("G21 G90 G17 G94\nG54\n" + program + "M30\n")
    more = []
    if override:
        (tmp_path / "over.yaml").write_text(override)
        more = ["--config", tmp_path / "over.yaml"]
    return camcomp("compensate", file, "--config", ARM, *more, "-o", tmp_path / "out.nc")


def arm_with(tmp_path, **start):
    """The arm with other start angles, as a machine file."""
    text = open_text()
    for name, angle in start.items():
        head, rest = text.split(f"name: {name},", 1)
        old = rest.split("start_deg: ", 1)[1].split(",", 1)[0]
        text = f"{head}name: {name}," + rest.replace(f"start_deg: {old},", f"start_deg: {angle},", 1)
    file = tmp_path / "arm.yaml"
    file.write_text(text)
    return file


def open_text():
    return Path(ARM).read_text()


def test_limits_are_reported_with_their_lines_in_degrees(tmp_path):
    arm = tmp_path / "arm.yaml"
    arm.write_text(open_text().replace("limits_deg: [-120, 155]", "limits_deg: [-120, 105]"))
    program = tmp_path / "part.nc"
    program.write_text("G21 G90 G17 G94\nG0 X0 Y0 Z0\n(towards the base)\nG1 X-300 F3000\nM30\n")
    done = camcomp("compensate", program, "--config", arm, "-o", tmp_path / "out.nc")
    text = done.stderr.decode()
    assert done.returncode == 1, text
    assert "CC602" in text and "actuator A3 leaves its travel -120 to 105 deg at source line 4" in text


def test_out_of_reach_names_the_line(tmp_path):
    done = run(tmp_path, "G0 X0 Y0 Z0\nG1 X3000 F3000\n")
    text = done.stderr.decode()
    assert done.returncode == 4, text
    assert "CC302" in text and "part.nc:4:" in text


def level(tmp_path, moves):
    """Compensates moves with the spindle level, where a level forearm straightens the wrist (at X0 Y0 of the program)."""
    arm = arm_with(tmp_path, A5=8)
    over = tmp_path / "level.yaml"
    over.write_text("workpiece: {origin_mm: [1900, 0, 1700], rotation_vector_deg: [0, -90, 0]}\n")
    program = tmp_path / "part.nc"
    program.write_text("G21 G90 G17 G94\n" + moves + "M30\n")
    return camcomp("compensate", program, "--config", arm, "--config", over, "-o", tmp_path / "out.nc")


def test_a_nearly_straight_wrist_is_a_warning_with_its_lines(tmp_path):
    done = level(tmp_path, "G0 X210 Y30 Z100\nG1 Y20 F600\nG1 X100\nG1 Y30\nG1 X220\n")
    text = done.stderr.decode()
    assert done.returncode == 0, text
    assert "warning: near a singular configuration at source lines 4, 5, 6: nearest at line" in text


def test_a_straight_wrist_is_refused_on_its_line(tmp_path):
    done = level(tmp_path, "G0 X100 Y30 Z100\nG1 Y20 F600\nG1 X-4 Y0\nG1 Y-20\n")
    text = done.stderr.decode()
    assert done.returncode == 4, text
    assert "CC303" in text and "part.nc:4:" in text


def test_the_branch_of_the_start_angles_is_kept(tmp_path):
    flipped = arm_with(tmp_path, A4=180, A5=-90, A6=-180)
    up, down = Job(load_config([ARM])), Job(load_config([flipped]))
    tip = [[1550.0, 10.0, 800.0]]
    wrist = [settle(job.machine, tip, [[0.0, 0.0, 0.0]])[1].rho[0, 4] for job in (up, down)]
    assert wrist[0] > 0 > wrist[1]
    assert wrist[0] == pytest.approx(-wrist[1], abs=1e-6)


def test_a_change_of_branch_between_two_points_is_refused_on_its_line():
    job = Job(load_config([ARM]))
    program = read_program(b"G21 G90\nG1 X0 Y0 Z0 F600\nG1 X1\nG1 X2\n", name="part.nc")
    tip = np.array([[1550.0, 0.0, 800.0], [1551.0, 0.0, 800.0], [1552.0, 0.0, 800.0]])
    rho = settle(job.machine, tip, np.zeros((3, 3)))[1].rho
    line = np.array([2, 3, 4])
    assert check_posture(program, job, line, tip, rho) == []
    rho[2] = [*rho[2, :3], rho[2, 3] + np.pi, -rho[2, 4], rho[2, 5] - np.pi]  # same pose, wrist turned over
    with pytest.raises(PhysicsError) as caught:
        check_posture(program, job, line, tip, rho)
    assert caught.value.rule == "CC305"
    assert caught.value.at.line == 4
