"""What counts as lost: an input touched, an output half-written, a file left over, a bug, a hang."""

import shutil
import subprocess
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path

from tests.benchmarks.programs import groove
from tests.commandline import ROOT
from tests.faults.process import camcomp, environment

CODES = (0, 1, 2, 3, 4, 5)  # of the contract; 70 is a bug
_COUNT = count(1)
MACHINE, PROGRAM = "machine.yaml", "program.nc"
OUTPUTS = {"-o": "out.nc", "--joints": "out.csv", "--summary": "out.json", "--paths": "paths.csv"}
LONG_OUTPUTS = {
    option: name for option, name in OUTPUTS.items() if option != "--paths"
}  # what long programs have in pieces
LONG_MOVES = 3000


def compensate(outputs):
    """Words of a compensation with these outputs."""
    return ["compensate", PROGRAM, "--config", MACHINE, *(word for pair in outputs.items() for word in pair)]


COMPENSATE = compensate(OUTPUTS)


@dataclass(frozen=True)
class Verdict:
    """hit: the fault met a living process; lost: what is wrong, or None."""

    hit: bool
    lost: str | None = None


@dataclass
class Project:
    """Folders with a machine and a program, and their outputs of an undisturbed run."""

    folder: Path
    more: dict[str, bytes] = field(default_factory=dict)  # further files by name
    outputs: dict[str, str] = field(default_factory=lambda: OUTPUTS)  # of a compensation, by option
    known: dict = field(default_factory=dict)  # what was found out once

    def fresh(self, old=()):
        """A new folder; old: outputs that an earlier run left there."""
        folder = self.folder / f"run-{next(_COUNT)}"
        folder.mkdir(parents=True)
        shutil.copy(ROOT / "config" / "orthoglide.yaml", folder / MACHINE)
        shutil.copy(ROOT / "samples" / "groove-circle-2.nc", folder / PROGRAM)
        for name, data in self.more.items():
            (folder / name).write_bytes(data)
        for name in old:
            (folder / name).write_bytes(b"old")
        return folder

    @property
    def expected(self):
        """Outputs of an undisturbed compensation, by name."""
        if "expected" not in self.known:
            calm = self.fresh()
            ended = camcomp(compensate(self.outputs), calm)
            assert ended.code == 0, f"the campaign cannot start: exit {ended.code}: {ended.said}"
            self.known["expected"] = {name: (calm / name).read_bytes() for name in self.outputs.values()}
            shutil.rmtree(calm)
        return self.known["expected"]

    @property
    def long(self):
        """The same with a long program, which is corrected in pieces."""
        if "long" not in self.known:
            text = "\n".join(groove(LONG_MOVES)) + "\n"
            self.known["long"] = Project(self.folder, {**self.more, PROGRAM: text.encode()}, LONG_OUTPUTS)
        return self.known["long"]

    def warm_code(self, start):
        """A folder with the compiled code of a compensation; start: runs a command line in a new process."""
        if "code" not in self.known:
            self.known["code"] = self.folder / "code"
            ended = start(COMPENSATE, self.fresh(), NUMBA_CACHE_DIR=str(self.known["code"]))
            assert ended.code == 0, ended.said
        return self.known["code"]

    def batch(self, command):
        """Programs that an undisturbed batch makes; command: its words, for a folder."""
        if "batch" not in self.known:
            calm = self.fresh()
            subprocess.run(command(calm, "--jobs", "1"), cwd=calm, env=environment(), capture_output=True, check=True)
            made = contents(calm / "out")
            self.known["batch"] = {name: data for name, data in made.items() if name.endswith(".nc")}
        return self.known["batch"]


def contents(folder):
    """Bytes of every file below a folder, by relative name."""
    return {each.relative_to(folder).as_posix(): each.read_bytes() for each in folder.rglob("*") if each.is_file()}


def wrong(ended, signals=()):
    """Faults of the end of a process, apart from its files."""
    if ended.hung:
        return "it hangs"
    if ended.code not in (*CODES, *(-number for number in signals), *(128 + number for number in signals)):
        return f"exit {ended.code}: {ended.said[-300:]}"
    for bad in ("Traceback", "internal error", "Exception ignored"):
        if bad in ended.said:
            return f"it says {bad}: {ended.said[-600:]}"
    return None


def damage(before, after, expected, *, leftovers=False):
    """Faults of the files; expected: whole outputs by name. leftovers: a nameless file may have got a name."""
    for name, data in before.items():
        if after.get(name) != data and name not in expected:
            return f"{name} was changed"
    for name, data in after.items():
        if name in expected:
            if data not in (expected[name], before.get(name)):
                return f"{name} is half-written"
        elif name not in before and not (leftovers and name.rpartition("/")[2].startswith(".camcomp-")):
            return f"{name} is left over"
    return None
