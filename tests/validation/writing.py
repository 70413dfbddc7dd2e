"""The command line that all generators have: which experiments to write, and where."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path

from tests.validation.recordings import recording


def write_all(
    module: str, make: Callable[[int, Path, str | None], object], option: str, choices: Sequence[str]
) -> None:
    """Writes the experiments that are not there yet, by make(seed, out, choice); the truth of each comes last."""
    parser = argparse.ArgumentParser(prog=f"python -m {module}")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--count", type=int, required=True)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument(option, choices=choices, dest="only")
    parser.add_argument("--recordings", choices=recording.SETS, default="pockets")
    given = parser.parse_args()
    with recording.taken_from(given.recordings):
        _write(make, given)


def _write(make: Callable[[int, Path, str | None], object], given: argparse.Namespace) -> None:
    for seed in range(given.seed, given.seed + given.count):
        if not (given.out / "truth" / f"e-{seed}.json").exists():
            said = make(seed, given.out, given.only)
            print(said or f"e-{seed}", flush=True)
