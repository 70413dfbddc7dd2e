"""The figures of a long program, added up piece by piece, and the proof of its interpolation."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from camcomp.compensation.bands.outcome import Bands, BandTotals, band_figures
from camcomp.compensation.long.control_account import ControlAccount, SeenPoints
from camcomp.compensation.long.engagement import path_of_run
from camcomp.compensation.long.plain import CorrectedRun, PlainCorrector
from camcomp.compensation.long.plain_run import PlainRun
from camcomp.compensation.long.runs import Runs
from camcomp.compensation.program.compensate import Compensated
from camcomp.compensation.program.result import (
    BOUND_UM,
    CycleTime,
    ErrorSize,
    Interpolation,
    Summary,
    interpolation_failed,
    job_figures,
    worse_than_before,
)
from camcomp.compensation.program.under_control import (
    control_warnings,
    mode_name,
    written_moves,
)
from camcomp.gcode.output import Part
from camcomp.gcode.path_mode import PathMode
from camcomp.gcode.uncorrected import UncorrectedFeeds, below_step_warning
from camcomp.ground.datatypes import LINE, RAPID, Bools, Floats, Ints
from camcomp.ground.source_lines import MOST_LINES, named_lines
from camcomp.model.control import limits_of
from camcomp.model.cutting.assumed import ForceDoubts
from camcomp.model.cutting.spindle import spindle_warning
from camcomp.model.job import Job
from camcomp.model.statics.target import correct, settle
from camcomp.model.trajectory.moves import line_moves, moves_of

SAME_MM = 1e-9  # of a place as programmed and as written
SAMPLE, SAMPLE_SHARE = 1000, 0.05  # points that are solved exactly, at most and of all


@dataclass(frozen=True, eq=False, kw_only=True)
class Batch:
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


class _Errors:
    """Sum of squares, count and largest of errors."""

    def __init__(self) -> None:
        self.squares, self.count, self.most = 0.0, 0, 0.0

    def add(self, error: Floats) -> None:
        square = np.einsum("ni,ni->n", error, error)
        square = square[np.isfinite(square)]
        self.squares += float(square.sum())
        self.count += len(square)
        self.most = max(self.most, float(np.sqrt(square.max(initial=0.0))))

    def figures(self) -> ErrorSize:
        rms = np.sqrt(self.squares / self.count) if self.count else 0.0
        return ErrorSize(rms_um=1e3 * float(rms), max_um=1e3 * self.most)


class Totals:
    """Everything that the summary of a run says."""

    def __init__(
        self, job: Job, name: str, digest: str, size: int, *, tolerance_um: float, tabled: bool = True
    ) -> None:
        """name, digest and size are those of the program; they decide which points are checked. tabled: rows are asked for."""
        self.job, self._tabled = job, tabled
        self.before, self.after, self.missed = _Errors(), _Errors(), _Errors()
        self.points = self.motions = self.lines_in = self.lines_out = self.joins = self.iterations = 0
        self.change = self.force = np.zeros(len(job.machine.actuators))
        self.tilt = 0.0
        self.step_mm = job.config.control.resolution_mm  # of the output
        self.warnings: list[str] = []
        self.interpolated: Interpolation | None = None
        self.bands: BandTotals | None = None
        self._s = self._t = 0.0
        self._beyond: list[list[int]] = [[] for _ in job.machine.actuators]
        self._random = np.random.default_rng(int(digest[:16], 16))
        self._share = min(1.0, 3.0 * SAMPLE * 24.0 / max(size, 1))  # a line has some 24 bytes
        self._sample: list[Floats] = []
        limits = limits_of(job.config)
        self._control = ControlAccount(limits, 1e-3 * tolerance_um), ControlAccount(limits, 1e-3 * tolerance_um)
        self.modes: dict[PathMode, None] = {}  # in which it cuts
        self.apart: dict[PathMode, None] = {}  # in which lines are kept from being made one
        self.waiting_s = 0.0  # beside its moves
        self.resting = 0  # end points at which the control rests because of joining lines
        self._doubts = ForceDoubts(config=job.config)
        self._feeds = UncorrectedFeeds(name)
        self._moved = False  # any feed move is corrected
        self._still: list[int] = []  # source lines that cut while the spindle stands, the first ones

    # --- pieces --------------------------------------------------------------------------------------------------

    def plain(self, whole: PlainRun, done: CorrectedRun, corrector: PlainCorrector) -> Batch:
        """Adds a run of plain lines."""
        run, rows, answers = done.run, done.rows, done.answers
        plain, frame = run.plain, self.job.frame
        way = plain.end - plain.start
        length = np.sqrt(np.einsum("ni,ni->n", way, way))
        s = self._s + (np.cumsum(length) - length)[rows.move] + rows.w * length[rows.move]
        feed = plain.feed[rows.move]
        feed = np.where(np.isnan(feed), self.job.config.process.feed_mm_per_min or np.nan, feed)
        moving = (plain.kind[rows.move] == LINE) & (feed > 0.0)
        t = self._t + np.cumsum(np.where(moving, np.diff(s, prepend=self._s) / np.where(moving, feed, 1.0) * 60.0, 0.0))
        self._s, self._t = self._s + float(length.sum()), float(t[-1])
        joints, drive = corrector.actuators(done)
        self.step_mm = max(self.step_mm, corrector.resolution)
        self._common(
            whole.motions, rows.joining, corrected=np.ones(len(s), np.bool_),
            line=plain.row[rows.move] + run.row0 + 1, nominal=answers.nominal, joints=joints, drive=drive,
            tilt=answers.rest[:, :3], before=done.before, after=done.after, missed=done.missed,
        )  # fmt: skip
        self._plain_control(run, done)
        moves = path_of_run(whole)
        self._doubts.add(moves)
        self._feeds.add(moves)
        self._moved = self._moved or _differ(rows.target, done.written, plain.kind[rows.move] != RAPID)
        if run.state.sense == 0.0:
            self._stands(np.unique(plain.row[rows.move[rows.force.any(axis=1)]]) + run.row0 + 1)
        force = frame.vectors(rows.force)
        chosen = np.flatnonzero(self._random.random(len(s)) < self._share)
        if len(chosen):
            off = corrector.off(done)
            parts = (frame.to_machine(rows.target), force, answers.correction, answers.unloaded, joints, drive, off)
            self._sample.append(np.concatenate([each[chosen] for each in parts], axis=1))
        return Batch(
            line=plain.row[rows.move] + run.row0 + 1, s=s, t=t, target=rows.target, written=done.written, force=force,
            nominal=answers.nominal, joints=joints, drive=drive,
            behind=self._behind(self._known(done.bands), rows.engagement),
        )  # fmt: skip

    def _plain_control(self, run: PlainRun, done: CorrectedRun) -> None:
        """Plan the moves of plain lines as the controller does."""
        plain, rows, mode = run.plain, done.rows, run.state.path_mode
        before, after = self._control
        default = self.job.config.process.feed_mm_per_min or np.nan
        self.modes[mode] = None
        told = np.where(np.isnan(plain.feed), default, plain.feed)
        before.add(line_moves(kind=plain.kind, start=plain.start, end=plain.end, feed=told, mode=mode, waits=run.waits))
        start = np.concatenate((done.begin[None], done.written[:-1]))
        moves = line_moves(
            kind=plain.kind[rows.move], start=start, end=done.written, feed=done.feed, mode=mode, waits=run.waits
        )
        moves = replace(moves, exact=moves.exact | done.rest)
        if done.apart:
            self.apart[mode] = None
            moves = replace(moves, merge=np.zeros(len(moves)))
        self.resting += int(done.rest.sum())
        ends = len(rows.move) - np.count_nonzero(rows.joining | (plain.kind[rows.move] != LINE))
        seen = done.seen
        told = np.concatenate((done.written[seen[:ends]], 0.5 * (start + done.written)[seen[ends:]]))
        joining = np.concatenate((rows.joining, [False]))
        line = plain.row[rows.move[seen]] + run.row0 + 1
        after.add(moves, SeenPoints(seen, told, done.missed, line, joining[seen - 1] | joining[seen + 1]))

    def _odd_control(self, result: Compensated, own: Bools, part: Part) -> None:
        """Plan the moves of exactly corrected lines as the controller does."""
        path, modes, control = result.program.path, result.program.modes, result.control
        before, after = self._control
        default = self.job.config.process.feed_mm_per_min or np.nan
        mine = slice(part.first, part.last)
        self.modes |= {modes[k]: None for k in range(part.first, part.last) if path.kind[k] != RAPID}
        feed = np.where(np.isnan(path.feed), default, path.feed)
        before.add(moves_of(path, modes, feed, result.program.per_turn).take(mine))
        first = int(np.flatnonzero(own)[0])
        moves = written_moves(result.program, result.rows, result.written, default)
        moves = replace(moves, exact=moves.exact | control.rest).take(own)
        self.resting += int(control.rest.sum())
        points = SeenPoints(control.row - first, control.told, result.missed, result.lines[control.row], control.joined)
        after.add(moves, points)

    def odd(self, result: Compensated, own: Bools, part: Part) -> Batch:
        """Adds a piece that was corrected exactly; own (N,): its rows without the context's."""
        first = int(np.flatnonzero(own)[0])
        s0, t0 = (result.s[first - 1], result.t[first - 1]) if first else (0.0, 0.0)
        s, t = self._s + result.s[own] - s0, self._t + result.t[own] - t0
        self._s, self._t = float(s[-1]), float(t[-1])
        state, rows = result.state, result.rows
        corrected = rows.corrected[own]
        self._odd_control(result, own, part)
        moves = result.program.path.take(np.arange(part.first, part.last))
        self._doubts.add(moves)
        self._feeds.add(moves)
        self._moved = self._moved or _differ(rows.target[own], result.written.end[own], rows.kind[own] != RAPID)
        self._common(
            part.last - part.first, rows.joining[own], corrected=corrected, line=result.lines[own],
            nominal=result.nominal[own], joints=state.rho[own], drive=state.drive[own], tilt=state.tilt[own],
            before=result.before, after=result.after, missed=result.missed,
        )  # fmt: skip
        self.iterations = max(self.iterations, result.iterations)
        self._stands(result.without_spindle)
        force = self.job.frame.vectors(rows.force[own])
        return Batch(
            line=result.lines[own], s=s, t=t, target=rows.target[own], written=result.written.end[own], force=force,
            nominal=result.nominal[own], joints=state.rho[own], drive=state.drive[own],
            behind=self._behind(self._known(result.bands, own), rows.engagement[own]),
        )  # fmt: skip

    def _behind(self, bands: Floats | None, engagement: Floats | None) -> Floats | None:
        """Columns behind the others: bands, and with a stock the engagement."""
        parts = [] if bands is None else [bands]
        if self.job.config.workpiece.stock is not None and engagement is not None:
            parts.append(engagement)
        return np.column_stack(parts) if parts else None

    def _known(self, bands: Bands | None, own: Bools | slice = slice(None)) -> Floats | None:
        """Add the expected error of a piece; return the band columns of its own rows if the table needs them."""
        if bands is None:
            return None
        self.bands = bands.totals if self.bands is None else self.bands.join(bands.totals)
        if not self._tabled:
            return None
        return bands.columns(with_share=self.job.config.compensation.policy != "full")[own]

    def _common(
        self,
        motions: int,
        joining: Bools,
        *,
        corrected: Bools,
        line: Ints,
        nominal: Floats,
        joints: Floats,
        drive: Floats,
        tilt: Floats,
        before: Floats,
        after: Floats,
        missed: Floats,
    ) -> None:
        self.points += len(line)
        self.motions += motions
        self.joins += int(joining.sum())
        if corrected.any():
            self.change = np.fmax(self.change, np.abs(joints - nominal)[corrected].max(axis=0))
            self.force = np.fmax(self.force, np.abs(drive)[corrected].max(axis=0))
            self.tilt = max(self.tilt, float(np.sqrt(np.einsum("ni,ni->n", tilt, tilt)[corrected].max())))
        self.before.add(before)
        self.after.add(after)
        self.missed.add(missed)
        for a, (low, high) in enumerate(self.job.machine.limits):
            over = np.flatnonzero((joints[:, a] < low) | (joints[:, a] > high))
            if len(over) and len(self._beyond[a]) < 10:
                self._beyond[a] = sorted({*self._beyond[a], *np.unique(line[over])[:10].tolist()})[:10]

    def _stands(self, lines: Ints) -> None:
        self._still += lines[: MOST_LINES + 1 - len(self._still)].tolist()

    # --- the end -------------------------------------------------------------------------------------------------

    def finish(self, corrector: PlainCorrector, runs: Runs, stock: list[str]) -> None:
        """Collect the warnings, also those of the stock, solve the sample exactly, and keep the largest differences."""
        for each in self._control:
            each.finish()
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
        known, m = corrector.field, len(self.job.machine.actuators)
        if known is None or not self._sample:
            return
        sample = np.concatenate(self._sample)
        wanted = min(SAMPLE, max(SAMPLE // 10, int(SAMPLE_SHARE * self.points)))
        sample = sample[self._random.permutation(len(sample))[:wanted]]
        sample = sample[np.lexsort(sample[:, :3].T)]
        p, f, correction, unloaded, joints, drive, off = np.split(sample, np.cumsum([3, 3, 3, 3, m, m]), axis=1)
        machine = corrector.machine
        exact = correct(machine, p, f)
        tip, _ = settle(machine, p, f)
        _, written = settle(machine, p + correction + off, f)
        reach = np.where(machine.revolute, 1000.0, 1.0)
        gaps = (exact.commanded - p - correction, tip - p - unloaded, (written.rho_nominal - joints) * reach)
        worst = max(1e3 * float(np.abs(each).max()) for each in gaps)
        self.iterations = max(self.iterations, int(exact.iterations.max()))
        self.interpolated = Interpolation(
            bound_um=BOUND_UM, checked=len(p), worst_um=worst if np.isfinite(worst) else float("inf"),
            worst_drive_force=float(np.nan_to_num(np.abs(written.drive - drive), nan=np.inf).max()),
            tiles=int(known.used.sum()), exact_solutions=int(known.tiles.solved[known.used].sum()) + 3 * len(p) + 2 * corrector.exact,
        )  # fmt: skip
        known.keep(sound=worst <= BOUND_UM)

    def summary(self) -> Summary:
        """The figures, as report.tables.summary has them for short programs, and those of the interpolation."""
        before, after = self._control
        rotary = self.job.machine.revolute
        sizes = {
            "actuator_change_max_mm": float(self.change[~rotary].max(initial=0.0)),
            "actuator_force_max_N": float(self.force[~rotary].max(initial=0.0)),
        }
        if rotary.any():
            sizes |= {
                "actuator_change_max_rad": float(self.change[rotary].max()),
                "actuator_torque_max_Nmm": float(self.force[rotary].max()),
            }
        return Summary.model_validate(
            {
                "points": self.points,
                "segments_in": self.motions,
                "lines_in": self.lines_in,
                "lines_out": self.lines_out,
                "before": self.before.figures(),
                "after": self.after.figures(),
                **sizes,
                "iterations_max": self.iterations,
                "method": "newton",
                **job_figures(self.job),
                "platform_tilt_max_mrad": 1e3 * self.tilt,
                "joining_lines": self.joins,
                "cycle_time_s": CycleTime(before=before.seconds + self.waiting_s, after=after.seconds + self.waiting_s),
                "control_mode": mode_name(tuple(self.modes)),
                "control_mode_stated": all(each.stated for each in self.modes),
                "under_control": ErrorSize(
                    rms_um=1e3 * float(np.sqrt(after.squares / max(after.count, 1))), max_um=1e3 * after.most
                ),
                **({} if self.bands is None else band_figures(self.bands, self.job.config.compensation.policy)),
                "interpolation": self.interpolated,
                "warnings": self.warnings,
            }
        )

    def failed_checks(self, tolerance_um: float) -> list[tuple[str, str]]:
        """Rule id and text of every check that the program does not pass."""
        out = []
        worst = 1e3 * self.missed.most
        if not worst <= tolerance_um * (1.0 + 1e-9):
            out.append(("CC601", f"{worst:.3f} um are left, more than the tolerance of {tolerance_um:g} um"))
        out += worse_than_before(self.before.figures().max_um, self.after.figures().max_um, self.step_mm)
        for a, name in enumerate(self.job.machine.actuators):
            if self._beyond[a]:
                low, high = self.job.machine.limits[a]
                unit, k = ("deg", 180.0 / np.pi) if self.job.machine.revolute[a] else ("mm", 1.0)
                span, lines = f"{k * low:g} to {k * high:g} {unit}", named_lines(self._beyond[a])
                out.append(("CC602", f"actuator {name} leaves its travel {span} at {lines}"))
        return out + interpolation_failed(self.interpolated)


def _differ(target: Floats, written: Floats, feed: Bools) -> bool:
    """Whether any feed move ends elsewhere than programmed; target, written (N, 3) mm."""
    return bool((np.abs(written - target)[feed] > SAME_MM).any())
