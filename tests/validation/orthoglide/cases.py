"""Experiments of the campaign, and the demands on the answer."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tests.validation.plants import unmodelled
from tests.validation.plants.causes import KINDS, Cause, every_cause
from tests.validation.plants.experiments import Plan

WORLDS = 16  # sets of programs; what can absorb what is computed once per world

# Pairs that no log of the given kind can tell apart: (true cause, the other, design, channels).
EQUAL: list[tuple[tuple[str, str | None], tuple[str, str | None], str, str]] = [
    (("servo_lag", None), ("time_sync", None), "both-ways", "tip"),
    (("time_sync", None), ("servo_lag", None), "six", "tip"),
    (("tool_length", None), ("workpiece_frame", None), "six", "all"),
    (("tool_length", None), ("workpiece_frame", None), "both-ways", "tip"),
    (("joint_offset", "x"), ("link_length", "x"), "circle", "all"),
    (("link_length", "y"), ("joint_offset", "y"), "both-ways", "all"),
    (("joint_offset", "z"), ("link_length", "z"), "four", "no-forces"),
]


@dataclass(frozen=True)
class Case:
    """One experiment and the question put to the tool."""

    name: str
    category: str  # single, pair, null, foreign, withheld, equal, poor
    plan: Plan
    without: tuple[str, ...] = ()
    twin: tuple[str, str | None] | None = None  # the other member of an equal pair

    @property
    def ratio(self) -> float:
        """Size of the first cause over the noise, 0 when there is none."""
        return self.plan.ratios[0] if self.plan.ratios else 0.0


def _seeds(start: int) -> Iterator[int]:
    n = start
    while True:
        yield n
        n += 1


def _cause(pair: tuple[str, str | None], seed: int) -> Cause:
    return Cause(pair[0], pair[1], seed)


def build(scale: float = 1.0, seed: int = 20_000) -> list[Case]:
    """All cases; scale 1 puts at least 200 experiments behind every rate, smaller values thin evenly."""
    seeds, cases = _seeds(seed), []
    every = every_cause()
    rng = np.random.default_rng(seed)

    def add(category: str, pairs, ratios, without=(), design="six", channels="all", twin=None) -> None:
        s = next(seeds)
        causes = tuple(_cause(p, s + 7919 * (i + 1)) for i, p in enumerate(pairs))
        plan = Plan(s, causes, tuple(ratios), design, channels, world=1 + s % WORLDS)
        cases.append(Case(f"{category}-{s}", category, plan, tuple(without), twin))

    def times(count: float) -> int:
        return max(1, round(count * scale))

    for ratio, total in ((0.3, 100), (1.0, 200), (3.0, 240), (10.0, 240)):
        for i in range(times(total)):
            add("single", [every[(i * 7) % len(every)]], [ratio])
    for i in range(times(240)):
        a = every[(i * 11) % len(every)]
        others = [p for p in every if p[0] != a[0]]
        b = others[int(rng.integers(len(others)))]
        add("pair", [a, b], [3.0, float(rng.choice([3.0, 6.0, 9.0]))])
    for _ in range(times(240)):
        add("null", [], [])
    names = sorted(unmodelled.NAMES)
    for ratio in (3.0, 10.0):
        for i in range(times(240)):
            name = names[i % len(names)]
            add("foreign", [(name, "xyz"[int(rng.integers(3))])], [ratio])
        effects = sorted(KINDS)
        for i in range(times(240)):
            name = effects[i % len(effects)]
            members = [p for p in every if p[0] == name]
            add("withheld", [members[int(rng.integers(len(members)))]], [ratio], without=[name])
    for i in range(times(210)):
        true, other, design, channels = EQUAL[i % len(EQUAL)]
        add("equal", [true], [float(rng.choice([3.0, 10.0]))], design=design, channels=channels, twin=other)
    poorer = [("circle", "all"), ("both-ways", "all"), ("four", "all"), ("six", "tip"), ("six", "encoders")]
    poorer += [("six", "no-forces"), ("six", "no-setpoints"), ("circle", "tip")]
    visible = [p for p in every if p[0] in ("servo_lag", "friction", "gravity", "cutting_force", "tool_wear")]
    for i in range(times(240)):
        design, channels = poorer[i % len(poorer)]
        pool = visible if channels == "encoders" else every
        add("poor", [pool[int(rng.integers(len(pool)))]], [3.0], design=design, channels=channels)
    return cases
