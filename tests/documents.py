"""Runs a Markdown document as a reader would: files are typed in, commands are given, and what is promised is compared.

A block with `title=NAME` is a file. In a ```console block a line `$ command` is run: a call of camcomp in this process,
anything else by bash. The lines below it are what it must print, in order, `...` standing for anything within a line or for
any number of lines. `# exit N` behind a command is the exit code that it must end with, else 0.
"""

import os
import re
import shlex
import subprocess
import sys
from dataclasses import dataclass, field

from tests.commandline import ROOT, camcomp

# what a run writes every 10 s, which a document does not show
_PROGRESS = re.compile(r"^[^\n]+: (?:\d+ %, about [^\n]* left|[^\n]* so far)\n", re.MULTILINE)
_OF_A_SHELL = re.compile(r"[|&;<>$*`~]")
_FENCE = re.compile(r"^```(\w*)([^\n]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


@dataclass
class Command:
    """A command of a document, with its line and the output that the document promises."""

    text: str
    line: int
    code: int = 0
    promised: list[str] = field(default_factory=list)


@dataclass
class TypedFile:
    """A file that the reader makes."""

    name: str
    text: str


def steps(document):
    """Commands and files of Markdown text in their order."""
    out = []
    for block in _FENCE.finditer(document):
        language, info, body = block.groups()
        title = re.search(r"title=(\S+)", info)
        first = document.count("\n", 0, block.start(3)) + 1
        if title:
            out.append(TypedFile(title[1], body))
        elif language == "console":
            for number, line in enumerate(body.splitlines(), first):
                if line.startswith("$ "):
                    text, _, code = line[2:].partition("  # exit ")
                    out.append(Command(text, number, int(code or 0)))
                else:
                    assert out and isinstance(out[-1], Command), f"line {number}: output without a command"
                    out[-1].promised.append(line)
    return out


def text_blocks(document):
    """Contents of ```text blocks without a title, by the line at which they begin."""
    return {
        document.count("\n", 0, block.start(3)) + 1: block[3]
        for block in _FENCE.finditer(document)
        if block[1] == "text" and "title=" not in block[2]
    }


def missing(promised, printed):
    """The first promised line that is missing in the printed text, or None."""
    lines, at, loose = printed.splitlines(), 0, False
    for promise in promised:
        if promise.strip() == "...":
            loose = True
            continue
        pattern = re.compile(".*".join(re.escape(part) for part in promise.rstrip().split("...")))
        span = range(at, len(lines)) if loose else range(at, min(at + 1, len(lines)))
        found = next((i for i in span if pattern.fullmatch(lines[i].rstrip())), None)
        if found is None:
            return promise
        at, loose = found + 1, False
    return None


class Reader:
    """A user at a shell in `folder`, with this camcomp and the packages that they install."""

    def __init__(self, folder, tools):
        self.folder = folder
        self.installs = False  # packages, which other processes see
        tools.mkdir()
        for name, call in (("camcomp", "-m camcomp"), ("pip", "-m pip"), ("python", "")):
            script = tools / name
            script.write_text(f'#!/bin/sh\nexec "{sys.executable}" {call} "$@"\n')
            script.chmod(0o755)
        self.environment = {
            **os.environ,
            "PATH": f"{tools}{os.pathsep}{os.environ['PATH']}",
            "PYTHONPATH": f"{ROOT}{os.pathsep}{tools / 'site'}",
            # `pip install .` as it stands in the text, without a network and without touching this environment.
            "PIP_TARGET": str(tools / "site"),
            "PIP_NO_DEPS": "1",
            "PIP_NO_INDEX": "1",
            "PIP_NO_BUILD_ISOLATION": "0",  # pip reads this one the other way round
            "PIP_DISABLE_PIP_VERSION_CHECK": "1",
            "PIP_QUIET": "1",
            "PIP_ROOT_USER_ACTION": "ignore",
        }

    def give(self, command):
        """Run a command and return its output and errors in the order of writing, progress removed."""
        self.installs |= command.text.startswith("pip ")
        if command.text.startswith("camcomp ") and not self.installs and not _OF_A_SHELL.search(command.text):
            done = camcomp(*shlex.split(command.text)[1:], cwd=self.folder, together=True)
        else:
            done = subprocess.run(
                ["bash", "-eo", "pipefail", "-c", command.text], check=False, cwd=self.folder, env=self.environment,
                stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=600,
            )  # fmt: skip
        printed = done.stdout.decode()
        assert done.returncode == command.code, f"line {command.line}: `{command.text}`\n{printed}"
        return _PROGRESS.sub("", printed)

    def follow(self, document, skip=lambda text: False):
        """Do everything that a document says."""
        for step in steps(document):
            if isinstance(step, TypedFile):
                (self.folder / step.name).write_text(step.text, encoding="utf-8")
            elif not skip(step.text):
                printed = self.give(step)
                lost = missing(step.promised, printed)
                assert lost is None, f"line {step.line}: `{step.text}` does not print `{lost}`, but\n{printed}"
