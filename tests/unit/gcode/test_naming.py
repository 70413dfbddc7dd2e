"""Names of codes, and our modal groups against those of pygcode."""

import subprocess
import sys

import pytest

from camcomp.gcode.codes import GROUPS, code_name
from camcomp.gcode.naming import _class_of, name_of, named


@pytest.mark.parametrize(
    ("word", "name"), [("G1", "linear move"), ("G43.1", "dynamic tool length offset"), ("G4", "dwell"), ("G199", "")]
)
def test_names(word, name):
    assert name_of(word) == name
    assert named(word) == (f"{word} ({name})" if name else word)


def test_our_modal_groups_are_those_of_pygcode():
    compared = 0
    for code, group in GROUPS.items():
        theirs = getattr(_class_of(code_name(code)), "modal_group", None)
        if theirs is not None:
            compared += 1
            assert theirs == group, code_name(code)
    assert compared > 40


def test_reading_a_program_does_not_import_pygcode():
    script = (
        "import sys; from camcomp.gcode.interpret import read_program; read_program(b'G0 X1', name='x'); "
        "sys.exit('pygcode' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", script], check=False, timeout=60).returncode == 0
