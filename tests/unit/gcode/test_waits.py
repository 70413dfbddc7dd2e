"""Where a control stands still for something in front of a motion; recorded in tests/validation/recordings/inches_and_cycles."""

import numpy as np
import pytest

from camcomp.gcode.interpret import read_program
from camcomp.gcode.setup import Setup
from tests.validation.recordings import recording

BEGIN = "G21 G90 G64\nF600\nG1 X0 Y0 Z0\nG1 X9\n"


def waits(text, **setup):
    path = read_program((BEGIN + text + "M2\n").encode(), name="a.nc", setup=Setup(**setup)).path
    return path.waits[2:].tolist()


@pytest.mark.parametrize(
    "block",
    [
        "S900",
        "M3 S900",
        "M5",
        "M8",
        "M9",
        "M7",
        "G4 P0.1",
        "M0",
        "M1",
        "G49",
        "G55",
        "G92.1",
        "G10 L2 P1 X0",
        "M64 P0",
        "M66 P0 L0",
        "T1 M6",
    ],
)
def test_the_motion_behind_it_begins_at_rest(block):
    assert waits(f"{block}\nG1 Y9\nG1 X0\n") == [True, False]


@pytest.mark.parametrize(
    "block", ["F900", "G54", "(remark)", "G17", "G91.1", "G10 L2 P2 X0", "M62 P0", "M48", "G61\nG64", "T1"]
)
def test_what_goes_with_the_motion_is_waited_for_by_nobody(block):
    assert waits(f"{block}\nG1 Y9\nG1 X0\n") == [False, False]


def test_in_its_own_block_a_word_is_waited_for_first_and_a_stop_last():
    assert waits("G1 Y9 M8\nG1 X0\n") == [True, False]
    assert waits("G1 Y9 M0\nG1 X0\n") == [False, True]


def test_the_way_to_a_hole_begins_at_rest_behind_a_dwell_at_its_bottom():
    assert waits("G82 X9 Y9 Z-1 R1 P0.2\nG80\n")[-1]


def test_linuxcnc_stands_still_there_and_nowhere_else():
    """But for a message, which is a remark to others: it waits for that, too."""
    with recording.taken_from("inches_and_cycles"):
        found = recording.load("rests-fast")
    path = read_program(found.program.encode(), name="rests", setup=Setup(start_mm=tuple(found.tip[0].tolist()))).path
    texts = found.program.splitlines()
    cuts = [k for k in range(len(path) - 1) if path.line[k] > 7 and path.kind[k] == path.kind[k + 1]]
    assert len(cuts) > 25
    for k in cuts:
        missed = np.linalg.norm(found.tip - path.end[k], axis=1).min()
        message = any("MSG" in each for each in texts[path.line[k] : path.line[k + 1] - 1])
        assert (missed < 1e-4) == (path.waits[k + 1] or message), texts[path.line[k] - 1]
