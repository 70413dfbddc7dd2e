"""Records what LinuxCNC's planner commands while it runs the programs of a set: `python -m tests.validation.recordings.record`.

Needs Debian's linuxcnc-uspace, iproute2 and the rights to make name spaces of its own, so that no other LinuxCNC on the
computer is in the way.  HAL's sampler writes the commanded tip, the line and the kind of motion at every servo cycle of
1 ms; `shorten` keeps all of them, in steps of 10 nm (see recording.py), cut to MARGIN before and behind the motion.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from tests.validation.recordings import recording

HERE = Path(__file__).parent
MARGIN = 0.25  # s of standstill kept at both ends
AXES = "XYZ"

INI = """[EMC]
VERSION = 1.1
MACHINE = recorded
[DISPLAY]
DISPLAY = {attendant}
[TASK]
TASK = milltask
CYCLE_TIME = 0.001
[RS274NGC]
PARAMETER_FILE = linuxcnc.var
[EMCMOT]
EMCMOT = motmod
SERVO_PERIOD = 1000000
COMM_TIMEOUT = 10.0
[EMCIO]
EMCIO = io
TOOL_TABLE = tools.tbl
[HAL]
HALFILE = machine.hal
[KINS]
KINEMATICS = trivkins coordinates=XYZ
JOINTS = 3
[TRAJ]
COORDINATES = X Y Z
LINEAR_UNITS = mm
ANGULAR_UNITS = degree
DEFAULT_LINEAR_VELOCITY = {half}
MAX_LINEAR_VELOCITY = {velocity}
DEFAULT_LINEAR_ACCELERATION = {acceleration}
MAX_LINEAR_ACCELERATION = {acceleration}
ARC_BLEND_ENABLE = 1
"""
AXIS = """[AXIS_{name}]
MIN_LIMIT = -150
MAX_LIMIT = 150
MAX_VELOCITY = {velocity}
MAX_ACCELERATION = {acceleration}
[JOINT_{number}]
TYPE = LINEAR
MIN_LIMIT = -151
MAX_LIMIT = 151
MAX_VELOCITY = {faster}
MAX_ACCELERATION = {harder}
HOME_SEQUENCE = 0
"""
HAL = """loadrt [KINS]KINEMATICS
loadrt [EMCMOT]EMCMOT servo_period_nsec=[EMCMOT]SERVO_PERIOD num_joints=[KINS]JOINTS
loadrt sampler depth=150000 cfg=fffss
addf motion-command-handler servo-thread
addf motion-controller servo-thread
addf sampler.0 servo-thread
setp sampler.0.enable 0
net joint-x joint.0.motor-pos-cmd => joint.0.motor-pos-fb
net joint-y joint.1.motor-pos-cmd => joint.1.motor-pos-fb
net joint-z joint.2.motor-pos-cmd => joint.2.motor-pos-fb
net tip-x axis.x.pos-cmd => sampler.0.pin.0
net tip-y axis.y.pos-cmd => sampler.0.pin.1
net tip-z axis.z.pos-cmd => sampler.0.pin.2
net line motion.program-line => sampler.0.pin.3
net kind motion.motion-type => sampler.0.pin.4
net enable iocontrol.0.user-enable-out => iocontrol.0.emc-enable-in
net turning spindle.0.speed-out-rps => spindle.0.speed-in
net prepared iocontrol.0.tool-prepare => iocontrol.0.tool-prepared
net changed iocontrol.0.tool-change => iocontrol.0.tool-changed
"""


def write_machine(folder: Path) -> None:
    """INI, HAL file and empty tool table of three axes with perfect drives."""
    velocity, acceleration = recording.limits()
    values = {"velocity": velocity, "half": velocity / 2, "acceleration": acceleration}
    values |= {"faster": 1.1 * velocity, "harder": 1.1 * acceleration}
    attendant = folder / "attendant.py"
    attendant.write_text((HERE / "attendant.py").read_text())
    attendant.chmod(0o755)
    ini = INI.format(attendant=attendant, **values)
    ini += "".join(AXIS.format(name=name, number=i, **values) for i, name in enumerate(AXES))
    (folder / "machine.ini").write_text(ini)
    (folder / "machine.hal").write_text(HAL)
    (folder / "tools.tbl").write_text("")


def run(folder: Path, jobs: list[dict]) -> str:
    """Runs the jobs in a LinuxCNC that is alone in its name spaces, and returns its output."""
    (folder / "jobs.json").write_text(json.dumps(jobs))
    for path in (folder, *folder.iterdir()):  # LinuxCNC does not want to run as root
        path.chmod(0o777)
    env = {key: value for key, value in os.environ.items() if key != "DISPLAY"}
    env |= {"RECORDING_JOBS": str(folder / "jobs.json"), "HOME": str(folder), "RUNTESTS": "1"}
    env |= {"RTAPI_UID": "65534", "RTAPI_FIFO_PATH": str(folder / "fifo")}
    alone = ["unshare", "--ipc", "--pid", "--net", "--mount", "--fork", "--mount-proc", "--kill-child"]
    inside = ["sh", "-c", 'ip link set lo up; exec linuxcnc "$0"', str(folder / "machine.ini")]
    done = subprocess.run(
        [*alone, *inside], cwd=folder, env=env, stdin=subprocess.DEVNULL, stdout=-1, stderr=-2, timeout=900, check=False
    )
    return done.stdout.decode(errors="replace")


def samples(path: Path) -> np.ndarray:
    """Rows (n, 5) x, y, z, line, kind of halsampler's file; raises where it says that samples were lost."""
    rows = [line.split() for line in path.read_text().splitlines() if line and not line.startswith("overrun")]
    values = np.array([row for row in rows if len(row) == 6], float)
    if len(values) < 100 or np.any(np.diff(values[:, 0]) != 1):
        raise RuntimeError(f"{path.name}: {len(values)} samples, some lost")
    return values[:, 1:]


def shorten(values: np.ndarray) -> np.ndarray:
    """Without the standstill before the first and behind the last motion, but for MARGIN of it."""
    moves = np.flatnonzero(np.any(np.diff(values[:, :3], axis=0) != 0, axis=1))
    margin = round(MARGIN / recording.STEP_S)
    return values[max(moves[0] - margin, 0) : moves[-1] + 1 + margin]


def main() -> int:
    """Records the named programs, or all of them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help="stems of programs; default: all")
    parser.add_argument("--raw", type=Path, help="keep halsampler's own files in this folder")
    parser.add_argument("--set", dest="of", choices=recording.SETS, default="pockets")
    chosen = parser.parse_args()
    with recording.taken_from(chosen.of):
        return record(chosen.names, chosen.raw)


def record(names: list[str], raw: Path | None) -> int:
    """Records programs of the set, all where none is named; raw: where halsampler's own files are kept. Exit status."""
    events = json.loads((recording.folder() / "events.json").read_text())
    names = names or sorted(path.stem for path in (recording.folder() / "programs").glob("*.nc"))
    with tempfile.TemporaryDirectory() as place:
        folder, jobs = Path(place), []
        write_machine(folder)
        for name in names:
            program = folder / f"{name}.nc"
            program.write_text((recording.folder() / "programs" / f"{name}.nc").read_text())
            jobs.append(
                {"program": str(program), "samples": str(folder / f"{name}.samples"), "events": events.get(name, [])}
            )
        said = run(folder, jobs)
        for job in jobs:
            path = Path(job["samples"])
            if not path.exists():
                print(f"{path.stem}: nothing was recorded\n{said[-2000:]}", file=sys.stderr)
                return 1
            if raw:
                raw.mkdir(parents=True, exist_ok=True)
                (raw / path.name).write_bytes(path.read_bytes())
            values = shorten(samples(path))
            recording.save(path.stem, values)
            print(f"{path.stem}: {len(values) * recording.STEP_S:.2f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main())
