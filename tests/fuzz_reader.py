"""Throws mutated programs at the reader and the writer: python -m tests.fuzz_reader --count 1000000 --seed 1

Every input has to end in a path or in a ProgramError with a place, and soon. Accepted programs are also written,
unchanged and moved, and read again. One input in a hundred goes through `camcomp canon` and one in five hundred through
`camcomp compensate` and `verify`, which have to end in an exit code of the contract. Not part of the test run.

Guided by coverage: one input in ten (--trace) runs under a line tracer, and joins the corpus when it passes from one
line of the reader to another as none did before. So does every input that is refused at a place in the code where none
was refused before, or that is accepted with a new set of motion kinds. The corpus can be kept (--corpus) for a later
run to start from. Failures are counted by kind (failed, too slow, wrong exit code), and one input of each is kept.
"""

import argparse
import contextlib
import faulthandler
import hashlib
import io
import json
import signal
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from random import Random
from typing import Self

import numpy as np

from camcomp.gcode import flow
from camcomp.gcode.interpret import read_program
from camcomp.gcode.output import Output
from camcomp.gcode.rewrite import rewrite
from camcomp.gcode.setup import Setup
from camcomp.ground.errors import ProgramError, format_error
from camcomp.terminal.cli import run
from tests.displaced import divided, shifted
from tests.nc_writer import ProgramWriter

ROOT = Path(__file__).parent
SETUPS = (Setup(tools={1: 10.0}), Setup(increment_mm=0.001, skip_deleted=True, home_mm=(1.0, 2.0, 3.0)))
TOKENS = (  # noqa: SIM905
    "G0 G1 G2 G3 G4 G17 G18 G19 G20 G21 G28 G30 G40 G41 G43 G49 G52 G53 G54 G54.1 G55 G59.3 G65 G68 G80 G81 G83 G84 G87 "
    "G90 G90.1 G91 G91.1 G92 G92.1 G92.3 G93 G94 G95 G98 G99 G10 L2 L20 P1 P2 P0 X0 X1. Y-2 Z3.5 I1 J-1 K.5 R2 R-2 F100 "
    "S500 T1 M3 M6 M30 M98 M99 N10 O100 # #1 #<a> =[1+2] [ ] ( ) ; % / , . - + = 1e3 nan inf o1 while endwhile if else "
    "endif sub endsub call repeat endrepeat do break continue return GOTO10 WHILE[#1LT3]DO1 END1 IF[#1EQ#0]THEN CR=5 "
    'X=IC(1) I=AC(2) TURN=2 MSG("a") SUPA R1=2 @1 ^2 99999999999 0.0000001 \r \n \r\n \t \0 \x1a \xff \xd6'
).split(" ")
READER = str(ROOT.parent / "camcomp" / "gcode")
SLOWEST = 10  # s
DIALECTS = (None, None, "rs274", "rs274", "fanuc", "grbl", "sinumerik")


def corpus() -> list[bytes]:
    """Programs to start from."""
    files = [*ROOT.glob("golden/bad/*"), *ROOT.glob("golden/programs/*"), *ROOT.parent.glob("samples/*.nc")]
    inputs = [each.read_bytes() for each in sorted(files) if each.suffix != ".canon"]
    return inputs + [ProgramWriter(Random(seed)).program(12).encode() for seed in range(300)]


def mutate(random: Random, seeds: list[bytes]) -> bytes:
    """One new input from the seeds."""
    data = bytearray(random.choice(seeds))
    for _ in range(random.choice((1, 1, 1, 2, 2, 3, 5, 9))):
        at = random.randrange(len(data) + 1)
        kind = random.randrange(8)
        if kind == 0 and data:
            data[at % len(data)] = random.randrange(256)
        elif kind == 1:
            del data[at : at + random.choice((1, 1, 2, 5, 20))]
        elif kind == 2:
            data[at:at] = random.choice(TOKENS).encode("latin-1")
        elif kind == 3:
            data[at:at] = b" " + random.choice(TOKENS).encode("latin-1") + b" "
        elif kind == 4:
            other = random.choice(seeds)
            start = random.randrange(len(other) + 1)
            data[at:at] = other[start : start + random.choice((3, 20, 80))]
        elif kind == 5:
            lines = bytes(data).split(b"\n")
            random.shuffle(lines)
            data = bytearray(b"\n".join(lines))
        elif kind == 6:
            lines = bytes(data).split(b"\n")
            line = random.randrange(len(lines))
            lines[line:line] = [random.choice(lines)] * random.choice((1, 1, 3))
            data = bytearray(b"\n".join(lines))
        elif data:
            k = at % len(data)
            data[k : k + 1] = random.choice((b"0", b"9", b".", b"-", b"9999", b"\n", b"\r", b"[", b"]", b"#", b"("))
        if len(data) > 4000:
            del data[4000:]
    if random.random() < 0.01:
        return b"\xff\xfe" + bytes(data).decode("latin-1").encode("utf-16-le")[: random.choice((10**6, 11, 101))]
    return bytes(data)


def place_of(error: BaseException) -> str:
    """Where in the code an error was raised."""
    trace, places = error.__traceback__, []
    while trace is not None:
        places.append(f"{Path(trace.tb_frame.f_code.co_filename).name}:{trace.tb_lineno}")
        trace = trace.tb_next
    return "<".join(reversed(places[-4:]))


def attempt(data: bytes, random: Random) -> str:
    """Read, write and read again; what happened, in short."""
    setup, dialect = random.choice(SETUPS), random.choice(DIALECTS)
    try:
        program = read_program(data, name="fuzz.nc", setup=setup, dialect=dialect)
    except ProgramError as error:
        format_error(error)
        if error.at is None or error.at.line < 1 or error.at.column < 1:
            raise AssertionError("an error without a place") from error
        return place_of(error)
    path = program.path
    if not (np.isfinite(path.end).all() and np.isfinite(path.start).all() and np.isfinite(path.angle).all()):
        raise AssertionError("a path that is not finite")
    if (path.feed[path.kind > 0] < 0.0).any() or np.isnan(path.feed[path.kind > 0]).any():
        raise AssertionError("a feed that is none")
    if len(path) == 0:
        return f"ok {program.dialect} nothing"
    same = rewrite(program, Output.same(path), resolution_mm=1e-3, version="1")
    if len(same.data) - len(data) > 400:
        raise AssertionError("zero correction changed the program")
    change = divided if random.random() < 0.5 else shifted
    try:
        written = rewrite(program, change(path, random), resolution_mm=1e-3, version="1")
    except ProgramError as error:
        return "write " + place_of(error)
    try:
        after = read_program(written.data, name="out.nc", setup=setup, dialect=program.dialect)
    except ProgramError as error:
        raise AssertionError(f"what was written cannot be read: {format_error(error)}\n{written.data!r}") from error
    # Where a whole program was moved, its last motion has to lead where the writer says.
    if np.abs(after.path.end[-1] - written.end[-1]).max() > 1e-6:
        raise AssertionError(f"written end {written.end[-1]}, read {after.path.end[-1]}\n{written.data!r}")
    return f"ok {program.dialect} {sorted(set(path.kind.tolist()))} {program.straight}"


class Edges:
    """Passages from line to line of the reader that any input has made."""

    def __init__(self) -> None:
        self.seen: set[tuple[int, int, int]] = set()
        self._codes: dict[object, int] = {}  # also keeps them, so that none takes another's number

    def __enter__(self) -> Self:
        self.before = len(self.seen)
        sys.settrace(self._call)
        return self

    def __exit__(self, *_: object) -> None:
        sys.settrace(None)

    @property
    def grew(self) -> bool:
        """Whether the last input went a new way."""
        return len(self.seen) > self.before

    def _call(self, frame, event, argument):
        if not frame.f_code.co_filename.startswith(READER):
            return None
        code = self._codes.setdefault(frame.f_code, len(self._codes))
        last = 0

        def line(frame, event, argument):
            nonlocal last
            self.seen.add((code, last, frame.f_lineno))
            last = frame.f_lineno
            return line

        return line


def commands(data: bytes, everything: bool, folder: Path) -> None:
    """The same through the command line: nothing but exit codes of the contract, and never a traceback."""
    source, out = folder / "in.nc", folder / "out.nc"
    source.write_bytes(data)
    out.unlink(missing_ok=True)
    calls = [(["canon", str(source)], (0, 3))]
    if everything:
        config = ["--config", str(ROOT.parent / "config/cartesian.yaml")]
        calls.append((["compensate", str(source), *config, "-o", str(out)], (0, 1, 3, 4)))
        calls.append((["verify", str(out), "--against", str(source), *config], (0, 1)))
    for call, allowed in calls:
        if call[0] == "verify" and not out.exists():
            continue
        said = io.StringIO()
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(said):
            code = run(call)
        if code not in allowed:
            raise AssertionError(f"exit code {code} of {call[0]}: {said.getvalue()}")
        if "Traceback" in said.getvalue():
            raise AssertionError(f"a traceback of {call[0]}: {said.getvalue()}")


class TooSlow(BaseException):
    """A hang, for the one who looks on. No Exception: nothing that is tried may catch it."""


def too_long(number: int, frame: object) -> None:
    """Ends what takes too long, in processor time: the machine may have other things to do."""
    raise TooSlow(f"more than {SLOWEST} s")


def options() -> argparse.Namespace:
    """The result that the user expects."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--trace", type=float, default=0.1, help="share of inputs that runs under the tracer")
    parser.add_argument("--corpus", type=Path, help="folder with inputs to start from; new ones are added")
    parser.add_argument("--keep", type=Path, default=Path("out/fuzz"), help="folder for inputs that fail")
    return parser.parse_args()


def main() -> int:
    """Run, report, and keep every input that fails."""
    chosen = options()
    faulthandler.enable()
    signal.signal(signal.SIGPROF, too_long)
    # The limits that stop endless loops, lowered so that the run is spent on other things.
    flow._MOST_BLOCKS, flow._MOST_IDLE = 5_000, 2_000
    random, edges, seeds = Random(chosen.seed), Edges(), corpus()
    if chosen.corpus:
        chosen.corpus.mkdir(parents=True, exist_ok=True)
        seeds += [each.read_bytes() for each in sorted(chosen.corpus.iterdir())]
    seen: Counter[str] = Counter()
    kinds: Counter[str] = Counter()
    slowest, started = 0.0, time.monotonic()

    def report(number: int) -> None:
        failures = ", ".join(f"{count} {kind}" for kind, count in sorted(kinds.items())) or "0 failures"
        accepted = sum(count for result, count in seen.items() if result.startswith("ok"))
        print(
            f"{number} inputs, {number / (time.monotonic() - started):.0f}/s, {accepted} accepted, {len(seen)} outcomes, "
            f"{len(edges.seen)} edges, corpus {len(seeds)}, slowest {slowest:.2f} s, {failures}", flush=True,
        )  # fmt: skip

    with tempfile.TemporaryDirectory() as folder:
        commands((ROOT.parent / "samples/groove-circle-2.nc").read_bytes(), True, Path(folder))  # compiles the solver
        for number in range(chosen.count):
            data = mutate(random, seeds)
            traced = random.random() < chosen.trace
            state = random.getstate()
            signal.setitimer(signal.ITIMER_PROF, SLOWEST)
            begun = time.process_time()
            try:
                with edges if traced else contextlib.nullcontext():
                    result = attempt(data, random)
                if random.random() < 0.01:
                    commands(data, random.random() < 0.2, Path(folder))
            except (Exception, TooSlow) as error:  # noqa: BLE001
                kind = "too slow" if isinstance(error, TooSlow) else "failed"
                kinds["wrong exit code" if str(error).startswith("exit code") else kind] += 1
                result = f"FAILED {type(error).__name__} {place_of(error)}"
                if result not in seen:
                    chosen.keep.mkdir(parents=True, exist_ok=True)
                    (chosen.keep / f"{chosen.seed}-{number}.nc").write_bytes(data)
                    (chosen.keep / f"{chosen.seed}-{number}.json").write_text(json.dumps(state))
                    print(f"{number}: {result}: {str(error)[:600]}\n  {data!r}"[:3000], flush=True)
            finally:
                signal.setitimer(signal.ITIMER_PROF, 0)
            slowest = max(slowest, time.process_time() - begun)
            new = result not in seen or (traced and edges.grew)
            if new and not result.startswith("FAILED") and len(data) < 3000:
                seeds.append(data)
                if chosen.corpus:
                    (chosen.corpus / f"{hashlib.sha256(data).hexdigest()[:16]}.nc").write_bytes(data)
            seen[result] += 1
            if number % 20_000 == 19_999:
                report(number + 1)
    report(chosen.count)
    return 1 if kinds else 0


if __name__ == "__main__":
    sys.exit(main())
