"""The figures of a program that is corrected in pieces, with what its controller makes of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from camcomp.compensation.long.linear_corrector import CorrectedRun, LinearCorrector
from camcomp.compensation.long.linear_run import LinearRun
from camcomp.compensation.long.runs import Runs
from camcomp.compensation.program.compensate import Compensated, warm_up_warnings
from camcomp.compensation.program.control_account import ControlAccount, PointsOnMoves
from camcomp.compensation.program.totals import JointTableRows, Totals
from camcomp.compensation.program.under_control import control_warnings
from camcomp.gcode.output import Part
from camcomp.gcode.path_mode import PathMode
from camcomp.gcode.uncorrected import UncorrectedFeeds, below_step_warning
from camcomp.ground.datatypes import RAPID, Bools, Floats, Ints, Path
from camcomp.ground.source_lines import MOST_LINES
from camcomp.model.control import limits_of
from camcomp.model.cutting.assumed import ForceDoubts
from camcomp.model.cutting.spindle import spindle_warning
from camcomp.model.job import Job
from camcomp.model.trajectory.moves import line_moves

SAME_MM = 1e-9  # of a place as programmed and as written


class TotalsOfPieces(Totals):
    """Figures, warnings and failed checks, added up piece by piece."""

    NULL = ("interpolation",)

    def __init__(self, job: Job, name: str, *, tolerance_um: float, tabled: bool) -> None:
        """name: of the program. tolerance_um: beyond which the controller is warned of. tabled: rows are asked for."""
        super().__init__(job, tabled=tabled)
        limits = limits_of(job.config)
        self._control = ControlAccount(limits, 1e-3 * tolerance_um), ControlAccount(limits, 1e-3 * tolerance_um)
        self.driven = self._control[1].errors
        self.apart: dict[PathMode, None] = {}  # in which lines are kept from being made one
        self.resting = 0  # end points at which the control rests because of joining lines
        self._doubts = ForceDoubts(config=job.config)
        self._feeds = UncorrectedFeeds(name)
        self._moved = False  # any feed move is corrected
        self._still: list[int] = []  # source lines that cut while the spindle stands, the first ones

    def add_linear(self, whole: LinearRun, done: CorrectedRun, corrector: LinearCorrector) -> JointTableRows:
        """Add a run of linear moves."""
        run, rows, answers = done.run, done.rows, done.answers
        linear, path = run.linear, whole.path
        way = linear.end - linear.start
        length = np.sqrt(np.einsum("ni,ni->n", way, way))
        s = self._s + (np.cumsum(length) - length)[rows.move] + rows.w * length[rows.move]
        feed = self._fed(linear.feed[rows.move])
        moving = (linear.kind[rows.move] != RAPID) & (feed > 0.0)
        t = self._t + np.cumsum(np.where(moving, np.diff(s, prepend=self._s) / np.where(moving, feed, 1.0) * 60.0, 0.0))
        self._s, self._t = self._s + float(length.sum()), float(t[-1])
        joints, drive = corrector.actuators(done)
        self.step_mm = max(self.step_mm, corrector.resolution)
        out = JointTableRows(
            line=linear.row[rows.move] + run.row0 + 1, s=s, t=t, target=rows.target, written=done.written,
            force=self.job.frame.vectors(rows.force), nominal=answers.nominal, joints=joints, drive=drive,
            behind=self._behind(None, rows.engagement),
        )  # fmt: skip
        self._add(
            out, joining=rows.joining, corrected=np.ones(len(s), np.bool_), tilt=answers.rest[:, :3],
            before=done.before, after=done.after, missed=done.after,
        )  # fmt: skip
        self._linear_control(run, done)
        self._examine(path, rows.target, done.written, linear.kind[rows.move] != RAPID)
        if run.state.sense == 0.0:
            self._stands(np.unique(linear.row[rows.move[rows.force.any(axis=1)]]) + run.row0 + 1)
        return out

    def add_piece(self, result: Compensated, own: Bools, part: Part) -> JointTableRows:
        """Add the motions `part` of a piece that was corrected exactly; own (N,): their rows."""
        out, rows = self.add_exact(result, own), result.rows
        self._exact_control(result, own, part)
        moves = result.program.path.take(np.arange(part.first, part.last))
        self._examine(moves, rows.target[own], result.written.end[own], rows.kind[own] != RAPID)
        self._stands(result.without_spindle)
        return out

    def _examine(self, path: Path, target: Floats, written: Floats, feed: Bools) -> None:
        """Look for doubts in the force and for uncorrected feeds; target, written (N, 3) mm at end points, feed (N,)."""
        self.motions += len(path)
        self._doubts.add(path)
        self._feeds.add(path)
        self._moved = self._moved or bool((np.abs(written - target)[feed] > SAME_MM).any())

    def _stands(self, lines: Ints) -> None:
        self._still += lines[: MOST_LINES + 1 - len(self._still)].tolist()

    # --- the controller ------------------------------------------------------------------------------------------

    def _fed(self, feed: Floats) -> Floats:
        """Feeds (n,) mm/min, where none is stated the config's."""
        return np.where(np.isnan(feed), self.job.config.process.feed_mm_per_min or np.nan, feed)

    def _linear_control(self, run: LinearRun, done: CorrectedRun) -> None:
        """Plan the moves of linear moves as the controller does."""
        linear, rows, mode = run.linear, done.rows, run.state.path_mode
        before, after = self._control
        self.modes[mode] = None
        fed = self._fed(linear.feed)
        before.add(
            line_moves(kind=linear.kind, start=linear.start, end=linear.end, feed=fed, mode=mode, waits=run.waits)
        )
        start = np.concatenate((done.begin[None], done.written[:-1]))
        moves = line_moves(
            kind=linear.kind[rows.move], start=start, end=done.written, feed=done.feed, mode=mode, waits=run.waits
        )
        moves = replace(moves, exact=moves.exact | done.rest)
        if done.apart:
            self.apart[mode] = None
            moves = replace(moves, merge=np.zeros(len(moves)))
        self.resting += int(done.rest.sum())
        ends = len(rows.move) - np.count_nonzero(rows.joining | (linear.kind[rows.move] == RAPID))
        seen = done.seen
        joining = np.concatenate((rows.joining, [False]))
        points = PointsOnMoves(
            move=seen, error=done.after, line=linear.row[rows.move[seen]] + run.row0 + 1,
            commanded=np.concatenate((done.written[seen[:ends]], 0.5 * (start + done.written)[seen[ends:]])),
            joined=joining[seen - 1] | joining[seen + 1],
        )  # fmt: skip
        after.add(moves, points)

    def _exact_control(self, result: Compensated, own: Bools, part: Part) -> None:
        """Plan the moves of exactly corrected lines as the controller does."""
        program, control, (before, after) = result.program, result.control, self._control
        path, modes = program.path, program.modes
        self.modes |= {modes[k]: None for k in range(part.first, part.last) if path.kind[k] != RAPID}
        before.add(control.programmed.take(slice(part.first, part.last)))
        self.resting += int(control.rest.sum())
        after.add(control.written.take(own), control.points.take(slice(None), int(np.flatnonzero(own)[0])))

    def finish(self, runs: Runs, stock: list[str]) -> None:
        """Collect the times and the warnings of all parts, also those of the stock."""
        for each in self._control:
            each.finish()
        self.times = (self._control[0].seconds, self._control[1].seconds)
        self.waiting_s = runs.waiting_s(self.job.config)
        feeds, control = self._feeds.warnings(), self._control[1]
        self.warnings = [*runs.warnings, *feeds, *runs.behind_end, *warm_up_warnings(self.job)]
        self.warnings += control_warnings(
            tuple(self.modes), control.at_joins, control.elsewhere, exact_stop=runs.language.exact_stop,
            resting=self.resting, apart=self.apart,
        )  # fmt: skip
        self.warnings += spindle_warning(np.array(self._still, np.int64))
        self.warnings += [*self.job.taken.remarks, *self._doubts.warnings(), *stock]
        if not (self._moved or feeds) and self._feeds.feeds:
            self.warnings.append(below_step_warning(self._feeds.name, self._feeds.feeds, self.step_mm))
