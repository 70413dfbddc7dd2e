"""One answer of `camcomp diagnose` against the truth, and the interval of a rate."""

from __future__ import annotations

import contextlib
import io
import json
import os
import tempfile
import time
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from tests.validation.recorded import added_faults, metamorphic

NAMED = 0.3  # of the noise: a cause of at least this size may be named
DUE = 2.7  # from which on it has to be: what was made as 3
SURE = 0.8
KNOWN_AS = {
    "disturbed_drive": "disturbance",
    **added_faults.KNOWN_AS,
}  # strange faults that the tool has learnt to name
# what control does wrong shows nowhere where no set-points are logged: encoders are the motion then
WITHOUT_SETPOINTS, OF_CONTROL = ("no-setpoints", "no cmd", "no_cmd"), ("servo_lag", "servo_overshoot")
Row = dict[str, Any]
Pair = tuple[str, str | None]


def ask(experiment: Path) -> Row:
    """The result JSON, run in this process; `failed` when there is none."""
    from camcomp.terminal.cli import run as camcomp

    said = io.StringIO()
    with tempfile.TemporaryDirectory() as folder:
        answer = Path(folder) / "result.json"
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            code = camcomp(["diagnose", str(experiment), "--json", str(answer)])
        if not answer.exists():
            return {"failed": f"exit {code}: {said.getvalue().strip()[-300:]}"}
        return json.loads(answer.read_text())


def library() -> set[str]:
    """Names of all effects that the tool has."""
    from camcomp.terminal.cli import run as camcomp

    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        camcomp(["effects", "--json"])
    return {each["effect"] for each in json.loads(said.getvalue())}


def held(cause: Row, truth: dict[str, float]) -> list[bool]:
    """Whether each interval of a named cause holds the true value."""
    return [miss <= 1.0 for miss in misses(cause, truth)]


def misses(cause: Row, truth: dict[str, float]) -> list[float]:
    """Distance of every true value from the one found, in the half width of the interval on its side."""
    out = []
    for name, value in truth.items():
        got = cause.get("parameters", {}).get(name)
        if got and got.get("ci95"):
            low, high = got["ci95"]
            turn = 2 * np.pi
            value = value + turn * round((got["value"] - value) / turn) if name.startswith("phase") else value
            if name == "offset_s":  # which of two clocks is ahead of the other, the contract leaves open
                value = float(np.copysign(value, got["value"]))
            half = high - got["value"] if value > got["value"] else got["value"] - low
            out.append(abs(value - got["value"]) / max(half, 1e-300) if not low <= value <= high or half > 0.0 else 0.0)
    return out


def _by_its_name(cause: Row, known: set[str]) -> Row:
    """A true cause as the library calls it; strange: whether the library has none such, though it may have the name for another thing."""
    name = KNOWN_AS.get(cause["effect"], cause["effect"])
    own = cause.get("strange", False) and cause["effect"] not in KNOWN_AS
    return {**cause, "effect": name, "strange": own or name not in known}


def judge(result: Row, truth: Row, known: set[str]) -> Row:
    """Correct claims by key; keys that do not apply are missing."""
    hidden = OF_CONTROL if truth["channels"] in WITHOUT_SETPOINTS else ()
    real = [_by_its_name(c, known) for c in truth["causes"] if c["ratio"] >= NAMED]
    real = [c for c in real if c["effect"] not in hidden]
    true = {(c["effect"], c["target"]) for c in real if not c["strange"]}
    due = {(c["effect"], c["target"]) for c in real if not c["strange"] and c["ratio"] >= DUE}
    foreign = [c for c in real if c["strange"]]
    out: Row = {"ratio": min((c["ratio"] for c in real), default=0.0), "true": sorted(map(str, true))}
    out |= {
        "foreign": [c["effect"] for c in foreign],
        "left": min((c.get("left_ratio", 0.0) for c in foreign), default=0.0),
    }
    if "failed" in result:
        return out | {"failed": result["failed"]}
    causes = [c for c in result["causes"] if c["effect"] != "unknown"]
    found = [(c["effect"], c["target"]) for c in causes]
    sets = [_pairs(one) for one in result["alternatives"]]
    out |= {
        "verdict": result["verdict"],
        "found": [[*pair, c.get("probability")] for pair, c in zip(found, causes, strict=True)],
    }
    gap, floor = result["gap"], result.get("floor") or {}
    out |= {
        "gap_um": gap["rms_um"],
        "floor_um": floor.get("um", gap.get("noise_floor_um")),
        "source": floor.get("source"),
    }
    out["unknown"], out["none"] = result["verdict"] == "unknown", result["verdict"] == "none"
    if true:
        out["first"] = bool(found) and found[0] in true
        out["first_or_class"] = out["first"] or any(true <= one for one in sets)
        out["all"] = due <= set(found) or any(due <= one for one in sets)
    out["due"] = sorted(map(str, due))
    sure = [(pair, c.get("probability") or 0.0) for pair, c in zip(found, causes, strict=True)]
    fair = true | may_be_named(truth)
    out["false_cause"] = any(pair not in fair and p > 0.5 for pair, p in sure)
    out["sure_and_wrong"] = any(pair not in fair and p > SURE for pair, p in sure)
    out["calibration"] = [[p, pair in fair] for pair, p in sure]
    if "allowed_verdicts" in truth:
        whole = [_pairs(one) for one in truth["allowed_sets"]]
        found_one = not whole or out["unknown"] or any(one <= named for one in whole for named in (set(found), *sets))
        out["honest"] = result["verdict"] in truth["allowed_verdicts"] and found_one and not out["sure_and_wrong"]
    out["held"] = [
        hit
        for cause, pair in zip(causes, found, strict=True)
        for c in real
        if pair == (c["effect"], c["target"])
        for hit in held(cause, c["parameters"])
    ]
    out["misses"] = [
        miss
        for cause, pair in zip(causes, found, strict=True)
        for c in real
        if pair == (c["effect"], c["target"])
        for miss in misses(cause, c["parameters"])
    ]
    return out


def may_be_named(truth: Row) -> set[Pair]:
    """Causes that the truth lists as equal to the true ones within the noise."""
    out = {(effect, target) for effect, target in truth.get("may_be_named", [])}
    for one in (truth.get("allowed_beside", []), *truth.get("allowed_sets", [])):
        out |= _pairs(one)
    return out


def _pairs(members: list[Row]) -> set[Pair]:
    return {(m["effect"], m["target"]) for m in members}


def trial(task: tuple[str, str, set[str]]) -> Row:
    """Asks and judges one experiment."""
    folder, answer, known = Path(task[0]), Path(task[1]), task[2]
    truth = json.loads(answer.read_text())
    row: Row = {"name": folder.name, **{k: truth[k] for k in ("kind", "machine", "channels", "noise_um", "small_um")}}
    begin = time.perf_counter()
    try:
        result = ask(folder / "experiment.yaml")
    except Exception as error:  # noqa: BLE001 - a crash is counted, not hidden
        result = {"failed": f"{type(error).__name__}: {error}"[:300]}
    return row | {"seconds": time.perf_counter() - begin} | judge(result, truth, known)


def run(folder: Path, results: Path, jobs: int, only: tuple[str, ...] = ()) -> list[Row]:
    """Judges every experiment below `folder` that `results` (JSON lines) does not hold yet; all rows."""
    done = map(json.loads, results.read_text().splitlines()) if results.exists() else ()
    rows = {row["name"]: row for row in done if "failed" not in row}
    known = library()
    answers = sorted((folder / "truth").glob("*.json"))
    todo = [
        (str(folder / a.stem), str(a), known) for a in answers if a.stem not in rows and (not only or a.stem in only)
    ]
    for name in ("NUMBA_NUM_THREADS", "OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    with results.open("a") as out, get_context("spawn").Pool(jobs, maxtasksperchild=50) as pool:
        for row in pool.imap_unordered(trial, todo):
            rows[row["name"]] = row
            out.write(json.dumps(row) + "\n")
            out.flush()
    return [rows[name] for name in sorted(rows)]


def laws(folder: Path, work: Path, names: list[str], seed: int) -> list[Row]:
    """Every law of those names tried on the experiment in a folder, the changed ones below `work`."""
    files, out = metamorphic.read(folder), []
    before = ask(metamorphic.write(files, work / "as it is"))
    for name in (each for each in names if metamorphic.applies(each, files)):
        less = name in metamorphic.LESS
        changed, labels = (metamorphic.LESS if less else metamorphic.SAME)[name](
            files, np.random.default_rng([seed, 7])
        )
        after = ask(metamorphic.write(changed, work / name))
        row: Row = {"name": folder.name, "law": name, "less": less, "before": before.get("verdict")}
        failed = "failed" in before or "failed" in after
        if failed:
            row |= {"failed": True, "said": after.get("failed", before.get("failed"))}
        elif less:
            row |= {"another": metamorphic.another_cause(before, after), "surer": metamorphic.surer(before, after)}
            row |= {
                "said": f"{before['verdict']} {metamorphic.named(before)} -> {after['verdict']} {metamorphic.named(after)}"
            }
        else:
            row |= {"said": metamorphic.differences(before, after, labels, turned=name == "turned frame")}
        out.append(row)
    return out


def wilson(hits: int, total: int, z: float = 1.96) -> tuple[float, float]:
    """Interval (95 %) of a rate."""
    if total == 0:
        return 0.0, 1.0
    p, n = hits / total, total
    middle, half = p + z * z / (2 * n), z * np.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    return max(0.0, float((middle - half) / (1 + z * z / n))), min(1.0, float((middle + half) / (1 + z * z / n)))


def all_due(row: Row) -> bool:
    """Whether all due causes are named; none are due where all are small."""
    return bool(row["all"]) if row["due"] else not row["unknown"]


def right(row: Row) -> bool:
    """Whether an answer is the one that its kind asks for, without a false claim."""
    if "failed" in row or row["false_cause"] or row["unknown"] != bool(row["foreign"]):
        return False
    if row["foreign"]:
        return not row["true"] or bool(row["all"])
    if not row["true"]:
        return bool(row["none"])
    if row["kind"] in ("pair", "imperfect"):
        return all_due(row)
    return bool(row["first_or_class"])


def listing(rows: list[Row]) -> str:
    """One line per answer."""
    out = []
    for r in rows:
        said = (
            r.get("failed")
            or f"{r['verdict']:<10} gap {r['gap_um'] or 0:8.1f} floor {r['floor_um'] or 0:6.1f} {r['found'][:3]}"
        )
        out.append(f"{r['name']} {r['kind']:<9} {r['true']} {r['foreign']} x{r['ratio']:.1f} -> {said}")
    return "\n".join(out)
