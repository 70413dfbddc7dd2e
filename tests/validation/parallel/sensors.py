"""What instruments make of the plant: noise, rounding, missing channels, and one kind of mess. mm, N, s."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from tests.validation.parallel.plant import simulate
from tests.validation.parallel.scenario import Scenario

SPINDLE_HZ = 8000 / 60  # every recorded program says S8000


def draw(rng: np.random.Generator, mess: str | None) -> dict:
    """Instruments of one experiment; `stated` are their values in the experiment file."""
    white = float(rng.uniform(1.5, 6.0)) * 1e-3
    stated = bool(mess == "drift" or rng.random() < 0.35)
    slow = float(rng.uniform(0.2, 0.5)) * white if stated else float(rng.uniform(0.2, 0.9)) * 1e-3
    if mess == "drift":
        slow = float(rng.uniform(0.8, 1.4)) * white
    out = {"tip_white_mm": white, "tip_slow_mm": slow, "slow_s": float(rng.uniform(1.0, 4.0)),
           "encoder_step_mm": float(rng.uniform(0.2, 1.0)) * 1e-3, "drive_N": float(rng.uniform(0.2, 2.0)),
           "dynamometer_N": float(rng.uniform(1.0, 3.0)), "tip_step_mm": 5e-3 if mess == "coarse" else 1e-4,
           "temperature_column": bool(rng.random() < 0.6), "stated": {}}  # fmt: skip
    if mess == "drift":
        out["slow_s"] = float(rng.uniform(5.0, 15.0))
    if stated:
        whole = np.sqrt(white**2 + slow**2 + out["tip_step_mm"] ** 2 / 12)
        out["stated"] = {"tip_mm": float(np.round(whole, 5))}
    return out


def expected_noise(sensor: dict) -> float:
    """rms 3-D of the tip noise, mm."""
    return float(
        np.sqrt(3 * (sensor["tip_white_mm"] ** 2 + sensor["tip_slow_mm"] ** 2 + sensor["tip_step_mm"] ** 2 / 12))
    )


def slow_noise(rng: np.random.Generator, times: np.ndarray, spread: float, memory: float) -> np.ndarray:
    """First-order noise (n, 3) of a correlation time, at rows of any spacing."""
    grid = np.arange(times[0], times[-1] + 0.2, 0.05)
    keep = np.exp(-0.05 / memory)
    drive = rng.normal(size=(len(grid), 3)) * np.sqrt(1 - keep**2)
    drive[0] /= np.sqrt(1 - keep**2)
    walk = lfilter([1], [1, -keep], drive, axis=0) * spread
    return np.stack([np.interp(times, grid, walk[:, i]) for i in range(3)], 1)


def logs(rng: np.random.Generator, s: Scenario) -> tuple[list[str], float]:
    """One CSV text per run, and the rms 3-D of the tip noise that was added (mm, without spikes)."""
    seen = simulate(s.machine, s.tracks, s.rows, [*s.causes, *s.small], s.fault, s.scatter, drives=True)
    texts, squares, count, begin = [], 0.0, 0, 0
    shift = int(rng.choice([-4, -3, -2, -1, 1, 2, 3, 4])) if s.mess == "line_shift" else 0
    rate = 1 + float(rng.choice([-200e-6, 200e-6])) if s.mess == "clock_rate" else 1.0
    s.sensors |= {"line_rows": shift, "clock_rate": rate}
    late = [int(rng.random() < 0.7) for _ in s.tracks]
    for k, (run, times) in enumerate(zip(s.tracks, s.rows, strict=True)):
        part = slice(begin, begin + len(times))
        begin += len(times)
        index = np.rint(times * 1000).astype(int)
        tip, force = seen.tip[part].copy(), seen.force[part].copy()
        if s.ripple:
            turn = 2 * np.pi * SPINDLE_HZ * (times + run.started_s)
            teeth = s.ripple["teeth"]
            tooth = s.ripple["share"] * np.sin(teeth * turn)
            once = s.ripple["share"] * s.ripple["runout"] * np.sin(turn + 1.0)
            mode = s.ripple["mode_Hz"] / SPINDLE_HZ
            bent = tip - run.tip[index]  # elastic: far above the mode it answers in opposite phase
            bent[~(run.fed & run.cutting)[index]] = 0
            tip -= bent * (tooth * (mode / teeth) ** 2 + once * mode**2)[:, None]
            force = force * (1 + 0.3 * tooth + 0.6 * once)[:, None]
        white = rng.normal(size=tip.shape)
        if s.mess == "heavy_tails":
            white = rng.standard_t(3, size=tip.shape) / np.sqrt(3)
        noise = white * s.sensors["tip_white_mm"]
        noise += slow_noise(rng, times, s.sensors["tip_slow_mm"], s.sensors["slow_s"])
        measured = np.round((tip + noise) / s.sensors["tip_step_mm"]) * s.sensors["tip_step_mm"]
        squares, count = squares + ((measured - tip) ** 2).sum(), count + len(tip)
        if s.mess == "outliers":
            hit = np.flatnonzero(rng.random(len(tip)) < 0.005)
            measured[hit] += rng.normal(size=(len(hit), 3)) * np.exp(
                rng.uniform(np.log(0.1), np.log(12), (len(hit), 1))
            )
            measured[hit] = np.clip(measured[hit], tip[hit] - 30, tip[hit] + 30)
        step = s.sensors["encoder_step_mm"]
        columns: dict[str, list[str]] = {"t_s": [f"{t * rate:.6f}" for t in times]}
        line = run.line[index]
        if shift:
            line = line[np.clip(np.arange(len(line)) - shift, 0, len(line) - 1)]
        if s.channels not in ("no_lines", "tip"):
            columns["line"] = [str(v) for v in line]
        for i, axis in enumerate("xyz"):
            columns[f"{axis}_mm"] = [f"{v:.4f}" for v in measured[:, i]]
        tip_only = s.channels.startswith("tip")
        for c, name in enumerate(s.machine.drives):
            if s.channels != "no_cmd" and not tip_only:
                columns[f"cmd_{name}_mm"] = [f"{v:.6f}" for v in run.rho[index, c]]
            if s.channels != "no_encoders" and not tip_only:
                columns[f"act_{name}_mm"] = [f"{v:.6f}" for v in np.round(seen.motor[part, c] / step) * step]
            if s.channels != "no_forces" and not tip_only:
                load = seen.drive[part, c] + rng.normal(size=len(times)) * s.sensors["drive_N"]
                columns[f"act_{name}_N"] = [f"{v:.3f}" for v in load]
        if s.channels != "no_forces" and not tip_only:
            felt = force + rng.normal(size=force.shape) * s.sensors["dynamometer_N"]
            for i, axis in enumerate("xyz"):
                columns[f"f{axis}_N"] = [f"{v:.2f}" for v in felt[:, i]]
        if s.channels == "all" or (s.sensors["temperature_column"] and not tip_only):
            warm = run.temperature[index] + rng.normal(size=len(times)) * 0.03
            columns["temp_C"] = [f"{v:.2f}" for v in warm]
        keep = np.ones(len(times), bool)
        if s.mess == "gaps":
            keep &= rng.random(len(times)) > rng.uniform(0.02, 0.08)
            hole = rng.integers(0, len(times))
            keep[hole : hole + int(rng.integers(3, 15))] = False
            for name, values in columns.items():
                if name not in ("t_s", "line"):
                    gone = np.flatnonzero(rng.random(len(times)) < 0.015)
                    for row in gone:
                        values[row] = ""
        if s.mess == "late_start" and (late[k] or not any(late)):
            keep[: int(rng.uniform(0.1, 0.45) * len(times))] = False
        body = [
            ",".join(values) for values, kept in zip(zip(*columns.values(), strict=True), keep, strict=True) if kept
        ]
        texts.append("\n".join([",".join(columns), *body]) + "\n")
    return texts, float(np.sqrt(squares / count))
