"""The command line is a door: its verbs call the interface that programs use, and do no work of their own."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

import camcomp
from camcomp.ground.files import shipped
from camcomp.terminal.cli import VERBS

PACKAGE = Path(camcomp.__file__).parent
COMMANDS = PACKAGE / "terminal" / "commands"
BELOW = ("camcomp.api", "camcomp.ground", "camcomp.report", "camcomp.terminal")
HEAVY = ("click", "numba", "numpy", "pandas", "plotly", "pydantic", "pygcode", "ruamel", "scipy")


def strangers(text):
    """Imports of a verb other than the interface, the ground, the findings and the terminal itself."""
    out = []
    for node in ast.walk(ast.parse(text)):
        names = [node.module] if isinstance(node, ast.ImportFrom) else []
        names += [each.name for each in node.names] if isinstance(node, ast.Import) else []
        out += [each for each in names if each.startswith("camcomp") and not each.startswith(BELOW)]
    return out


@pytest.mark.parametrize("verb", sorted(VERBS))
def test_a_verb_imports_the_interface_and_nothing_behind_it(verb):
    assert strangers((COMMANDS / f"{verb}.py").read_text(encoding="utf-8")) == []


def test_a_planted_stranger_is_caught():
    assert strangers("def f():\n    from camcomp.model.job import Job\n") == ["camcomp.model.job"]
    assert strangers("import numpy\nfrom camcomp.api.machine import Job\n") == []


def loaded_by(statement):
    """Heavy packages that are there after a statement in an interpreter of its own."""
    code = f"import sys\n{statement}\nprint(*{{each.split('.')[0] for each in sys.modules}})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return sorted(set(done.stdout.split()) & set(HEAVY))


def test_importing_camcomp_imports_nothing_else():
    assert loaded_by("import camcomp; dir(camcomp)") == []


def test_help_imports_no_numbers():
    help_text = "from camcomp.terminal.cli import run; import io, contextlib\n"
    help_text += "with contextlib.redirect_stdout(io.StringIO()): run(['--help'])"
    assert loaded_by(help_text) == ["click"]


UNUSED = {"concurrent.futures", "numba", "numpy.ma", "plotly", "pygcode", "scipy", "statistics"}
MOST_FILES = 190  # of camcomp


def test_a_compensation_of_a_short_program_imports_no_more_than_it_uses(tmp_path):
    groove, machine = (str(shipped(each)) for each in ("samples/groove-circle-2.nc", "config/orthoglide-1deg.yaml"))
    words = ["compensate", groove, "--config", machine, "--quiet", "-o", str(tmp_path / "out.nc")]
    code = f"import sys; from camcomp.terminal.cli import run; assert run({words}) == 0; print(*sys.modules)"
    for _ in range(2):  # the first run may compile
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = set(done.stdout.split())
    assert loaded & UNUSED == set()
    files = [
        PACKAGE.joinpath(*each.split(".")[1:]).with_suffix(".py") for each in loaded if each.startswith("camcomp.")
    ]
    assert sum(each.is_file() for each in files) <= MOST_FILES


def test_a_start_defines_its_dataclasses_with_shared_methods():
    """The standard decorator is for results that users handle, and for what only a diagnosis imports."""
    standard = re.compile(r"^from dataclasses import .*\bdataclass\b", re.MULTILINE)
    found = {path.relative_to(PACKAGE) for path in PACKAGE.rglob("*.py") if standard.search(path.read_text("utf-8"))}
    assert {each.parts[0] for each in found - {Path("ground/records.py")}} <= {"api", "diagnosis"}


def test_every_name_of_the_interface_is_there_and_typed():
    for name in camcomp.__all__:
        assert getattr(camcomp, name).__doc__, name
    tree = ast.parse(Path(camcomp.__file__).read_text(encoding="utf-8"))
    branch = next(node for node in tree.body if isinstance(node, ast.If))
    typed = [(node.module, alias.name) for node in branch.body for alias in node.names]
    lazy = [(f"camcomp.{home}", name) for home, names in camcomp._HOMES.items() for name in names]
    assert sorted(typed) == sorted(lazy)
    assert sorted(name for _, name in typed) == sorted(camcomp.__all__)
    with pytest.raises(AttributeError, match="no attribute 'compensated'"):
        _ = camcomp.compensated
