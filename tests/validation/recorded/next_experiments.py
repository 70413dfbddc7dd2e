"""Is the next experiment well designed? The information of designs on the truth plant, compared with random ones and a fine grid.

A question is one of two causes that runs could not tell apart well. On the plant (tests.validation.plants.machine: it shares neither model nor
linearisation with camcomp) both are put into one machine, the second as large as it has to be to look like the first on the runs.
What a design tells is the mutual information, bits, between the cause and the plant's log, with the plant's noise (coloured,
an offset of the run), and the sizes of both causes as uncertain as the runs leave them. Its value is that less half a bit for
every hour of machine time. camcomp designs from the files alone.

    python -m tests.validation.recorded.next_experiments            # all questions, a fine grid, 60 random designs: some minutes
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from pathlib import Path

import numpy as np

from camcomp.diagnosis.experiment.open_experiment import open_experiment
from camcomp.diagnosis.fit.bench import Bench
from camcomp.diagnosis.fit.columns import candidate_causes, working_causes
from camcomp.diagnosis.fit.lookalikes import without_lookalikes
from camcomp.diagnosis.fit.open_problem import open_problem
from camcomp.diagnosis.next_experiment.design import MotionDesign
from camcomp.diagnosis.next_experiment.designed import propose
from camcomp.diagnosis.next_experiment.predicted_logs import Question
from tests.validation import runner
from tests.validation.plants.causes import Cause
from tests.validation.plants.experiments import Noise, Plan, even, make, middle, observe_all, size, small_errors, write
from tests.validation.plants.machine import Run, State
from tests.validation.plants.motion import Timeline, read

PRICE = 0.5 / 60.0  # bits a minute
NOISE = Noise()
MEMORY = 0.82  # of the plant's coloured noise, in the middle
FEW, MOST = 40, 200  # rows of a log
POINTS = 16  # of a log that are worked out: what these causes change is smooth along the way
QUESTIONS = (
    (("link_length", "y"), ("screw_pitch", "y"), 1.5),
    (("link_length", "y"), ("chain_error", "y"), 1.0),
    (("screw_pitch", "x"), ("link_length", "x"), 1.0),
    (("drive_stiffness", "x"), ("tool_deflection", None), 1.0),
    (("joint_offset", "x"), ("chain_error", "x"), 1.0),
)


@dataclass(frozen=True)
class World:
    """A machine that ran a plan, and its states with either of two causes."""

    plan: Plan
    other: Cause

    @cached_property
    def made(self):
        return make(self.plan)

    @cached_property
    def truths(self):
        """The machine without the cause, with it, and with the other one in its stead."""
        runs, span = self.made.runs, middle(self.made.runs)
        clean = small_errors(np.random.default_rng([self.plan.seed, 7]), self.plan.nuisance)
        [cause], [ratio] = self.plan.causes, self.plan.ratios
        one = cause.put(clean, size(self.plan, runs, clean, cause, ratio), span)[0]
        small = self.other.unit()
        moved = self._over_runs(clean, self.other.put(clean, small, span)[0])
        wanted = self._over_runs(clean, one)
        share = float(moved @ wanted / (moved @ moved))
        return clean, one, self.other.put(clean, share * small, span)[0]

    def _over_runs(self, a, b):
        times = [even(run, 60) for run in self.made.runs]
        states = zip(observe_all(self.made.runs, a, times), observe_all(self.made.runs, b, times), strict=True)
        return np.concatenate([whitened(_change(*each)) for each in states])

    @cached_property
    def unsure(self):
        """Relative standard deviations of the sizes of both causes after the runs."""
        clean, *both = self.truths
        return [1.0 / float(np.linalg.norm(self._over_runs(clean, each))) for each in both]

    def tells(self, design: MotionDesign) -> float:
        """Bits of one log between the causes."""
        last = self.made.runs[-1]
        run = Run(Timeline(read(design.program("design"))), design.cutting, last.started_s + 900.0, last.cut_before_min)
        rows = int(np.clip(len(self.made.states[-1].t) * run.timeline.log_end / last.timeline.log_end, FEW, MOST))
        clean, one, two = (observe_all([run], each, [even(run, POINTS)])[0] for each in self.truths)
        a, b = (whitened(_over_rows(_change(clean, each), rows)) for each in (one, two))
        free = np.stack([self.unsure[0] * a, self.unsure[1] * b], axis=1)
        gap = a - b
        left = gap - free @ np.linalg.solve(free.T @ free + np.eye(2), free.T @ gap)
        return told_of_two(max(float(gap @ left), 0.0))

    def value(self, design: MotionDesign) -> float:
        """Bits less the price of the time."""
        return self.tells(design) - PRICE * design.minutes


def _change(a: State, b: State) -> np.ndarray:
    """Change (n, 6) of tip and encoders, mm."""
    return np.concatenate([b.tip - a.tip, b.encoder - a.encoder], axis=1)


def _over_rows(change: np.ndarray, rows: int) -> np.ndarray:
    at, there = (np.arange(rows) + 0.5) / rows, (np.arange(len(change)) + 0.5) / len(change)
    return np.stack([np.interp(at, there, each) for each in change.T], axis=1)


def whitened(change: np.ndarray) -> np.ndarray:
    """White rows of a change (n, 6): coloured noise and an offset of the run in the tip, white noise in the encoders."""
    n, noise = len(change), NOISE
    away = np.abs(np.subtract.outer(np.arange(n), np.arange(n)))
    covariance = 0.5 * noise.tip**2 * (MEMORY**away + np.eye(n)) + noise.offset**2
    tip = np.linalg.solve(np.linalg.cholesky(covariance), change[:, :3])
    return np.concatenate([tip.ravel(), change[:, 3:].ravel() / noise.encoder])


def told_of_two(square: float) -> float:
    """Mutual information, bits, between one of two equally likely causes and a log in which they are `square` apart (chi-square)."""
    z = np.linspace(-8.0, 8.0, 2001)
    log_odds = 0.5 * square + np.sqrt(square) * z
    weight = np.exp(-0.5 * z**2)
    return float(1.0 - np.sum(weight * np.logaddexp(0.0, -log_odds)) / np.sum(weight) / np.log(2.0))


def opened_question(folder: Path, world: World) -> Question:
    """What camcomp makes of the files of a world, asked about the two causes."""
    opened = open_experiment(write(world.made, world.plan, folder, runner.CONFIG))
    bench = Bench(twin=opened.twin, runs=opened.runs)
    causes = without_lookalikes(bench, working_causes(bench, candidate_causes(opened.twin.robot)))
    problem = open_problem(bench, causes)
    names = [(world.plan.causes[0].effect, world.plan.causes[0].target), (world.other.effect, world.other.target)]
    at = [next(i for i, c in enumerate(problem.columns.candidates) if (c.name, c.target) == name) for name in names]
    return Question(problem, [problem.refit((i,)) for i in at], np.array([0.5, 0.5]), opened.job)


def random_designs(question: Question, count: int, seed: int) -> list[MotionDesign]:
    """Designs that the machine can do, drawn evenly over place, plane, radius, feed, direction and load."""
    rng = np.random.default_rng(seed)
    site, out = question.site, []
    while len(out) < count:
        feed = site.work.feed * 4.0 ** rng.uniform(-1.0, 1.0)
        turns = [(1,), (-1,), (1, -1)][rng.integers(3)]
        if rng.uniform() < 0.25:
            centre, radius = site.cut.centre, site.cut.radius * rng.uniform(0.2, 1.0)
            design = MotionDesign(
                centre=tuple(centre),
                radius=radius,
                feed=site.cut.feed * rng.uniform(0.5, 1.5),
                turns=turns,
                cutting=True,
            )
        else:
            centre = site.work.centre + site.farther * rng.uniform(-1.0, 1.0, 3)
            way = rng.normal(size=3)
            line = tuple(way / np.linalg.norm(way)) if rng.uniform() < 0.25 else None
            plane = ("XY", "XZ", "YZ")[rng.integers(3)]
            design = MotionDesign(
                centre=tuple(centre),
                radius=3.0 * (site.farther / 3.0) ** rng.uniform(),
                feed=feed,
                plane=plane,
                turns=turns,
                along=line,
            )
        if allowed(question, design):
            out.append(design.tidy())
    return out


def every_design(question: Question, steps: int) -> list[MotionDesign]:
    """A grid over places (steps each way), planes, radii, feeds, lines, and cuts."""
    site, out = question.site, []
    at = np.linspace(-0.9, 0.9, steps) * site.farther
    up = np.linspace(0.0, 0.9, (steps + 1) // 2) * site.farther
    feeds = site.work.feed * np.array([0.5, 1.5] if steps > 3 else [0.7])
    radii = site.farther * np.array([0.2, 0.45, 0.7, 0.9] if steps > 3 else [0.3, 0.8])
    for x, y, z, radius, plane, feed in product(at, at, up, radii, ("XY", "XZ", "YZ"), feeds):
        centre = site.work.centre + [x, y, z + (0.0 if plane == "XY" else radius)]
        out.append(MotionDesign(centre=tuple(centre), radius=float(radius), feed=float(feed), plane=plane))
    for way in ((1, 0, 0), (0, 1, 0), (1, 1, 0), (1, -1, 0)):
        unit = np.array(way) / np.linalg.norm(way)
        out += [
            MotionDesign(centre=tuple(site.work.centre), radius=float(r), feed=float(f), along=tuple(unit))
            for r in radii
            for f in feeds
        ]
    for share, feed in product((0.3, 0.6, 1.0), (0.5, 1.0, 1.5)):
        out.append(
            MotionDesign(
                centre=tuple(site.cut.centre), radius=share * site.cut.radius, feed=feed * site.cut.feed, cutting=True
            )
        )
    return [each.tidy() for each in out if allowed(question, each)]


def allowed(question: Question, design: MotionDesign) -> bool:
    """Whether the machine can run it without a collision."""
    return question.site.holds(design.points()) and (
        design.cutting or design.points()[:, 2].min() >= question.site.low - 0.05
    )


def world_of(question, seed: int = 61) -> World:
    """The machine of a question: it has the first cause and drove one circle."""
    (effect, target), (other, at), ratio = question
    plan = Plan(seed, (Cause(effect, target, 5),), (ratio,), "circle", "no-forces", 120)
    return World(plan, Cause(other, at, 5))


def compare(question, folder: Path, *, steps: int, random: int) -> dict[str, float]:
    """Values of what camcomp designs, of random designs in the mean, of the best of a grid."""
    world = world_of(question)
    asked = opened_question(folder, world)
    chosen = propose(asked.problem, asked.rivals, asked.probability, asked.job)
    assert chosen is not None and not chosen.candidate.knows
    by_chance = [world.value(each) for each in random_designs(asked, random, 5)]
    grid = every_design(asked, steps)
    values = [world.value(each) for each in grid]
    best = int(np.argmax(values))
    return {
        "designed": world.value(chosen.candidate.design), "expected": chosen.value, "random": float(np.mean(by_chance)),
        "best of random": max(by_chance), "brute force": values[best], "tried": len(grid),
        "it": chosen.candidate.action, "brute": grid[best].action,
    }  # fmt: skip


def main() -> None:
    """Prints a row per question."""
    steps = int(sys.argv[1]) if len(sys.argv) > 1 else 5
    with tempfile.TemporaryDirectory() as folder:
        for k, question in enumerate(QUESTIONS):
            found = compare(question, Path(folder) / str(k), steps=steps, random=60)
            print(question, {n: round(v, 3) if isinstance(v, float) else v for n, v in found.items()}, flush=True)


if __name__ == "__main__":
    main()
