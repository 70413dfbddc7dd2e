"""Imports of a run once everything is compiled: not what numba needs for compiling only."""

import subprocess
import sys

from camcomp.ground.files import shipped
from tests.benchmarks.programs import groove
from tests.commandline import ROOT

SCRIPT = """
import sys
from camcomp.compensation import file_to_file
from camcomp.terminal.cli import run
file_to_file.LONG = 1
assert run(sys.argv[1:]) == 0
print(*(each for each in ("numba.np.arraymath", "numba.np.linalg", "scipy.linalg") if each in sys.modules))
"""


def test_compiled_code_is_loaded_without_the_declarations_for_compiling(tmp_path):
    program = tmp_path / "p.nc"
    program.write_text("\n".join(groove(150)) + "\n")
    arguments = [
        "compensate",
        program,
        "--config",
        shipped("config/cartesian.yaml"),
        "-o",
        tmp_path / "o.nc",
        "--quiet",
    ]
    for _ in range(2):  # what is not compiled yet is so after the first one
        command = [sys.executable, "-c", SCRIPT, *map(str, arguments)]
        told = subprocess.run(command, check=True, capture_output=True, text=True, cwd=ROOT).stdout
    assert told.split() == []
