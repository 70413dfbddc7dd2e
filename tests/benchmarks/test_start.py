"""How much work is done before anything happens, in processor time, which a busy machine changes little."""

import resource
import subprocess
import sys

import pytest

from camcomp.ground.files import shipped

pytestmark = pytest.mark.benchmarks


def shortest(*args, runs=10):
    """Processor seconds of the fastest of several runs of the interpreter."""

    def spent():
        usage = resource.getrusage(resource.RUSAGE_CHILDREN)
        return usage.ru_utime + usage.ru_stime

    def once():
        before = spent()
        subprocess.run([sys.executable, *args], check=True, capture_output=True)
        return spent() - before

    return min(once() for _ in range(runs))


def test_help_takes_at_most_six_bare_starts():
    assert shortest("-m", "camcomp", "--help") <= 6 * shortest("-c", "pass")


def test_validate_takes_at_most_forty_bare_starts():
    machine = str(shipped("config/orthoglide.yaml"))
    assert shortest("-m", "camcomp", "validate", machine, runs=5) <= 40 * shortest("-c", "pass")
