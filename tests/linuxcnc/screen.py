#!/usr/bin/python3
"""Takes the place of LinuxCNC's screen: carries out a scenario, and writes down what HAL says.

Run by LinuxCNC's own Python; what to do and where to write comes from the file that SCREEN names.  On a busy computer the
solver may be late by itself, and the machine then holds as it should: the operator here switches off and on and goes on.
"""

import ast
import json
import os
import re
import select
import shutil
import signal
import subprocess
import sys
import time
from types import SimpleNamespace

import linuxcnc

COMMAND, STATUS = linuxcnc.command(), linuxcnc.stat()
TRIES = 8
CIRCLE, FAST = 3, 49.0  # line of the program; mm/s


class LateError(Exception):
    """The machine holds, only because the solver was late."""


class BusyError(Exception):
    """That happens again and again."""


def text_of(name):
    """Value of a HAL pin, as text."""
    return subprocess.run(["halcmd", "getp", name], check=True, capture_output=True, text=True).stdout.strip()


def pin(name):
    """Value of a HAL pin."""
    return float(text_of(name))


def is_on(name):
    """Value of a HAL pin that is a bit."""
    return text_of(name) == "TRUE"


def period():
    """Number of the servo period."""
    return pin("camcomp-period.out")


def state():
    """What LinuxCNC says of itself."""
    STATUS.poll()
    return STATUS


def until(what, seconds=30.0):
    """Waits for something to become true."""
    end = time.time() + seconds
    while not what():
        if time.time() > end:
            raise TimeoutError(what)
        time.sleep(0.02)


def mode(wanted):
    """Changes the mode."""
    COMMAND.mode(wanted)
    COMMAND.wait_complete()


def switch_on():
    """Machine on."""
    COMMAND.state(linuxcnc.STATE_ESTOP_RESET)
    COMMAND.wait_complete()
    COMMAND.state(linuxcnc.STATE_ON)
    until(lambda: state().task_state == linuxcnc.STATE_ON)


def switch_off():
    """Machine off; joints stay homed."""
    COMMAND.state(linuxcnc.STATE_OFF)
    until(lambda: state().task_state != linuxcnc.STATE_ON)
    until(lambda: is_on("camcomp.wait"))


def home():
    """Homes all joints, which takes a moment in the simulator."""
    mode(linuxcnc.MODE_MANUAL)
    COMMAND.home(-1)
    until(lambda: all(state().homed[:3]))


def released():
    """Waits until the offsets are there. Raises LateError."""
    until(lambda: is_on("camcomp.error") or not is_on("camcomp.wait"))
    if is_on("camcomp.error"):
        raise LateError


def recover():
    """The reaction of an operator to an error."""
    COMMAND.abort()
    COMMAND.wait_complete()
    switch_off()
    time.sleep(0.1)
    switch_on()


def finished(seconds=60.0):
    """Waits for the end of the command. Raises LateError."""
    end = time.time() + seconds
    while COMMAND.wait_complete(0.1) == -1 or state().interp_state != linuxcnc.INTERP_IDLE or not state().inpos:
        if is_on("camcomp.error"):
            raise LateError
        if time.time() > end:
            raise TimeoutError("motion does not end")


def mdi(*codes):
    """Carries out lines of G-code one by one."""
    mode(linuxcnc.MODE_MDI)
    for code in codes:
        COMMAND.mdi(code)
        finished()


def patiently(what):
    """The answer of a function, asked again where the solver was late."""
    for _ in range(TRIES):
        try:
            released()
            return what()
        except LateError:
            recover()
    raise BusyError("the solver is late again and again")


def settled():
    """Waits until the joints stand still and have taken up the offsets; their positions."""
    before = None
    for _ in range(200):
        # first the offsets: one that comes between the two readings is not in the joints yet
        taken = all(abs(pin(f"axis.{each}.eoffset-request") - pin(f"axis.{each}.eoffset")) < 1e-6 for each in "xyz")
        now = [pin(f"joint.{k}.motor-pos-cmd") for k in range(3)]
        still = before is not None and max(abs(a - b) for a, b in zip(before, now, strict=True)) < 1e-6
        if taken and still:
            return now
        before = now
        time.sleep(0.1)
    raise TimeoutError(f"the machine does not come to rest: {now}, {[pin(f'axis.{each}.eoffset') for each in 'xyz']}")


def push(force):
    """Sets the force on the tool."""
    for axis, value in zip("xyz", force, strict=True):
        subprocess.run(["halcmd", "setp", f"camcomp.f{axis}", str(value)], check=True)


def stepped(code):
    """Pins of HAL at rest behind lines of G-code. Raises LateError."""
    mdi(*code.splitlines())
    row = {
        "code": code,
        "joints": settled(),
        "tip": [pin(f"axis.{each}.pos-cmd") for each in "xyz"],
        "offset": [pin(f"axis.{each}.eoffset") for each in "xyz"],
        "drive": [pin(f"camcomp.drive-{k}") for k in range(3)],
        "solved": pin("camcomp.solved"),
    }
    if is_on("camcomp.error"):
        raise LateError
    return row


def steps(task):
    """G-code, each step with the force at its end."""
    switch_on()
    home()
    rows = []
    for code, force in task["steps"]:
        push(force)
        rows.append(patiently(lambda: stepped(code)))  # noqa: B023
    return {"rows": rows, "refused": [any(refused(*each) for _ in range(TRIES)) for each in task["refused"]]}


def refused(code, force):
    """Whether the component, and not the clock before it, refuses what some G-code leads to; undone afterwards."""
    push(force)
    mode(linuxcnc.MODE_MDI)
    COMMAND.mdi(code)
    until(lambda: is_on("camcomp.error"))
    seen = is_on("camcomp.refused") and is_on("motion.feed-hold")
    push((0.0, 0.0, 0.0))
    COMMAND.abort()
    mode(linuxcnc.MODE_MDI)
    COMMAND.mdi("G49")
    COMMAND.wait_complete()
    recover()
    patiently(lambda: mdi("G0 X0 Y0 Z0"))
    return seen


class Recorder:
    """halsampler into a file, and the servo periods between which something was done."""

    def __init__(self, command):
        self._process = subprocess.Popen(command)
        self.marks = {}
        time.sleep(0.2)

    def mark(self, name, what):
        """Carries out something until it comes through undisturbed, and marks when."""

        def marked():
            began = period()
            what()
            self.marks[name] = [began, period()]

        patiently(marked)

    def mark_rest(self, name):
        """Marks a tenth of a second of standstill, from when the offsets are taken up, however late they come."""
        patiently(settled)
        self.mark(name, lambda: time.sleep(0.1))

    def close(self):
        """Ends the recording."""
        time.sleep(0.3)
        self._process.terminate()
        self._process.wait()


def start(program):
    """Starts a program and waits until it is well on its circle, in line 3, at full speed. Raises LateError."""
    COMMAND.feedrate(1.0)
    mode(linuxcnc.MODE_AUTO)
    COMMAND.program_open(program)
    COMMAND.auto(linuxcnc.AUTO_RUN, 0)
    until(lambda: is_on("camcomp.error") or (state().motion_line == CIRCLE and pin("motion.current-vel") > FAST))
    time.sleep(0.4)
    if is_on("camcomp.error"):
        raise LateError


def with_pause(program):
    """A program that is paused and resumed on its way."""
    start(program)
    COMMAND.auto(linuxcnc.AUTO_PAUSE)
    time.sleep(0.3)
    COMMAND.auto(linuxcnc.AUTO_RESUME)
    finished()


def with_override(program):
    """A program whose feed is changed on its way."""
    start(program)
    for rate in (0.4, 1.2, 1.0):
        COMMAND.feedrate(rate)
        time.sleep(0.3)
    finished()


def with_abort(program):
    """A program that is aborted on its way."""
    start(program)
    COMMAND.abort()
    finished()


def pids(word):
    """Processes with a word in their command line, other than shells and this one."""
    found = []
    for name in filter(str.isdigit, os.listdir("/proc")):
        try:
            with open(f"/proc/{name}/cmdline", "rb") as file:
                words = file.read().split(b"\0")
        except OSError:
            continue
        if any(each.endswith(word.encode()) for each in words) and int(name) != os.getpid():
            found.append(int(name))
    return found


def hurt(program, word, number):
    """Sends a signal to a process in the middle of a program; waits until the machine holds."""
    patiently(lambda: start(program))
    for process in pids(word):
        os.kill(process, number)
    until(lambda: is_on("camcomp.error"))
    time.sleep(0.3)
    return period()


def orthoglide(task):
    """Enable and homing in both orders, a fast program through what happens to programs, tools, and faults."""
    recorder, program = Recorder(["halsampler", task["record"]]), task["program"]
    push(task["force"])
    switch_on()
    time.sleep(0.2)
    home()
    recorder.mark_rest("homed after on")
    switch_off()
    switch_on()
    recorder.mark_rest("on after homed")
    patiently(lambda: mdi("G21 G90 G64", task["work_offset"], "G54", "T1 M6 G43", "G0 X25 Y0 Z10"))
    recorder.mark("pause", lambda: with_pause(program))
    recorder.mark("override", lambda: with_override(program))
    recorder.mark("abort", lambda: with_abort(program))
    recorder.mark("other tool", lambda: mdi("G0 Z10", "T2 M6 G43", "G1 X30 Y5 Z1 F3000", "G1 X10 F3000"))
    recorder.mark("other work offset", lambda: mdi("G55", "G0 X0 Y0 Z0", "G1 X20 F3000", "G54"))
    faults = []
    for name, word, number in task["faults"]:
        began = period()
        faults.append([name, began, hurt(program, word, number)])
        if word == "stream":
            recover()
            recorder.mark_rest(f"after {name}")
    recorder.close()
    return {"marks": recorder.marks, "faults": faults}


def filter_of_axis():
    """The function by which AXIS sends a program through its filter, and the progress that it would draw."""
    with open(shutil.which("axis"), encoding="utf-8") as file:
        tree = ast.parse(file.read())
    kept = [each for each in tree.body if isinstance(each, ast.FunctionDef) and each.name == "filter_program"]
    kept += [
        each for each in tree.body if isinstance(each, ast.Assign) and ast.unparse(each.targets[0]) == "progress_re"
    ]
    shares = []
    bar = SimpleNamespace(
        set_text=lambda text: None, update=lambda share, force: shares.append(share), done=lambda: None
    )
    space = {"os": os, "sys": sys, "re": re, "select": select, "_": str, "Progress": lambda phases, total: bar,
             "t": SimpleNamespace(update=lambda: None)}  # fmt: skip
    exec(compile(ast.Module(kept, []), "axis", "exec"), space)  # noqa: S102
    return space["filter_program"], shares


def opened(task):
    """A program opened through the filter of the INI file, as AXIS does, run, and recorded."""
    program, filtered = task["program"], task["program"] + ".filtered"
    command = linuxcnc.ini(os.environ["INI_FILE_NAME"]).find("FILTER", os.path.splitext(program)[1][1:])
    filter_program, shares = filter_of_axis()
    code, said = filter_program(command, program, filtered)
    if code:
        return {"exit_code": code, "said": said}
    switch_on()
    home()
    mode(linuxcnc.MODE_AUTO)
    COMMAND.program_open(filtered)
    recorder = Recorder(["halsampler", "-t", task["recording"]])
    COMMAND.auto(linuxcnc.AUTO_RUN, 0)
    time.sleep(0.5)
    until(lambda: state().interp_state == linuxcnc.INTERP_IDLE and STATUS.inpos and STATUS.queue == 0, 100.0)
    recorder.close()
    return {"exit_code": 0, "said": said, "progress": shares}


def main():
    """Follows the file and writes the results next to it."""
    with open(os.environ["SCREEN"], encoding="utf-8") as file:
        task = json.load(file)
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    try:
        out = {"steps": steps, "orthoglide": orthoglide, "opened": opened}[task["scenario"]](task)
    except (OSError, ValueError, LateError, BusyError, linuxcnc.error, subprocess.CalledProcessError) as error:
        out = {"error": repr(error), "busy": isinstance(error, BusyError)}
    with open(task["answer"], "w", encoding="utf-8") as file:
        json.dump(out, file)
    return 0


if __name__ == "__main__":
    sys.exit(main())
