"""Laws of diagnosis: less data never names another cause, and what carries no information changes nothing.

A law takes an experiment's files, changes them, and says how names of actuators in the answer are to be read.  "Less" laws take
away; "same" laws write the same thing differently.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml

CLOCK_S = 37.0  # by which a clock is shifted
AGREE = 0.25  # of an interval's width, by which a value may change
Names = dict[str, str]


@dataclass(frozen=True)
class Log:
    """Cells of a log as they stand in its file: header, rows (n, columns)."""

    header: list[str]
    rows: np.ndarray

    def without(self, columns: list[str]) -> Log:
        """The log with fewer columns."""
        kept = [i for i, name in enumerate(self.header) if name not in columns]
        return Log([self.header[i] for i in kept], self.rows[:, kept])

    def numbers(self, column: str) -> np.ndarray:
        """A column without empty cells (n,)."""
        return self.rows[:, self.header.index(column)].astype(float)

    def put(self, column: str, values: np.ndarray) -> Log:
        """The log with a column of other numbers."""
        rows = self.rows.copy()
        rows[:, self.header.index(column)] = [f"{v:.6f}" for v in values]
        return Log(self.header, rows)


@dataclass(frozen=True)
class Files:
    """An experiment's files: experiment.yaml and the machine file as they are parsed, programs and logs by run."""

    experiment: dict[str, Any]
    machine: dict[str, Any]
    programs: list[str]
    logs: list[Log]

    def each_log(self, change: Callable[[Log], Log]) -> Files:
        """The same with every log changed."""
        return replace(self, logs=[change(log) for log in self.logs])

    def chosen(self, order: list[int]) -> Files:
        """These runs in this order."""
        runs = [self.experiment["runs"][k] for k in order]
        return Files(
            {**self.experiment, "runs": runs},
            self.machine,
            [self.programs[k] for k in order],
            [self.logs[k] for k in order],
        )


def read(folder: Path) -> Files:
    """The files of an experiment of one config file."""
    experiment = yaml.safe_load((folder / "experiment.yaml").read_text())
    (config,) = experiment["config"]
    runs = experiment["runs"]
    return Files(
        experiment,
        yaml.safe_load((folder / config).read_text()),
        [(folder / run["program"]).read_text() for run in runs],
        [_log((folder / run["log"]).read_text()) for run in runs],
    )


def _log(text: str) -> Log:
    lines = [line.split(",") for line in text.splitlines()]
    return Log(lines[0], np.array(lines[1:], dtype="U24"))


def write(files: Files, folder: Path) -> Path:
    """Writes everything; the path of experiment.yaml."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "machine.yaml").write_text(yaml.safe_dump(files.machine, sort_keys=False))
    runs = []
    for k, (run, program, log) in enumerate(zip(files.experiment["runs"], files.programs, files.logs, strict=True)):
        (folder / f"p{k}.nc").write_text(program)
        (folder / f"l{k}.csv").write_text("\n".join(",".join(row) for row in [log.header, *log.rows.tolist()]) + "\n")
        runs.append({**run, "program": f"p{k}.nc", "log": f"l{k}.csv"})
    path = folder / "experiment.yaml"
    path.write_text(yaml.safe_dump({**files.experiment, "config": ["machine.yaml"], "runs": runs}, sort_keys=False))
    return path


def fewer_rows(files: Files, rng: np.random.Generator) -> tuple[Files, Names]:
    """A third of the rows is lost."""
    return files.each_log(lambda log: Log(log.header, log.rows[rng.uniform(size=len(log.rows)) > 0.35])), {}


def fewer_columns(files: Files, rng: np.random.Generator) -> tuple[Files, Names]:
    """One kind of column is missing."""
    groups = [["line"], ["temp_C"], ["fx_N", "fy_N", "fz_N"]]
    header = files.logs[0].header
    groups += [[n for n in header if re.fullmatch(p, n)] for p in ("cmd_.*", "act_.*_(mm|rad)", "act_.*_(N|Nmm)")]
    there = [group for group in groups if group and group[0] in header]
    gone = there[int(rng.integers(len(there)))] if there else []
    return files.each_log(lambda log: log.without(gone)), {}


def fewer_runs(files: Files, rng: np.random.Generator) -> tuple[Files, Names]:
    """One run is missing."""
    gone = int(rng.integers(len(files.logs)))
    return files.chosen([k for k in range(len(files.logs)) if k != gone]), {}


def half_the_rate(files: Files, rng: np.random.Generator) -> tuple[Files, Names]:
    """Every second row."""
    return files.each_log(lambda log: Log(log.header, log.rows[::2])), {}


def order_of_runs(files: Files, rng: np.random.Generator) -> tuple[Files, Names]:
    """The list the other way round."""
    return files.chosen(list(range(len(files.logs)))[::-1]), {}


def order_of_rows(files: Files, rng: np.random.Generator) -> tuple[Files, Names]:
    """Rows shuffled; their times say when they were."""
    return files.each_log(lambda log: Log(log.header, log.rows[rng.permutation(len(log.rows))])), {}


def other_names(files: Files, rng: np.random.Generator) -> tuple[Files, Names]:
    """Runs named the other way round by the alphabet."""
    runs = [{**run, "name": f"{chr(122 - k)} other"} for k, run in enumerate(files.experiment["runs"])]
    return replace(files, experiment={**files.experiment, "runs": runs}), {}


def shifted_clock(files: Files, rng: np.random.Generator) -> tuple[Files, Names]:
    """Loggers count from another moment, which started_s says."""
    runs = [{**run, "started_s": run.get("started_s", 0.0) - CLOCK_S} for run in files.experiment["runs"]]
    moved = replace(files, experiment={**files.experiment, "runs": runs})
    return moved.each_log(lambda log: log.put("t_s", log.numbers("t_s") + CLOCK_S)), {}


def duplicated_rows(files: Files, rng: np.random.Generator) -> tuple[Files, Names]:
    """Every row is logged twice."""
    return files.each_log(lambda log: Log(log.header, np.repeat(log.rows, 2, axis=0))), {}


def _relabelled(files: Files, new: Names) -> tuple[Files, Names]:
    """Actuators by other names; new: old name to new one.  Of a machine whose chains are named by their actuators."""

    def renamed(column: str) -> str:
        found = re.fullmatch(r"(cmd|act)_(\w+)_(mm|N)", column)
        return f"{found[1]}_{new[found[2]]}_{found[3]}" if found else column

    chains = {new[name]: chain for name, chain in files.machine["robot"]["chains"].items()}
    machine = {**files.machine, "robot": {**files.machine["robot"], "chains": chains}}
    moved = files.each_log(lambda log: Log([renamed(column) for column in log.header], log.rows))
    return replace(moved, machine=machine), {b: a for a, b in new.items()}


def cyclic_labels(files: Files, rng: np.random.Generator) -> tuple[Files, Names]:
    """The first actuator gets the name of the second, and so on round."""
    names = list(files.machine["robot"]["chains"])
    return _relabelled(files, dict(zip(names, names[1:] + names[:1], strict=True)))


def mirrored_labels(files: Files, rng: np.random.Generator) -> tuple[Files, Names]:
    """The first two actuators swap their names."""
    names = list(files.machine["robot"]["chains"])
    return _relabelled(files, dict(zip(names, [*names[1::-1], *names[2:]], strict=True)))


def turned_frame(files: Files, rng: np.random.Generator) -> tuple[Files, Names]:
    """The program frame is turned by a quarter, machine and motion stay: x is the old y, y the old -x."""
    words = {"X": ("Y", -1), "Y": ("X", 1), "I": ("J", -1), "J": ("I", 1)}

    def word(found: re.Match[str]) -> str:
        letter, sign = words[found[1]]
        return f"{letter}{sign * float(found[2]):g}"

    def log(each: Log) -> Log:
        i, j = each.header.index("x_mm"), each.header.index("y_mm")
        rows = each.rows.copy()
        rows[:, i] = each.rows[:, j]
        rows[:, j] = [f"{-float(v):.4f}" if v else "" for v in each.rows[:, i]]
        return Log(each.header, rows)

    workpiece = files.machine["workpiece"]
    turned = {**workpiece, "rotation_deg": workpiece.get("rotation_deg", 0) + 90.0}
    programs = [re.sub(r"([XYIJ])(-?[\d.]+)", word, text) for text in files.programs]
    return replace(
        files,
        machine={**files.machine, "workpiece": turned},
        programs=programs,
        logs=[log(each) for each in files.logs],
    ), {}


Law = Callable[[Files, np.random.Generator], tuple[Files, Names]]
LESS: dict[str, Law] = {
    "fewer rows": fewer_rows,
    "fewer columns": fewer_columns,
    "fewer runs": fewer_runs,
    "half the rate": half_the_rate,
}
SAME: dict[str, Law] = {
    "order of runs": order_of_runs,
    "order of rows": order_of_rows,
    "other names": other_names,
    "shifted clock": shifted_clock,
    "duplicated rows": duplicated_rows,
    "cyclic labels": cyclic_labels,
    "mirrored labels": mirrored_labels,
    "turned frame": turned_frame,
}


def named(result: dict[str, Any], names: Names | None = None) -> list[tuple[str, str | None]]:
    """Known causes of a result, targets by their old names."""
    causes = [c for c in result["causes"] if c["effect"] != "unknown"]
    return [(c["effect"], (names or {}).get(c["target"], c["target"])) for c in causes]


def another_cause(before: dict[str, Any], after: dict[str, Any]) -> bool:
    """Whether less data made an open verdict, or another one, into a single cause that was not among those named."""
    found = named(after)
    if after["verdict"] != "identified" or len(found) != 1:
        return False
    spoken_of = {(m["effect"], m["target"]) for one in before["alternatives"] for m in one} | set(named(before))
    return found[0] not in spoken_of


def surer(before: dict[str, Any], after: dict[str, Any]) -> bool:
    """Whether less data closed an open verdict."""
    return before["verdict"] in ("unknown", "ambiguous") and after["verdict"] in ("identified", "none")


def differences(before: dict[str, Any], after: dict[str, Any], names: Names, turned: bool = False) -> list[str]:
    """Values that changed where they have to stay; turned: values in the program frame are not compared."""
    out = []
    if before["verdict"] != after["verdict"]:
        out.append(f"verdict {before['verdict']} -> {after['verdict']}")
    a, b = named(before), named(after, names)
    if set(a) != set(b):
        out.append(f"causes {sorted(map(str, a))} -> {sorted(map(str, b))}")
    if abs(after["gap"]["rms_um"] / before["gap"]["rms_um"] - 1) > 0.02:
        out.append(f"gap {before['gap']['rms_um']} -> {after['gap']['rms_um']}")
    old = {key: c for key, c in zip(a, (c for c in before["causes"] if c["effect"] != "unknown"), strict=True)}
    for key, cause in zip(b, (c for c in after["causes"] if c["effect"] != "unknown"), strict=True):
        if key in old and not (turned and key[0] == "workpiece_frame"):
            out += _values(key, old[key]["parameters"], cause["parameters"])
    return out


def _values(key: tuple[str, str | None], before: dict[str, Any], after: dict[str, Any]) -> list[str]:
    out = []
    for name in before.keys() & after.keys():
        was, now = before[name], after[name]
        if was.get("ci95") and now.get("ci95"):
            wide, width = was["ci95"][1] - was["ci95"][0], now["ci95"][1] - now["ci95"][0]
            if abs(now["value"] - was["value"]) > AGREE * wide:
                out.append(f"{key} {name} {was['value']} -> {now['value']} +- {wide / 2:.3g}")
            if not 1 - AGREE < max(width, 1e-12) / max(wide, 1e-12) < 1 / (1 - AGREE):
                out.append(f"{key} {name} interval {wide:.3g} -> {width:.3g}")
    return out


def applies(name: str, files: Files) -> bool:
    """Whether a law of this name says anything about such a machine: one without chains has no names to change round."""
    return "labels" not in name or "chains" in files.machine["robot"]
