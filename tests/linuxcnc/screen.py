#!/usr/bin/python3
"""Takes the place of LinuxCNC's screen: switches the machine on, moves it, and writes down what HAL says.

Run by LinuxCNC's own Python; what to do and where to write comes from the file that SCREEN names.
"""

import json
import os
import subprocess
import sys
import time

import linuxcnc


def text_of(name):
    """Value of a HAL pin, as text."""
    return subprocess.run(["halcmd", "getp", name], check=True, capture_output=True, text=True).stdout.strip()


def pin(name):
    """Value of a HAL pin."""
    return float(text_of(name))


def until(what, seconds=30.0):
    """Waits for something to become true."""
    end = time.time() + seconds
    while not what():
        if time.time() > end:
            raise TimeoutError(what)
        time.sleep(0.02)


def settled():
    """Waits until the joints stand still and have taken up the offsets; their positions."""
    before = None
    for _ in range(200):
        now = [pin(f"joint.{k}.motor-pos-cmd") for k in range(3)]
        still = before is not None and max(abs(a - b) for a, b in zip(before, now, strict=False)) < 1e-6
        if still and all(
            abs(pin(f"axis.{each}.eoffset-request") - pin(f"axis.{each}.eoffset")) < 1e-6 for each in "xyz"
        ):
            return now
        before = now
        time.sleep(0.1)
    raise TimeoutError(f"the machine does not come to rest: {now}, {[pin(f'axis.{each}.eoffset') for each in 'xyz']}")


def work(steps):
    """Carries out the steps: G-code and the force at its end."""
    command, status = linuxcnc.command(), linuxcnc.stat()

    def state():
        status.poll()
        return status

    command.state(linuxcnc.STATE_ESTOP_RESET)
    command.wait_complete()
    command.state(linuxcnc.STATE_ON)
    until(lambda: state().task_state == linuxcnc.STATE_ON)
    command.mode(linuxcnc.MODE_MANUAL)
    command.wait_complete()
    command.home(-1)  # without it LinuxCNC takes no external offsets
    until(lambda: all(state().homed[:3]))
    command.mode(linuxcnc.MODE_MDI)
    command.wait_complete()
    rows = []
    for code, force in steps:
        for axis, value in zip("xyz", force, strict=False):
            subprocess.run(["halcmd", "setp", f"camcomp.f{axis}", str(value)], check=True)
        command.mdi(code)
        until(lambda: command.wait_complete(1.0) != -1)
        joints = settled()
        rows.append(
            {
                "code": code,
                "joints": joints,
                "tip": [pin(f"axis.{each}.pos-cmd") for each in "xyz"],
                "offset": [pin(f"axis.{each}.eoffset") for each in "xyz"],
                "drive": [pin(f"camcomp.drive-{k}") for k in range(3)],
                "solved": pin("camcomp.solved"),
                "error": text_of("camcomp.error"),
            }
        )
    return rows


def main():
    """Does what the file says and writes beside it what came out."""
    with open(os.environ["SCREEN"], encoding="utf-8") as file:
        task = json.load(file)
    try:
        out = {"rows": work(task["steps"])}
    except (OSError, ValueError, TimeoutError, linuxcnc.error, subprocess.CalledProcessError) as error:
        out = {"error": repr(error)}
    with open(task["answer"], "w", encoding="utf-8") as file:
        json.dump(out, file)
    return 0


if __name__ == "__main__":
    sys.exit(main())
