"""Where results lie: one JSON per generator and code, written whole after every step, so that a run goes on where it stopped."""

from __future__ import annotations

import json
import os
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.validation.runner import ROOT

RESULTS = Path(__file__).parent / "results"
Result = dict[str, Any]


@dataclass(frozen=True)
class Code:
    """The code that is judged: the last commit that changed it, and its minute; `tree` names the content of camcomp, whatever the commit is called."""

    commit: str
    date: str
    tree: str


def _git(*words: str) -> str:
    return subprocess.run(["git", "-C", str(ROOT), *words], capture_output=True, text=True, check=True).stdout.strip()


def code() -> Code:
    """The code of this checkout; changes of camcomp that are not committed are marked by a plus sign."""
    changed = "+" if _git("status", "--porcelain", "--", "camcomp", "config") else ""
    commit, date = _git(
        "log", "-1", "--format=%h %cd", "--date=format:%Y-%m-%dT%H:%M", "--abbrev=10", "--", "camcomp", "config"
    ).split()
    return Code(commit + changed, date, _git("rev-parse", "--short=10", "HEAD:camcomp") + changed)


def all_of(generator: str) -> list[Result]:
    """Stored results of a generator, the oldest first."""
    found = [json.loads(path.read_text()) for path in (RESULTS / generator).glob("*.json")]
    return sorted(found, key=lambda each: (each["date"], each["first_seed"] or 0))


def opened(generator: str, first_seed: int | None) -> Result:
    """The result of this code: the stored one, or a new one that begins at the next free seed, at first_seed where none is used."""
    now = code()
    stored = all_of(generator)
    for each in stored:
        if each["tree"] == now.tree:
            return each
    seed = None if first_seed is None else max([first_seed, *(each["next_seed"] for each in stored)])
    return {
        "generator": generator,
        "commit": now.commit,
        "date": now.date,
        "tree": now.tree,
        "first_seed": seed,
        "next_seed": seed,
    }


def save(result: Result) -> None:
    """Write a result whole."""
    path = RESULTS / result["generator"] / f"{result['date'][:10]}-{result['tree'].replace('+', '-changed')}.json"
    path.parent.mkdir(parents=True, exist_ok=True)
    text = path.with_suffix(".tmp")
    text.write_text(json.dumps(result, indent=1) + "\n")
    os.replace(text, path)
