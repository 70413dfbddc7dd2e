"""Draws an experiment from a seed, lets a laser tracker measure it, and writes it with its sealed answer."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import yaml

from tests.validation.poses.arm import Arm, Off, load_arm, turn_vector
from tests.validation.poses.causes import (
    ODDS,
    Item,
    Local,
    alike,
    by_another_name,
    disturbed,
    library,
    loose,
    remains,
    rms,
    strange,
)
from tests.validation.poses.plant import WAYS, AgainError, Odd, Plant, Run, poses, visited

MACHINES = ("ur10", "kuka-kr210")
KINDS = ("null", "single", "unknown", "pair", "single", "imperfect", "unknown", "single", "null", "pair")
NOISES = ("white", "white", "tails", "range", "outliers", "drift")
STAMP = 0.45  # of the noise: what all small errors may come to


def draw_plant(arm: Arm, kind: str, rng: np.random.Generator) -> tuple[Plant, dict]:
    """Campaigns with the positions of tracker and target in each, and their labels."""
    campaigns = int(rng.choice([1, 2, 2, 3]))
    clampings = list(range(campaigns))
    if campaigns == 3 and rng.random() < 0.3:
        clampings[2] = 1  # measured once more, with nothing moved
    again = rng.random() < 0.6
    runs, started = [], 0.0
    for k in range(campaigns):
        count = int(np.exp(rng.uniform(np.log(30), np.log(400))))
        if kind == "unknown":
            count = max(count, int(rng.uniform(150, 400) / campaigns))
        visits = int(rng.integers(2, 5)) if again and rng.random() < 0.8 else 1
        way = str(rng.choice(WAYS))
        different = max(count // visits, 12) if visits > 1 else count
        q = visited(poses(arm, way, different, rng), visits, rng)[:400]
        pace = rng.uniform(5, 20)
        steps = pace * np.exp(rng.normal(0, 0.3, len(q)))
        steps[rng.random(len(q)) < 0.01] += rng.uniform(300, 3000)
        steps[0] = 0
        runs.append(
            Run(f"campaign-{k + 1}", clampings[k], round(started, 1), way, visits, q, np.cumsum(steps).round(1))
        )
        started += float(runs[-1].t[-1]) + float(np.exp(rng.uniform(np.log(600), np.log(80000))))
    framed = rng.random() < 0.25  # measured in the frame of the program, at the tip of the tool
    seats, trackers = [], []
    tip = np.array([0, 0, -arm.tool_mm])
    for _ in range(max(clampings) + 1):
        if framed:
            seats.append(tip)
            trackers.append((np.eye(3), arm.origin))
        else:
            seats.append(tip + rng.uniform(-1, 1, 3) * [80, 80, 60])
            azimuth, far = rng.uniform(0, 2 * np.pi), rng.uniform(2500, 5000)
            place = np.array([far * np.cos(azimuth), far * np.sin(azimuth), rng.uniform(200, 1600)])
            turn = turn_vector(np.array([[0, 0, rng.uniform(0, 2 * np.pi)]]))[0]
            trackers.append((turn_vector(rng.normal(0, 0.02, (1, 3)))[0] @ turn, place))
    swing = float(rng.uniform(0, 1.5)) if rng.random() < 0.6 else 0.0
    warmth = (float(rng.uniform(1, 12)), float(rng.uniform(1200, 9000)), swing, 86400.0)
    return Plant(arm, runs, np.array(seats), trackers, warmth), {"framed": framed}


def entry(item: Item, amount: float) -> dict:
    """An effect as the truth lists it."""
    out = {"effect": item.effect, "target": item.target, "parameters": item.parameters(amount)}
    return out | ({"shape": item.shape} if item.shape else {})


def sized(local: Local, item: Item, want_um: float, sign: float) -> tuple[float, np.ndarray]:
    """Amount at which an effect alone moves the target by want_um apart from the frames, and its whole move."""
    amount = item.unit * sign
    for _ in range(8):
        change = local.of(item, amount)
        got = rms(local.free(change))
        if got < 1e-3 or got < 0.02 * rms(change):
            raise AgainError
        if abs(got / want_um - 1) < 0.03:
            return amount, change
        amount *= want_um / got
        if not (item.low or -item.high) <= amount <= item.high:
            raise AgainError
    raise AgainError


def draw_causes(kind: str, local: Local, items: list[Item], noise_um: float, rng) -> list[tuple[Item, float, dict]]:
    """Causes with their amounts, and as the truth lists them."""
    out: list[tuple[Item, float, dict]] = []
    many = {"null": 0, "unknown": int(rng.random() < 0.3), "single": 1, "pair": 2, "imperfect": int(rng.integers(3, 6))}
    effects = sorted({item.effect for item in items})
    moves: list[np.ndarray] = []
    for _ in range(80):
        if len(out) == many[kind]:
            return out
        effect = str(rng.choice(effects))
        some = [item for item in items if item.effect == effect]
        item = some[int(rng.integers(len(some)))]
        if item.key in {each[0].key for each in out}:
            continue
        ratio = float(np.exp(rng.uniform(np.log(3), np.log(14))))
        if kind == "imperfect" and out:
            ratio = float(rng.uniform(0.35, 1.2))
        try:
            amount, change = sized(local, item, ratio * noise_um, float(rng.choice([-1, 1])) if item.signed else 1.0)
        except AgainError:
            continue
        free = local.free(change)
        unit = free.ravel() / np.linalg.norm(free)
        if any(abs(unit @ other) > 0.9 for other in moves):
            continue
        moves.append(unit)
        um = rms(free)
        said = {"strange": False, "um": um, "raw_um": rms(change), "ratio": um / noise_um}
        out.append((item, amount, entry(item, amount) | said))
    raise AgainError


def small_errors(local: Local, items: list[Item], noise_um: float, rng) -> tuple[list[tuple[Item, float]], float]:
    """Amounts of small errors, each below a tenth of the noise and all together below a half of it."""
    kept, total = [], np.zeros_like(local.base)
    for item in items:
        change = local.of(item, item.unit)
        size = rms(local.free(change))
        if size < 1e-3 or size < 0.02 * rms(change):
            continue
        want = noise_um * np.exp(rng.uniform(np.log(0.005), np.log(0.08)))
        sign = float(rng.choice([-1, 1])) if item.signed else 1.0
        kept.append((item, sign * want / size * item.unit))
        total += change * (sign * want / size)
    whole = rms(local.free(total))
    shrink = min(1.0, 0.8 * STAMP * noise_um / max(whole, 1e-9))
    return [(item, amount * shrink) for item, amount in kept], whole * shrink


def draw_odd(plant: Plant, local: Local, noise_um: float, seed: int, rng) -> tuple[Odd, dict]:
    """A strange fault that the library cannot take up, and its entry in the truth."""
    order = [ODDS[(2 * (seed // 10) + (seed % 10 > 4)) % len(ODDS)], *rng.permutation(ODDS)]
    for name in order:
        for _ in range(2):
            odd = strange(plant, local, str(name), rng)
            span = local.span(odd.since)
            if span.shape[1] + local.frames.shape[1] > 0.6 * span.shape[0]:
                raise AgainError
            want = float(rng.uniform(4, 12)) * noise_um
            change = plant.tips(local.off, odd) - local.base
            for _ in range(3):
                got = rms(local.free(change))
                if got < 1e-3:
                    break
                odd.size *= want / got
                change = plant.tips(local.off, odd) - local.base
            free = local.free(change)
            rest = remains(span, free)
            um, left = rms(free), rms(rest) / noise_um
            if abs(um / want - 1) > 0.1 or left < 1.2:
                continue
            said = {"effect": odd.name, "target": odd.target, "parameters": odd.say | {"size": odd.size}}
            said |= {"strange": True, "um": um, "raw_um": rms(change), "ratio": um / noise_um, "left_ratio": left}
            said["left_by_run"] = [rms(rest[plant.run == k]) / noise_um for k in range(len(plant.runs))]
            return odd, said
    raise AgainError


def measured(plant: Plant, local: Local, tips: np.ndarray, s: dict, rng) -> tuple[np.ndarray, np.ndarray]:
    """Readings (n, 3) of targets by the trackers, and the deviation (n,) of each row."""
    n = len(tips)
    sigma = np.full(n, s["white_mm"])
    if s["noise"] == "range":
        far = np.linalg.norm(plant.seen(local.base), axis=1)
        for k in range(len(plant.runs)):  # what is stated of an instrument holds for every run
            rows = plant.run == k
            sigma[rows] *= np.sqrt((1 + (far[rows] / far[rows].mean()) ** 4) / 2)
            sigma[rows] *= s["white_mm"] / np.sqrt((sigma[rows] ** 2).mean())
    white = rng.standard_t(3, (n, 3)) / np.sqrt(3) if s["noise"] == "tails" else rng.normal(size=(n, 3))
    out = plant.seen(tips) + sigma[:, None] * white
    if s["noise"] == "drift":
        for k in range(len(plant.runs)):
            rows = plant.run == k
            walk = np.cumsum(rng.normal(size=(rows.sum(), 3)), axis=0)
            walk -= walk.mean(0)
            out[rows] += s["drift_mm"] * walk / walk.std(0)
    if s["noise"] == "outliers":
        hit = rng.random(n) < 0.005
        hit[rng.integers(n)] = True
        out[hit] += rng.choice([-1, 1], (hit.sum(), 3)) * rng.uniform(1, 6, (hit.sum(), 3))
        s["outliers"] = [
            [plant.runs[plant.run[k]].name, int(k - np.flatnonzero(plant.run == plant.run[k])[0])]
            for k in np.flatnonzero(hit)
        ]
    return np.round(out / s["step_mm"]) * s["step_mm"], sigma


def write_log(path: Path, columns: dict[str, tuple[np.ndarray, str]], empty: np.ndarray) -> None:
    """A CSV; cells of `empty` (rows, columns) are omitted."""
    rows = [",".join(columns)]
    for k in range(len(empty)):
        cells = [format(values[k], how) for values, how in columns.values()]
        rows.append(",".join("" if gone else cell for cell, gone in zip(cells, empty[k], strict=True)))
    path.write_text("\n".join(rows) + "\n")


def make(seed: int, out: Path, only: str | None) -> None:
    """Writes experiment e-<seed> and its truth; redraws impossible experiments in a fixed order."""
    for attempt in range(25):
        try:
            return attempt_one(seed, np.random.default_rng([seed, attempt, 6007]), out, only)
        except AgainError:
            continue
    raise RuntimeError(f"seed {seed} gives no experiment")


def honest(kind: str, known_floor: bool, moved: bool, sets: int) -> list[str]:
    """Verdicts that an honest answer may have."""
    if kind == "unknown":
        return ["unknown"] if known_floor else ["unknown", "ambiguous"]
    if not known_floor:
        return ["ambiguous", "unknown"]
    if kind == "null":
        return ["none", "identified", "ambiguous"] if moved else ["none"]
    return ["identified", "ambiguous"] if sets < 2 else ["ambiguous", "identified"]


def attempt_one(seed: int, rng: np.random.Generator, out: Path, only: str | None) -> None:
    """One try."""
    first = np.random.default_rng([seed, 104651])  # the same kind and machine at every try
    kind = KINDS[seed % len(KINDS)]
    machine = only or str(first.choice(MACHINES, p=[0.6, 0.4]))
    stated = (
        str(first.choice(["no", "no", "sd", "rows"])) if kind != "null" else str(first.choice(["no", "sd", "rows"]))
    )
    arm = load_arm(machine)
    plant, said = draw_plant(arm, kind, rng)
    local = Local(plant)

    s: dict = {"noise": str(rng.choice(NOISES)), "white_mm": float(rng.uniform(0.010, 0.060))}
    if stated == "no" and all(run.visits == 1 for run in plant.runs) and rng.random() < 0.5:
        stated = "sd"
    s |= {"drift_mm": 0.5 * s["white_mm"] if s["noise"] == "drift" else 0.0}
    s |= {"step_mm": float(rng.choice([1e-4, 1e-3, 1e-3])), "encoder_rad": float(rng.choice([1e-6, 1e-5]))}
    repeat = float(rng.uniform(1e-6, 6e-6))  # rad, between where a joint is and what its encoder says
    shaky = np.sqrt((np.sum(local.shares**2, axis=2).mean(1) * (repeat**2 + s["encoder_rad"] ** 2 / 12)).sum() / 3)
    whole = float(np.sqrt(s["white_mm"] ** 2 + s["drift_mm"] ** 2 + shaky**2))
    noise_um = 1e3 * np.sqrt(3) * whole

    items = [i for i in library(plant, rng) if i.effect != "thermal_growth" or np.ptp(plant.temp) > 2]
    pool = items + ([disturbed(plant, rng)] if rng.random() < 0.3 else [])
    causes = draw_causes(kind, local, pool, noise_um, rng)
    odd, truth = None, [each[2] for each in causes]
    if kind == "unknown":
        odd, strange_ = draw_odd(plant, local, noise_um, seed, rng)
        truth.append(strange_)
    taken = {item.key for item, _, _ in causes}
    small, small_um = small_errors(local, [i for i in items if i.key not in taken], noise_um, rng)
    off, without = Off.nothing(), Off.nothing()
    for item, amount in small:
        off, without = item.put(off, amount), item.put(without, amount)
    for item, amount, _ in causes:
        off = item.put(off, amount)
    together = rms(local.free(plant.tips(off, odd) - plant.tips(without)))

    frame = None
    if said["framed"] and rng.random() < 0.5:
        frame = {"shift_mm": rng.uniform(-1, 1, 3).tolist(), "rotation_deg": float(rng.uniform(-0.1, 0.1))}
        turn = turn_vector(np.array([[0, 0, np.radians(frame["rotation_deg"])]]))[0]
        plant.trackers = [(turn, arm.origin + frame["shift_mm"]) for _ in plant.trackers]
        if rng.random() < 0.5:
            frame["length_mm"] = float(rng.uniform(-0.5, 0.5))
            plant.seats = plant.seats - [0, 0, frame["length_mm"]]
    keys = [item.key for item, _, _ in causes]
    for item, amount, listed in causes:
        if item.effect == "disturbance":
            continue
        own = local.of(item, amount)
        free = loose(local, [k for k in keys if k[0] != "disturbance"], item.key, own, whole)
        names = list(listed["parameters"])
        free = free if item.effect == "link_geometry" else [any(free)] * len(names)
        listed["loose_parameters"] = [n for n, gone in zip(names, free, strict=True) if gone]
        listed["all_parameters"] = listed["parameters"]
        listed["parameters"] = {n: v for n, v in listed["parameters"].items() if n not in listed["loose_parameters"]}
    due = [(item, amount) for item, amount, listed in causes if listed["ratio"] >= 2.7]
    change = np.zeros_like(local.base)
    for item, amount in due:
        change = change + local.of(item, amount)
    sets = alike(local, [item.key for item, _ in due], change, whole) if due else []
    # small ones need not be named, but may be, by any name that does the same
    names = {key for item, amount, listed in causes if listed["ratio"] < 2.7 and item.effect != "disturbance"
             for key in by_another_name(local, local.of(item, amount))}  # fmt: skip

    tips = plant.tips(off, odd)
    seen, sigma = measured(plant, local, tips, s, rng)
    encoder = np.round((plant.q + rng.normal(0, repeat, plant.q.shape)) / s["encoder_rad"]) * s["encoder_rad"]
    with_temperature = bool(rng.random() < 0.5)
    if "thermal_growth" in {k[0] for k in keys} and (plant.warmth[2] > 0 or rng.random() < 0.5):
        with_temperature = True  # without it a curve of warming up has to do
    gaps, numbered = rng.random() < 0.25, rng.random() < 0.15
    folder = out / f"e-{seed}"
    folder.mkdir(parents=True, exist_ok=True)
    listed_runs, labels = [], len({run.clamping for run in plant.runs}) > 1 or rng.random() < 0.5
    for k, run in enumerate(plant.runs):
        rows = plant.run == k
        columns: dict[str, tuple[np.ndarray, str]] = {"t_s": (run.t, ".1f")}
        if numbered:  # a label, nothing else
            columns["line"] = (np.arange(1.0, rows.sum() + 1), ".0f")
        digits = 6 if s["encoder_rad"] < 5e-6 else 5
        columns |= {f"act_{n}_rad": (encoder[rows, j], f".{digits}f") for j, n in enumerate(arm.names)}
        digits = 4 if s["step_mm"] < 5e-4 else 3
        columns |= {f"{a}_mm": (seen[rows, j], f".{digits}f") for j, a in enumerate("xyz")}
        if with_temperature:
            columns["temp_C"] = (np.round((plant.temp[rows] + rng.normal(0, 0.03, rows.sum())) * 8) / 8, ".3f")
        if stated == "rows":
            own = np.hypot(np.hypot(sigma[rows], shaky), s["drift_mm"])
            columns |= {f"{a}_sd_mm": (own * rng.uniform(0.9, 1.1, rows.sum()), ".4f") for a in "xyz"}
        empty = np.zeros((rows.sum(), len(columns)), bool)
        if gaps:
            empty[:, 1:] = rng.random((rows.sum(), len(columns) - 1)) < 0.004
        write_log(folder / f"log-{k + 1}.csv", columns, empty)
        one = {"name": run.name, "log": f"log-{k + 1}.csv", "cutting": False, "started_s": run.started_s}
        listed_runs.append(one | ({"clamping": "ABC"[run.clamping]} if labels else {}))
    experiment: dict = {"config": [str(arm.path)], "runs": listed_runs}
    held = len(plant.runs) > 1 and rng.random() < 0.4 and "disturbance" not in {k[0] for k in keys}
    if held:
        experiment["holdout"] = [plant.runs[-1].name]
    if stated == "sd":
        experiment["sd"] = {"tip_mm": round(whole, 4)}
    (folder / "experiment.yaml").write_text(yaml.safe_dump(experiment, sort_keys=False))
    floor = "stated" if stated != "no" else "repeats" if any(r.visits > 1 for r in plant.runs) else "not identifiable"
    answer = {
        "seed": seed,
        "kind": kind,
        "machine": machine,
        "channels": f"poses{', temperature' if with_temperature else ''}",
        "mess": s["noise"],
        "noise_um": noise_um,
        "small_um": small_um,
        "causes_um": together,
        "causes": truth,
        "small": [entry(item, amount) for item, amount in small],
        "floor": floor,
        "allowed_verdicts": honest(kind, floor != "not identifiable", frame is not None, len(sets)),
        "allowed_beside": [{"effect": e, "target": None} for e in ("workpiece_frame", "tool_length") if frame],
        "may_be_named": sorted(names, key=str),
        "allowed_sets": [[{"effect": e, "target": t} for e, t in one] for one in sets],
        "frame": frame,
        "sensors": s
        | {
            "stated": stated,
            "tip_mm": whole,
            "repeat_rad": repeat,
            "rows": [len(run.q) for run in plant.runs],
            "ways": [run.way for run in plant.runs],
            "visits": [run.visits for run in plant.runs],
            "clampings": [run.clamping for run in plant.runs],
            "framed": said["framed"],
            "holdout": held,
            "missing_cells": gaps,
            "warmth": plant.warmth,
        },
    }
    sealed = out / "truth" / f"e-{seed}.json"
    sealed.parent.mkdir(parents=True, exist_ok=True)
    begun = sealed.with_suffix(".part")
    begun.write_text(json.dumps(answer, indent=1, default=float) + "\n")
    os.replace(begun, sealed)
