"""Diagnosis against an earlier camcomp on the same experiments: `pytest tests/benchmarks/test_diagnosis_speed.py -m benchmarks -s`.

Whole processes, one after the other in turns, one thread each; processor time (user and system), which other work on the
machine changes little. The least of the turns counts: nothing makes a process faster than it is.
"""

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

from tests.benchmarks.spent import spent
from tests.validation.plants.causes import Cause
from tests.validation.plants.experiments import Plan, make, write
from tests.validation.runner import CONFIG

pytestmark = pytest.mark.benchmarks

BEFORE = "f4c4e65"
ROOT = Path(__file__).parents[2]
TURNS = 2
FEW, MANY = 500, 13_000  # rows of each of six runs
MOST, MOST_MANY, MOST_MB = 1.5, 6.0, 1000.0  # wanted: times the earlier one, times that, memory
KINDS = {
    "null": ((), ()),
    "single": ((Cause("drive_stiffness", "y", 778),), (3.0,)),
    "pair": ((Cause("backlash", "x", 779), Cause("cutting_force", None, 780)), (3.0, 6.0)),
    "unknown": ((Cause("guide_straightness", "y", 781),), (10.0,)),
}


@pytest.fixture(scope="module")
def before(tmp_path_factory):
    """The earlier camcomp's tree."""
    tree = tmp_path_factory.mktemp("earlier") / BEFORE
    subprocess.run(["git", "worktree", "add", "-q", "--detach", tree, BEFORE], check=True, cwd=ROOT)
    yield tree
    subprocess.run(["git", "worktree", "remove", "--force", tree], check=True, cwd=ROOT)


def experiment(folder, kind, rows):
    causes, ratios = KINDS[kind]
    plan = Plan(777, causes, ratios, samples=rows)
    return write(make(plan), plan, folder / f"{kind}-{rows}", CONFIG)


def diagnosed(tree, path):
    """Time of a diagnosis by the camcomp of a tree."""
    with pytest.MonkeyPatch.context() as patch:
        for threads in ("OMP", "OPENBLAS", "NUMBA"):
            patch.setenv(f"{threads}_NUM_THREADS", "1")
        patch.setenv("PYTHONPATH", str(tree))
        patch.chdir(tree)
        return spent("-m", "camcomp", "diagnose", path, "--quiet")


def in_turns(pairs):
    """Processor time (s) and memory (MB) of each (tree, experiment): the least of its turns."""
    made = np.array([[diagnosed(*each)[1:] for each in pairs] for _ in range(TURNS)])
    return made.min(axis=0)


@pytest.fixture(scope="module", autouse=True)
def table(request):
    told: list[str] = []
    yield told
    with request.config.pluginmanager.getplugin("capturemanager").global_and_fixture_disabled():
        print("\n" + "\n".join([f"processor time, load {os.getloadavg()[0]:.1f}", *told]))


@pytest.fixture(scope="module")
def warm(before, tmp_path_factory):
    """Compiled code of both sides is on the disk from here on."""
    path = experiment(tmp_path_factory.mktemp("warm"), "null", 100)
    for tree in (before, ROOT):
        diagnosed(tree, path)


@pytest.mark.parametrize("kind", KINDS)
def test_six_runs_against_the_earlier_diagnosis(kind, before, warm, table, tmp_path):
    few = experiment(tmp_path, kind, FEW)
    (old, _), (new, memory) = in_turns([(before, few), (ROOT, few)])
    table.append(f"{kind}, 6 x {FEW} rows: {new / old:5.2f} times {BEFORE} ({old:.0f} s), {memory:.0f} MB")
    assert new <= MOST * old and memory < MOST_MB


@pytest.mark.parametrize("kind", KINDS)
def test_many_rows_against_few(kind, before, warm, table, tmp_path):
    few, many = experiment(tmp_path, kind, FEW), experiment(tmp_path, kind, MANY)
    (old, _), (new, _), (long, memory) = in_turns([(before, few), (ROOT, few), (ROOT, many)])
    table.append(
        f"{kind}, 6 x {MANY} rows: {long / new:5.2f} times 6 x {FEW} rows, "
        f"{long / old:.2f} times {BEFORE} on 6 x {FEW}, {memory:.0f} MB"
    )
    assert long <= MOST_MANY * MOST * old and memory < MOST_MB
