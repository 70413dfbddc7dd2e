"""Feed moves that pass uncorrected are counted, with their reason and the first line, in every language."""

import numpy as np
import pytest

from camcomp.gcode.interpret import read_program
from camcomp.gcode.robot_frames import RobotFrames
from camcomp.gcode.setup import Setup

BEFORE = "2 of 2 feed moves come before X, Y and Z have all been commanded"
MACHINE = "1 of 2 feed moves are given in machine coordinates"
PLACE = "come from a place that the program does not state"


def said(text, dialect=None, **frames):
    setup = Setup(orients=True, frames=lambda: RobotFrames(**frames)) if frames else Setup()
    found = read_program(text.encode(), name="p.nc", setup=setup, dialect=dialect).warnings
    return [each for each in found if "[CC146]" in each]


@pytest.mark.parametrize("dialect", ["rs274", "fanuc", "grbl", "sinumerik", None])
@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        ("G1 X1. Y1. F100\nX100.\nM30\n", 1, BEFORE),
        ("G90\nG0 X0 Y0\nG1 X5. F100\nG2 X6. I0.5 J0.\nG0 Z2.\nM30\n", 3, BEFORE),
        ("G0 X0 Y0 Z5.\nG1 X5. F100\nG53 G1 X7. F100\nM30\n", 3, MACHINE),
        (
            "G0 X0 Y0 Z5.\nG1 X5. F100\nM30\nG1 X9.\n(G1 X10.)\nX11.\n",
            4,
            "lines with moves behind the end of the program (2)",
        ),
    ],
)
def test_what_passes_uncorrected_is_said_with_count_and_first_line(text, dialect, line, message):
    if dialect == "sinumerik":
        text = text.replace("(G1 X10.)", "; G1 X10.")
    found = said(text, dialect)
    if dialect == "fanuc" and "G53" in text:  # it makes a rapid of the line
        assert found == []
    else:
        assert len(found) == 1 and found[0].startswith(f"p.nc:{line}: {message}")


def test_what_is_corrected_is_not_mentioned():
    assert said("G0 X0 Y0 Z5\nG1 X5 F100\nG28 X0\nG53 G0 Z0\nG0 X0 Y0 Z1\nG1 X3\nM30\n(G1 X2)\n%\n") == []


def test_a_cut_of_a_robot_without_a_start_is_said():
    frames = {"tip": np.array([0.0, 0.0, 250.0]), "flange": np.eye(3)}
    krl = "DEF p ( )\n$VEL.CP = 0.02\nLIN {X 0,Y 0,Z 10,A 0,B 0,C 0}\nLIN {X 5}\nEND\n"
    (warning,) = said(krl, **frames)
    assert warning == f"p.nc:3: 1 of 2 feed moves {PLACE}, and pass uncorrected [CC146]"
    assert said(krl.replace("LIN {X 0", "PTP {X 0"), **frames) == []


def test_a_main_program_that_begins_again_is_said():
    found = read_program(b"O1\nG0 X0. Y0. Z5.\nG1 X2. F100\nM99\n", name="p.nc", dialect="fanuc").warnings
    assert any(each.startswith("p.nc:4: M99") and "runs once" in each for each in found)
