"""The HAL component of samples/linuxcnc in LinuxCNC's own simulator, without a screen, joints read back through HAL."""

import fcntl
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from camcomp.compensation.set_points.stream import Stream
from camcomp.ground.files import shipped
from camcomp.model.config.load import load_config
from camcomp.model.job import Job

pytestmark = pytest.mark.skipif(
    not (shutil.which("linuxcnc") and shutil.which("halcmd")), reason="LinuxCNC is not installed (linuxcnc-uspace)"
)
CONFIG = shipped("config/cartesian.yaml")
STEPS = [
    ("G21 G90 G0 X0 Y0 Z0", (0.0, 0.0, 0.0)),
    ("G0 X10 Y5 Z-2", (0.0, 0.0, 0.0)),
    ("G1 X12 Y5 F600", (-400.0, 300.0, -800.0)),
    ("G1 X-20 Y8.5 Z1", (215.0, -10.0, -25.0)),
    ("G2 X-20 Y-8.5 I0 J-8.5", (1000.0, 2000.0, 4000.0)),
    ("G0 X0 Y0", (0.0, 0.0, 0.0)),
]


def machine(folder):
    """The sample machine in a folder, its screen replaced by that of the test."""
    for path in Path(shipped("samples/linuxcnc")).iterdir():
        shutil.copy(path, folder)
    program = folder / "camcomp"
    program.write_text(f'#!/bin/sh\nexec {sys.executable} -m camcomp "$@"\n')
    program.chmod(0o755)
    ini = (folder / "machine.ini").read_text()
    ini = ini.replace("DISPLAY = axis", f"DISPLAY = {Path(__file__).with_name('screen.py')}")
    ini = ini.replace("CONFIG = ../../config/cartesian.yaml", f"CONFIG = {CONFIG}")
    ini = ini.replace("COMMAND = camcomp", f"COMMAND = {program}")
    (folder / "machine.ini").write_text(ini)
    (folder / "tool.tbl").write_text("")


@contextmanager
def alone():
    """There can be one LinuxCNC on a machine at a time; other runs of this test wait."""
    with open(Path(tempfile.gettempdir()) / f"camcomp-linuxcnc-{os.getuid()}.lock", "w", encoding="utf-8") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield


def simulate(folder):
    """What it saw, and what LinuxCNC printed."""
    task, answer = folder / "task.json", folder / "answer.json"
    task.write_text(json.dumps({"steps": STEPS, "answer": str(answer)}))
    env = dict(os.environ, SCREEN=str(task), RTAPI_FIFO_PATH=str(folder / "fifo"), HOME=str(folder))
    if os.getuid() == 0:  # the simulator does not want to run as root
        env["RTAPI_UID"] = "65534"
        folder.chmod(0o777)
    command = ["linuxcnc", str(folder / "machine.ini")]
    with (
        alone(),
        subprocess.Popen(
            command,
            cwd=folder,
            env=env,
            stdout=-1,
            stderr=subprocess.STDOUT,
            stdin=subprocess.DEVNULL,
            start_new_session=True,
        ) as process,
    ):
        try:
            said, _ = process.communicate(timeout=120)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGTERM)
            said, _ = process.communicate()
    return json.loads(answer.read_text()) if answer.exists() else {"error": "no answer"}, said.decode(errors="replace")


@pytest.fixture
def folder():
    """A folder that another user can reach, unlike that of pytest."""
    with tempfile.TemporaryDirectory() as name:
        yield Path(name)


def test_the_joints_go_where_camcomp_sends_them(folder):
    machine(folder)
    seen, said = simulate(folder)
    assert "error" not in seen, f"{seen}\n{said}"
    stream = Stream(Job(load_config([CONFIG])))
    programmed = [(0, 0, 0), (10, 5, -2), (12, 5, -2), (-20, 8.5, 1), (-20, -8.5, 1), (0, 0, 1)]
    largest = 0.0
    for row, tip, (code, force) in zip(seen["rows"], programmed, STEPS, strict=True):
        point = stream.correct(tip, force)
        assert row["error"] == "FALSE"
        assert np.abs(np.array(row["joints"]) - point.actuators).max() <= 1.01e-4, (code, row)  # a count is 0.1 um
        assert np.array(row["drive"]) == pytest.approx(point.drive, abs=1e-3)
        largest = max(largest, np.abs(np.array(row["joints"]) - tip).max())
    assert largest == pytest.approx(0.1, abs=1e-3)  # 2000 N against 20 000 N/mm
