#!/usr/bin/python3
"""HAL user component: feeds camcomp's correction to LinuxCNC as external offsets while the machine runs.

    loadusr -Wn camcomp camcomp_eoffset.py --config machine.yaml [--camcomp PROGRAM] [--name camcomp]

It runs in LinuxCNC's Python and asks a `camcomp stream` of its own for a set-point in every servo period, through a pipe.

Pins in:  period           number of the servo period, counted by HAL
          enable, homed    machine on, all joints homed
          x, y, z          commanded position in mm, as axis.N.pos-cmd has it, without external offsets
          tool-x, -y, -z   tool offset in mm (G43), as motion.tooloffset.N has it
          fx, fy, fz       force on the tool in N, machine axes
          request-x, ...   offset that LinuxCNC was asked for in mm, as axis.N.eoffset-request has it
          offset-x, ...    offset that it has reached, as axis.N.eoffset has it
          limited          an offset ends at a soft limit
          error            what HAL makes of `answered` and `refused` (machine.hal); here for the operator's eyes
Pins out: counts-x, -y, -z for axis.N.eoffset-counts
          scale            for axis.N.eoffset-scale
          answered         the servo period that the counts answer
          refused          camcomp has no answer; the counts stay as they were
          wait             not to be driven yet: the offsets are not those of this tool and place
          drive-0, ...     drive forces of the machine's actuators in N (or Nmm)
          solved           set-points answered so far
"""

import argparse
import json
import os
import select
import signal
import subprocess
import sys
import tempfile
import time
from collections import deque
from math import cos, radians, sin
from pathlib import Path

import hal
import linuxcnc

STEP = 1e-4  # mm per count
LOOK = 1e-4  # s between looks at the servo period
PATIENCE = 1.0  # s for an answer; HAL has raised the error long before
COMPILED = 300.0  # s for the first answer, which waits for the solver to be compiled
QUIET = 3  # servo periods without new counts, behind which LinuxCNC has taken up all of them
PRIORITY = 10  # below all threads of LinuxCNC
NEAR = 5e-4  # mm from an offset that has arrived
NAMES = ("x_mm", "y_mm", "z_mm", "fx_N", "fy_N", "fz_N")


class RefusedError(Exception):
    """There is no answer, or none that may be driven."""


class Solver:
    """A `camcomp stream` of this component's own, for one length of tool."""

    def __init__(self, command, length, folder):
        """length: mm, of G43; 0 without it, and the tool is that of the machine file."""
        if length:
            file = Path(folder) / "tool.yaml"
            file.write_text(f"tool: {{length_mm: {length!r}, vector_mm: null}}\n", encoding="utf-8")
            command = [*command, "--config", str(file)]
        self.length, self.first, self.lost = length, None, False
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self._send((0.0,) * len(NAMES))  # compiled and warm before the machine moves

    def warm(self, seconds=0.0):
        """Whether its first answer is there, or comes within some seconds. Raises RefusedError where it has ended."""
        if self.first is None:
            self.first = self._receive(seconds)
            if self.first is not None:
                hurry(self._process.pid)
        return self.first is not None

    def ask(self, tip, force):
        """The answer to a set-point. Raises RefusedError."""
        self._send((*tip, *force))
        answer = self._receive(PATIENCE)
        if answer is None:  # what comes later would be taken for the answer to another set-point
            self._lose("camcomp does not answer")
        if "error" in answer:
            raise RefusedError(f"{answer['error']} {answer.get('message', '')}")
        return answer

    def _send(self, values):
        try:
            self._process.stdin.write(json.dumps(dict(zip(NAMES, values, strict=True))).encode() + b"\n")
            self._process.stdin.flush()
        except OSError:
            self._lose("camcomp has ended")

    def _receive(self, seconds):
        if not select.select([self._process.stdout], [], [], seconds)[0]:
            return None
        try:
            return json.loads(self._process.stdout.readline())
        except ValueError:
            self._lose("camcomp has ended")

    def _lose(self, why):
        self.lost = True
        self.close()
        raise RefusedError(why)

    def close(self):
        """Ends it, also where it hangs."""
        self._process.kill()
        self._process.wait()


class WorkOffset:
    """Origin and turn of G54 in LinuxCNC's machine frame, as they stood when the running program began."""

    def __init__(self):
        self._status = None
        self._origin, self._turn = stored_work_offset()

    def look(self):
        """Takes over what LinuxCNC says, which must have started: who asks earlier may never hear of it."""
        self._status = self._status or linuxcnc.stat()
        self._status.poll()
        # 1 is G54; 0 as long as no program has named a work offset since the start
        if self._status.g5x_index == 1 and self._status.interp_state == linuxcnc.INTERP_IDLE:
            self._origin, self._turn = self._status.g5x_offset[:3], radians(self._status.rotation_xy)

    def to_program(self, point):
        """A point of the machine frame in that of the program."""
        return turned([a - b for a, b in zip(point, self._origin, strict=True)], -self._turn)

    def to_machine(self, vector):
        """A vector of the program frame in that of the machine."""
        return turned(vector, self._turn)


def hurry(process):
    """Lets a process wait for nothing but realtime threads, where the user may (rtprio in /etc/security/limits.conf)."""
    try:
        os.sched_setscheduler(process, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(PRIORITY))
    except PermissionError:
        print("camcomp: no realtime priority; other work on this computer may delay it", file=sys.stderr)


def stored_work_offset():
    """Origin and turn of G54 that LinuxCNC starts with, from its parameter file."""
    ini = os.environ["INI_FILE_NAME"]
    path = Path(ini).parent / (linuxcnc.ini(ini).find("RS274NGC", "PARAMETER_FILE") or "rs274ngc.var")
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    values = {words[0]: float(words[1]) for words in map(str.split, lines) if len(words) == 2}
    x, y, z, turn = (values.get(number, 0.0) for number in ("5221", "5222", "5223", "5230"))
    return (x, y, z), radians(turn)


def turned(vector, angle):
    """A vector turned about z."""
    x, y, z = vector
    return x * cos(angle) - y * sin(angle), x * sin(angle) + y * cos(angle), z


class Counts:
    """The counts of one axis. LinuxCNC adds up their changes, and drops those that come while it is off or not homed."""

    def __init__(self, pins, axis):
        self._pins, self._axis, self._zero, self._sent = pins, axis, 0, deque(maxlen=50)

    def _request(self):
        return round(self._pins[f"request-{self._axis}"] / STEP)

    def begin(self):
        """Counts on from what LinuxCNC has, which must have taken up all counts before."""
        self._zero = self._pins[f"counts-{self._axis}"] - self._request()
        self._sent.clear()
        self._sent.append(self._request())

    def kept(self):
        """Whether LinuxCNC has what it was sent, of late."""
        return self._request() in self._sent

    def arrived(self):
        """Whether the axis has moved by the offset that was sent last."""
        return abs(self._pins[f"offset-{self._axis}"] - self._sent[-1] * STEP) < NEAR

    def send(self, offset):
        """offset: mm."""
        self._sent.append(round(offset / STEP))
        self._pins[f"counts-{self._axis}"] = self._zero + self._sent[-1]


class Correction:
    """From the pins to the pins, once per servo period."""

    def __init__(self, pins, solver, start):
        """start: makes a Solver for a length of tool."""
        self._pins, self._solver, self._start, self._work_offset = pins, solver, start, WorkOffset()
        self._axes = [Counts(pins, axis) for axis in "xyz"]
        self._quiet = 0  # servo periods since counts were sent, as long as none are

    def step(self):
        """One servo period. `answered` stays behind where there is no answer; HAL sees that."""
        pins, period = self._pins, self._pins["period"]
        try:
            if not (pins["enable"] and pins["homed"]):
                self._rest()
            elif self._prepared():
                self._correct()
            else:
                pins["wait"] = True
        except RefusedError as error:
            if not pins["refused"]:
                print(f"camcomp: {error}", file=sys.stderr)
            pins["refused"] = True
        else:
            pins["refused"] = False
            pins["answered"] = period

    def _rest(self):
        """LinuxCNC takes no offsets; a solver that was lost is replaced."""
        self._pins["wait"], self._quiet = True, 0
        if self._solver.lost:
            self._solver = self._start(0.0)

    def _prepared(self):
        """Whether there are a solver for this tool and counts that LinuxCNC has taken up. Raises RefusedError."""
        pins, length = self._pins, self._pins["tool-z"]
        if self._solver.lost:
            raise RefusedError("no solver; a new one starts while the machine is off")
        self._work_offset.look()
        if pins["tool-x"] or pins["tool-y"]:
            raise RefusedError("a tool offset along x or y")
        if length != self._solver.length:
            self._solver.close()
            self._solver, self._quiet = self._start(length), 0
        self._quiet += 1
        if self._quiet == QUIET + 1:
            for axis in self._axes:
                axis.begin()
        return self._quiet > QUIET and self._solver.warm()

    def _correct(self):
        """Answers the set-point of this period. Raises RefusedError."""
        pins = self._pins
        if pins["limited"]:
            raise RefusedError("the corrected position lies beyond a soft limit")
        if not all(axis.kept() for axis in self._axes):
            self._quiet, pins["wait"] = 0, True
            return
        tip = self._work_offset.to_program([pins[axis] - pins[f"tool-{axis}"] for axis in "xyz"])
        answer = self._solver.ask(tip, [pins[f"f{axis}"] for axis in "xyz"])
        correction = [answer[f"{axis}c_mm"] - at for axis, at in zip("xyz", tip, strict=True)]
        for axis, offset in zip(self._axes, self._work_offset.to_machine(correction), strict=True):
            axis.send(offset)
        for number, force in enumerate(drives(answer)):
            pins[f"drive-{number}"] = force
        pins["wait"] = pins["wait"] and not all(axis.arrived() for axis in self._axes)
        pins["solved"] += 1

    def close(self):
        """Ends the solver."""
        self._solver.close()


def drives(answer):
    """Drive forces in an answer."""
    return [value for name, value in answer.items() if name.startswith("act_") and name.endswith(("_N", "_Nmm"))]


def component(name, actuators):
    """The component with its pins."""
    made = hal.component(name)
    for axis in "xyz":
        for pin in (axis, f"tool-{axis}", f"f{axis}", f"request-{axis}", f"offset-{axis}"):
            made.newpin(pin, hal.HAL_FLOAT, hal.HAL_IN)
        made.newpin(f"counts-{axis}", hal.HAL_S32, hal.HAL_OUT)
    for number in range(actuators):
        made.newpin(f"drive-{number}", hal.HAL_FLOAT, hal.HAL_OUT)
    for pin in ("enable", "homed", "limited", "error"):
        made.newpin(pin, hal.HAL_BIT, hal.HAL_IN)
    for pin in ("refused", "wait"):
        made.newpin(pin, hal.HAL_BIT, hal.HAL_OUT)
    made.newpin("period", hal.HAL_FLOAT, hal.HAL_IN)
    made.newpin("answered", hal.HAL_FLOAT, hal.HAL_OUT)
    made.newpin("scale", hal.HAL_FLOAT, hal.HAL_OUT)
    made.newpin("solved", hal.HAL_U32, hal.HAL_OUT)
    made["scale"], made["wait"] = STEP, True
    return made


def serve(options, folder):
    """Serves until LinuxCNC ends."""
    configs = [word for each in options.config for word in ("--config", each)]
    command = [options.camcomp, "stream", "--json", *configs]
    solver = Solver(command, 0.0, folder)
    if not solver.warm(COMPILED):
        sys.exit("camcomp does not answer")
    pins = component(options.name, len(drives(solver.first)) or 3)
    correction = Correction(pins, solver, lambda length: Solver(command, length, folder))
    hurry(0)
    pins.ready()
    try:
        seen = None
        while True:
            if pins["period"] == seen:
                time.sleep(LOOK)
                continue
            seen = pins["period"]
            correction.step()
    finally:
        correction.close()


def main():
    """Reads the command line and serves."""
    parser = argparse.ArgumentParser(description="camcomp's correction as external offsets")
    parser.add_argument("--config", action="append", required=True)
    parser.add_argument("--camcomp", default="camcomp", help="the program, where it is not on the PATH")
    parser.add_argument("--name", default="camcomp")
    options = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    with tempfile.TemporaryDirectory() as folder:
        try:
            serve(options, folder)
        except (RefusedError, OSError) as error:
            sys.exit(f"camcomp: {error}")
        except KeyboardInterrupt:
            pass


if __name__ == "__main__":
    main()
