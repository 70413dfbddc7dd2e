"""Completions of bash, zsh and fish behind <TAB>."""

import os
import subprocess
import sys

import pytest

from camcomp.terminal.cli import run
from tests.commandline import ROOT

CASES = [
    (["compensate", "samp"], "file"),
    (["compensate", "a.nc", "--config", "ma"], "file"),
    (["compensate", "a.nc", "-o", ""], "file"),
    (["verify", "a.nc", "--against", ""], "file"),
    (["diagnose", "e"], "file"),
    (["batch", "in", "--output-dir", "o"], "dir"),
    (["init", ""], "dir"),
    (["explain", "CC14"], "CC141"),
    (["init", "--machine", "kuka"], "kuka-kr210"),
    (["diagnose", "e.yaml", "--without", "back"], "backlash"),
    (["canon", "a.nc", "--dialect", "gr"], "grbl"),
    (["compensate", "a.nc", "--method", "fix"], "fixed-point"),
    (["compensate", "a.nc", "--stock", "co"], "comments"),
    (["config", "screw-file", "--config", str(ROOT / "config/cartesian.yaml"), "--actuator", "x"], "x"),
    (["config", "show", "--config", "ma"], "file"),
    (["config", "skew", "--config", "a.yaml", "-o", ""], "file"),
    (["place", "a.nc", "--report", ""], "file"),
    (["import", "a.csv", "-o", ""], "dir"),
    (["import", "a.csv", "--program", "a"], "file"),
    (["history", ""], "dir"),
    (["compare", "a.csv", "b"], "file"),
    (["init", "d", "--from-urdf", "a"], "file"),
    (["comp"], "compensate"),
]


def asked(shell, words):
    """Variables by which a shell asks for completions."""
    whole = ["camcomp", *words]
    found = {"COMP_WORDS": " ".join(whole), "COMP_CWORD": str(len(words)), "_CAMCOMP_COMPLETE": f"{shell}_complete"}
    if shell == "fish":
        found |= {"COMP_WORDS": " ".join(whole[:-1]), "COMP_CWORD": words[-1]}
    return found


def offered(shell, printed):
    """(kind, value) of every completion."""
    lines = printed.splitlines()
    if shell == "zsh":
        return list(zip(lines[::3], lines[1::3], strict=True))
    return [tuple(line.split("\t")[0].split(",", 1)) for line in lines]


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_every_shell_is_offered_files_and_names(shell, monkeypatch, capsys):
    for words, wanted in CASES:
        for name, value in asked(shell, words).items():
            monkeypatch.setenv(name, value)
        assert run([]) == 0
        found = offered(shell, capsys.readouterr().out)
        if wanted in ("file", "dir"):
            assert [kind for kind, _ in found] == [wanted], words
        else:
            assert ("plain", wanted) in found, words
            assert all(value.lower().startswith(words[-1].lower()) for _, value in found), words


def test_a_process_answers_a_shell():
    done = subprocess.run(
        [sys.executable, "-m", "camcomp"], capture_output=True, text=True, check=True,
        env={**os.environ, **asked("bash", ["comp"]), "PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    assert ("plain", "compensate") in offered("bash", done.stdout)
