"""`python -m tests.foreign.axes --out DIR --count N --seed S [--kind KIND]`."""

from __future__ import annotations

import argparse
from pathlib import Path

from tests.foreign.axes.make import KINDS, make


def main() -> None:
    """Writes the experiments that are not there yet; the truth of each is written last."""
    parser = argparse.ArgumentParser(prog="python -m tests.foreign.axes")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--count", type=int, required=True)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--kind", choices=KINDS)
    given = parser.parse_args()
    for seed in range(given.seed, given.seed + given.count):
        if not (given.out / "truth" / f"e-{seed}.json").exists():
            make(seed, given.out, given.kind)
            print(f"e-{seed}", flush=True)


if __name__ == "__main__":
    main()
