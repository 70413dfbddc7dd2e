"""Imported once by the server from which the processes of the campaign fork: all is loaded and compiled by then."""

import os
import tempfile
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

from camcomp.terminal import cli
from tests.commandline import ROOT

with tempfile.TemporaryDirectory() as folder:
    machine, program = str(ROOT / "config" / "orthoglide.yaml"), str(ROOT / "samples" / "groove-circle-2.nc")
    made = [str(Path(folder, name)) for name in ("a.nc", "a.csv", "a.json", "b.csv", "c.csv")]
    with open(os.devnull, "w") as nobody, redirect_stdout(nobody), redirect_stderr(nobody):
        cli.run(["compensate", program, "--config", machine, "-o", made[0], "--joints", made[1], "--summary", made[2],
                 "--paths", made[3]])  # fmt: skip
        cli.run(["simulate", program, "--config", machine, "-o", made[4]])
        cli.run(["compare", made[4], made[4], "--json", made[2]])
        cli.run(["validate", machine, program, "--json", made[2]])
