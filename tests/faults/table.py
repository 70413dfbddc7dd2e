"""The trials of every kind, counted."""

import random
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

from tests.faults.judge import Project
from tests.faults.kinds import KINDS


@dataclass
class Count:
    """Of one kind: trials, those whose fault met a living process, and what was lost."""

    tried: int = 0
    hit: int = 0
    lost: list[str] = field(default_factory=list)


def campaign(minutes, seed, only=(), tell=print):
    """Trials for so many minutes, every kind its share: counts by kind. minutes 0: the short version."""
    counts = {name: Count() for name in KINDS if not only or any(each in name for each in only)}
    spent = dict.fromkeys(counts, 0.0)
    start = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="camcomp-faults-") as folder:
        project = Project(Path(folder))
        assert project.expected
        while name := _next(counts, spent, minutes, time.monotonic() - start):
            count, began = counts[name], time.monotonic()
            rng = random.Random(f"{seed} {name} {count.tried}")
            verdict = KINDS[name][0](rng, project)
            spent[name] += time.monotonic() - began
            count.tried += 1
            count.hit += verdict.hit
            if verdict.lost:
                count.lost.append(verdict.lost)
                tell(f"lost: {name}, trial {count.tried - 1}: {verdict.lost}")
    return counts


def _next(counts, spent, minutes, elapsed):
    """The kind whose turn it is, None at the end."""
    if not minutes:
        return next((name for name, count in counts.items() if count.tried < KINDS[name][1]), None)
    untried = [name for name, count in counts.items() if not count.tried]
    if elapsed > 60.0 * minutes and not untried:
        return None
    return min(untried or counts, key=lambda name: spent[name] / KINDS[name][2])


def render(counts):
    """The table for the README."""
    lines = ["| fault | tried | hit | survived | lost |", "|---|---|---|---|---|"]
    rows = [(name, c.tried, c.hit, c.tried - len(c.lost), len(c.lost)) for name, c in counts.items()]
    rows.append(("all", *(sum(row[k] for row in rows) for k in range(1, 5))))
    return "\n".join([*lines, *("| " + " | ".join(map(str, row)) + " |" for row in rows)])
