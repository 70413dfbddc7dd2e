"""camcomp and textbook opponents on measured data: fitted to some runs, judged on runs that the fit has not seen.

A row is one quantity of one split: its rms in the nominal model, what camcomp leaves of it, what the machine file leaves that
camcomp writes, and what every opponent leaves.  `ratio` is camcomp over the first opponent, the one that is named in advance;
`best` names the one that is best on the judged run, which nobody knows in advance.
"""

from __future__ import annotations

import csv
import json
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from tests.validation import runner
from tests.validation.measured import opponents_of_arms as arms
from tests.validation.measured import opponents_of_axes as axes
from tests.validation.measured import tables

ALLOWED = 1.03  # camcomp over the first opponent
KEPT = 0.02  # share by which the written machine file may differ from what was claimed
Row = dict[str, Any]
Opponents = dict[str, Callable[[], np.ndarray]]


@dataclass(frozen=True)
class Quantity:
    """A quantity that is compared: columns of the residuals, the nominal residual, and the opponents'; (n,) or (n, 3) in mm, rad or N."""

    name: str
    channels: tuple[str, ...]
    unit: str
    scale: float  # from the log's unit to `unit`
    nominal: Callable[[], np.ndarray]
    opponents: Opponents


@dataclass(frozen=True, kw_only=True)
class Split:
    """An experiment with one withheld run."""

    set: str
    name: str
    judged: str
    write: Callable[[Path], dict[str, Any]]  # logs into a folder; the experiment file's content
    quantities: list[Quantity] = field(default_factory=list)


def rms(residual: np.ndarray) -> float:
    """Root of the mean square; of rows of vectors that of their lengths."""
    squares = residual**2 if residual.ndim == 1 else (residual**2).sum(1)
    return float(np.sqrt(np.nanmean(squares)))


def splits(only: tuple[str, ...] = ()) -> Iterator[Split]:
    """All splits of the data sets that are here."""
    for name, make in SETS.items():
        if not only or name in only:
            yield from make()


def judge(split: Split) -> list[Row]:
    """Ask camcomp and the opponents; one row per quantity."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        content = split.write(folder)
        result, claimed = _asked(folder, content, "answer")
        left = _left_by(folder, folder / "answer.written.yaml", content, split.judged)
    rows = []
    for q in split.quantities:
        row: Row = {"set": split.set, "split": split.name, "quantity": q.name, "unit": q.unit}
        row |= {"answer": result.get("verdict", "failed"), "causes": _causes(result), "failed": result.get("failed")}
        row["nominal"] = q.scale * rms(q.nominal())
        row["file"] = _rms_of(left, "gap", q, split.judged)
        row["camcomp"] = _rms_of(claimed, "rest", q, split.judged)  # the file alone has its constants fitted again
        row["claimed"] = _claim(result, q)
        row["opponents"] = {name: q.scale * rms(residual()) for name, residual in q.opponents.items()}
        rows.append(row | compared(row))
    return rows


def compared(row: Row) -> Row:
    """The ratio of camcomp to the first opponent, the best opponent, and whether the written file keeps the claim."""
    others = row["opponents"]
    first, best = next(iter(others)), min(others, key=others.__getitem__)
    out: Row = {"best": best, "ratio": None, "ratio_to_best": None, "verdict": "no answer", "kept": None}
    if row["camcomp"] is not None:
        out["ratio"], out["ratio_to_best"] = (row["camcomp"] / others[name] for name in (first, best))
        out["verdict"] = "worse" if out["ratio"] > ALLOWED else "better" if out["ratio"] < 1 / ALLOWED else "equal"
        if row["file"] is not None:
            out["kept"] = all(
                abs(row["file"] - each) <= KEPT * each for each in (row["camcomp"], row["claimed"]) if each
            )
    return out


def render(rows: list[Row]) -> str:
    """The table as text, one line per quantity."""
    lines = []
    for row in rows:
        others = ", ".join(f"{name} {value:.4g}" for name, value in row["opponents"].items())
        figures = [
            f"{row[key]:.4g}" if row[key] is not None else "-" for key in ("nominal", "camcomp", "claimed", "file")
        ]
        ratio = f"{row['ratio']:.2f}" if row["ratio"] else "-"
        lines.append(
            f"{row['set']:<10} {row['split']:<26} {row['quantity']:<8} {row['unit']:<4} nominal {figures[0]:>7} "
            f"camcomp {figures[1]:>7} claimed {figures[2]:>7} file {figures[3]:>7} | {others} | {ratio} {row['verdict']} | {row['answer']} "
            f"{', '.join(row['causes'])}{row['failed'] or ''}"
        )
    return "\n".join(lines)


def _left_by(folder: Path, written: Path, content: dict[str, Any], judged: str) -> tables.Table:
    """Residuals of the written machine file on the same runs; on the judged one alone where those do not list it."""
    if not written.exists():
        return {}
    content = {**content, "config": [str(written)]}
    _, left = _asked(folder, content, "written")
    if left and not (left["run"] == judged).any():
        runs = [run for run in content["runs"] if run["name"] == judged]
        _, left = _asked(folder, {"config": content["config"], "runs": runs}, "alone")
    return left


def _claim(result: dict[str, Any], q: Quantity) -> float | None:
    """Residual on the held-out run that the answer predicts, in the quantity's unit."""
    shrunk = result.get("shrinkage") or {}
    if q.channels == ("x_mm", "y_mm", "z_mm"):
        return 1e-3 * q.scale * shrunk["after_rms_um"] if shrunk else None
    own = (shrunk.get("actuators") or {}).get(q.name)
    return own["after_rms"] * q.scale * (1e-6 if own["unit"] == "urad" else 1e-3) if own else None


def _causes(result: dict[str, Any]) -> list[str]:
    return [f"{c['effect']}:{c['target']}" if c["target"] else c["effect"] for c in result.get("causes", [])]


def _asked(folder: Path, content: dict[str, Any], name: str) -> tuple[dict[str, Any], tables.Table]:
    """The result and the residuals; {"failed": text} where there is none."""
    path, answer, residuals = (folder / f"{name}.{end}" for end in ("yaml", "json", "csv"))
    path.write_text(yaml.safe_dump(content))
    words = [
        "--json",
        str(answer),
        "--residuals",
        str(residuals),
        "--write-config",
        str(folder / f"{name}.written.yaml"),
    ]
    code, said = runner.invoke(["diagnose", str(path), *words])
    if not answer.exists() or not residuals.exists():
        return {"failed": f"exit {code}: {said.strip()[-300:]}"}, {}
    with residuals.open() as file:
        rows = list(csv.DictReader(file))
    table = {key: np.array([row[key] if key == "run" else float(row[key] or "nan") for row in rows]) for key in rows[0]}
    return json.loads(answer.read_text()), table


def _rms_of(table: tables.Table, what: str, q: Quantity, run: str) -> float | None:
    columns = [table.get(f"{what}_{channel}") for channel in q.channels]
    if any(each is None for each in columns) or not (table["run"] == run).any():
        return None
    values = np.stack(columns, 1)[table["run"] == run]
    return q.scale * rms(values[:, 0] if len(q.channels) == 1 else values)


# --- the data sets ---------------------------------------------------------------------------------------------------


def _pose_table(path: Path, arm: arms.Arm) -> arms.Poses:
    table = tables.read(path)
    return arms.Poses(
        np.stack([table[f"act_{name}_rad"] for name in arm.names], 1),
        np.stack([table[f"{axis}_mm"] for axis in "xyz"], 1),
    )


def _of_poses(arm: arms.Arm, fit: arms.Poses, judged: arms.Poses, unit: tuple[str, float], *, refit: bool) -> Quantity:
    def opponent(**with_: bool) -> Callable[[], np.ndarray]:
        return lambda: arms.residual(arms.Calibration(arm, **with_), fit, judged, refit_frame=refit)

    opponents: Opponents = {"geometry": opponent()}
    if arm.mass.any():
        opponents["geometry, compliance"] = opponent(compliance=True)
        opponents["geometry, compliance, harmonics"] = opponent(compliance=True, harmonics=True)
    nominal = arms.Calibration(arm)
    return Quantity(
        "tip", ("x_mm", "y_mm", "z_mm"), *unit,
        lambda: arms.residual(nominal, fit, judged, refit_frame=refit, nominal=True), opponents,
    )  # fmt: skip


def _ur5() -> Iterator[Split]:
    folder = tables.HERE / "ur5"
    arm = arms.Arm(folder / "ur5.yaml")
    grid, random = (_pose_table(folder / f"{name}.csv", arm) for name in ("grid", "random"))
    for name, labels in (("frames kept", "AA"), ("frames fitted again", "AB")):
        runs = [
            {"name": each, "log": str(folder / f"{each}.csv"), "cutting": False, "clamping": label}
            for each, label in zip(("grid", "random"), labels, strict=True)
        ]
        content = {"config": [str(folder / "ur5.yaml")], "runs": runs, "holdout": ["random"]}
        quantity = _of_poses(arm, grid, random, ("um", 1e3), refit=labels == "AB")
        yield Split(
            set="ur5",
            name=f"grid to random, {name}",
            judged="random",
            write=lambda _, c=content: c,
            quantities=[quantity],
        )


def _ur10() -> Iterator[Split]:
    folder = tables.ROOT / "samples" / "ur10"
    arm = arms.Arm(tables.ROOT / "config" / "ur10.yaml")
    poses = {name: _pose_table(folder / f"series_{name}.csv", arm) for name in "AB"}
    for fit, judged in ("AB", "BA"):
        runs = [
            {"name": name, "log": str(folder / f"series_{name}.csv"), "cutting": False, "clamping": name}
            for name in "AB"
        ]
        content = {"config": [str(tables.ROOT / "config" / "ur10.yaml")], "runs": runs, "holdout": [judged]}
        quantity = _of_poses(arm, poses[fit], poses[judged], ("um", 1e3), refit=True)
        yield Split(
            set="ur10", name=f"{fit} to {judged}", judged=judged, write=lambda _, c=content: c, quantities=[quantity]
        )


def _of_axis(name: str, fit: tables.Table, judged: tables.Table, hinge: bool) -> Quantity:
    length = "rad" if hinge else "mm"
    cmd, act = f"cmd_{name}_{length}", f"act_{name}_{length}"
    one, two = ((run["t_s"], run[cmd], run[act]) for run in (fit, judged))
    opponents: Opponents = {
        "least squares": lambda: axes.least_squares(one, two, hinge=hinge),
        "ridge": lambda: axes.least_squares(one, two, hinge=hinge, ridge=axes.RIDGE),
        "without weight": lambda: axes.least_squares(one, two, hinge=False),
        "first-order lag": lambda: axes.first_order_lag(one, two),
    }
    unit = ("mrad", 1e3) if hinge else ("um", 1e3)
    return Quantity(name, (act,), *unit, lambda: two[2] - two[1], opponents)


def _two_runs(
    name: str, runs: dict[str, tables.Table], judged: str, machine: Path, quantities: list[Quantity]
) -> Split:
    def write(folder: Path) -> dict[str, Any]:
        for run, table in runs.items():
            tables.write(folder / f"{run}.csv", table)
        entries = [{"name": run, "log": str(folder / f"{run}.csv"), "cutting": False} for run in runs]
        return {"config": [str(machine)], "runs": entries, "holdout": [judged]}

    (fit,) = set(runs) - {judged}
    return Split(set=name, name=f"{fit} to {judged}", judged=judged, write=write, quantities=quantities)


def _kr300() -> Iterator[Split]:
    runs = {name: tables.kr300(name) for name in "AB"}
    for fit, judged in ("AB", "BA"):
        quantities = [_of_axis(f"A{k}", runs[fit], runs[judged], hinge=True) for k in range(1, 7)]
        yield _two_runs("kr300", runs, judged, tables.HERE / "kr300" / "kr300.yaml", quantities)


def _servo() -> Iterator[Split]:
    folder = tables.HERE / "uart_servo"
    runs = {name: tables.read(folder / f"{name}.csv") for name in ("first", "second")}
    for fit, judged in (("first", "second"), ("second", "first")):
        quantity = _of_axis("M", runs[fit], runs[judged], hinge=True)
        one, two = ((run["t_s"], run["cmd_M_rad"], run["act_M_rad"]) for run in (runs[fit], runs[judged]))
        limit = {"speed limit": lambda one=one, two=two: axes.speed_limit(one, two)}
        quantity = replace(quantity, opponents={**limit, **quantity.opponents})
        yield _two_runs("uart_servo", runs, judged, folder / "servo.yaml", [quantity])


def _emps() -> Iterator[Split]:
    if not (tables.ELSEWHERE / "emps").is_dir():
        return
    runs = dict(zip(("begin", "end"), tables.emps(), strict=True))
    for fit, judged in (("begin", "end"), ("end", "begin")):
        position = _of_axis("x", runs[fit], runs[judged], hinge=False)
        one, two = ((run["t_s"], run["act_x_mm"], run["act_x_N"]) for run in (runs[fit], runs[judged]))
        force = Quantity(
            "x force", ("act_x_N",), "N", 1.0, lambda two=two: two[2],
            {"force balance": lambda one=one, two=two: axes.force_balance(one, two)},
        )  # fmt: skip
        machine = tables.ROOT / "config" / "cartesian.yaml"
        yield _two_runs("emps", runs, judged, machine, [position, force])


SETS = {"ur5": _ur5, "ur10": _ur10, "kr300": _kr300, "uart_servo": _servo, "emps": _emps}
