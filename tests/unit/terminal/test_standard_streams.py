"""Standard streams that the caller has closed."""

import os
import subprocess
import sys

import pytest

from tests.benchmarks.programs import write
from tests.commandline import ROOT


def ended(redirections, *words):
    """Exit code, output and messages of camcomp under a shell's redirections."""
    line = f'exec "$0" -m camcomp "$@" {redirections}'
    done = subprocess.run(
        ["sh", "-c", line, sys.executable, *words], cwd=ROOT, capture_output=True, timeout=60, check=False
    )
    return done.returncode, done.stdout, done.stderr.decode()


@pytest.mark.parametrize(
    ("redirections", "words", "code", "said"),
    [
        ("<&-", ["canon", "-"], 5, "cannot read <stdin>"),
        ("<&-", ["effects"], 0, ""),
        (">&-", ["effects"], 5, "Bad file descriptor"),
        ("2>&-", ["canon", "nothing.nc"], 5, ""),
        ("<&- >&- 2>&-", ["canon", "samples/groove-circle-2.nc"], 5, ""),
    ],
)
def test_what_cannot_be_read_or_written_is_told_by_the_exit_code(redirections, words, code, said):
    found, _, messages = ended(redirections, *words)
    assert found == code and said in messages and "Traceback" not in messages and "internal" not in messages


def test_a_long_program_ends_without_a_word_when_its_reader_has_gone(tmp_path):
    program, joints = tmp_path / "p.nc", tmp_path / "joints.csv"
    write(str(program), 1000)
    reader, pipe = os.pipe()
    os.close(reader)
    words = ["compensate", program, "--config", "config/cartesian.yaml", "-o", "-", "--joints", joints, "--quiet"]
    with os.fdopen(pipe, "wb") as stream:
        done = subprocess.run(
            [sys.executable, "-m", "camcomp", *words], cwd=ROOT, stdout=stream, stderr=subprocess.PIPE, check=False
        )
    assert (done.returncode, done.stderr) == (141, b"") and joints.read_bytes().endswith(b"\n")
    assert sorted(each.name for each in tmp_path.iterdir()) == ["joints.csv", "p.nc"]


def test_an_output_file_does_not_take_the_number_of_a_closed_stream(tmp_path):
    program, out = "samples/groove-circle-2.nc", tmp_path / "out.nc"
    assert ended("<&- >&- 2>&-", "compensate", program, "--config", "config/cartesian.yaml", "-o", str(out))[0] == 0
    again = tmp_path / "again.nc"
    assert ended("", "compensate", program, "--config", "config/cartesian.yaml", "-o", str(again))[0] == 0
    assert out.read_bytes() == again.read_bytes()
