"""Commands on the pages print what stands there, drawings are those of their script, and the site is built without a warning."""

import importlib.util
import re
import shutil
import subprocess
import sys

import pytest

from tests.documentation import drawings
from tests.documents import ROOT, Command, Reader, missing, steps, text_blocks

README = (ROOT / "README.md").read_text(encoding="utf-8")
DOCS = ROOT / "docs"
FOLLOWED = sorted(
    path for path in DOCS.rglob("*.md") if any(isinstance(each, Command) for each in steps(path.read_text("utf-8")))
)
FOLLOWED += [ROOT / "samples/tutorial.md", ROOT / "samples/diagnosis/README.md"]
SLOW = ("next-experiment", "reports", "static-poses")  # pages whose commands take long; they are a campaign


@pytest.fixture
def reader(tmp_path):
    (tmp_path / "folder").mkdir()
    return Reader(tmp_path / "folder", tmp_path / "tools")


@pytest.mark.parametrize(
    "path",
    [pytest.param(each, marks=pytest.mark.campaign) if each.stem in SLOW else each for each in FOLLOWED],
    ids=lambda path: path.relative_to(ROOT).as_posix(),
)
def test_commands_of_a_page_print_what_stands_there(path, reader):
    """They run in a folder that holds config and samples."""
    for name in ("config", "samples"):
        shutil.copytree(ROOT / name, reader.folder / name)
    reader.follow(path.read_text(encoding="utf-8"))


def test_the_readme_is_followed(reader):
    """Its commands run in a copy of the checkout, without those that set up and test."""
    for name in ("config", "samples"):
        shutil.copytree(ROOT / name, reader.folder / name)
    printed = []
    for step in steps(README):
        parts = [part for part in step.text.split(" && ") if "venv .venv" not in part and "pip install" not in part]
        step.text = " && ".join(parts).replace(".venv/bin/", "")
        if step.text and "-m pytest" not in step.text:
            printed.append(reader.give(step))
            lost = missing(step.promised, printed[-1])
            assert lost is None, f"line {step.line}: `{step.text}` does not print `{lost}`"
    assert len(printed) >= 2
    files = [
        path.read_text(encoding="utf-8") for path in reader.folder.rglob("*") if path.suffix in (".nc", ".csv", ".json")
    ]
    told = text_blocks(README)
    assert told
    for line, text in told.items():
        promised = ["...", *text.splitlines()]
        assert any(missing(promised, each) is None for each in (*printed, *files)), (
            f"README.md:{line} is not what comes out"
        )


@pytest.mark.parametrize("name", sorted(drawings.DRAWINGS))
def test_drawings_are_those_of_their_script(name):
    """Same words and lines, coordinates within a quarter of a pixel."""
    kept, made = (drawings.FOLDER / f"{name}.svg").read_text(encoding="utf-8"), drawings.DRAWINGS[name]().text()
    number = r"-?\d+\.\d"
    assert re.sub(number, "#", kept) == re.sub(number, "#", made), "run `python -m tests.documentation.drawings`"
    pairs = zip(re.findall(number, kept), re.findall(number, made), strict=True)
    assert all(abs(float(one) - float(other)) <= 0.25 for one, other in pairs)


@pytest.mark.skipif(importlib.util.find_spec("mkdocs") is None, reason="the extra docs is not installed")
def test_the_site_is_built_without_a_warning(tmp_path):
    words = [
        sys.executable,
        "-W",
        "ignore",
        "-m",
        "mkdocs",
        "build",
        "--strict",
        "--quiet",
        "--site-dir",
        tmp_path / "site",
    ]
    done = subprocess.run(words, check=False, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert (tmp_path / "site/tutorial/diagnosis/index.html").exists()
    assert "<math" in (tmp_path / "site/explanation/method/index.html").read_text(encoding="utf-8")
