"""Long programs: read, corrected and written piece by piece, in constant memory.

Every piece is corrected by compensate.py. On runs of linear moves, and on all of a program whose machine file states effects
or uncertain numbers, the machine answers by interpolation between exact solutions (answers.py). At the end a random sample of the interpolated rows is solved exactly, and the largest difference is part
of the result.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TYPE_CHECKING, BinaryIO

import numpy as np

from camcomp.compensation.long.answers import MOST_CHECKED, with_answers
from camcomp.compensation.long.runs import NotInPieces, ProgramRun, Runs
from camcomp.compensation.program.compensate import compensate
from camcomp.compensation.program.moves import minutes_of
from camcomp.compensation.program.totals import JointTableRows, Totals
from camcomp.gcode.output import Part, Standing
from camcomp.gcode.program import Program
from camcomp.gcode.setup import Setup
from camcomp.gcode.stamp import is_stamped, stamp_index, stamp_text
from camcomp.gcode.text import Text
from camcomp.gcode.uncorrected import UncorrectedFeeds
from camcomp.ground import path_geometry
from camcomp.ground.datatypes import LINE, RAPID, Path
from camcomp.ground.errors import CheckFailed, FileError, Location
from camcomp.ground.progress import done
from camcomp.ground.progress import part as part_of_work
from camcomp.ground.records import dataclass, replace
from camcomp.model.cutting.engaged import Engaged
from camcomp.model.job import Job

if TYPE_CHECKING:
    from camcomp.model.stock.memory import StockMemory

HASHED = 1 << 20  # bytes at once
LINE_OF_STAMP, LINE_BYTES = 256, 24.0  # bytes; of a stamp at most, of a line of a program about
NEAR = 1e-3  # mm: only the direction of a neighbour matters, and on which side of the stock's top it is


@dataclass(eq=False, kw_only=True)
class LongProgram:
    """One long program. `on_rows` gets every batch of rows, in order; `totals` hold the figures at the end."""

    job: Job
    name: str
    setup: Setup
    tolerance_um: float
    version: str
    arcs: bool | None = None
    on_rows: Callable[[JointTableRows], None] | None = None

    def run(self, source: BinaryIO, sink: Callable[[bytes], object]) -> Totals:
        """Reads the seekable source twice: once for its hash. Raises NotInPieces before or in the middle of writing.

        Raises FileError CC500 for a source that is another one when it is read again.
        """
        digest, size, lines, rest = hashlib.sha256(), 0, 0, b""
        while block := source.read(HASHED):
            digest.update(block)
            size += len(block)
            lines += _count_of(b"\n", block)
            if (
                b":" in (seen := rest + block) and b"sha256:" in seen and is_stamped(seen)
            ):  # a single byte is found faster
                raise CheckFailed("CC603", f"{self.name} was compensated before")
            rest = block[-LINE_OF_STAMP:]
        source.seek(0)
        x, y, z = map(float, self.setup.start_mm)
        self._output = Standing((x, y, z))
        self._told: Future[None] = Future()
        self._told.set_result(None)
        self.totals = Totals(self.job, self.name, tolerance_um=self.tolerance_um, tabled=self.on_rows is not None)
        self.totals.null = ("interpolation",)
        self._feeds = UncorrectedFeeds(self.name)
        if self.job.conditions.model is not None and not self.job.conditions.steady:
            raise NotInPieces
        self._minutes = 0.0  # of the pieces so far
        self._random = np.random.default_rng(
            int(digest.hexdigest()[:16], 16)
        )  # the program decides which rows are proved
        self._share = min(1.0, 3.0 * MOST_CHECKED * LINE_BYTES / max(size, 1))
        self._sample = [np.zeros((0, 6))]  # target (3) mm and force (3) N of corrected rows, machine frame
        self._lines = max(lines, 1)
        self.totals.lines_in = lines
        self._stock = _stock_of(self.job, source, self.name, self.setup)
        self._runs = Runs(source=source, name=self.name, setup=self.setup, dialect=self.job.config.control.dialect)
        self._stamp: str | None = stamp_text(digest.hexdigest(), self.version, self.job.fingerprint)
        self._interpolated = with_answers(self.job)
        with ThreadPoolExecutor(1) as self._beside:
            for data in self._pieces():
                self.totals.lines_out += _count_of(b"\n", data)
                sink(data)
            self._told.result()
        totals, runs = self.totals, self._runs
        if runs.digest.digest() != digest.digest():
            raise FileError("CC500", f"cannot read {self.name}: it changed meanwhile", hint="run the command again")
        if self._stock is not None:
            from camcomp.model.stock.follow import refuse_untouched

            refuse_untouched(self.job.config, self._stock)
        read = [*runs.warnings, *self._feeds.warnings(), *runs.behind_end]
        totals.finish(runs.language, read, runs.waiting_s(self.job.config))
        target, force = np.split(np.concatenate(self._sample), [3], axis=1)
        totals.interpolated, iterations = self._interpolated.real_machine.answers.proof(target, force)
        totals.iterations = max(totals.iterations, iterations)
        return totals

    # --- order ---------------------------------------------------------------------------------------------------

    def _pieces(self) -> Iterator[bytes]:
        """The corrected program. A piece waits until the motion behind it is known."""
        current: _Piece | None = None
        behind: list[bytes] = []
        before: _Piece | None = None
        for item in self._runs:
            if isinstance(item, bytes) or not item.motions:
                behind.append(item if isinstance(item, bytes) else item.text)
                if current is None:
                    yield from map(self._stamped, behind)
                    behind = []
                continue
            piece = _Piece(item, self._runs)
            done(item.row0 / self._lines)
            if current is not None:
                self._follow(current, piece)
                yield self._stamped(self._corrected(current, before, piece))
                yield from behind
                behind, before = [], current
            current = piece
        if current is not None:
            self._follow(current, None)
            yield self._stamped(self._corrected(current, before, None))
        yield from behind

    def _follow(self, piece: _Piece, after: _Piece | None) -> None:
        """Leads a piece, and only then, through the stock."""
        if self._stock is None:
            return
        from camcomp.model.stock.follow import refuse_crashes

        n, paths = len(piece.path), [piece.path]
        if after is not None:
            paths.append(after.path.take(np.arange(after.ends[0] + 1)))
        both = Path.joined(paths)
        found, crashes = self._stock.follow(both, ahead=len(both) - n)
        refuse_crashes(piece.path, crashes, lambda line: Location(self.name, line, 1))
        piece.engaged = found.of_motions(0, n)
        if after is not None:
            after.engaged = found.of_motions(n, len(both))

    def _stamped(self, data: bytes) -> bytes:
        if self._stamp is None or not data:
            return data
        text = Text.read(data[:HASHED], self.name)
        at, end = stamp_index(text), text.end_of_line(0).encode("latin-1")
        opening, closing = (each.encode() for each in self._runs.language.comment)
        stamp, self._stamp = opening + self._stamp.encode() + closing + end, None
        return data[:at] + stamp + data[at:]

    def _corrected(self, piece: _Piece, before: _Piece | None, after: _Piece | None) -> bytes:
        """A piece, with the ends of the motions on either side in sight.

        Machines without effects are interpolated along linear moves only; other lines are few.
        """
        by_points = bool(self.job.config.uncertain or self.job.causes)
        job = self._interpolated if by_points or piece.run.linear is not None else self.job
        first = int(before is not None)
        part = Part(first, first + len(piece.path), self._output)
        program = piece.between(before, after)
        here = piece.run.row0 / self._lines
        minutes = minutes_of(self.job, program.path) if self.job.causes else np.zeros(len(program.path))
        began = self._minutes - float(minutes[:first].sum())
        self._minutes += float(minutes[part.first : part.last].sum())
        with part_of_work(here, here):
            result = compensate(
                program, job, method="newton", tolerance_um=self.tolerance_um, version=self.version, part=part,
                arcs=self.arcs, began_min=began, engaged=self._engagement_of(piece, before, after),
            )  # fmt: skip
        self._feeds.add(piece.path)
        own = slice(*np.searchsorted(result.rows.motion, (part.first, part.last)).tolist())
        assert result.written.behind is not None
        self._output = result.written.behind

        def add_up() -> None:
            rows = self.totals.add(result, own, part)
            if job is not self.job:
                drawn = result.rows.corrected[own] & (self._random.random(len(rows.s)) < self._share)
                target = self.job.frame.to_machine(rows.target[drawn])
                self._sample.append(np.concatenate((target, rows.force[drawn]), axis=1))
            if self.on_rows is not None:
                self.on_rows(rows)

        self._told.result()
        self._told = self._beside.submit(add_up)  # while the next piece is computed; one at a time, in order
        return result.written.data

    def _engagement_of(self, piece: _Piece, before: _Piece | None, after: _Piece | None) -> Engaged | None:
        """Engagement on a piece, at the end of the motion in front of it, and at the begin of that behind it."""
        if piece.engaged is None:
            return None
        first = int(before is not None)
        parts = [replace(piece.engaged, motion=piece.engaged.motion + first)]
        if before is not None and before.engaged is not None:
            parts.insert(0, _still(before.engaged.of_motions(before.ends[1], before.ends[1] + 1), -1, 0))
        if after is not None and after.engaged is not None:
            behind = first + len(piece.path)
            parts.append(_still(after.engaged.of_motions(after.ends[0], after.ends[0] + 1), 0, behind))
        return Engaged.joined(parts)


def _count_of(byte: bytes, data: bytes) -> int:
    """How often a byte occurs; for frequent ones faster than `count`."""
    return int(np.count_nonzero(np.frombuffer(data, np.uint8) == ord(byte)))


def _stock_of(job: Job, source: BinaryIO, name: str, setup: Setup) -> StockMemory | None:
    """The stock; the program is read here where it depends on its bounds or tools. None: there is no stock."""
    stock = job.config.workpiece.stock
    if stock is None:
        return None
    from camcomp.model.stock.from_config import Bounds, memory_of  # only those with a stock wait for it
    from camcomp.model.stock.tool_frame import tool_frame_of

    bounds = Bounds()
    if stock.type == "program" or job.config.tools:
        runs = Runs(source=source, name=name, setup=setup, dialect=job.config.control.dialect)
        for run in runs:
            if isinstance(run, ProgramRun) and run.linear is not None and stock.type != "program":
                if (run.linear.kind != RAPID).any():
                    bounds.tools.add(run.state.tool)
            elif isinstance(run, ProgramRun) and run.motions:
                bounds.add(runs.program(run).path)
        source.seek(0)
    return memory_of(job.config, tool_frame_of(job.config, job.tool_axis), bounds)


class _Piece:
    """A run with what its neighbours need to know of it. Raises NotInPieces for a run without a motion of a length."""

    def __init__(self, run: ProgramRun, runs: Runs) -> None:
        self.run, self.program = run, runs.program(run)
        self.engaged: Engaged | None = None  # what the tool meets, or, as long as it is only looked at, at its begin
        self.path = path = self.program.path
        real = np.flatnonzero((path.kind == RAPID) | (path_geometry.lengths(path) > 0.0))
        if not len(real) or len(path) != run.motions:
            raise NotInPieces
        self.ends = (int(real[0]), int(real[-1]))
        self.first, self.last = (_straight(path, k, u) for k, u in zip(self.ends, (0.0, 1.0), strict=True))

    def between(self, before: _Piece | None, after: _Piece | None) -> Program:
        """Its program with the end of the motion in front of it and the begin of that behind it, which have no words."""
        program, n = self.program, len(self.path)
        paths, modes, rows = [self.path], program.modes, [slice(n)]
        if before is not None:
            paths, modes = [before.last, *paths], (before.program.modes[before.ends[1]], *modes)
            rows = [slice(1), *rows]
        if after is not None:
            paths, modes = [*paths, after.first], (*modes, after.program.modes[after.ends[0]])
            rows = [*rows, slice(n - 1, n)]
        shift = int(before is not None)
        return replace(
            program, path=Path.joined(paths), sites=program.sites.stretches(rows), modes=modes,
            rebases=tuple(replace(each, motion=each.motion + shift) for each in program.rebases),
        )  # fmt: skip


def _still(engaged: Engaged, row: int, motion: int) -> Engaged:
    """The constant engagement of one row all along a motion."""
    if not len(engaged.u):
        return engaged
    out = engaged.take(np.array([row % len(engaged.u)] * 2))
    return replace(out, motion=np.array([motion, motion]), u=np.array([0.0, 1.0]), bends=np.ones(2, np.bool_))


def _straight(path: Path, k: int, u: float) -> Path:
    """The begin (u 0) or the end (u 1) of motion k as a straight move of length NEAR."""
    way = NEAR * path_geometry.tangents(path, np.array([k]), np.array([u]))
    point, each = path.start[k] if u == 0.0 else path.end[k], path.take(np.array([k]))
    return replace(
        each, kind=np.where(each.kind == RAPID, RAPID, LINE).astype(np.int8), start=point - u * way,
        end=point + (1.0 - u) * way, angle=np.zeros(1), axis=np.zeros((1, 3)), centre=np.full((1, 3), np.nan),
    )  # fmt: skip
