"""A run of linear moves corrected by interpolation, as compensate.py corrects it exactly, and written.

Where every number of the config is exact; runs of other programs are corrected by compensate.py.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from camcomp.compensation.long.field import Field, Tiles
from camcomp.compensation.long.kernel import follow
from camcomp.compensation.long.linear_run import LinearRun, NotInPieces, Unsolved
from camcomp.compensation.long.loads import Loads, RunContext, joints_at, loads_of
from camcomp.compensation.long.output_state import OutputState
from camcomp.compensation.long.tile_files import TileFiles
from camcomp.compensation.program.chords import divide, second_derivative, trial_nodes
from camcomp.compensation.program.moves import chord_budget
from camcomp.compensation.program.under_control import apart_pays, merging, rests_of, rounds
from camcomp.gcode.dialect import Dialect
from camcomp.gcode.linear_rows import MAX_ROW_BYTES, write_rows
from camcomp.ground.datatypes import LINE, RAPID, Bools, Floats, Ints
from camcomp.model.control import limits_of
from camcomp.model.job import Job
from camcomp.model.statics.solve import FREE, TARGET, inverse, solve
from camcomp.model.trajectory.moves import line_moves

ROUNDS = 5
EASY_MM = 8.0  # longer lines are divided at trial points; shorter ones when their middle says so
MODELS = (
    "none",
    "constant",
    "mechanistic",
    "kienzle",
)  # whose force does not depend on the way from the program's start
COARSE_MM = 1e-3  # a control with larger steps moves the joints by more than first order tells


@dataclass(frozen=True, eq=False, kw_only=True)
class LinearRows:
    """End points (N,) of the corrected run, in order; program frame."""

    move: Ints
    w: Floats
    joining: Bools
    target: Floats  # (N, 3) mm
    force: Floats  # (N, 3) N
    shift: Floats  # (N, 3) mm added to the correction at division points
    engagement: Floats | None  # (N, 2) depth of the cut mm, engaged arcs rad; None: no stock is known


@dataclass(frozen=True, eq=False, kw_only=True)
class Answers:
    """Response of the machine at points (N,), machine frame; the rest and the nominal joints where they are asked for."""

    correction: Floats  # (N, 3) mm
    unloaded: Floats  # (N, 3) mm, loaded tip minus target when the target itself is commanded
    rest: Floats  # (N, 3 + 2 m) tilt, drives, change of the joints
    nominal: Floats  # (N, m)
    tile: Ints  # (N,) negative: solved by itself
    tiles: Tiles  # that are counted by `tile`


@dataclass(frozen=True, eq=False, kw_only=True)
class CorrectedRun:
    """A corrected run."""

    data: bytes
    run: LinearRun  # the moves that the rows count
    rows: LinearRows
    answers: Answers
    commanded: Floats  # (N, 3) mm before rounding, program frame
    written: Floats  # (N, 3) mm
    before: Floats  # (k, 3) mm at the end points and the middles of lines
    after: Floats
    begin: Floats  # (3,) mm where the written run starts
    feed: Floats  # (N,) mm/min in force
    rest: Bools  # (N,) ends at rest because of a joining line
    seen: Ints  # (k,) rows of before and after
    apart: bool = False  # the control is kept from making one line of several


@dataclass(frozen=True, eq=False, kw_only=True)
class Middles:
    """Middles (k,) of lines."""

    rows: Ints  # the end point of the line
    move: Ints
    aimed: Floats  # (k, 3) mm to be commanded there, program frame
    answers: Answers


def _sizes(vectors: Floats) -> Floats:
    return np.asarray(np.sqrt(np.einsum("ni,ni->n", vectors, vectors)))


class LinearCorrector:
    """Corrects runs of linear moves of one program."""

    def __init__(self, job: Job, tolerance_um: float, language: Dialect, feed_point: bool) -> None:
        """language, feed_point: how it is written. Raises NotInPieces for what needs the program as a whole."""
        force = job.config.process.force
        if force.model not in MODELS:
            raise NotInPieces
        self.job, self.machine = job, job.real_machine
        self.language, self.feed_point = language, feed_point
        self.tolerance = 1e-3 * tolerance_um
        self.field: Field | None = None
        self.exact = 0  # rows that had to be solved one by one

    def correct(self, context: RunContext, output: OutputState) -> CorrectedRun:
        """The run corrected and written; `output` is moved along. Raises Unsolved, NotInPieces."""
        loads = loads_of(context, self.job)
        try:
            return self._corrected(context, loads, output)
        except Unsolved as error:
            raise Unsolved(loads.motion[error.move], error.target, error.status) from None

    def _corrected(self, context: RunContext, loads: Loads, output: OutputState) -> CorrectedRun:
        run = loads.run
        self._set_up(run, loads)
        lead, trail = joints_at(loads, context.before, context.after)
        tolerance = np.full(run.motions, self.budget)
        hard = (loads.length > EASY_MM) & (run.linear.kind == LINE)
        for left in range(ROUNDS, 0, -1):
            rows = self._rows(run=run, loads=loads, lead=lead, trail=trail, hard=hard, tolerance=tolerance)
            answers = self.ask(rows.move, rows.target, rows.force)
            commanded, kept = self._commanded(rows, answers, loads.motion)
            if left == ROUNDS and self._drop_small_joints(rows, commanded, output, lead, trail):
                continue
            middles = self._middles(run, loads, rows)
            told = self._halfway(commanded, output.commanded)[middles.rows] - middles.aimed
            bent = (_sizes(told) > self.budget) & ~hard[middles.move]
            if bent.any() and left > 1:
                hard[middles.move[bent]] = True
                continue
            trial = replace(output)
            data, written, held, rest = self._write(
                run=context.run, loads=loads, rows=rows, commanded=commanded, kept=kept, output=trial
            )
            judged = self._judged(run, rows)
            error = self._after(
                rows, judged, answers=answers, middles=middles, commanded=commanded, written=written,
                first=output.written,
            )  # fmt: skip
            worst = np.zeros(run.motions)
            at = np.concatenate((rows.move[judged], middles.move))
            np.maximum.at(worst, at, _sizes(error))
            missed = worst > self.tolerance
            if not missed.any() or left == 1:
                break
            hard |= missed
            shrink = np.clip(0.9 * self.tolerance / np.maximum(worst, 1e-300), 0.3, 0.9)
            tolerance = np.where(missed, tolerance * shrink, tolerance)
        begin = output.written
        output.__dict__.update(trial.__dict__)
        return CorrectedRun(
            data=data, run=run, rows=rows, answers=answers, commanded=commanded, written=written, after=error,
            before=self._back(np.concatenate((answers.unloaded[judged], middles.answers.unloaded))), begin=begin, feed=held,
            rest=rest, seen=np.concatenate((np.flatnonzero(judged), middles.rows)),
            apart=bool(output.apart),
        )  # fmt: skip

    def _set_up(self, run: LinearRun, loads: Loads) -> None:
        """Set resolution and chord budget of a run; make the field of corrections on the first run."""
        if self.field is None:
            force = self.job.frame.vectors(np.concatenate((loads.first, loads.last)))
            self.field = Field(self.machine, force, self.job.frame.origin, TileFiles(self.machine))
        self.resolution = self.language.step_mm(self.job.config.control.resolution_mm, run.state.unit)
        self.budget = float(chord_budget(np.array(self.tolerance), self.resolution))

    # --- rows ----------------------------------------------------------------------------------------------------

    def _rows(
        self, run: LinearRun, loads: Loads, lead: Bools, trail: Bools, hard: Bools, tolerance: Floats
    ) -> LinearRows:
        linear, n = run.linear, run.motions
        move, w, shift = np.flatnonzero(~hard), None, None
        w, shift = np.ones(len(move)), np.zeros((len(move), 3))
        which = np.flatnonzero(hard)
        if len(which):
            inner = self._divided(run, loads, which, tolerance[which])
            move, w, shift = (np.concatenate(pair) for pair in zip((move, w, shift), inner, strict=True))
        a, b = np.flatnonzero(lead), np.flatnonzero(trail)
        move = np.concatenate((move, a, b))
        kind = np.concatenate((np.ones(len(w), np.int8), np.zeros(len(a), np.int8), np.full(len(b), 2, np.int8)))
        w = np.concatenate((w, np.zeros(len(a)), np.ones(len(b))))
        shift = np.concatenate((shift, np.zeros((len(a) + len(b), 3))))
        if len(move) > n or len(which):
            order = np.lexsort((w, kind, move))
            move, w, kind, shift = move[order], w[order], kind[order], shift[order]
        target = linear.end[move]
        force = loads.last[move]
        inside = np.flatnonzero(w < 1.0)
        if len(inside):
            start = linear.start[move[inside]]
            target[inside] = start + w[inside, None] * (target[inside] - start)
            force[inside] = loads.at(move[inside], w[inside])
        force[kind == 2] = 0.0
        return LinearRows(
            move=move, w=w, joining=kind != 1, target=target, force=force, shift=shift, engagement=loads.sizes(move, w)
        )

    def _divided(self, run: LinearRun, loads: Loads, which: Ints, tolerance: Floats) -> tuple[Ints, Floats, Floats]:
        """Division points of some moves: move, w and shift of each."""
        start, way = run.linear.start[which], run.linear.end[which] - run.linear.start[which]
        length = loads.length[which]
        trial = trial_nodes(length, np.zeros(len(which)), np.ones(len(which), np.bool_))
        target = start[trial.piece] + trial.w[:, None] * way[trial.piece]
        force = loads.at(which[trial.piece], trial.w)
        answers = self.ask(which[trial.piece], target, force, every=False)
        bend = second_derivative(trial, target + self._back(answers.correction))
        nodes, shift = divide(trial, bend, tolerance)
        inner = np.arange(len(nodes.w)) != nodes.first[nodes.piece]
        return which[nodes.piece[inner]], nodes.w[inner], shift[inner]

    def _drop_small_joints(
        self, rows: LinearRows, commanded: Floats, output: OutputState, lead: Bools, trail: Bools
    ) -> bool:
        """Takes joining lines out that would be shorter than the resolution; whether there were any."""
        joins = np.flatnonzero(rows.joining)
        previous = np.concatenate((output.commanded[None], commanded[:-1]))[joins]
        small = _sizes(commanded[joins] - previous) <= self.resolution
        front = rows.w[joins] == 0.0
        lead[rows.move[joins[small & front]]] = False
        trail[rows.move[joins[small & ~front]]] = False
        return bool(small.any())

    def _judged(self, run: LinearRun, rows: LinearRows) -> Bools:
        out: Bools = (run.linear.kind[rows.move] == LINE) & ~rows.joining
        return out

    # --- the machine ---------------------------------------------------------------------------------------------

    def _back(self, vectors: Floats) -> Floats:
        return vectors @ self.job.frame.rotation

    def ask(self, move: Ints, target: Floats, force: Floats, every: bool = True) -> Answers:
        """Answers at points of moves (n,), program frame; every: the rest and the nominal joints, too.

        A wider range of forces makes new tiles, so those that the numbers count go with them.
        """
        target, force = self.job.frame.to_machine(target), self.job.frame.vectors(force)
        known = self.field
        assert known is not None
        answer, nominal, tile = known.look(target, force, every=every)
        lost = np.flatnonzero(tile < 0)
        if len(lost):
            self.exact += len(lost)
            answer[lost], nominal[lost if every else []] = self._solved(move[lost], target[lost], force[lost], every)
        return Answers(
            correction=answer[:, :3], unloaded=answer[:, 3:6], rest=answer[:, 6:], nominal=nominal, tile=tile,
            tiles=known.tiles,
        )  # fmt: skip

    def _commanded(self, rows: LinearRows, answers: Answers, of: Ints) -> tuple[Floats, Bools]:
        """Tips (N, 3) to be commanded, and which rows (N,) stay as programmed: what would be rounded away is left out."""
        moved = self._back(answers.correction) + rows.shift
        single = ~rows.joining
        motion = of[rows.move]
        single[1:] &= motion[1:] != motion[:-1]
        single[:-1] &= motion[:-1] != motion[1:]
        kept = single & (np.abs(moved).max(axis=1) <= 0.5 * self.resolution)
        return rows.target + np.where(kept[:, None], 0.0, moved), kept

    def off(self, done: CorrectedRun) -> Floats:
        """Written command minus exact command of the full correction (N, 3) mm, machine frame."""
        return self.job.frame.vectors(done.written - done.rows.target) - done.answers.correction

    def actuators(self, done: CorrectedRun) -> tuple[Floats, Floats]:
        """Joints (N, m) of the written end points and drives there: those of the exact command, and the step that rounding makes.

        Where more than rounding lies between the two, the written point is solved.
        """
        m, frame = len(self.machine.actuators), self.job.frame
        tile, off = done.answers.tile, self.off(done)
        out, drive = np.zeros((len(tile), m)), done.answers.rest[:, 3 : 3 + m]
        follow(done.answers.tiles.rates, tile, off, out)
        out += done.answers.nominal + done.answers.rest[:, 3 + m :]
        far = np.abs(off).max(axis=1) > COARSE_MM
        lost = np.flatnonzero((tile < 0) | (self.resolution > COARSE_MM) | far)
        if len(lost):
            out[lost] = inverse(self.machine, frame.to_machine(done.written[lost]))
        if far.any():
            told, force = frame.to_machine(done.written[far]), frame.vectors(done.rows.force[far])
            drive = drive.copy()
            drive[far] = solve(self.machine, FREE, told, force=force, check=False).drive
        return out, drive

    def _solved(self, move: Ints, target: Floats, force: Floats, every: bool) -> tuple[Floats, Floats]:
        aimed = solve(self.machine, TARGET, target, force=force)
        linear = solve(self.machine, FREE, target, force=force)
        bad = np.where(aimed.status != 0, aimed.status, linear.status)
        if bad.any():
            raise Unsolved(move[bad != 0], target[bad != 0], bad[bad != 0])
        parts = [aimed.commanded - target, linear.tip - target]
        if not every:
            return np.concatenate(parts, axis=1), np.empty((0, len(self.machine.actuators)))
        parts += [aimed.tilt, aimed.drive, aimed.rho - aimed.rho_nominal]
        return np.concatenate(parts, axis=1), aimed.rho_nominal

    # --- middles of lines ----------------------------------------------------------------------------------------

    def _middles(self, run: LinearRun, loads: Loads, rows: LinearRows) -> Middles:
        """The middles of the lines that cut."""
        at = np.flatnonzero(self._judged(run, rows) & (loads.length[rows.move] > 0.0))
        move, w = rows.move[at], rows.w[at]
        same = (at > 0) & (rows.move[at - 1] == move)
        middle = 0.5 * (w + np.where(same, rows.w[at - 1], 0.0))
        start = run.linear.start[move]
        target = start + middle[:, None] * (run.linear.end[move] - start)
        answers = self.ask(move, target, loads.at(move, middle), every=False)
        return Middles(rows=at, move=move, aimed=target + self._back(answers.correction), answers=answers)

    def _halfway(self, ends: Floats, first: Floats) -> Floats:
        return 0.5 * (ends + np.concatenate((first[None], ends[:-1])))

    def _after(
        self, rows: LinearRows, judged: Bools, *, answers: Answers, middles: Middles, commanded: Floats,
        written: Floats, first: Floats,
    ) -> Floats:  # fmt: skip
        """Errors (k, 3) of the written program, program frame: end points that are judged, then middles."""
        R = self.job.frame.rotation
        off = (written - commanded + rows.shift)[judged]
        told = self._halfway(written, first)[middles.rows] - middles.aimed
        off = np.concatenate((off, told)) @ R.T  # from the exact command, machine frame
        error, ends = off.copy(), len(off) - len(told)
        follow(answers.tiles.slope, answers.tile[judged], off[:ends], error[:ends])
        follow(middles.answers.tiles.slope, middles.answers.tile, off[ends:], error[ends:])
        return error @ R

    # --- writing -------------------------------------------------------------------------------------------------

    def _write(
        self, run: LinearRun, loads: Loads, rows: LinearRows, commanded: Floats, kept: Bools, output: OutputState
    ) -> tuple[bytes, Floats, Floats, Bools]:
        linear, N = run.linear, len(rows.move)
        rest, mode = self._rests(loads.run, rows), run.state.path_mode
        able = merging(mode, self.language)
        apart = able and self._apart(run=loads.run, rows=rows, commanded=commanded, rest=rest, kept=kept, output=output)
        begins = -1 if able and apart != output.apart else 0
        output.apart = apart
        own = (mode.apart if apart else mode).said(run.state.unit)
        modes = [np.frombuffer(each.encode(), np.uint8) for each in (self.language.exact_stop, own)]
        first = np.searchsorted(loads.motion[rows.move], np.arange(run.motions + 1))
        out = np.empty(run.text_end - run.text_at + MAX_ROW_BYTES * (N + 1 + int(rest.sum())), np.uint8)
        written, held = np.empty((N, 3)), np.empty(N)
        position, state = output.written.copy(), np.array([output.code, output.feed])
        unit = run.state.unit
        size = write_rows(
            run.data, run.text_at, run.text_end, linear.line, linear.begin, linear.finish, linear.kind, linear.end,
            linear.code_stated, linear.feed_stated, linear.feed, first, rows.joining, rest, begins, *modes, commanded,
            self._feeds(loads.run, rows, commanded, kept, output),
            position, state, unit, np.array(run.state.offset), self.language.digits(self.job.config.control.resolution_mm, unit),
            0.5 * self.resolution * (1.0 + 1e-9), self.feed_point, out, written, held,
        )  # fmt: skip
        output.written, output.commanded = position, commanded[-1].copy()
        output.code, output.feed = float(state[0]), float(state[1])
        return out[:size].tobytes(), written, held, rest

    def _rests(self, run: LinearRun, rows: LinearRows) -> Bools:
        """Rows (N,) at which an exact stop keeps a corner sharp; the last row of a run is never one."""
        if not rounds(run.state.path_mode, 1e3 * self.tolerance):
            return np.zeros(len(rows.move), np.bool_)
        return rests_of((run.linear.kind[rows.move] == LINE) & ~rows.joining, rows.joining)

    def _apart(
        self, run: LinearRun, rows: LinearRows, commanded: Floats, rest: Bools, kept: Bools, output: OutputState
    ) -> bool:
        """Whether to forbid the controller to merge lines; changes of feed are not considered."""
        kind, feed = run.linear.kind[rows.move], run.linear.feed[rows.move]
        cut = (kind == LINE) & ~rows.joining & ~kept
        start = np.concatenate((output.commanded[None], commanded[:-1]))
        moves = line_moves(kind, start, commanded, feed, run.state.path_mode)
        moves = replace(moves, exact=moves.exact | rest)
        return bool(cut.any()) and apart_pays(moves, cut, limits_of(self.job.config), 1e3 * self.tolerance)

    def _feeds(self, run: LinearRun, rows: LinearRows, commanded: Floats, kept: Bools, output: OutputState) -> Floats:
        """Feed (N,) so that the tip keeps its programmed speed, as in compensate.py."""
        feed = np.where(run.linear.kind[rows.move] == RAPID, np.nan, run.linear.feed[rows.move])
        start = np.concatenate((output.commanded[None], commanded[:-1]))
        same = np.concatenate(([False], rows.move[1:] == rows.move[:-1]))
        w0 = np.where(same, np.concatenate(([0.0], rows.w[:-1])), 0.0)
        way = run.linear.end[rows.move] - run.linear.start[rows.move]
        programmed = (rows.w - w0) * _sizes(way)
        step = commanded - start
        size = _sizes(step)
        scale = np.divide(size, programmed, out=np.ones(len(feed)), where=programmed > 1e-6)
        return np.where(rows.joining | kept | (programmed < 0.01), feed, feed * np.clip(scale, 0.2, 5.0))
