"""Laws that no library has: experiments with one such law on recorded motions, and how well `diagnose` finds it.

Most faults are those of unmodelled.py; those of OWN are added to the tip here. Small errors of every kind are always there, each and together
below what is minor and below the noise, as in experiment.py.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.validation.recorded.experiment import Bench, Character, Made, Plan, row_times, small_errors, write
from tests.validation.recorded.faults import Fault, Faults
from tests.validation.recorded.machines import MACHINES
from tests.validation.recorded.plant import Run, State, observe
from tests.validation.recorded.unmodelled import STRANGE, strange
from tests.validation.recordings import recording

PATHS = ("circles-exact", "zigzag-blended", "pocket-10um", "rectangle-exact", "circles-exact")
AIR = 4  # the last run repeats the first one in the air
NOISE_MM = 0.003
PAUSE_S = 240.0
FEW = 60


def _across(axis: int) -> int:
    return (axis + 1) % 3 if axis < 2 else 0


def _bow(s: State, axis: int) -> np.ndarray:
    return (s.commanded[:, _across(axis)] / 25.0) ** 2


def _shear(s: State, axis: int) -> np.ndarray:
    return s.commanded[:, 0] * s.commanded[:, 1] / 400.0


def _parity(s: State, axis: int) -> np.ndarray:
    step = np.gradient(s.commanded, axis=0)
    angle = np.arctan2(step[:, 1], step[:, 0])
    return np.where(np.hypot(step[:, 0], step[:, 1]) > 1e-9, np.cos(2 * angle), 0.0)


def _pull(s: State, axis: int) -> np.ndarray:
    return s.force[:, (axis + 1) % 2] / 200.0


def _tangle(s: State, axis: int) -> np.ndarray:
    """A function of s that no form of the search can express."""
    x, y = s.commanded[:, 0], s.commanded[:, 1]
    return np.sin((x + 0.6 * y) / 6.0) * np.tanh((y - 0.4 * x) / 8.0)


# name -> what it adds to the tip along an axis (n,), of size 1
OWN: dict[str, Callable[[State, int], np.ndarray]] = {
    "bow": _bow, "shear": _shear, "parity": _parity, "pull": _pull, "tangle": _tangle,
}  # fmt: skip


@dataclass(frozen=True)
class Truth:
    """families of forms that say the law; about: beginnings of the covariates; on: stages; own: along its target alone."""

    families: tuple[str, ...]
    about: tuple[str, ...]
    on: tuple[str, ...] = ("structure",)
    own: bool = True


TRUTH: dict[str, Truth] = {
    "guide_bump": Truth(("bump",), ("act_",), ("drive",)),
    "rack_period": Truth(("wave",), ("x_", "y_")),
    "straightness": Truth(("wave",), ("x_", "y_")),
    "twist": Truth(("product",), ("x_", "y_")),
    "disturbed_drive": Truth(("while",), ("common",), ("drive",)),
    "hardening": Truth(("force squared",), ("f", "load"), ("structure", "drive")),
    "crosstalk": Truth(("force",), ("f", "load"), ("structure", "drive")),
    "creep": Truth(("settling",), ("cut",)),
    "joint_hysteresis": Truth(("drag", "sense"), ("x_", "y_"), own=False),
    "clamp_slip": Truth(("step",), ("common",), ("workpiece", "structure"), own=False),
    "breathing": Truth(("wave",), ("common",)),
    "bow": Truth(("power",), ("x_", "y_")),
    "shear": Truth(("product",), ("x_",)),
    "parity": Truth(("heading 2",), ("heading",)),
    "pull": Truth(("force",), ("f",), ("structure", "tool")),
}


# effects that came to the library later and say just what these do (axis_error on machines of slides alone): it does without
KNOWN = {"disturbed_drive": ("disturbance",), "bow": ("axis_error",), "shear": ("axis_error",)}


class Experiment:
    """One machine with one law, driven along PATHS."""

    def __init__(self, effect: str, target: str, machine: str, seed: int, ratio: float, rows: int) -> None:
        self.effect, self.target, self.machine = effect, target, MACHINES[machine]
        rng = np.random.default_rng([seed, 21])
        clock, cut, self.runs = float(rng.integers(60, 300)), 0.0, []
        for i, name in enumerate(PATHS):
            run = Run(recording.load(name), i != AIR, round(clock, 1), cut)
            self.runs.append(run)
            cut += float(run.cuts.sum()) * recording.STEP_S / 60
            clock += run.last_s + float(rng.integers(60, PAUSE_S))
        self.plan = Plan(seed, "unknown", machine=machine, rows=rows, runs=len(PATHS), stated=True)
        self.times = [row_times(run, self.plan, True, rng) for run in self.runs]
        self.ways = Character()
        self.base = small_errors(Bench(self.plan, self.runs, self.ways), machine, set(), 3**0.5 * NOISE_MM, rng)
        middle = self.runs[1]
        span = (middle.started_s + 0.3 * middle.last_s, middle.started_s + 0.6 * middle.last_s)
        self.fault = None if effect in OWN or effect == "null" else strange(effect, target, 1.0, seed, span)
        self.size = 0.0
        if effect != "null":
            few = [run.last_s * (np.arange(FEW) + 0.5) / FEW for run in self.runs]
            plain = self.see(0.0, few)
            self.size = 1.0
            for _ in range(3):
                moved = [((a.tip - b.tip) ** 2).sum(1) for a, b in zip(self.see(self.size, few), plain, strict=True)]
                self.size *= ratio * NOISE_MM * 3**0.5 / max(float(np.sqrt(np.mean(np.concatenate(moved)))), 1e-9)

    def see(self, size: float, times: list[np.ndarray]) -> list[State]:
        """States with the law at that size."""
        faults = list(self.base)
        if self.fault is not None and size:
            faults.append(Fault(self.effect, self.target, {**self.fault.parameters, "size": size}))
        out = [observe(self.machine, r, Faults(faults), self.ways, t) for r, t in zip(self.runs, times, strict=True)]
        if self.effect in OWN:
            axis = "xyz".index(self.target)
            for s in out:
                s.tip[:, axis] += 0.03 * size * OWN[self.effect](s, axis)
        return out

    def write(self, folder: Path) -> list[np.ndarray]:
        """The experiment as a user would hand it in; the law's deviation of the tip (n, 3) mm at every row."""
        states, plain = self.see(self.size, self.times), self.see(0.0, self.times)
        write(Made(self.runs, states, {"runs": [{} for _ in self.runs]}), self.plan, folder)
        return [a.tip - b.tip for a, b in zip(states, plain, strict=True)]


def judged(effect: str, target: str, machine: str, seed: int, ratio: float, folder: Path, rows: int = 220) -> dict:
    """Makes one experiment, asks, and compares."""
    from camcomp.diagnosis.diagnose import diagnose
    from camcomp.diagnosis.experiment.open_experiment import open_experiment
    from camcomp.diagnosis.law.answer import answer_law, rms_um

    made = Experiment(effect, target, machine, seed, ratio, rows)
    own = made.write(folder)
    opened = open_experiment(folder / "experiment.yaml")
    began = time.process_time()
    done = diagnose(
        opened.job, opened.twin, opened.runs, without=KNOWN.get(effect, ()), stated_mm=opened.experiment.sd.tip_mm
    )
    row: dict = {
        "effect": effect, "target": target, "machine": machine, "seed": seed, "ratio": ratio,
        "verdict": done.result.verdict, "seconds": round(time.process_time() - began, 1),
        "causes": [(each.effect, each.target) for each in done.result.causes],
    }  # fmt: skip
    answer, law = done.law, done.result.law
    if effect == "null":  # the search for a law, although nobody asked for one
        forced = answer or answer_law(done.problem, done.search.sets.best, "tip")
        return {**row, "law": forced is not None, "formula": None if forced is None else forced.law.formula}
    gaps = [done.problem.bench.gap(k)[:, :3] for k in range(len(own))]
    if law is None or answer is None:
        return {**row, "law": False, "formula": None, "form": False, "place": False, "off": None}
    truth = TRUTH[effect]
    best = [g - at_rows(o, t, now) for g, o, t, now in zip(gaps, own, made.times, done.problem.times, strict=True)]
    before = rms_um(gaps)
    off = abs(law.after_rms_um - rms_um(best)) / before
    return {
        **row, "law": True, "kind": law.kind, "formula": law.formula, "off": off,
        "form": form_right(answer.found, truth), "place": place_right(law, truth, target),
    }  # fmt: skip


def at_rows(own: np.ndarray, times: np.ndarray, kept: np.ndarray) -> np.ndarray:
    """The kept rows (n, 3) of values at `times`."""
    return own[np.abs(times[:, None] - kept).argmin(axis=0)]


def form_right(found: object, truth: Truth) -> bool:
    """Whether the first and strongest terms are of the family of the truth, over its covariates."""
    terms = getattr(found, "terms", ())
    kinds = {t.form.family for t in terms if any(a.startswith(truth.about) for a in t.form.about)}
    return bool(kinds & set(truth.families)) and terms[0].form.family in {*truth.families, "line"}


def place_right(law: object, truth: Truth, target: str) -> bool:
    """Whether stage and axis are those of the truth."""
    at = {each.target or each.axis for each in law.parts}  # type: ignore[attr-defined]
    return law.on in truth.on and (target in at if truth.own else True) and (len(at) == 1 or not truth.own)  # type: ignore[attr-defined]


assert set(TRUTH) <= {*STRANGE, *OWN}
