"""How much the answers of a diagnosis hang on its tuned constants: each halved and doubled on a fixed set of experiments.

The set is small on purpose (three short runs each): what is asked is which constants decide anything at all, and at which
size of a change, not what the rates are. A diagnosis goes on in a process of its own, with the constant changed, from
where it first uses it: what stands before is not worked out again. `python -m tests.validation.recorded sensitivity` prints the column of camcomp/data/constants.md.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import shutil
import sys
from collections import defaultdict
from importlib import import_module
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np

from tests.validation.axes.make import make as logs_of_axes
from tests.validation.poses.make import make as static_poses
from tests.validation.recorded.experiment import Plan, make, write

FACTORS = (0.5, 2.0)
WING = "camcomp.diagnosis."
SHORT = {"runs": 3, "rows": 200, "stated": False, "rapids": True}
SET = (
    Plan(8101, "null", **SHORT),
    Plan(8102, "null", machine="router", **SHORT),
    Plan(8103, "imperfect", imperfect=True, **SHORT),
    Plan(8104, "single", (("backlash", "y"),), (1.0,), **SHORT),
    Plan(8105, "single", (("screw_pitch", "x"),), (3.0,), **SHORT),
    Plan(8106, "single", (("friction", "x"),), (10.0,), machine="router", **SHORT),
    Plan(8107, "single", (("joint_offset", "A2"),), (10.0,), machine="kuka-kr210", **SHORT),
    Plan(8108, "pair", (("servo_lag", None), ("cutting_force", None)), (3.0, 6.0), machine="delta", **SHORT),
    Plan(8109, "unknown", (("guide_bump", "x"),), (10.0,), **SHORT),
    Plan(8110, "unknown", (("disturbed_drive", "y"),), (3.0,), **SHORT),
)
# one of each kind by the generators that know nothing of camcomp
AXES, POSES = (31000, 31001, 31002, 31003, 31004), (21000, 21001, 21002, 21003, 21005)

ROOT = Path(__file__).resolve().parents[3]


def written(folder: Path) -> list[Path]:
    """The experiments of the fixed set below a folder: an axis by itself, an arm in static poses, milled paths, more of the first two."""
    out = [_axis(folder / "s-axis"), _poses(folder / "s-poses")]
    for plan in SET:
        there = folder / f"s-{plan.seed}"
        out.append(there / "experiment.yaml")
        if not out[-1].exists():
            write(make(plan), plan, there)
    for one, seeds in ((logs_of_axes, AXES), (static_poses, POSES)):
        for seed in seeds:
            out.append(folder / f"e-{seed}" / "experiment.yaml")
            if not out[-1].exists():
                one(seed, folder, None)
    return out


def _axis(folder: Path) -> Path:
    """Two runs of an axis that is late, rubs, and feels a ball screw's pitch in its drive, which no effect has."""
    folder.mkdir(parents=True, exist_ok=True)
    t = np.arange(0.0, 16.0, 0.01)
    for k, w in enumerate((1.0, 1.3)):
        rng = np.random.default_rng(k)
        x = 100.0 * np.sin(0.9 * w * t) + 40.0 * np.sin(2.3 * w * t + 0.4)
        speed = np.gradient(x, t)
        force = 0.08 * np.gradient(speed, t) + 30.0 * np.tanh(speed / 0.5) + 0.1 * speed + 2.0 * np.sin(0.4 * np.pi * x)
        force += rng.normal(0.0, 0.5, len(t))
        table = np.column_stack([t, x + 0.005 * speed + rng.normal(0.0, 5e-4, len(t)), x, force])
        header = "t_s,cmd_x_mm,act_x_mm,act_x_N"
        np.savetxt(folder / f"{k}.csv", table, fmt="%.6f", delimiter=",", header=header, comments="")
    runs = [{"name": f"run-{k}", "log": f"{k}.csv", "cutting": False} for k in range(2)]
    return _stated(folder, "cartesian", runs)


def _poses(folder: Path) -> Path:
    """The shipped measurement of an arm."""
    folder.mkdir(parents=True, exist_ok=True)
    runs = []
    for name in "AB":
        shutil.copy(ROOT / "samples" / "ur10" / f"series_{name}.csv", folder)
        runs.append({"name": name, "log": f"series_{name}.csv", "cutting": False, "clamping": name})
    return _stated(folder, "ur10", runs)


def _stated(folder: Path, machine: str, runs: list[dict[str, Any]]) -> Path:
    path = folder / "experiment.yaml"
    path.write_text(json.dumps({"config": [str(ROOT / "config" / f"{machine}.yaml")], "runs": runs}))
    return path


def answer(experiment: Path, folder: Path) -> str:
    """Verdict and causes of an answer; its file lies in the folder."""
    from camcomp.terminal.cli import run as camcomp

    file = folder / "result.json"
    file.unlink(missing_ok=True)
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        code = camcomp(["diagnose", str(experiment), "--json", str(file)])
    if not file.exists():
        return f"exit {code}"
    result = json.loads(file.read_text())
    causes = sorted(f"{c['effect']}({c['target']})" for c in result["causes"])
    return f"{result['verdict']} {' '.join(causes)}"


class Bench:
    """Answers of experiments, and of every constant (module below the wing, name) how many of them it changes when halved, and when doubled."""

    def __init__(self, constants: list[tuple[str, str]]) -> None:
        self.constants = constants
        self.homes = {module: import_module(WING + module) for module, _ in constants}
        self.usual: dict[Path, str] = {}
        self.met: dict[tuple[str, str], int] = defaultdict(int)
        self.changed: dict[tuple[str, str], list[int]] = {each: [0, 0] for each in constants}

    def ask(self, experiment: Path) -> None:
        """Diagnoses an experiment, and on the way all that it would be with each constant halved and doubled."""
        other: dict[tuple[str, str], list[str]] = {}
        pending: dict[str, list[tuple[str, str]]] = defaultdict(list)
        for module, name in self.constants:
            pending[name].append((module, name))
        seen = set()

        def on_call(frame: FrameType, event: str, _: Any) -> None:
            code = frame.f_code
            if event != "call" or code in seen:
                return
            seen.add(code)
            home = str(frame.f_globals.get("__name__", ""))
            if not home.startswith("camcomp."):
                return
            for name in set(code.co_names) & pending.keys():
                for module, _ in list(pending[name]):
                    if frame.f_globals.get(name) is not getattr(self.homes[module], name):
                        continue  # something else of that name
                    pending[name].remove((module, name))
                    other[module, name] = []
                    for factor in FACTORS:
                        other[module, name].append(forked(module, name, factor))
                        if tell:
                            return  # the copy: it asks for nothing else

        def forked(module: str, name: str, factor: float) -> str:
            """The answer of a copy of this process that goes on with the changed constant."""
            reading, writing = os.pipe()
            child = os.fork()
            if child:
                os.close(writing)
                with os.fdopen(reading) as pipe:
                    said = pipe.read()
                os.waitpid(child, 0)
                return said
            sys.setprofile(None)
            os.close(reading)
            tell.append(writing)
            _change(module, name, factor)
            return ""

        tell: list[int] = []
        sys.setprofile(on_call)
        said = answer(experiment, experiment.parent)
        sys.setprofile(None)
        if tell:
            os.write(tell[0], said.encode())
            os._exit(0)
        self.usual[experiment] = said
        for each, answers in other.items():
            self.met[each] += 1
            for n, one in enumerate(answers):
                self.changed[each][n] += one != said


def _change(module: str, name: str, factor: float) -> None:
    """Sets a constant below the wing, there and wherever it is imported, to `factor` times its value."""
    home = import_module(WING + module)
    usual = getattr(home, name)
    for each in list(sys.modules.values()):
        if getattr(each, "__name__", "").startswith("camcomp.") and each.__dict__.get(name) is usual:
            setattr(each, name, _times(usual, factor))


def _times(value: Any, factor: float) -> Any:
    if isinstance(value, tuple):
        return tuple(_times(each, factor) for each in value)
    if isinstance(value, np.ndarray):
        return value * factor
    return max(round(value * factor), 1) if isinstance(value, int) else value * factor
