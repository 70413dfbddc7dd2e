"""Experiments made by the truth machine: a folder as a user would hand it in, and the truth, kept apart from it.

Everything is drawn from one seed: programs, order of the runs, pauses, the small errors of everything that are always there,
noise.  Names in the folder are neutral.  A cause is sized so that the rms it adds at the tip (3-D, over all runs) is `ratio`
times the rms of the tip's noise; without a tip in the log the encoder or the drive force takes its place.
"""

from __future__ import annotations

import json
import shutil
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from tests.validation.plants.causes import Cause
from tests.validation.plants.designs import Planned, plan
from tests.validation.plants.machine import ORIGIN, Run, State, Truth, observe
from tests.validation.plants.motion import Timeline, read

AXES = ("x", "y", "z")
CHANNELS = {
    "all": ("tip", "cmd", "act", "drive", "dyno", "temp"),
    "tip": ("tip",),
    "encoders": ("cmd", "act", "drive"),
    "no-forces": ("tip", "cmd", "act", "temp"),
    "no-setpoints": ("tip", "act", "drive", "dyno"),
}


@dataclass(frozen=True)
class Noise:
    """Standard deviations per sample and axis: mm, N, K."""

    tip: float = 0.0015
    encoder: float = 0.0005
    drive: float = 1.0
    dyno: float = 1.5
    temp: float = 0.05
    offset: float = 0.0006
    jitter_s: float = 1e-5

    @property
    def tip_rms(self) -> float:
        """3-D rms of the tip's noise, mm, offsets of the runs included."""
        return float(np.sqrt(3 * (self.tip**2 + self.offset**2)))


@dataclass(frozen=True)
class Plan:
    """What to make."""

    seed: int
    causes: tuple[Cause, ...] = ()
    ratios: tuple[float, ...] = ()
    design: str = "six"
    channels: str = "all"
    samples: int = 500
    nuisance: float = 1.0
    noise: Noise = Noise()
    world: int | None = None  # programs, order and pauses are drawn from this; default: the seed


def small_errors(rng: np.random.Generator, scale: float) -> Truth:
    """A machine with the small errors that every machine has (together below the tip's noise)."""

    def three(size: float) -> np.ndarray:
        return scale * size * rng.normal(size=3)

    return Truth(
        lag_ms=np.abs(three(0.003)),
        play_mm=np.abs(three(1e-4)),
        offset_mm=three(1e-4),
        pitch_ppm=three(0.4),
        cyclic_mm=np.abs(three(7e-5)),
        cyclic_phase=rng.uniform(-3, 3, 3),
        growth_mm_per_K=three(6e-6),
        drive_factor=1 + three(1.2e-3),
        link_factor=1 + scale * 6e-4 * rng.normal(),
        roll_deg=three(6e-5),
        longer_mm=three(1e-4),
        force_factor=1 + scale * 5e-4 * rng.normal(),
        tool_mm=scale * 1e-4 * rng.normal(),
        shift_mm=three(1e-4),
        damping=float(rng.uniform(0.7, 1.0)),
        slip_mm=float(rng.uniform(0.004, 0.012)),
        play_start=rng.uniform(-1, 1, 3),
        heat_K=(float(rng.uniform(1.5, 4)), float(rng.uniform(3, 7))),
        heat_taus_s=(float(rng.uniform(180, 400)), float(rng.uniform(1200, 2600))),
    )


@dataclass
class Made:
    """An experiment before it is written: runs, their noise-free states, sample times, and the truth that made them."""

    runs: list[Run]
    programs: list[str]
    states: list[State]
    truth: Truth
    record: dict


def even(run: Run, count: int) -> np.ndarray:
    """Times in the middle of `count` equal parts of a run."""
    return (np.arange(count) + 0.5) * run.timeline.log_end / count


def middle(runs: list[Run]) -> tuple[float, float]:
    """The central part of the middle run on the common clock, for what happens at one moment."""
    run = runs[len(runs) // 2]
    return run.started_s + 0.3 * run.timeline.log_end, run.started_s + 0.7 * run.timeline.log_end


def _busy(runs: list[Run]) -> list[tuple[float, float]]:
    return [(r.started_s, r.started_s + r.timeline.log_end) for r in runs]


def schedule(planned: list[Planned], rng: np.random.Generator) -> list[Run]:
    """Runs with pauses between them; minutes of cutting add up."""
    runs: list[Run] = []
    clock, cut = float(rng.integers(60, 400)), 0.0
    for p in planned:
        line = Timeline(read(p.program))
        runs.append(Run(line, p.cutting, round(clock, 1), cut))
        if p.cutting:
            grid = np.arange(0, line.log_end, 0.05)
            cut += float(line.sample(grid)["cuts"].sum() * 0.05 / 60)
        clock += line.log_end + float(rng.integers(120, 600))
    return runs


def observe_all(runs: list[Run], truth: Truth, times: list[np.ndarray]) -> list[State]:
    """Every run at its times."""
    return [observe(r, truth, t, _busy(runs)) for r, t in zip(runs, times, strict=True)]


def severity(a: list[State], b: list[State], noise: Noise, channels: tuple[str, ...]) -> float:
    """rms of the change from a to b over the rms of the noise, in the channel that stands for the experiment."""

    def rms(pick) -> float:
        return float(
            np.sqrt(np.mean(np.concatenate([((pick(y) - pick(x)) ** 2).sum(1) for x, y in zip(a, b, strict=True)])))
        )

    if "tip" in channels:
        return rms(lambda s: s.tip) / noise.tip_rms
    found = [rms(lambda s: s.encoder) / (noise.encoder * 3**0.5)] if "act" in channels else []
    found += [rms(lambda s: s.drive) / (noise.drive * 3**0.5)] if "drive" in channels else []
    return max(found)


def size(plan_: Plan, runs: list[Run], base: Truth, cause: Cause, ratio: float) -> float:
    """Amplitude at which the cause, put into `base`, reaches the ratio; clipped to physical values."""
    times = [even(r, 60) for r in runs]
    before = observe_all(runs, base, times)
    span = middle(runs)
    low, high = cause.bounds()
    a = cause.sign() * cause.unit()
    for _ in range(4):
        a = float(np.clip(a, low, high))
        after = observe_all(runs, cause.put(base, a, span)[0], times)
        got = severity(before, after, plan_.noise, CHANNELS[plan_.channels])
        if got <= 0 or abs(got / ratio - 1) < 0.03:
            break
        if cause.sign() < 0 and a * ratio / got < low:  # cannot be that small: take the other sign
            a = -a
            continue
        a *= min(max(ratio / got, 0.02), 50.0)
    return float(np.clip(a, low, high))


def executed(plan_: Plan) -> tuple[list[Planned], list[Run]]:
    """The motion that a plan executes without faults."""
    rng = np.random.default_rng([plan_.seed if plan_.world is None else plan_.world, 5])
    planned = plan(plan_.design, rng)
    return planned, schedule(planned, rng)


def make(plan_: Plan) -> Made:
    """Runs the machine: everything but noise and files."""
    planned, runs = executed(plan_)
    rng = np.random.default_rng([plan_.seed, 7])
    base = small_errors(rng, plan_.nuisance)
    truth, listed = base, []
    span = middle(runs)
    pure = Truth(damping=base.damping, slip_mm=base.slip_mm, heat_K=base.heat_K, heat_taus_s=base.heat_taus_s)
    clean = pure
    for cause, ratio in zip(plan_.causes, plan_.ratios, strict=True):
        amplitude = size(plan_, runs, base, cause, ratio)
        truth, parameters = cause.put(truth, amplitude, span)
        clean, _ = cause.put(clean, amplitude, span)
        listed.append({"effect": cause.effect, "target": cause.target, "ratio": ratio, "parameters": parameters})
    few = [even(r, 40) for r in runs]
    times = [_times(r, plan_, rng) for r in runs]
    states = observe_all(runs, truth, times)
    record = {
        "seed": plan_.seed,
        "design": plan_.design,
        "channels": plan_.channels,
        "world": plan_.world,
        "causes": listed,
        "noise_rms_um": 1e3 * plan_.noise.tip_rms,
        "nuisance_rms_um": 1e3 * _rms(observe_all(runs, base, few), observe_all(runs, pure, few)),
        "runs": [],
    }
    explained = observe_all(runs, clean, times)
    nominal = observe_all(runs, pure, times)
    for i, (s, e, n) in enumerate(zip(states, explained, nominal, strict=True)):
        record["runs"].append(
            {
                "name": f"run-{i + 1}",
                "effect_rms_um": 1e3 * _rms([s], [n]),
                "left_rms_um": 1e3 * _rms([s], [e]),
            }
        )
    return Made(runs, [p.program for p in planned], states, truth, record)


def _rms(a: list[State], b: list[State]) -> float:
    d = np.concatenate([y.tip - x.tip for x, y in zip(a, b, strict=True)])
    return float(np.sqrt((d**2).sum(1).mean()))


def _times(run: Run, plan_: Plan, rng: np.random.Generator) -> np.ndarray:
    """Sample times: even, jittered, now and then a lost sample; quantised as they will be written."""
    t = even(run, plan_.samples)
    t += rng.normal(0, 0.06 * t[0], len(t))
    keep = rng.uniform(size=len(t)) > 0.005
    return np.unique(np.round(np.clip(t[keep], 0, run.timeline.log_end), 5))


def _coloured(rng: np.random.Generator, shape: tuple[int, int], sigma: float) -> np.ndarray:
    """Half white, half AR(1) with a memory of some ten samples."""
    memory = rng.uniform(0.7, 0.93)
    kick = rng.normal(size=shape) * np.sqrt(1 - memory**2)
    slow = np.empty(shape)
    slow[0] = rng.normal(size=shape[1])
    for i in range(1, shape[0]):
        slow[i] = memory * slow[i - 1] + kick[i]
    return sigma * np.sqrt(0.5) * (slow + rng.normal(size=shape))


def table(state: State, plan_: Plan, rng: np.random.Generator) -> tuple[list[str], np.ndarray, list[str]]:
    """Names, values (rows, columns) with noise and gaps (NaN), and formats of one log."""
    noise, n, present = plan_.noise, len(state.t), CHANNELS[plan_.channels]
    drift = state.speed[:, None] * state.along * rng.normal(0, noise.jitter_s, (n, 1))
    tip = state.tip + drift + _coloured(rng, (n, 3), noise.tip) + rng.normal(0, noise.offset, 3)
    blocked = rng.uniform(size=n) < 0.004
    tip[blocked] = np.nan
    parts = {
        "tip": ([f"{a}_mm" for a in AXES], tip, "%.4f"),
        "cmd": ([f"cmd_{a}_mm" for a in AXES], state.setpoint, "%.4f"),
        "act": ([f"act_{a}_mm" for a in AXES], state.encoder + rng.normal(0, noise.encoder, (n, 3)), "%.4f"),
        "drive": ([f"act_{a}_N" for a in AXES], state.drive + _coloured(rng, (n, 3), noise.drive), "%.1f"),
        "dyno": ([f"f{a}_N" for a in AXES], state.force + rng.normal(0, noise.dyno, (n, 3)), "%.1f"),
        "temp": (["temp_C"], state.temperature[:, None] + rng.normal(0, noise.temp, (n, 1)), "%.2f"),
    }
    names, values, formats = (
        ["t_s", "line"],
        [state.t[:, None], state.line[:, None].astype(float)],
        ["%.5f", "%d"],
    )
    for key in present:
        names += parts[key][0]
        values.append(parts[key][1])
        formats += [parts[key][2]] * len(parts[key][0])
    return names, np.concatenate(values, 1), formats


def write_log(path: Path, names: list[str], values: np.ndarray, formats: list[str]) -> None:
    """CSV with empty cells where a value is missing."""
    with path.open("w") as out:
        out.write(",".join(names) + "\n")
        for row in values:
            out.write(",".join("" if np.isnan(v) else f % v for f, v in zip(formats, row, strict=True)) + "\n")


def write(made: Made, plan_: Plan, folder: Path, config: Path | str) -> Path:
    """Writes programs, logs and experiment.yaml; returns the path of the latter.

    config: a machine file to copy into the folder, or text that experiment.yaml shall name instead.
    """
    folder.mkdir(parents=True, exist_ok=True)
    if isinstance(config, Path):
        shutil.copyfile(config, folder / "machine.yaml")
        config = "machine.yaml"
    rng = np.random.default_rng([plan_.seed, 11])
    lines = ["config:", f"  - {config}", "runs:"]
    for i, (run, program, state) in enumerate(zip(made.runs, made.programs, made.states, strict=True), 1):
        (folder / f"program-{i}.nc").write_text(program)
        write_log(folder / f"log-{i}.csv", *table(state, plan_, rng))
        lines.append(
            f"  - {{name: run-{i}, program: program-{i}.nc, log: log-{i}.csv, "
            f"cutting: {str(run.cutting).lower()}, started_s: {run.started_s}}}"
        )
    (folder / "experiment.yaml").write_text("\n".join(lines) + "\n")
    return folder / "experiment.yaml"


def truth_json(made: Made, plan_: Plan) -> str:
    """The sealed answer."""
    noise = asdict(plan_.noise)
    return json.dumps({**made.record, "noise": noise}, indent=1)


def rerun(made: Made, program: str, groove: str) -> State:
    """The same machine executes a corrected program of `groove` without stops at its chords; 500 even times, noise-free."""
    began = made.runs[-1].started_s + 600.0
    line = Timeline(read(program), looks_ahead=True)
    run = Run(line, True, began, made.runs[-1].cut_before_min, Timeline(read(groove)))
    return observe_all([run], made.truth, [even(run, 500)])[0]


__all__ = ["CHANNELS", "ORIGIN", "Made", "Noise", "Plan", "make", "rerun", "size", "truth_json", "write"]
