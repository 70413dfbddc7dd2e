"""Programs opened through camcomp in LinuxCNC's simulator, on a machine with play that HAL puts behind one drive.

The play is the operator of Prandtl, by LinuxCNC's own components: the carriage keeps its place between the flanks, and
these move with the motor.
"""

import json
import os
import subprocess
import tempfile
from pathlib import Path

import numpy as np
import pytest

from camcomp.ground.files import shipped
from tests.linuxcnc import simulator

pytestmark = [simulator.needs_linuxcnc, pytest.mark.ecosystem]
PLAY_MM, RADIUS_MM, DEPTH_MM = 0.03, 15.0, -1.0
PROGRAM = f"""(a circle)
G21 G90 G17 G54 G64 P0.0005
G0 X20 Y-5 Z5
G0 X{RADIUS_MM} Y0
G1 Z{DEPTH_MM} F600
G3 X{RADIUS_MM} Y0 I-{RADIUS_MM} J0 F1200
G1 Z5
M2
"""
HAL = f"""loadrt [KINS]KINEMATICS
loadrt [EMCMOT]EMCMOT servo_period_nsec=[EMCMOT]SERVO_PERIOD num_joints=[KINS]JOINTS
loadrt sum2 names=low,high
loadrt limit1 names=motor-x,motor-y,motor-z,slide-x,slide-y,slide-z
addf motion-command-handler servo-thread
addf motion-controller servo-thread
addf motor-x servo-thread
addf motor-y servo-thread
addf motor-z servo-thread
addf low servo-thread
addf high servo-thread
addf slide-x servo-thread
addf slide-y servo-thread
addf slide-z servo-thread
setp low.offset {-PLAY_MM / 2}
setp high.offset {PLAY_MM / 2}
net joint-0 joint.0.motor-pos-cmd => motor-x.in
net joint-1 joint.1.motor-pos-cmd => motor-y.in
net joint-2 joint.2.motor-pos-cmd => motor-z.in
net encoder-0 motor-x.out => joint.0.motor-pos-fb low.in0 high.in0
net encoder-1 motor-y.out => joint.1.motor-pos-fb slide-y.in
net encoder-2 motor-z.out => joint.2.motor-pos-fb slide-z.in
net low low.out => slide-x.min
net high high.out => slide-x.max
net scale-x slide-x.out => slide-x.in
net scale-y slide-y.out
net scale-z slide-z.out
net estop iocontrol.0.user-enable-out => iocontrol.0.emc-enable-in
net prepare iocontrol.0.tool-prepare => iocontrol.0.tool-prepared
net change iocontrol.0.tool-change => iocontrol.0.tool-changed
"""
FILTER = """
[FILTER]
PROGRAM_EXTENSION = .ngc G-code, compensated by camcomp
ngc = ./camcomp compensate --config learned.yaml --config machine.ini --if-compensated pass
"""


def test_the_third_opening_cuts_a_circle_below_three_micrometres_on_a_machine_with_play():
    with tempfile.TemporaryDirectory() as name:  # another user can reach it, unlike that of pytest
        folder = Path(name)
        set_up(folder)
        errors, causes = [], []
        for number in range(3):
            recording = folder / f"run{number}.txt"
            task = {"program": str(folder / "circle.ngc"), "recording": str(recording)}
            seen, said = simulator.simulate(folder, "opened", **task)
            assert seen.get("exit_code") == 0, f"{seen}\n{said}"
            assert seen["progress"], "AXIS draws no bar"
            errors.append(largest_error_um(recording))
            learn(folder, recording.name)
            result = json.loads((folder / f"study-{number + 1}" / "result.json").read_text())
            causes.append([(each["effect"], each["target"]) for each in result["causes"]])
    print(f"largest error of each opening: {errors} um; {causes}")
    assert errors[0] > 0.4 * PLAY_MM * 1000
    assert causes == [[("backlash", "x")], [], []]
    assert errors[2] < 3.0


def set_up(folder):
    """The machine and its files, without later commands."""
    simulator.machine(folder, shipped("config/cartesian.yaml"))
    (folder / "machine.hal").write_text(HAL)
    ini = (folder / "machine.ini").read_text()
    ini = ini.replace("HALFILE = machine.hal", "HALFILE = machine.hal\nHALFILE = record.hal")
    (folder / "machine.ini").write_text(ini + FILTER)
    (folder / "circle.ngc").write_text(PROGRAM)
    machine = Path(shipped("config/cartesian.yaml")).read_text()
    (folder / "learned-0.yaml").write_text(
        machine.replace("model: constant, Fr_N: 215, Ft_N: -10, Fz_N: -25", "model: none")
    )
    (folder / "learned.yaml").symlink_to("learned-0.yaml")
    os.chmod(folder / "learn", 0o755)


def learn(folder, recording):
    """The command that a user starts behind a run."""
    env = os.environ | {"PATH": f"{folder}:{os.environ['PATH']}"}
    done = subprocess.run(["./learn", recording], cwd=folder, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def largest_error_um(recording):
    """Distance of the carriage from the circle, in every servo period at depth."""
    rows = np.array([line.split() for line in recording.read_text().splitlines() if len(line.split()) == 11], float)
    tip = rows[:, 7:10]
    cut = np.abs(tip[:, 2] - DEPTH_MM) < 1e-4
    assert cut.sum() > 1000
    return 1000.0 * float(np.abs(np.hypot(tip[cut, 0], tip[cut, 1]) - RADIUS_MM).max())
