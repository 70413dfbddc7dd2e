"""LinuxCNC's simulator, headless, with the machine of samples/linuxcnc, a screen of our own and a recorder of servo periods."""

import fcntl
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
from contextlib import contextmanager, nullcontext
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from camcomp.ground.files import shipped

needs_linuxcnc = pytest.mark.skipif(
    not (shutil.which("linuxcnc") and shutil.which("halcmd")), reason="LinuxCNC is not installed (linuxcnc-uspace)"
)
RECORDED = {  # columns of the recording, a row per servo period, and the pins or signals behind them
    "period": ("f", "period"),
    "answered": ("f", "answered"),
    "x": ("f", "tip-x"),
    "y": ("f", "tip-y"),
    "z": ("f", "tip-z"),
    "joint_x": ("f", "joint-0"),
    "joint_y": ("f", "joint-1"),
    "joint_z": ("f", "joint-2"),
    "tool": ("f", "tool-z"),
    "velocity": ("f", "velocity motion.current-vel"),
    "error": ("b", "error"),
    "wait": ("b", "wait"),
    "hold": ("b", "hold"),
    "on": ("b", "on"),
    "homed": ("b", "homed"),
}
ALONE = ["unshare", "--ipc", "--pid", "--net", "--mount", "--fork", "--mount-proc", "--kill-child"]
FIRST = ["nice", "-n", "-15"]  # before other tests, which may then run beside it
SECONDS = 150


def machine(folder, config, tools=""):
    """The sample machine in a folder, its screen replaced by that of the tests, and a recorder behind its HAL file."""
    for path in Path(shipped("samples/linuxcnc")).iterdir():
        shutil.copy(path, folder)
    program = folder / "camcomp"
    program.write_text(f'#!/bin/sh\nexec {sys.executable} -m camcomp "$@"\n')
    program.chmod(0o755)
    ini = (folder / "machine.ini").read_text()
    ini = ini.replace("DISPLAY = axis", f"DISPLAY = {Path(__file__).with_name('screen.py')}")
    ini = ini.replace("CONFIG = ../../config/cartesian.yaml", f"CONFIG = {config}")
    ini = ini.replace("COMMAND = camcomp", f"COMMAND = {program}")
    (folder / "machine.ini").write_text(ini)
    (folder / "tool.tbl").write_text(tools)
    with open(folder / "machine.hal", "a", encoding="utf-8") as file:
        kinds = "".join(kind for kind, _ in RECORDED.values())
        file.write(f"loadrt sampler depth=20000 cfg={kinds}\naddf sampler.0 servo-thread\n")
        file.writelines(
            f"net {signal_name} => sampler.0.pin.{number}\n"
            for number, (_, signal_name) in enumerate(RECORDED.values())
        )


@contextmanager
def in_turn():
    """There is one LinuxCNC at a time where name spaces of its own are not allowed; other runs of these tests wait."""
    with open(Path(tempfile.gettempdir()) / f"camcomp-linuxcnc-{os.getuid()}.lock", "w", encoding="utf-8") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield


def separate():
    """Whether a LinuxCNC can have shared memory, processes and ports of its own."""
    return (
        bool(shutil.which("ip")) and subprocess.run([*ALONE, "true"], capture_output=True, check=False).returncode == 0
    )


@cache
def goes_first():
    """Whether a LinuxCNC may be put before all else that the computer does."""
    return subprocess.run([*FIRST, "true"], capture_output=True, text=True, check=False).stderr == ""


def simulate(folder, scenario, **settings):
    """Runs a scenario of screen.py: what it wrote down, and what LinuxCNC printed."""
    task, answer = folder / "task.json", folder / "answer.json"
    task.write_text(json.dumps({"scenario": scenario, "answer": str(answer), **settings}))
    names = {"SCREEN": str(task), "RTAPI_FIFO_PATH": str(folder / "fifo"), "HOME": str(folder), "RUNTESTS": "yes"}
    env = {name: value for name, value in os.environ.items() if name != "DISPLAY"} | names
    if os.getuid() == 0:  # the simulator does not want to run as root
        env["RTAPI_UID"] = "65534"
        folder.chmod(0o777)
    command, turn = ["linuxcnc", str(folder / "machine.ini")], in_turn()
    if separate():
        command, turn = [*ALONE, "sh", "-c", 'ip link set lo up; exec "$@"', "sh", *command], nullcontext()
    if goes_first():
        command = [*FIRST, *command]
    with turn:
        process = subprocess.Popen(
            command,
            cwd=folder,
            env=env,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            stdin=subprocess.DEVNULL,
            start_new_session=True,
        )
        with process:
            try:
                said, _ = process.communicate(timeout=SECONDS)
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, signal.SIGTERM)
                said, _ = process.communicate()
    seen = json.loads(answer.read_text()) if answer.exists() else {"error": "no answer"}
    load = os.getloadavg()[0] / (os.cpu_count() or 1)
    if seen.get("busy") and load > 2:
        pytest.skip(f"{load:.1f} processes wait for each processor: no place for a control in real time")
    return seen, said.decode(errors="replace")


def recording(path):
    """The recording: an array per column of RECORDED, a row per servo period; none may be missing."""
    lines = Path(path).read_text().splitlines()
    rows = np.array([line.split() for line in lines if len(line.split()) == len(RECORDED)], float)
    assert len(rows) and (np.diff(rows[:, 0]) == 1).all(), "servo periods are missing in the recording"
    return dict(zip(RECORDED, rows.T, strict=True))
