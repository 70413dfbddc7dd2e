#!/usr/bin/python3
"""Stands at LinuxCNC in place of its screen: runs each job's program, and does at the stated times what an operator does.

Run by LinuxCNC with its own Python; RECORDING_JOBS names the file with the jobs (see record.py).
"""

import json
import os
import signal
import subprocess
import time

import linuxcnc

STEP = 0.005  # s between two looks at the machine
AT_REST = 0.3  # s without motion that count as the end


class Attendant:
    """One machine that is switched on, and its operator."""

    def __init__(self):
        self.command, self.status = linuxcnc.command(), linuxcnc.stat()

    def look(self):
        self.status.poll()
        return self.status

    def wait(self, what, seconds=30.0):
        end = time.monotonic() + seconds
        while not what():
            if time.monotonic() > end:
                raise TimeoutError
            time.sleep(STEP)

    def mode(self, which):
        self.command.mode(which)
        self.command.wait_complete()

    def switch_on(self):
        self.command.state(linuxcnc.STATE_ESTOP_RESET)
        self.command.wait_complete()
        self.command.state(linuxcnc.STATE_ON)
        self.wait(lambda: self.look().task_state == linuxcnc.STATE_ON)
        self.mode(linuxcnc.MODE_MANUAL)
        self.command.home(-1)
        self.wait(lambda: all(self.look().homed[:3]))

    def go_to_start(self):
        self.mode(linuxcnc.MODE_MDI)
        for block in ("G21 G90 G49 G92.1", "G10 L2 P1 X0 Y0 Z0", "G54 G61", "G0 X0 Y0 Z20"):
            self.command.mdi(block)
            self.wait(lambda: self.command.wait_complete(1.0) != -1)

    def act(self, action):
        if action == "pause":
            self.command.auto(linuxcnc.AUTO_PAUSE)
        elif action == "resume":
            self.command.auto(linuxcnc.AUTO_RESUME)
        else:  # feed override, as a share of the programmed feed
            self.command.feedrate(float(action))

    def rests(self):
        status = self.look()
        return status.interp_state == linuxcnc.INTERP_IDLE and status.queue == 0 and status.inpos

    def run(self, job):
        self.go_to_start()
        self.command.feedrate(1.0)
        self.mode(linuxcnc.MODE_AUTO)
        self.command.program_open(job["program"])
        self.command.wait_complete()
        subprocess.run(["halcmd", "setp", "sampler.0.enable", "1"], check=True)
        sampler = subprocess.Popen(["halsampler", "-t", job["samples"]])
        time.sleep(0.2)
        began = time.monotonic()
        self.command.auto(linuxcnc.AUTO_RUN, 0)
        todo, still = list(job["events"]), began
        while True:
            now = time.monotonic()
            if todo and now - began >= todo[0][0]:
                self.act(todo.pop(0)[1])
            if now - began < 0.5 or not self.rests():
                still = now
            if not todo and now - still > AT_REST:
                break
            if now - began > 120.0:
                raise TimeoutError(job["program"])
            time.sleep(STEP)
        subprocess.run(["halcmd", "setp", "sampler.0.enable", "0"], check=True)
        time.sleep(0.3)
        sampler.send_signal(signal.SIGTERM)
        sampler.wait()


if __name__ == "__main__":
    attendant = Attendant()
    attendant.switch_on()
    with open(os.environ["RECORDING_JOBS"], encoding="utf-8") as file:
        for each in json.load(file):
            attendant.run(each)
