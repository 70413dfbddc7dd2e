#!/usr/bin/python3
"""HAL user component: feeds camcomp's correction to LinuxCNC as external offsets while the machine runs.

    loadusr -Wn camcomp python3 camcomp_eoffset.py --config machine.yaml [--camcomp PROGRAM] [--name camcomp]

It runs in LinuxCNC's Python and asks a `camcomp stream` of its own for every set-point, through a pipe.

Pins in:  x, y, z          commanded tip in mm, as axis.N.pos-cmd has it, without external offsets
          fx, fy, fz       force on the tool in N, machine axes
          enable           off: the counts go back to zero
Pins out: counts-x, -y, -z for axis.N.eoffset-counts
          scale            for axis.N.eoffset-scale
          drive-0, ...     drive forces of the machine's actuators in N (or Nmm)
          error            camcomp refused the set-point; the counts stay as they were
          solved           set-points answered so far
"""

import argparse
import json
import subprocess
import time

import hal

STEP = 1e-4  # mm per count
PERIOD = 0.001  # s between set-points


def component(name, actuators):
    """The component with its pins."""
    made = hal.component(name)
    for axis in "xyz":
        made.newpin(axis, hal.HAL_FLOAT, hal.HAL_IN)
        made.newpin(f"f{axis}", hal.HAL_FLOAT, hal.HAL_IN)
        made.newpin(f"counts-{axis}", hal.HAL_S32, hal.HAL_OUT)
    for number in range(actuators):
        made.newpin(f"drive-{number}", hal.HAL_FLOAT, hal.HAL_OUT)
    made.newpin("enable", hal.HAL_BIT, hal.HAL_IN)
    made.newpin("error", hal.HAL_BIT, hal.HAL_OUT)
    made.newpin("scale", hal.HAL_FLOAT, hal.HAL_OUT)
    made.newpin("solved", hal.HAL_U32, hal.HAL_OUT)
    made["scale"] = STEP
    return made


class Stream:
    """A `camcomp stream` of this component's own."""

    def __init__(self, command):
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1)

    def ask(self, tip, force):
        """The answer to a set-point, with an `error` where there is none."""
        names = ("x_mm", "y_mm", "z_mm", "fx_N", "fy_N", "fz_N")
        self._process.stdin.write(json.dumps(dict(zip(names, (*tip, *force), strict=False))) + "\n")
        return json.loads(self._process.stdout.readline())

    def close(self):
        """Ends it."""
        self._process.stdin.close()
        self._process.wait()


def step(pins, stream):
    """One set-point from the pins to the pins."""
    if not pins["enable"]:
        for axis in "xyz":
            pins[f"counts-{axis}"] = 0
        return
    tip = [pins[axis] for axis in "xyz"]
    answer = stream.ask(tip, [pins[f"f{axis}"] for axis in "xyz"])
    pins["error"] = "error" in answer
    if pins["error"]:
        return
    for axis, programmed in zip("xyz", tip, strict=False):
        pins[f"counts-{axis}"] = round((answer[f"{axis}c_mm"] - programmed) / STEP)
    for number, force in enumerate(drives(answer)):
        pins[f"drive-{number}"] = force
    pins["solved"] = pins["solved"] + 1


def drives(answer):
    """Drive forces in an answer."""
    return [value for name, value in answer.items() if name.startswith("act_") and name.endswith(("_N", "_Nmm"))]


def main():
    """Serves until LinuxCNC ends."""
    parser = argparse.ArgumentParser(description="camcomp's correction as external offsets")
    parser.add_argument("--config", action="append", required=True)
    parser.add_argument("--camcomp", default="camcomp", help="the program, where it is not on the PATH")
    parser.add_argument("--name", default="camcomp")
    options = parser.parse_args()
    configs = [word for each in options.config for word in ("--config", each)]
    stream = Stream([options.camcomp, "stream", "--json", *configs])
    first = stream.ask((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))  # compiled and warm before LinuxCNC goes on
    pins = component(options.name, len(drives(first)) or 3)
    pins.ready()
    try:
        while True:
            step(pins, stream)
            time.sleep(PERIOD)
    except KeyboardInterrupt:
        pass
    finally:
        stream.close()


if __name__ == "__main__":
    main()
