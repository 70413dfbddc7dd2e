"""`python -m tests.foreign.poses --out DIR --count N --seed S [--machine NAME]`."""

from __future__ import annotations

import argparse
from pathlib import Path

from tests.foreign.poses.make import MACHINES, make


def main() -> None:
    """Writes the experiments that are not there yet; the truth of each is written last."""
    parser = argparse.ArgumentParser(prog="python -m tests.foreign.poses")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--count", type=int, required=True)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--machine", choices=MACHINES)
    given = parser.parse_args()
    for seed in range(given.seed, given.seed + given.count):
        if not (given.out / "truth" / f"e-{seed}.json").exists():
            make(seed, given.out, given.machine)
            print(f"e-{seed}", flush=True)


if __name__ == "__main__":
    main()
