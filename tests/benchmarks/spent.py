"""Time and memory of a process: wall time, processor time, memory."""

import os
import subprocess
import sys
import time

import numpy as np


def installed():
    """Environment of a user: the bytecode of camcomp is on disk, as pip leaves it."""
    return {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}


def spent(*args, ends=(0,)):
    """Wall time, processor time (s) and peak memory (MB) of a process that has to end with one of these exit codes."""
    begin = time.perf_counter()
    process = subprocess.Popen(
        [sys.executable, *map(str, args)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=installed()
    )
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = status
    assert os.waitstatus_to_exitcode(status) in ends
    return np.array([time.perf_counter() - begin, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024.0])
