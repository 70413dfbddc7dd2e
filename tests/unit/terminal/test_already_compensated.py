"""A program that was compensated before: refused, or passed on as it is; camcomp as a filter of LinuxCNC's AXIS."""

import os
import subprocess
import sys

import pytest

from tests.commandline import ROOT, camcomp

CONFIG = ROOT / "config/cartesian.yaml"


@pytest.fixture(scope="module")
def corrected(tmp_path_factory):
    path = tmp_path_factory.mktemp("once") / "in" / "once.nc"
    path.parent.mkdir()
    done = camcomp("compensate", ROOT / "samples/groove-circle-2.nc", "--config", CONFIG, "-o", path)
    assert done.returncode == 0, done.stderr.decode()
    return path


@pytest.mark.parametrize("source", ["file", "standard input"])
def test_passes_unchanged_where_that_is_asked_for(corrected, source):
    data = corrected.read_bytes()
    program, stdin = (corrected, b"") if source == "file" else ("-", data)
    done = camcomp("compensate", program, "--config", CONFIG, "--if-compensated", "pass", stdin=stdin)
    assert (done.returncode, done.stdout) == (0, data)
    assert b"was compensated before and passes unchanged" in done.stderr
    refused = camcomp("compensate", program, "--config", CONFIG, stdin=stdin)
    assert refused.returncode == 1 and b"CC603" in refused.stderr and refused.stdout == b""


def test_a_batch_passes_it_on(corrected, tmp_path):
    words = ("batch", corrected.parent, "--config", CONFIG, "--output-dir", tmp_path / "out", "--jobs", "1")
    done = camcomp(*words, "--if-compensated", "pass")
    assert done.returncode == 0, done.stderr.decode()
    assert (tmp_path / "out/once.nc").read_bytes() == corrected.read_bytes()
    assert camcomp(*words).returncode == 1


def test_axis_gets_its_progress_and_the_program():
    """As AXIS starts a filter: the name behind the words of the INI file, the program on standard output."""
    words = [sys.executable, "-m", "camcomp", "compensate", "--config", CONFIG, "--if-compensated", "pass"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "AXIS_PROGRESS_BAR": "1"}
    done = subprocess.run(
        [*words, ROOT / "samples/groove-circle-2.nc"], capture_output=True, env=environment, timeout=300, check=True
    )
    shares = [int(each.partition(b"=")[2]) for each in done.stderr.splitlines() if each.startswith(b"FILTER_PROGRESS=")]
    assert shares[-1] == 100 and shares == sorted(shares)
    assert b"\n(camcomp " in done.stdout
