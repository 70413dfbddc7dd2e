"""The hooks and the workflow that are offered to users work as described."""

import os
import re
import subprocess
import sys

import pytest
from ruamel.yaml import YAML

from camcomp.terminal.cli import run
from tests.commandline import ROOT

HOOKS = YAML(typ="safe").load((ROOT / ".pre-commit-hooks.yaml").read_text())
WORKFLOW = YAML(typ="safe").load((ROOT / "samples/ci/github-actions.yml").read_text())
STEPS = [step for step in WORKFLOW["jobs"]["programs"]["steps"] if "run" in step and step["name"] != "Install"]


@pytest.fixture
def project(tmp_path):
    folder = tmp_path / "project"
    assert run(["init", str(folder)]) == 0
    return folder


@pytest.fixture
def shell(tmp_path):
    """Runs shell text in a folder where the word camcomp is this camcomp."""
    (tmp_path / "bin").mkdir()
    script = tmp_path / "bin/camcomp"
    script.write_text(f'#!/bin/sh\nPYTHONPATH="{ROOT}" exec "{sys.executable}" -m camcomp "$@"\n')
    script.chmod(0o755)
    path = f"{script.parent}{os.pathsep}{os.environ['PATH']}"

    def call(text, folder):
        command = ["bash", "-eo", "pipefail", "-c", text]  # as GitHub runs it
        return subprocess.run(
            command,
            check=False,
            cwd=folder,
            env={**os.environ, "PATH": path},
            capture_output=True,
            text=True,
            timeout=600,
        )

    return call


def test_the_workflow_passes_on_a_starter_project(project, shell):
    assert len(STEPS) == 3
    for step in STEPS:
        done = shell(step["run"], project)
        assert done.returncode == 0, f"{step['name']}: {done.stderr}"
    assert (project / "corrected/groove.nc").exists() and (project / "validate.sarif").exists()
    assert len(list(project.glob("*.xml"))) == 3


def test_the_workflow_fails_on_a_bad_program(project, shell):
    program = project / "groove.nc"
    program.write_text(program.read_text().replace("X25", "X2,5", 1))
    assert shell(STEPS[0]["run"], project).returncode == 3
    assert (project / "validate.sarif").read_text().count('"ruleId": "CC101"') == 1


def test_the_recipe_of_the_image_compiles_by_commands_that_work(tmp_path, shell):
    text = (ROOT / "samples/ci/Containerfile").read_text().replace("\\\n", "")
    _, warm_up = re.findall(r"^RUN (.*)", text, re.MULTILINE)
    (tmp_path / "cache").mkdir()
    done = shell(
        warm_up.replace("/tmp/start", str(tmp_path / "start")).replace("/var/cache/camcomp", str(tmp_path / "cache")),
        tmp_path,
    )
    assert done.returncode == 0, done.stderr
    assert re.search(r"^FROM docker\.io/library/python:3\.\d+-slim$", text, re.MULTILINE)


@pytest.mark.parametrize("hook", HOOKS, ids=lambda hook: hook["id"])
def test_a_hook_takes_many_files_and_fails_on_a_bad_one(hook, project, shell):
    files = sorted(each.name for each in project.iterdir() if re.search(hook["files"], each.name))
    assert files and hook["language"] == "python"
    done = shell(f"{hook['entry']} {' '.join(files * 2)}", project)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    (project / files[0]).write_text("G1 X1,5\n")
    done = shell(f"{hook['entry']} {' '.join(files)}", project)
    assert done.returncode in (2, 3) and files[0] in done.stderr


def test_hooks_see_programs_of_every_ending_that_batch_takes():
    from camcomp.compensation.batch.programs import SUFFIXES
    from camcomp.gcode.detect import endings

    (pattern,) = [hook["files"] for hook in HOOKS if hook["id"] == "camcomp-programs"]
    assert all(re.search(pattern, f"a/b{suffix}") for suffix in {*SUFFIXES, *endings()})
    assert not re.search(pattern, "a/b.ncx")
