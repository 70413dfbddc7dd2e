"""Programs that use what controls can do: read as LinuxCNC reads them, and kept as text of the canonical path."""

from pathlib import Path

import pytest

from camcomp.gcode.canon import canonical
from camcomp.gcode.interpret import read_program
from camcomp.gcode.setup import Setup
from tests.oracles import compare, rs274

FOLDER = Path(__file__).parent / "programs"
FILES = sorted(each for each in FOLDER.iterdir() if each.suffix != ".canon")
TOOLS = {1: 12.5, 2: 30.0}
HOMES = {28: (1.0, 2.0, 50.0), 30: (-5.0, 4.0, 60.0)}
SETUP = Setup(tools=TOOLS, home_mm=HOMES[28], second_home_mm=HOMES[30])


@rs274.needs_rs274
@pytest.mark.parametrize("path", [each for each in FILES if each.suffix == ".ngc"], ids=lambda path: path.stem)
def test_motions_are_those_of_linuxcnc(path):
    run = rs274.run(path.read_bytes(), tools=TOOLS, homes=HOMES)
    assert run.error == ""
    assert compare.difference(read_program(path.read_bytes(), name=path.name, setup=SETUP), run) == ""


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_canonical_path_is_the_one_that_was_checked(path):
    program = read_program(path.read_bytes(), name=path.name, setup=SETUP)
    expected = path.with_suffix(path.suffix + ".canon").read_text(encoding="utf-8").splitlines()
    assert list(canonical(program.path)) == expected
