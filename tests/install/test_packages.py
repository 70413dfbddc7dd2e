"""Wheel and sdist: what is in them, and that an installed camcomp works without the checkout."""

import os
import subprocess
import sys
import tarfile
import venv
import zipfile
from pathlib import Path

import pytest

from tests.commandline import ROOT

SAFE = {"filter": "data"} if hasattr(tarfile, "data_filter") else {}  # Python 3.11.0 to 3.11.3 have none


def call(*words, cwd, **environment):
    done = subprocess.run(
        [str(each) for each in words], check=False, cwd=cwd, capture_output=True, text=True, timeout=900,
        env={**os.environ, **{key: str(value) for key, value in environment.items()}},
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="session")
def built(tmp_path_factory):
    """(wheel, sdist); the wheel is built from the unpacked sdist, as a distributor would."""
    out = tmp_path_factory.mktemp("built")
    call(sys.executable, "-m", "hatchling", "build", "-t", "sdist", "-d", out, cwd=ROOT)
    (sdist,) = out.glob("*.tar.gz")
    with tarfile.open(sdist) as archive:
        archive.extractall(out / "source", **SAFE)
    (source,) = (out / "source").iterdir()
    call(sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", out, cwd=source)
    (wheel,) = out.glob("*.whl")
    return wheel, sdist


def test_the_wheel_holds_all_that_is_needed_and_nothing_else(built):
    names = set(zipfile.ZipFile(built[0]).namelist())
    for folder in ("config", "docs", "samples"):
        files = subprocess.run(["git", "ls-files", folder], check=True, cwd=ROOT, capture_output=True, text=True).stdout
        assert files
        assert {f"camcomp/data/{each}" for each in files.splitlines()} <= names
    for each in (
        "report/assets/page.css",
        "report/assets/page.js",
        "effects/backlash.py",
        "py.typed",
    ):
        assert f"camcomp/{each}" in names
    strangers = [each for each in names if not each.startswith(("camcomp/", "camcomp-"))]
    assert strangers == [] and not any("__pycache__" in each or "/tests/" in each for each in names)
    assert any(each.endswith("licenses/LICENSE") for each in names)


def test_the_wheel_says_what_it_needs(built):
    archive = zipfile.ZipFile(built[0])
    (name,) = [each for each in archive.namelist() if each.endswith("METADATA")]
    text = archive.read(name).decode()
    assert "Requires-Python: >=3.11" in text and "Requires-Dist: plotly>=6; extra == 'report'" in text
    assert "# camcomp" in text and "## Two commands" in text  # the README
    assert "](" not in text and "<!--" not in text and "://" not in text  # nothing that an index would show broken


@pytest.mark.campaign  # `.ci/versions` compensates with an installed one
def test_an_installed_camcomp_needs_no_checkout(built, tmp_path):
    site, project = tmp_path / "site", tmp_path / "project"
    call(
        sys.executable,
        "-m",
        "pip",
        "install",
        "-q",
        "--no-deps",
        "--no-index",
        "--target",
        site,
        built[0],
        cwd=tmp_path,
    )
    paths = {"PYTHONPATH": site, "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
    where = call(sys.executable, "-c", "import camcomp; print(camcomp.__file__)", cwd=tmp_path, **paths)
    assert where.startswith(str(site))
    command = site / "bin/camcomp"
    call(command, "init", project, cwd=tmp_path, **paths)
    call(command, "validate", project / "machine.yaml", project / "groove.nc", cwd=tmp_path, **paths)
    config = site / "camcomp/data/config/cartesian.yaml"
    program, out = tmp_path / "p.nc", tmp_path / "out.nc"
    program.write_text("G21 G90 G17 G94\nS8000 M3\nG0 X0 Y0 Z5\nG1 X10 F600\nM30\n")
    words = ["compensate", str(program), "--config", str(config), "-o", str(out)]
    call(command, *words, cwd=tmp_path, **paths)
    assert b"camcomp" in out.read_bytes()


def test_wheels_are_equal_byte_by_byte(built, tmp_path):
    """Built again later, elsewhere, by another user's umask, from a folder in which camcomp has run."""
    source = tmp_path / "source"
    with tarfile.open(built[1]) as archive:
        archive.extractall(source, **SAFE)
    (source,) = source.iterdir()
    (source / "camcomp/__pycache__").mkdir()
    (source / "camcomp/__pycache__/cli.cpython-311.pyc").write_bytes(b"left over")
    for each in source.rglob("*.py"):
        os.utime(each, (1e9, 1e9))
    call("sh", "-c", 'umask 077; exec "$0" -m hatchling build -t wheel -d "$1"', sys.executable, tmp_path, cwd=source)
    (again,) = tmp_path.glob("*.whl")
    assert again.read_bytes() == built[0].read_bytes()


@pytest.mark.ecosystem
def test_from_pip_install_to_a_corrected_program_in_two_commands(built, tmp_path):
    """With all dependencies from the package index, in an environment of its own."""
    venv.create(tmp_path / "venv", with_pip=True)
    tools = tmp_path / "venv" / ("Scripts" if os.name == "nt" else "bin")
    call(tools / "pip", "install", "-q", f"{built[0]}[report]", cwd=tmp_path)
    call(tools / "camcomp", "init", "start", cwd=tmp_path, PYTHONPATH="")
    call(
        tools / "camcomp", "compensate", "start/groove.nc", "--config", "start/machine.yaml", "-o", "out.nc",
        "--report", "report.html", cwd=tmp_path, PYTHONPATH="",
    )  # fmt: skip
    assert (tmp_path / "out.nc").stat().st_size > 1000 and (tmp_path / "report.html").stat().st_size > 1e6
