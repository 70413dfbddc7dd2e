"""Files changed at random never end in a bug, a warning of a library, or a long wait. Seeded: the same files every time."""

import contextlib
import io
import re
import time
import warnings
from pathlib import Path
from random import Random

import pytest

from camcomp.ground.files import shipped
from camcomp.terminal.cli import run
from tests.mutations import mutated_markup, mutated_table, mutated_text
from tests.pace import soon
from tests.unit.gcode.test_fanuc_ls import HEAD, MOVES, TAIL
from tests.unit.gcode.test_rapid import POSTED
from tests.unit.model.config.test_urdf import urdf

CONTRACT = (0, 1, 2, 3, 4, 5)
LONGEST_S = 2.0
MACHINES = ("cartesian", "orthoglide-1deg", "puu", "router", "kuka-kr210")
PROGRAM = str(shipped("samples/groove-circle-2.nc"))
STUDY = shipped("samples/diagnosis/ambiguous")
TOKENS = (
    "[",
    "]",
    "{",
    "}",
    ",",
    ";",
    ":",
    ":=",
    "\\",
    '"',
    "'",
    "-9",
    "9E9",
    "1e400",
    "TRUE",
    "fine",
    "A",
    "(",
    "!",
    "#X",
    "\0",
    "ä",
)
FRAME = "{origin_mm: [1550, 0, 800], abc_deg: [0, 0, 0]}"
TOOL = "{origin_mm: [0, 0, 250], abc_deg: [0, 0, 0]}"
FRAMES = f"control:\n  absolute_accuracy: false\n  base_frames: {{1: {FRAME}, 2: {FRAME}}}\n  tool_frames: {{1: {TOOL}, 2: {TOOL}}}\n"


def end_of(data, *words, longest=LONGEST_S):
    """The exit code of one command line in this process; `data` is shown where it is not as it has to be."""
    said, begun = io.StringIO(), time.process_time()
    with (
        warnings.catch_warnings(record=True) as warned,
        contextlib.redirect_stdout(io.TextIOWrapper(io.BytesIO())),
        contextlib.redirect_stderr(said),
    ):
        warnings.simplefilter("always")
        code = run([str(word) for word in words])
    took = time.process_time() - begun
    assert code in CONTRACT and not warned and soon(took, longest), (
        code,
        took,
        warned and warned[0].message,
        said.getvalue(),
        data,
    )
    return code


@pytest.fixture(scope="module", autouse=True)
def warm(tmp_path_factory):
    """Imports and the compiled solver, which no input is to blame for."""
    out = tmp_path_factory.mktemp("warm") / "out"
    for verb in ("compensate", "simulate"):
        end_of(b"", verb, PROGRAM, "--config", shipped("config/cartesian.yaml"), "-o", out, longest=300.0)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.src", shipped("samples/robot/slot.src").read_text()),
        ("a.mod", POSTED.replace("[[10.5,-3,248],[0.99904822,0,0.04361939,0]]", "[[0,0,250],[1,0,0,0]]")),
        ("a.ls", HEAD + MOVES + TAIL),
    ],
)
def test_robot_programs(tmp_path, name, text):
    random, ends = Random(8), set()
    tokens = re.findall(r"\w+|\s+|[^\w\s]", text)
    (tmp_path / "frames.yaml").write_text(FRAMES)
    for _ in range(30):
        changed = list(tokens)
        for _ in range(random.choice((1, 1, 2, 3))):
            changed[random.randrange(len(changed))] = random.choice((*TOKENS, random.choice(tokens), ""))
        data = "".join(changed).encode()
        (tmp_path / name).write_bytes(data)
        ends.add(
            end_of(
                data,
                "canon",
                tmp_path / name,
                "--config",
                shipped("config/kuka-kr210.yaml"),
                "--config",
                tmp_path / "frames.yaml",
            )
        )
    assert ends == {0, 3}


@pytest.mark.parametrize("seed", range(4))
def test_machine_files(tmp_path, seed):
    random, ends = Random(seed), set()
    for number in range(25):
        data = mutated_text(random, shipped(f"config/{random.choice(MACHINES)}.yaml").read_bytes())
        file = tmp_path / "machine.yaml"
        file.write_bytes(data)
        ends.add(code := end_of(data, "validate", file))
        if code == 0 and number % 3 == 0:
            verb = random.choice(("compensate", "simulate"))
            end_of(data, verb, PROGRAM, "--config", file, "-o", tmp_path / "out", longest=20.0)
    assert ends == {0, 2}


def test_experiments(tmp_path):
    random = Random(5)
    for _ in range(30):
        data = mutated_text(random, (STUDY / "experiment.yaml").read_bytes())
        (tmp_path / "experiment.yaml").write_bytes(data)
        end_of(data, "validate", tmp_path / "experiment.yaml")


def test_logs(tmp_path):
    random, log, good = Random(6), tmp_path / "log.csv", STUDY / "log-2.csv"
    machine, program = shipped("config/orthoglide.yaml"), STUDY / "program-2.nc"
    (tmp_path / "experiment.yaml").write_text(
        f"config: [{machine}]\nruns: [{{name: a, program: {program}, log: log.csv, cutting: true}}]\n"
    )
    ends = set()
    for number in range(30):
        data = mutated_table(random, good.read_bytes())
        log.write_bytes(data)
        ends.add(end_of(data, "compare", log, good))
        if number % 12 == 0:
            end_of(data, "diagnose", tmp_path / "experiment.yaml", longest=30.0)
    assert ends == {0, 2}


def test_robot_descriptions(tmp_path):
    random, ends = Random(7), set()
    for number in range(40):
        data = mutated_markup(random, urdf())
        (tmp_path / "arm.urdf").write_bytes(data)
        folder = Path(tmp_path / str(number))
        ends.add(code := end_of(data, "init", "--from-urdf", tmp_path / "arm.urdf", folder))
        if code == 0:
            assert end_of(data, "validate", folder / "machine.yaml") == 0, data
    assert ends == {0, 2}
