"""Experiments on recorded motions: a folder as a user would hand it in, and the truth, which is kept apart from it.

Sizes are what the plant itself shows: a cause of ratio k moves the tip by k times the rms (3-D) of the tip's noise, over all
runs.  Every machine has small errors of everything else, each and together below the noise.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from functools import cache, partial
from pathlib import Path

import numpy as np

from tests.validation.recorded import added_faults
from tests.validation.recorded import faults as library
from tests.validation.recorded.faults import Fault, Faults, Target
from tests.validation.recorded.machines import MACHINES
from tests.validation.recorded.plant import Character, Run, State, observe
from tests.validation.recorded.sensors import Sensors, table, write_log
from tests.validation.recorded.unmodelled import STRANGE, strange
from tests.validation.recordings import recording
from tests.validation.recordings.recording import Recording

IDLE_S = (1.0, 6.0)
FEW = 40  # rows per run on which sizes are found
SMALL = (0.03, 0.25)  # ratio of a small error, drawn evenly in its logarithm
SMALL_TOGETHER = 0.5  # ratio of all small errors at most
SLOW_UNSTATED = 0.001  # mm; slow noise beyond the contract's repeatability is stated in the experiment


@dataclass(frozen=True)
class Plan:
    """What to make; everything that is not said here is drawn from the seed.

    causes: (effect, target); ratios: their sizes over the noise.  rapids: whether rows of rapids and rest are logged, None
    lets the seed choose.  imperfect: springs some per cent off, a force up to a tenth off, ripple of the teeth.  stated: whether
    the experiment says how far the tip's instrument is off; None lets the seed choose where the slow noise is small.
    paths: names of the recordings to choose from, circles among them.  hertz: of the log, in place of `rows` per run.  waits: machines stand idle now and then.  middle: logs begin after a part of
    the run, at the common time that started_s says.
    """

    seed: int
    kind: str = "null"
    causes: tuple[tuple[str, Target], ...] = ()
    ratios: tuple[float, ...] = ()
    machine: str = "orthoglide"
    channels: str = "full"
    sensors: Sensors = field(default_factory=Sensors)
    rows: int = 500
    runs: int = 6
    rapids: bool | None = None
    imperfect: bool = False
    stated: bool | None = None
    paths: tuple[str, ...] = ()
    hertz: float | None = None
    waits: bool = False
    middle: bool = False


@dataclass
class Made:
    """An experiment before it is written."""

    runs: list[Run]
    states: list[State]
    record: dict
    left: dict[int, Callable[[], float]] = field(default_factory=dict)  # mm, by place in the record: see truth_json


def character(rng: np.random.Generator, ripple: bool) -> Character:
    """A machine's ways."""
    return Character(
        speed_loop=float(rng.uniform(0.08, 0.24)),
        presliding_mm=float(rng.uniform(0.004, 0.012)),
        stribeck=float(rng.uniform(0.0, 0.12)),
        rise_K=(float(rng.uniform(1.5, 4)), float(rng.uniform(3, 7))),
        slow_s=(float(rng.uniform(150, 400)), float(rng.uniform(1200, 2600))),
        play_start=tuple(float(v) for v in rng.uniform(-1, 1, 6)),
        ripple=float(rng.uniform(0.1, 0.3)) if ripple else 0.05,
        teeth_hertz=float(rng.uniform(200, 400)),
    )


def schedule(plan: Plan, rng: np.random.Generator) -> list[Run]:
    """Runs of different recordings with pauses between them: circles first, all kinds of paths, one or two in the air."""
    names = list(plan.paths) or recording.names()
    circles = [each for each in names if each.startswith("circles")]
    others = [str(each) for each in rng.permutation([each for each in names if each not in circles])]
    chosen = [str(rng.choice(circles)), *others[: plan.runs - 2]]
    chosen = [str(each) for each in rng.permutation([*chosen, str(rng.choice(chosen))])]  # one is run twice
    air = set(rng.permutation(len(chosen))[: max(1, round(len(chosen) / 4))].tolist())
    runs, clock, cut = [], float(rng.integers(60, 400)), 0.0
    for i, name in enumerate(chosen):
        record = recording.load(name)
        run = Run(idling(record, rng) if plan.waits else record, i not in air, round(clock, 1), cut)
        runs.append(run)
        cut += float(run.cuts.sum()) * recording.STEP_S / 60
        clock += run.last_s + float(rng.integers(120, 600))
    return runs


def idling(record: Recording, rng: np.random.Generator) -> Recording:
    """The recording with IDLE_S of standing still, wherever its speed is 0 anyway, one to three times."""
    still = np.flatnonzero((np.diff(record.tip, axis=0) == 0).all(1))
    k = np.sort(rng.choice(still, min(len(still), int(rng.integers(1, 4))), replace=False))
    times = np.ones(len(record.t), int)
    times[k] += (rng.uniform(*IDLE_S, len(k)) / recording.STEP_S).astype(int)
    each = np.repeat(np.arange(len(times)), times)
    t = np.arange(len(each)) * recording.STEP_S
    name = f"{record.name}, idle at {[(int(i), int(n)) for i, n in zip(k, times[k], strict=True)]}"
    return Recording(name, record.program, t, record.tip[each], record.line[each], record.kind[each])


def row_times(run: Run, plan: Plan, rapids: bool, rng: np.random.Generator) -> np.ndarray:
    """Times of the rows (about plan.rows,) s: samples at even steps of the control, without rapids and rest if so chosen."""
    record = run.recording
    logged = np.ones(len(record.t), bool) if rapids else record.kind > 1
    if plan.middle:
        logged &= record.t >= rng.uniform(0.1, 0.5) * run.last_s
    step = max(1, round(int(logged.sum()) / plan.rows if plan.hertz is None else 1 / (plan.hertz * recording.STEP_S)))
    k = np.arange(step // 2, len(record.t), step)
    return record.t[k[logged[k]]]


def few_times(run: Run) -> np.ndarray:
    """Times (FEW,) s on which sizes are found."""
    return (np.arange(FEW) + 0.5) * run.last_s / FEW


def rms(a: list[State], b: list[State]) -> float:
    """Root of the mean square (3-D) by which the tips differ away from jumps of the cutting force, mm."""
    parts = [((y.tip - x.tip) ** 2).sum(1)[x.steady] for x, y in zip(a, b, strict=True)]
    return float(np.sqrt(np.mean(np.concatenate(parts))))


class Bench:
    """One machine that runs its programs with this or that wrong."""

    def __init__(self, plan: Plan, runs: list[Run], ways: Character) -> None:
        self.machine, self.runs, self.ways = MACHINES[plan.machine], runs, ways
        self.times = [few_times(run) for run in runs]
        middle = runs[len(runs) // 2]
        self.span = (middle.started_s + 0.3 * middle.last_s, middle.started_s + 0.7 * middle.last_s)

    def see(self, wrong: tuple[Fault, ...], times: list[np.ndarray] | None = None) -> list[State]:
        """States of every run."""
        rows = times or self.times
        return [observe(self.machine, r, Faults(wrong), self.ways, t) for r, t in zip(self.runs, rows, strict=True)]

    def fault(self, effect: str, target: Target, size: float, seed: int) -> Fault:
        """A fault of the library or a strange one."""
        if effect in STRANGE:
            return strange(effect, target or self.machine.actuators[0], size, seed, self.span)
        if effect in added_faults.KNOWN_AS:
            return added_faults.fault(effect, target, size, seed, self.span)
        return library.sized(effect, target, size, seed, self.machine.reach if self.machine.rotary else None)

    def sized(self, base: tuple[Fault, ...], effect: str, target: Target, goal_mm: float, seed: int) -> Fault:
        """The fault that, put to base, moves the tip by goal_mm rms."""
        before = self.see(base)
        low, high = library.bounds(effect)
        sign = library.sign(effect, seed)
        size = sign * (library.LIBRARY[effect].fair if effect in library.LIBRARY else 1.0)
        for _ in range(5):
            size = float(np.clip(size, low, high))
            got = rms(before, self.see((*base, self.fault(effect, target, size, seed))))
            if got > 0 and abs(got / goal_mm - 1) < 0.03:
                break
            if size == low and got < goal_mm and low < 0:  # a factor cannot fall that far: it rises
                size, low = -size, 0.0
                continue
            size *= float(np.clip(goal_mm / max(got, 1e-9), 0.02, 50.0))
        return self.fault(effect, target, float(np.clip(size, low, high)), seed)


@cache
def sensitivity(machine: str) -> dict[tuple[str, Target], float]:
    """Tip rms (mm) of a fair size of everything in the library, on one set of programs; good to a factor of about two."""
    plan = Plan(seed=1, machine=machine, runs=3)
    bench = Bench(plan, schedule(plan, np.random.default_rng(1)), Character())
    before = bench.see(())
    out = {}
    for effect, target in library.every(bench.machine):
        fair = library.LIBRARY[effect].fair
        fair = fair / 10 if effect in ("backlash", "servo_lag", "time_sync", "friction") else fair
        out[effect, target] = rms(before, bench.see((bench.fault(effect, target, fair, 1),))) / fair
    return out


def unabsorbed(bench: Bench, machine: str, base: tuple[Fault, ...], fault: Fault, sensors: Sensors) -> float:
    """Rms (mm) at the tip of the residual of a fault after a first-order fit of every effect of the library."""

    def readings(states: list[State]) -> np.ndarray:
        tip = np.concatenate([s.tip[s.steady] / sensors.tip_mm for s in states])
        encoder = np.concatenate([s.encoder[s.steady] * bench.machine.reach / sensors.encoder_step_mm for s in states])
        return np.concatenate([tip.ravel(), encoder.ravel()])

    plain, size = readings(bench.see(base)), 0.1 * sensors.rms_mm
    columns = []
    for (effect, target), per_mm in sensitivity(machine).items():
        changed = bench.see((*base, bench.fault(effect, target, size / per_mm, 1)))
        columns.append(readings(changed) - plain)
    span = np.stack(columns, 1)
    gap = readings(bench.see((*base, fault))) - plain
    left = gap - span @ np.linalg.lstsq(span, gap, rcond=1e-9)[0]
    rows = sum(int(s.steady.sum()) for s in bench.see(base))
    return float(sensors.tip_mm * np.sqrt((left[: 3 * rows] ** 2).sum() / rows))


def small_errors(
    bench: Bench, machine: str, without: set[str], noise_mm: float, rng: np.random.Generator
) -> tuple[Fault, ...]:
    """Errors of every kind but those named, each of a size that stays below the noise, and all of them together too."""
    ratios, found = {}, []
    for effect, target in library.every(bench.machine):
        common = target is None and library.LIBRARY[effect].own
        if effect not in without and not common:  # one value for all is the same thing once more
            ratios[effect, target] = float(np.exp(rng.uniform(*np.log(SMALL))))
    seeds = {each: int(rng.integers(1 << 30)) for each in ratios}
    per_mm = sensitivity(machine)
    shrink = 1.0
    for _ in range(2):
        found = [
            bench.fault(e, t, shrink * library.sign(e, seeds[e, t]) * ratio * noise_mm / per_mm[e, t], seeds[e, t])
            for (e, t), ratio in ratios.items()
        ]
        together = rms(bench.see(()), bench.see(tuple(found)))
        if together <= SMALL_TOGETHER * noise_mm:
            break
        shrink *= 0.9 * SMALL_TOGETHER * noise_mm / together
    return tuple(found)


def off_model(bench: Bench, rng: np.random.Generator) -> tuple[Fault, ...]:
    """A model that is not perfect: springs some per cent off, a cutting force up to a tenth off."""
    out = [Fault("cutting_force", None, {"factor": float(1 + rng.choice([-1, 1]) * rng.uniform(0.03, 0.1))})]
    if "link_stiffness" not in bench.machine.without:
        out.append(Fault("link_stiffness", None, {"factor": float(1 + rng.normal() * 0.02)}))
    for each in bench.machine.actuators:
        out.append(Fault("drive_stiffness", each, {"factor": float(1 + rng.normal() * 0.03)}))
    return tuple(out)


def make(plan: Plan) -> Made:
    """Runs the machine: everything but noise and files."""
    rng = np.random.default_rng([plan.seed, 5])
    ways = character(rng, plan.imperfect)
    runs = schedule(plan, rng)
    bench = Bench(plan, runs, ways)
    noise = plan.sensors.rms_mm
    rapids = bool(rng.integers(2)) if plan.rapids is None else plan.rapids
    off = off_model(bench, rng) if plan.imperfect else ()
    taken = {effect for effect, _ in plan.causes} | {each.effect for each in off}
    small = small_errors(bench, plan.machine, taken, noise, rng)
    base, causes = (*small, *off), []
    for k, ((effect, target), ratio) in enumerate(zip(plan.causes, plan.ratios, strict=True)):
        causes.append(bench.sized((*base, *causes), effect, target, ratio * noise, plan.seed + 7919 * (k + 1)))
    named = [each for each in off if rms(bench.see(()), bench.see((each,))) > 0.3 * noise] + causes
    every = (*base, *causes)
    few = bench.see(every)
    listed: list[dict] = []
    left: dict[int, Callable[[], float]] = {}
    for each in named:
        moved = rms(bench.see(tuple(other for other in every if other is not each)), few)
        one = {**asdict(each), "strange": each.effect in STRANGE, "um": 1e3 * moved, "ratio": moved / noise}
        if each.effect in STRANGE:
            left[len(listed)] = partial(unabsorbed, bench, plan.machine, small, each, plan.sensors)
        listed.append(one)
    times = [row_times(run, plan, rapids, rng) for run in runs]
    states, perfect = bench.see(every, times), bench.see((), times)
    record = {
        "seed": plan.seed, "kind": plan.kind, "machine": plan.machine, "channels": plan.channels, "rapids": rapids,
        "noise_um": 1e3 * noise, "sensors": asdict(plan.sensors), "causes": listed,
        "small": [asdict(each) for each in (*small, *(e for e in off if e not in named))],
        "small_um": 1e3 * rms(bench.see(()), bench.see(small)),
        "runs": [
            {
                "name": f"run-{i + 1}", "recording": r.recording.name, "cutting": r.cutting,
                "wrong_um": 1e3 * rms([s], [p]), "from_commanded_um": 1e3 * float(np.sqrt(((s.tip - s.commanded) ** 2).sum(1).mean())),
            }
            for i, (r, s, p) in enumerate(zip(runs, states, perfect, strict=True))
        ],
    }  # fmt: skip
    return Made(runs, states, record, left)


def write(made: Made, plan: Plan, folder: Path) -> Path:
    """Writes programs, logs and experiment.yaml; the path of the latter."""
    folder.mkdir(parents=True, exist_ok=True)
    machine, sensors = MACHINES[plan.machine], plan.sensors
    rng = np.random.default_rng([plan.seed, 11])
    lines = [f"config: [{machine.config}]"]
    unstated = sensors.tip_mm * (sensors.slow + sensors.drift) ** 0.5 <= SLOW_UNSTATED
    drawn = not (unstated and rng.integers(2))
    if drawn if plan.stated is None else plan.stated:
        lines.append(f"sd: {{tip_mm: {sensors.tip_mm:g}}}")
    lines.append("runs:")
    for i, (run, state) in enumerate(zip(made.runs, made.states, strict=True), 1):
        (folder / f"program-{i}.nc").write_text(run.recording.program)
        log = table(state, sensors, plan.channels, machine, rng)
        begun = float(state.t[0]) if plan.middle else 0.0
        log.values[:, 0] -= begun
        write_log(folder / f"log-{i}.csv", log)
        made.record["runs"][i - 1]["outliers"] = log.outliers
        cutting = str(run.cutting).lower()
        started = f"{run.started_s + begun:.3f}"
        lines.append(
            f"  - {{name: run-{i}, program: program-{i}.nc, log: log-{i}.csv, cutting: {cutting}, started_s: {started}}}"
        )
    (folder / "experiment.yaml").write_text("\n".join(lines) + "\n")
    return folder / "experiment.yaml"


def truth_json(made: Made) -> str:
    """The sealed answer, with the residual of unmodelled causes after a fit of the library: half of an experiment's work."""
    for place, left in made.left.items():
        made.record["causes"][place]["left_ratio"] = 1e3 * left() / made.record["noise_um"]
    return json.dumps(made.record, indent=1)
