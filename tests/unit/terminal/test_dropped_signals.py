"""A signal ends the command even where it comes while an object is finalised: what is raised there Python drops."""

import subprocess
import sys

import pytest

COMMAND = """
import signal, sys, time
from camcomp.terminal import cli


class Closing:
    def __del__(self):
        signal.raise_signal(signal.{name})


def command(args):
    try:
        closing = Closing()
        del closing
        time.sleep(20.0)
        return 0
    except (cli.Terminated, KeyboardInterrupt) as end:
        return 7


cli.run = command
cli.main([])
"""


@pytest.mark.parametrize("name", ["SIGTERM", "SIGINT"])
def test_a_signal_in_a_finaliser_is_not_lost(name):
    """And wakes the command where it waits, for a line of a stream or for other processes: it does not wait for a minute."""
    code = COMMAND.replace("{name}", name).replace("20.0", "60.0")
    ended = subprocess.run([sys.executable, "-c", code], check=False, capture_output=True, text=True, timeout=50)
    assert (ended.returncode, ended.stderr) == (7, "")


def test_anything_else_that_goes_wrong_there_is_told_as_ever():
    code = COMMAND.replace("signal.raise_signal(signal.{name})", "raise ValueError('broken')").replace("20.0", "0.1")
    ended = subprocess.run([sys.executable, "-c", code], check=False, capture_output=True, text=True, timeout=60)
    assert ended.returncode == 0
    assert "ValueError: broken" in ended.stderr
