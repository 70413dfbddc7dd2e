"""Compensates the programs of programs.py and records what LinuxCNC makes of them: `python -m tests.control.record`.

Needs what tests/validation/recordings/record.py needs, whose machine it uses. `--long DIR` records every program of the long version there.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np

from camcomp.compensation.program.compensate import compensate
from camcomp.ground.datatypes import RAPID
from camcomp.model.control import program_of
from tests.control import driven
from tests.control.programs import LONG, SHORT, arcs, source
from tests.validation.recordings import record as recorder

AT_ONCE = 8  # programs of one LinuxCNC


def prepared(names: list[str]) -> dict[str, dict[str, np.ndarray]]:
    """The corrected programs with their end points."""
    machine = driven.job()
    out = {}
    for name in names:
        program = program_of(source(name).encode(), f"{name}.nc", machine.config)
        done = compensate(program, machine, method="newton", tolerance_um=1.0, version="1", arcs=arcs(name))
        rows = done.rows
        out[name] = {
            "program": np.frombuffer(done.written.data, np.uint8),
            "cut": (rows.kind != RAPID) & ~rows.joining & rows.force.any(axis=1),
            "target": np.round(rows.target, 6),
            "force": np.round(machine.frame.vectors(rows.force), 3),
        }
    return out


def record(names: list[str], folder: Path) -> None:
    """Records the named programs into a folder. Raises RuntimeError where LinuxCNC left no samples."""
    for a in range(0, len(names), AT_ONCE):
        some = prepared(names[a : a + AT_ONCE])
        with tempfile.TemporaryDirectory() as place:
            work = Path(place)
            recorder.write_machine(work)
            jobs = []
            for name, parts in some.items():
                (work / f"{name}.nc").write_bytes(parts["program"].tobytes())
                jobs.append(
                    {"program": str(work / f"{name}.nc"), "samples": str(work / f"{name}.samples"), "events": []}
                )
            said = recorder.run(work, jobs)
            for name, parts in some.items():
                samples = work / f"{name}.samples"
                if not samples.exists():
                    raise RuntimeError(f"{name}: nothing was recorded\n{said[-2000:]}")
                tip = recorder.shorten(recorder.samples(samples))[:, :3]
                whole = np.round(tip / driven.QUANTUM_MM).astype(np.int64)
                bend = np.diff(whole, n=2, axis=0)
                assert np.abs(bend).max() < 2**15
                driven.Driven(**parts, begin=whole[:2], bend=bend.astype(np.int16)).save(name, folder)
                print(f"{name}: {len(tip) * driven.STEP_S:.2f} s", flush=True)


def main() -> int:
    """Records the short version into data/, or the long one elsewhere."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help="default: all")
    parser.add_argument("--long", type=Path, help="record the long version into this folder")
    chosen = parser.parse_args()
    record(chosen.names or (LONG if chosen.long else SHORT), chosen.long or driven.HERE / "data")
    return 0


if __name__ == "__main__":
    sys.exit(main())
