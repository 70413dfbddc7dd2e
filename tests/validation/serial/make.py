"""Draws an experiment from a seed, runs it through the plant and its sensors, and writes it with its sealed answer."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import yaml

from tests.validation.recordings import recording
from tests.validation.serial.causes import Item, Local, common, disturbed, library, remains, rms, strange
from tests.validation.serial.plant import Off, Plant, Run, Warmth, make_run
from tests.validation.serial.structure import load_machine

MACHINES = ("router", "kuka-kr210", "cartesian")
KINDS = {"null": 0.2, "single": 0.3, "pair": 0.15, "imperfect": 0.15, "unknown": 0.2}
MESSES = ("tails", "spikes", "drift", "coarse", "clock", "lines", "lost", "middle", "idle")
CHANNELS = ("no forces", "no lines", "no cmd", "no encoders", "tip only")
COARSE_MM = 0.005
SMALL_ROWS = 250


class AgainError(Exception):
    """The drawn experiment is impossible; draw again."""


def draw_runs(machine, rng: np.random.Generator) -> list[Run]:
    """3 to 6 runs, or as many as there are, on different recordings, one pair of circles among most, a quarter of them in the air."""
    names = recording.names()
    circles = [n for n in names if n.startswith("circles")]
    count = int(rng.integers(3, 7))
    chosen = [str(rng.choice(circles))] if rng.random() < 0.8 else []
    others = [n for n in names if n not in circles]
    chosen += [str(n) for n in rng.choice(others, min(count - len(chosen), len(others)), replace=False)]
    chosen, count = [str(n) for n in rng.permutation(chosen)], len(chosen)
    air = rng.random(count) < 0.25
    if air.all():
        air[int(rng.integers(count))] = False
    started = np.cumsum(np.concatenate([[0.0], rng.uniform(60, 900, count - 1)])).round(1)
    return [make_run(machine, n, not a, float(s)) for n, a, s in zip(chosen, air, started, strict=True)]


def choose_rows(run: Run, rng: np.random.Generator, keep_idle: bool, rate: float | None) -> None:
    """Sets the times of the logged rows: on a grid, all of them or those of feed lines."""
    seconds = run.t[-1] if keep_idle else np.count_nonzero(run.fed) * 1e-3
    if rate is None:
        rate = float(rng.integers(200, 501)) / seconds
    step = 1 / rate
    times = np.arange(float(rng.uniform(0, step)), run.t[-1], step)
    if not keep_idle:
        times = times[run.fed[np.minimum(np.round(times * 1e3).astype(int), len(run.t) - 1)]]
    run.rows = times


def thinned(plant: Plant) -> list[np.ndarray]:
    """Keeps the full rows and leaves some of them for the sizing of causes."""
    full = [run.rows for run in plant.runs]
    for run in plant.runs:
        run.rows = run.rows[:: max(1, len(run.rows) // SMALL_ROWS)]
    return full


def sized(local: Local, item: Item, want_um: float, sign: float) -> tuple[float, np.ndarray]:
    """Amount at which an effect alone moves the tip by want_um, and that move."""
    amount = item.unit * sign
    for _ in range(6):
        change = local.of(item, amount)
        got = rms(change)
        if got < 1e-4:
            raise AgainError
        if abs(got / want_um - 1) < 0.02:
            break
        amount = amount * want_um / got
        low = -item.high if item.signed and item.low == 0 else item.low
        if not low <= amount <= item.high:
            raise AgainError
    return amount, change


def small_errors(local: Local, items: list[Item], noise_um: float, rng) -> tuple[list[tuple[Item, float]], Off, float]:
    """Amounts of small errors, each 0.03 to 0.25 of the noise and all together below a half of it."""
    kept = []
    for item in items:
        change = local.quick(item)
        size = rms(change)
        if size < 1e-3:
            continue  # moves nothing in these runs
        want = noise_um * np.exp(rng.uniform(np.log(0.032), np.log(0.24)))
        sign = float(rng.choice([-1, 1])) if item.signed else 1.0
        kept.append([item, sign * want / size * item.unit, want])
    for _ in range(12):
        off = local.off
        for item, amount, _want in kept:
            off = item.put(local.plant, off, amount)
        total = rms(local.plant.tips(off) - local.base)
        if total < 0.47 * noise_um:
            break
        for entry in kept:
            shrunk = max(0.032 * noise_um, entry[2] * 0.8)
            entry[1] *= shrunk / entry[2]
            entry[2] = shrunk
    else:
        raise AgainError
    return [(item, amount) for item, amount, _ in kept], off, total


def draw_causes(kind, plant, local, noise_um, rng) -> tuple[list[dict], list[tuple[Item, float]], set, dict]:
    """Causes as the truth lists them, how to put them into a plant, the keys they take, and the unmodelled ones."""
    items = library(plant, rng)
    truth, put, taken, odd = [], [], set(), {}
    if kind in ("single", "pair"):
        pool = items + common(plant) + [disturbed(plant, rng)]
        effects = sorted({item.effect for item in pool})
        moves = []
        for _ in range(60):
            if len(put) == (1 if kind == "single" else 2):
                break
            effect = str(rng.choice(effects))
            item = [i for i in pool if i.effect == effect][int(rng.integers(sum(i.effect == effect for i in pool)))]
            if effect in {e for e, _ in taken}:
                continue
            ratio = float(rng.uniform(3, 12))
            sign = float(rng.choice([-1, 1])) if item.signed else 1.0
            try:
                amount, change = sized(local, item, ratio * noise_um, sign)
            except AgainError:
                continue
            unit = change.ravel() / np.linalg.norm(change)
            if any(abs(unit @ other) > 0.9 for other in moves):
                continue
            moves.append(unit)
            put.append((item, amount))
            taken |= {item.key} if item.target else {i.key for i in pool if i.effect == effect}
            um = rms(change)
            truth.append(entry(item, amount) | {"strange": False, "um": um, "ratio": um / noise_um})
        else:
            raise AgainError
    elif kind == "imperfect":
        for item in items:
            if item.effect == "drive_stiffness" or item.effect == "link_stiffness":
                amount = float(rng.uniform(0.02, 0.08) * rng.choice([-1, 1]))
            elif item.effect == "cutting_force":
                amount = float(rng.uniform(0.03, 0.10) * rng.choice([-1, 1]))
            else:
                continue
            um = rms(local.of(item, amount))
            put.append((item, amount))
            taken.add(item.key)
            if um > 0.3 * noise_um:
                truth.append(entry(item, amount) | {"strange": False, "um": um, "ratio": um / noise_um})
    elif kind == "unknown":
        for _ in range(25):
            odd = strange(plant, local, rng)
            want = float(rng.uniform(4, 10)) * noise_um
            change = odd_change(plant, local, odd)
            for _ in range(3):
                if rms(change) < 1e-2 or not np.isfinite(change).all():
                    break
                odd["size"] *= want / rms(change)
                change = odd_change(plant, local, odd)
            um = rms(change)
            most = {"process": 1.2, "control": 1.5 if odd["name"] == "ringing" else np.inf}.get(odd["stage"], np.inf)
            if abs(um / want - 1) > 0.05 or odd["size"] > most:
                continue
            span = local.span(items, rng, odd.get("pitch") or odd.get("period"))
            left = rms(remains(span, change)) / noise_um
            if left < 1:
                continue
            side = {k: v for k, v in odd.items() if k not in ("name", "stage", "axis")}
            name = plant.machine.names[odd["axis"]] if odd["stage"] in ("control", "drive", "spring") else None
            side |= {"stage": odd["stage"]}
            if odd["name"] == "yaw_play":
                side |= {"along": "xyz"[odd["axis"]], "other": "xyz"[odd["other"]]}
            truth.append(
                {
                    "effect": odd["name"],
                    "target": name,
                    "parameters": side,
                    "strange": True,
                    "um": um,
                    "ratio": um / noise_um,
                    "left_ratio": left,
                }
            )
            break
        else:
            raise AgainError
    return truth, put, taken, odd


def odd_change(plant: Plant, local: Local, odd: dict) -> np.ndarray:
    """Tip change (n, 3) by a strange fault alone."""
    off = local.off.copy()
    off.strange = dict(odd)
    return plant.tips(off) - local.base


def entry(item: Item, amount: float) -> dict:
    """An effect as the truth lists it."""
    parameters = {k: v for k, v in item.parameters(amount).items() if k != "run_index"}
    return {"effect": item.effect, "target": item.target, "parameters": parameters}


def slow_noise(times: np.ndarray, sigma: float, seconds: float, rng: np.random.Generator) -> np.ndarray:
    """First-order noise (n, 3) of a deviation sigma over times (n,)."""
    out = np.zeros((len(times), 3))
    out[0] = rng.normal(size=3)
    for k in range(1, len(times)):
        keep = np.exp(-(times[k] - times[k - 1]) / seconds)
        out[k] = keep * out[k - 1] + np.sqrt(1 - keep**2) * rng.normal(size=3)
    return sigma * out


def sensed(plant: Plant, off: Off, number: int, s: dict, rng: np.random.Generator) -> dict[str, np.ndarray]:
    """Columns of a run's log before any is removed."""
    run, machine = plant.runs[number], plant.machine
    u, uf = ("rad", "Nmm") if machine.rotary else ("mm", "N")
    times = run.rows
    seen = plant.rows(number, off, times, drive_too=True)
    n = len(times)
    white = rng.normal(size=(n, 3))
    if s["mess"] == "tails":
        white = rng.standard_t(3, size=(n, 3)) / np.sqrt(3)
    tip = seen.tip + s["white_mm"] * white + slow_noise(times, s["slow_mm"], s["slow_s"], rng)
    if s["mess"] == "drift":
        tip = tip + s["drift_mm"] * rng.uniform(-1, 1, 3) * np.linspace(-1, 1, n)[:, None] * np.sqrt(3)
    if s["mess"] == "coarse":
        tip = np.round(tip / COARSE_MM) * COARSE_MM
    if s["mess"] == "spikes":
        hit = rng.random(n) < 0.005
        tip[hit] += rng.uniform(-30, 30, (int(hit.sum()), 3)) * rng.random((int(hit.sum()), 3))
    line = run.line[np.minimum(np.round(times * 1e3).astype(int), len(run.t) - 1)].astype(float)
    if s["mess"] == "lines":
        late = s["late_rows"]
        line = np.roll(line, late)
        if late > 0:
            line[:late] = line[late]
        else:
            line[late:] = line[late - 1]
    shown = times * (1 + s["clock_ppm"] * 1e-6)
    columns = {"t_s": shown, "line": line}
    columns |= {f"{k}_mm": tip[:, j] for j, k in enumerate("xyz")}
    step = s["encoder"]
    for a, name in enumerate(machine.names):
        columns[f"cmd_{name}_{u}"] = seen.command[:, a]
    for a, name in enumerate(machine.names):
        columns[f"act_{name}_{u}"] = np.round(seen.motor[:, a] / step) * step
    for a, name in enumerate(machine.names):
        columns[f"act_{name}_{uf}"] = seen.drive[:, a] + rng.normal(0, s["drive"], n)
    for j, k in enumerate("xyz"):
        columns[f"f{k}_N"] = seen.force[:, j] + rng.normal(0, s["dynamometer_N"], n)
    columns["temp_C"] = plant.warmth.at(run.started_s + times) + rng.normal(0, 0.05, n)
    return columns


def kept_columns(columns: dict, channels: str, with_temperature: bool, forces: tuple[str, ...]) -> dict:
    """Columns of a log that are written at this choice of channels."""

    def out(name: str) -> bool:
        cmd, act = name.startswith("cmd_"), name.startswith("act_")
        force = name.endswith(forces) and (act or name[0] == "f")
        extra = cmd or act or force or name == "temp_C"
        return {
            "all": False,
            "no forces": force,
            "no lines": name == "line",
            "no cmd": cmd,
            "no encoders": act and not force,
            "tip only": extra,
        }[channels] or (name == "temp_C" and not with_temperature)

    return {name: values for name, values in columns.items() if not out(name)}


def write_log(path: Path, columns: dict, empty: np.ndarray | None) -> None:
    """A CSV with as many decimals as each column is worth."""
    texts = []
    for name, values in columns.items():
        digits = 0 if name == "line" else 4 if name == "t_s" else 9 if name.endswith("_rad") else 5
        digits = 2 if name.endswith("_Nmm") else 3 if name.endswith(("_N", "_C")) else digits
        texts.append([f"{value:.{digits}f}" for value in values])
    if empty is not None:
        for k, column in enumerate(texts):
            if k:
                texts[k] = ["" if gone else text for text, gone in zip(column, empty[:, k], strict=True)]
    rows = [",".join(columns)] + [",".join(row) for row in zip(*texts, strict=True)]
    path.write_text("\n".join(rows) + "\n")


def make(seed: int, out: Path, only: str | None) -> None:
    """Writes experiment e-<seed> and its truth; redraws impossible experiments in a fixed order."""
    for attempt in range(20):
        try:
            return attempt_one(seed, np.random.default_rng([seed, attempt, 7919]), out, only)
        except AgainError:
            continue
    raise RuntimeError(f"seed {seed} gives no experiment")


def attempt_one(seed: int, rng: np.random.Generator, out: Path, only: str | None) -> None:
    """One try."""
    first = np.random.default_rng([seed, 104729])  # the same kind and machine at every try: shares stay as they are
    kind = str(first.choice(list(KINDS), p=list(KINDS.values())))
    machine = load_machine(only or str(first.choice(MACHINES, p=[0.4, 0.4, 0.2])))
    channels = "all" if first.random() < 0.5 else str(first.choice(CHANNELS))
    mess = str(first.choice(MESSES)) if first.random() < 0.5 else None
    runs = draw_runs(machine, rng)
    keep_idle = mess in ("idle",) or rng.random() < 0.5
    rate = float(np.exp(rng.uniform(np.log(20), np.log(200)))) if rng.random() < 0.3 else None
    for run in runs:
        choose_rows(run, rng, keep_idle, rate)
    warmth = Warmth(float(rng.uniform(6, 15)), float(rng.uniform(600, 2400)))
    plant = Plant(machine, runs, warmth)

    white = float(rng.uniform(1.5, 6.0)) * 1e-3
    stated = mess == "drift" or rng.random() < 0.5
    slow = float(rng.uniform(0.2, 1.0)) * (white if stated else min(0.9e-3, white))
    encoder = float(rng.uniform(0.2, 1.0)) * (1e-6 if machine.rotary else 1e-3)
    s = {
        "mess": mess,
        "white_mm": white,
        "slow_mm": slow,
        "slow_s": float(rng.uniform(1, 5)),
        "drift_mm": white * float(rng.uniform(0.3, 0.8)) if mess == "drift" else 0.0,
        "encoder": encoder,
        "drive": float(rng.uniform(0.2, 2.0)) * (1e3 if machine.rotary else 1.0),
        "dynamometer_N": float(rng.uniform(1, 3)),
        "late_rows": int(rng.integers(1, 5) * rng.choice([-1, 1])) if mess == "lines" else 0,
        "clock_ppm": float(rng.choice([-200, 200])) if mess == "clock" else 0.0,
    }
    coarse = COARSE_MM / np.sqrt(12) if mess == "coarse" else 0.0
    # A uniform end of a straight drift has a third of its square on average, and so has the line itself.
    whole = float(np.sqrt(white**2 + slow**2 + coarse**2 + s["drift_mm"] ** 2 / 3))
    noise_um = 1e3 * np.sqrt(3) * whole

    full = thinned(plant)
    local = Local(plant)
    truth, put, taken, odd = draw_causes(kind, plant, local, noise_um, rng)
    items = [item for item in library(plant, rng) if item.key not in taken]
    small, off, small_um = small_errors(local, items, noise_um, rng)
    for item, amount in put:
        off = item.put(plant, off, amount)
    if kind == "unknown":
        off = off.copy()
        off.strange = odd
    if kind == "imperfect":
        off = off.copy()
        hertz = runs_teeth_hertz(machine)
        own = float(rng.uniform(15, 30)) if machine.rotary else float(rng.uniform(40, 90))
        off.ripple = (float(rng.uniform(0.05, 0.2)), hertz, 1 / abs((hertz / own) ** 2 - 1))
        s["ripple"] = {"share": off.ripple[0], "hertz": hertz, "share_that_bends": off.ripple[2]}
    # Causes may cancel: what they do together, over the rows that sized them.
    without = local.off
    for item, amount in small:
        without = item.put(plant, without, amount)
    together_um = rms(plant.tips(off) - plant.tips(without))
    for run, rows in zip(runs, full, strict=True):
        run.rows = rows

    with_temperature = channels == "all" or rng.random() < 0.5
    forces = ("_Nmm", "_N") if machine.rotary else ("_N",)
    logs = []
    for number, run in enumerate(runs):
        columns = sensed(plant, off, number, s, rng)
        n, empty = len(run.rows), None
        keep = np.ones(n, bool)
        if mess == "middle":
            keep[: int(rng.uniform(0.15, 0.5) * n)] = False
        if mess == "lost":
            for start in rng.integers(0, n, max(2, n // 60)):
                keep[start : start + int(rng.integers(1, 6))] = False
        columns = {k: v[keep] for k, v in kept_columns(columns, channels, with_temperature, forces).items()}
        if mess == "lost":
            empty = rng.random((int(keep.sum()), len(columns))) < 0.015
        logs.append((columns, empty))

    folder = out / f"e-{seed}"
    folder.mkdir(parents=True, exist_ok=True)
    listed = []
    for number, (run, (columns, empty)) in enumerate(zip(runs, logs, strict=True), 1):
        (folder / f"program-{number}.nc").write_text(run.program)
        write_log(folder / f"log-{number}.csv", columns, empty)
        listed.append(
            {
                "name": f"run-{number}",
                "program": f"program-{number}.nc",
                "log": f"log-{number}.csv",
                "cutting": run.cutting,
                "started_s": run.started_s,
            }
        )
    experiment: dict = {"config": [str(machine.path)], "runs": listed}
    if stated:
        experiment["sd"] = {"tip_mm": round(whole, 5)}
    (folder / "experiment.yaml").write_text(yaml.safe_dump(experiment, sort_keys=False))
    answer = {
        "seed": seed,
        "kind": kind,
        "machine": machine.name,
        "channels": channels,
        "mess": mess,
        "noise_um": noise_um,
        "small_um": small_um,
        "causes_um": together_um,
        "causes": truth,
        "small": [entry(item, amount) for item, amount in small],
        "sensors": {k: v for k, v in s.items() if k != "mess"}
        | {
            "sd_stated": stated,
            "rows": [len(c["t_s"]) for c, _ in logs],
            "rapids_kept": keep_idle,
            "temperature": with_temperature and channels != "tip only",
            "recordings": [run.name for run in runs],
            "warm_up": {"rise_K": warmth.rise_K, "seconds": warmth.seconds},
        },
    }
    sealed = out / "truth" / f"e-{seed}.json"
    sealed.parent.mkdir(parents=True, exist_ok=True)
    begun = sealed.with_suffix(".part")
    begun.write_text(json.dumps(answer, indent=1) + "\n")
    os.replace(begun, sealed)


def runs_teeth_hertz(machine) -> float:
    """Teeth per second at the 8000 rpm that all recorded programs state."""
    return machine.teeth * 8000 / 60
