"""What a shell offers behind <TAB>, asked for as bash, zsh and fish ask."""

import os
import subprocess
import sys

import pytest

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
    (["comp"], "compensate"),
]


def offered(shell, words):
    """(kind, value) of what is offered."""
    whole = ["camcomp", *words]
    asked = {"COMP_WORDS": " ".join(whole), "COMP_CWORD": str(len(words)), "_CAMCOMP_COMPLETE": f"{shell}_complete"}
    if shell == "fish":
        asked |= {"COMP_WORDS": " ".join(whole[:-1]), "COMP_CWORD": words[-1]}
    done = subprocess.run(
        [sys.executable, "-c", "from camcomp.terminal.cli import main; main()"], capture_output=True, text=True, check=True,
        env={**os.environ, **asked, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    lines = done.stdout.splitlines()
    if shell == "zsh":
        return list(zip(lines[::3], lines[1::3], strict=True))
    return [tuple(line.split("\t")[0].split(",", 1)) for line in lines]


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_every_shell_is_offered_files_and_names(shell):
    for words, wanted in CASES:
        found = offered(shell, words)
        if wanted in ("file", "dir"):
            assert [kind for kind, _ in found] == [wanted], words
        else:
            assert ("plain", wanted) in found, words
            assert all(value.lower().startswith(words[-1].lower()) for _, value in found), words
