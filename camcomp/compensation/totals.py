"""The figures of a corrected program, added up part by part: of one that was corrected as a whole, or in pieces."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from camcomp.compensation.bands.outcome import Bands, BandTotals, band_figures
from camcomp.compensation.long.control_account import ControlAccount, SeenPoints
from camcomp.compensation.program.compensate import Compensated
from camcomp.compensation.program.result import (
    CycleTime,
    ErrorSum,
    Interpolation,
    Summary,
    interpolation_failed,
    job_figures,
    worse_than_before,
)
from camcomp.compensation.program.under_control import control_warnings, mode_name, written_moves
from camcomp.gcode.output import Part
from camcomp.gcode.path_mode import PathMode
from camcomp.gcode.text import count_lines
from camcomp.gcode.uncorrected import UncorrectedFeeds, below_step_warning
from camcomp.ground.datatypes import RAPID, Bools, Floats, Ints, Path
from camcomp.ground.orientation import angles_of
from camcomp.ground.source_lines import MOST_LINES, named_lines
from camcomp.model.control import limits_of, waiting_s
from camcomp.model.cutting.assumed import ForceDoubts
from camcomp.model.cutting.spindle import spindle_warning
from camcomp.model.job import Job
from camcomp.model.trajectory.moves import line_moves, moves_of

if TYPE_CHECKING:
    from camcomp.compensation.long.linear_corrector import CorrectedRun, LinearCorrector
    from camcomp.compensation.long.linear_run import LinearRun
    from camcomp.compensation.long.runs import Runs

SAME_MM = 1e-9  # of a place as programmed and as written


@dataclass(frozen=True, eq=False, kw_only=True)
class JointRows:
    """Rows (N,) of the corrected program as the joint table has them."""

    line: Ints
    s: Floats  # mm
    t: Floats  # s
    target: Floats  # (N, 3) mm program frame
    written: Floats  # (N, 3) mm program frame
    force: Floats  # (N, 3) N machine frame
    nominal: Floats  # (N, m)
    joints: Floats  # (N, m)
    drive: Floats  # (N, m)
    behind: Floats | None = None  # (N, e) columns behind the others


class Totals:
    """Figures, warnings and failed checks of a corrected program."""

    def __init__(self, job: Job, name: str, *, tolerance_um: float = 0.0, tabled: bool = True) -> None:
        """name: of the program. tolerance_um: beyond which the controller is warned of. tabled: rows are asked for."""
        self.job, self._tabled = job, tabled
        self.before, self.after, self.missed = ErrorSum(), ErrorSum(), ErrorSum()
        self.points = self.motions = self.lines_in = self.lines_out = self.joins = self.iterations = 0
        self.change = self.force = np.zeros(len(job.machine.actuators))
        self.tilt, self.method, self.step_mm = 0.0, "newton", 0.0  # step of the output
        self.tilt_after: float | None = None  # of programs with orientation
        self.warnings: list[str] = []
        self.interpolated: Interpolation | None = None
        self.bands: BandTotals | None = None
        self._s = self._t = 0.0
        self._beyond: list[list[int]] = [[] for _ in job.machine.actuators]
        limits = limits_of(job.config)
        self._control = ControlAccount(limits, 1e-3 * tolerance_um), ControlAccount(limits, 1e-3 * tolerance_um)
        self.driven = self._control[1].errors  # under the controller
        self._in_pieces = True
        self.times = (0.0, 0.0)  # s of the moves, before and after
        self.modes: dict[PathMode, None] = {}  # in which it cuts
        self.apart: dict[PathMode, None] = {}  # in which lines are kept from being made one
        self.waiting_s = 0.0  # besides its moves
        self.resting = 0  # end points at which the control rests because of joining lines
        self._doubts = ForceDoubts(config=job.config)
        self._feeds = UncorrectedFeeds(name)
        self._moved = False  # any feed move is corrected
        self._still: list[int] = []  # source lines that cut while the spindle stands, the first ones

    @classmethod
    def of(cls, result: Compensated, job: Job) -> Totals:
        """Totals of a program that was corrected as a whole."""
        program, control = result.program, result.control
        out = cls(job, program.name, tabled=False)
        out.add_exact(result)
        out.motions, out.method, out.warnings = len(program.path), result.method, result.warnings
        out.lines_in, out.lines_out = count_lines(program.data), count_lines(result.written.data)
        out.modes, out.times = dict.fromkeys(control.modes), (control.before_s, control.after_s)
        out.driven.add(control.error)
        out.waiting_s = waiting_s(job.config, program.dwelt_s, program.tool_changes)
        out.interpolated, out._in_pieces = result.interpolated, False
        if result.tilt_after is not None:
            out.tilt = out.tilt_after = float(np.fmax.reduce(result.tilt_after, initial=0.0))
        return out

    # --- parts ---------------------------------------------------------------------------------------------------

    def add_linear(self, whole: LinearRun, done: CorrectedRun, corrector: LinearCorrector) -> JointRows:
        """Add a run of linear moves."""
        run, rows, answers = done.run, done.rows, done.answers
        linear, path = run.linear, whole.path()
        way = linear.end - linear.start
        length = np.sqrt(np.einsum("ni,ni->n", way, way))
        s = self._s + (np.cumsum(length) - length)[rows.move] + rows.w * length[rows.move]
        feed = self._fed(linear.feed[rows.move])
        moving = (linear.kind[rows.move] != RAPID) & (feed > 0.0)
        t = self._t + np.cumsum(np.where(moving, np.diff(s, prepend=self._s) / np.where(moving, feed, 1.0) * 60.0, 0.0))
        self._s, self._t = self._s + float(length.sum()), float(t[-1])
        joints, drive = corrector.actuators(done)
        self.step_mm = max(self.step_mm, corrector.resolution)
        out = JointRows(
            line=linear.row[rows.move] + run.row0 + 1, s=s, t=t, target=rows.target, written=done.written,
            force=self.job.frame.vectors(rows.force), nominal=answers.nominal, joints=joints, drive=drive,
            behind=self._behind(self._columns(done.bands), rows.engagement),
        )  # fmt: skip
        self._add(
            out, joining=rows.joining, corrected=np.ones(len(s), np.bool_), tilt=answers.rest[:, :3],
            before=done.before, after=done.after, missed=done.missed,
        )  # fmt: skip
        self._linear_control(run, done)
        self._examine(path, rows.target, done.written, linear.kind[rows.move] != RAPID)
        if run.state.sense == 0.0:
            self._stands(np.unique(linear.row[rows.move[rows.force.any(axis=1)]]) + run.row0 + 1)
        return out

    def add_piece(self, result: Compensated, own: Bools, part: Part) -> JointRows:
        """Add the motions `part` of a piece that was corrected exactly; own (N,): their rows."""
        out, rows = self.add_exact(result, own), result.rows
        self._exact_control(result, own, part)
        moves = result.program.path.take(np.arange(part.first, part.last))
        self._examine(moves, rows.target[own], result.written.end[own], rows.kind[own] != RAPID)
        self._stands(result.without_spindle)
        return out

    def add_exact(self, result: Compensated, own: Bools | slice = slice(None)) -> JointRows:
        """Add rows `own` (N,) of a result that was corrected exactly."""
        rows, state, first = result.rows, result.state, int(np.arange(len(result.s))[own][0])
        s0, t0 = (result.s[first - 1], result.t[first - 1]) if first else (0.0, 0.0)
        s, t = self._s + result.s[own] - s0, self._t + result.t[own] - t0
        self._s, self._t = float(s[-1]), float(t[-1])
        words = None
        if result.orienting is not None and result.written.words is not None:
            both = (result.programmed_words[own], result.written.words[own])
            words = np.column_stack([angles_of(result.orienting.form, each) for each in both])
        out = JointRows(
            line=result.lines[own], s=s, t=t, target=rows.target[own], written=result.written.end[own],
            force=result.force[own], nominal=result.nominal[own], joints=state.rho[own], drive=state.drive[own],
            behind=self._behind(self._columns(result.bands, own), rows.engagement[own], words),
        )  # fmt: skip
        self._add(
            out, joining=rows.joining[own], corrected=rows.corrected[own], tilt=state.tilt[own], before=result.before,
            after=result.after, missed=result.missed,
        )  # fmt: skip
        self.iterations = max(self.iterations, result.iterations)
        self.step_mm = max(self.step_mm, result.program.step_mm(self.job.config.control.resolution_mm))
        return out

    def _add(
        self, rows: JointRows, *, joining: Bools, corrected: Bools, tilt: Floats, before: Floats, after: Floats,
        missed: Floats,
    ) -> None:  # fmt: skip
        """Add rows (N,), and errors (k, 3) mm between them."""
        self.points += len(rows.line)
        self.joins += int(joining.sum())
        change = np.abs(rows.joints - rows.nominal)[corrected]
        self.change = np.fmax(self.change, np.fmax.reduce(change, axis=0, initial=0.0))
        self.force = np.fmax(self.force, np.fmax.reduce(np.abs(rows.drive)[corrected], axis=0, initial=0.0))
        self.tilt = float(np.fmax.reduce(np.linalg.norm(tilt, axis=1)[corrected], initial=self.tilt))
        self.before.add(before)
        self.after.add(after)
        self.missed.add(missed)
        for a, (low, high) in enumerate(self.job.machine.limits):
            over = np.flatnonzero((rows.joints[:, a] < low) | (rows.joints[:, a] > high))
            if len(over) and len(self._beyond[a]) <= MOST_LINES:
                lines = np.unique(rows.line[over])[: MOST_LINES + 1]
                self._beyond[a] = sorted({*self._beyond[a], *lines.tolist()})[: MOST_LINES + 1]

    def _examine(self, path: Path, target: Floats, written: Floats, feed: Bools) -> None:
        """Look for doubts in the force and for uncorrected feeds; target, written (N, 3) mm at end points, feed (N,)."""
        self.motions += len(path)
        self._doubts.add(path)
        self._feeds.add(path)
        self._moved = self._moved or bool((np.abs(written - target)[feed] > SAME_MM).any())

    def _stands(self, lines: Ints) -> None:
        self._still += lines[: MOST_LINES + 1 - len(self._still)].tolist()

    def _columns(self, bands: Bands | None, own: Bools | slice = slice(None)) -> Floats | None:
        """Add the expected error of a part; return the band columns of its own rows if the table needs them."""
        if bands is None:
            return None
        self.bands = bands.totals if self.bands is None else self.bands.join(bands.totals)
        if not self._tabled:
            return None
        return bands.columns(with_share=self.job.config.compensation.policy != "full")[own]

    def _behind(self, bands: Floats | None, engagement: Floats | None, words: Floats | None = None) -> Floats | None:
        """Columns behind the others: bands, with a stock the engagement, words of the orientation."""
        stock = engagement if self.job.config.workpiece.stock is not None else None
        parts = [each for each in (bands, stock, words) if each is not None]
        return np.column_stack(parts) if parts else None

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
        told = np.concatenate((done.written[seen[:ends]], 0.5 * (start + done.written)[seen[ends:]]))
        joining = np.concatenate((rows.joining, [False]))
        line = linear.row[rows.move[seen]] + run.row0 + 1
        after.add(moves, SeenPoints(seen, told, done.missed, line, joining[seen - 1] | joining[seen + 1]))

    def _exact_control(self, result: Compensated, own: Bools, part: Part) -> None:
        """Plan the moves of exactly corrected lines as the controller does."""
        program, control = result.program, result.control
        path, modes, (before, after) = program.path, program.modes, self._control
        self.modes |= {modes[k]: None for k in range(part.first, part.last) if path.kind[k] != RAPID}
        mine = slice(part.first, part.last)
        before.add(moves_of(path, modes, self._fed(path.feed), program.per_turn).take(mine))
        first = int(np.flatnonzero(own)[0])
        default = self.job.config.process.feed_mm_per_min or np.nan
        moves = written_moves(program, result.rows, result.written, default)
        moves = replace(moves, exact=moves.exact | control.rest).take(own)
        self.resting += int(control.rest.sum())
        lines = result.lines[control.row]
        after.add(moves, SeenPoints(control.row - first, control.told, result.missed, lines, control.joined))

    # --- the end -------------------------------------------------------------------------------------------------

    def finish(self, runs: Runs, stock: list[str]) -> None:
        """Collect the times and the warnings of all parts, also those of the stock."""
        for each in self._control:
            each.finish()
        self.times = (self._control[0].seconds, self._control[1].seconds)
        self.waiting_s = runs.waiting_s(self.job.config)
        feeds, control = self._feeds.warnings(), self._control[1]
        self.warnings = [*runs.warnings, *feeds, *runs.behind_end]
        self.warnings += control_warnings(
            tuple(self.modes), control.beside, control.elsewhere, exact_stop=runs.language.exact_stop,
            resting=self.resting, apart=self.apart,
        )  # fmt: skip
        self.warnings += spindle_warning(np.array(self._still, np.int64))
        self.warnings += [*self.job.taken.remarks, *self._doubts.warnings(), *stock]
        if not (self._moved or feeds) and self._feeds.feeds:
            self.warnings.append(below_step_warning(self._feeds.name, self._feeds.feeds, self.step_mm))

    def summary(self) -> Summary:
        """The figures of the program."""
        rotary = self.job.machine.revolute
        before, after = (each + self.waiting_s for each in self.times)
        tilt, policy = self.tilt_after, self.job.config.compensation.policy
        figures = {
            "points": self.points,
            "segments_in": self.motions,
            "lines_in": self.lines_in,
            "lines_out": self.lines_out,
            "before": self.before.figures(),
            "after": self.after.figures(),
            "actuator_change_max_mm": float(self.change[~rotary].max(initial=0.0)),
            "actuator_force_max_N": float(self.force[~rotary].max(initial=0.0)),
            "actuator_change_max_rad": float(self.change[rotary].max()) if rotary.any() else None,
            "actuator_torque_max_Nmm": float(self.force[rotary].max()) if rotary.any() else None,
            "iterations_max": self.iterations,
            "method": self.method,
            **job_figures(self.job),
            "platform_tilt_max_mrad": 1e3 * self.tilt,
            "tilt_after_mrad": None if tilt is None else 1e3 * tilt,
            "joining_lines": self.joins,
            "cycle_time_s": CycleTime(before=before, after=after),
            "control_mode": mode_name(tuple(self.modes)),
            "control_mode_stated": all(each.stated for each in self.modes),
            "under_control": self.driven.figures(),
            **({} if self.bands is None else band_figures(self.bands, policy)),
            "warnings": self.warnings,
        }
        figures = {key: each for key, each in figures.items() if each is not None}
        proof = {"interpolation": self.interpolated} if self._in_pieces or self.interpolated else {}
        return Summary.model_validate({**figures, **proof})

    def failed_checks(self, tolerance_um: float) -> list[tuple[str, str]]:
        """Rule id and text of every check that the program does not pass."""
        out, machine = [], self.job.machine
        worst = self.missed.most_um
        if not worst <= tolerance_um * (1.0 + 1e-9):
            out.append(("CC601", f"{worst:.3f} um are left, more than the tolerance of {tolerance_um:g} um"))
        out += worse_than_before(self.before.most_um, self.after.most_um, self.step_mm)
        for name, turns, limits, lines in zip(
            machine.actuators, machine.revolute, machine.limits, self._beyond, strict=True
        ):
            if lines:
                (low, high), (unit, k) = limits, ("deg", 180.0 / np.pi) if turns else ("mm", 1.0)
                span = f"{k * low:g} to {k * high:g} {unit}"
                out.append(("CC602", f"actuator {name} leaves its travel {span} at {named_lines(lines)}"))
        return out + interpolation_failed(self.interpolated)
