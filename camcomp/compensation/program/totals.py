"""The figures and warnings of a corrected program, added up part by part: corrected as a whole, or in pieces."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from camcomp.compensation.bands.outcome import Bands, BandTotals, band_figures
from camcomp.compensation.program.compensate import Compensated
from camcomp.compensation.program.control_account import ControlAccount
from camcomp.compensation.program.result import (
    CycleTime,
    ErrorSum,
    Interpolation,
    Summary,
    interpolation_failed,
    job_figures,
    worse_than_before,
)
from camcomp.compensation.program.under_control import control_warnings, merging, mode_name
from camcomp.gcode.dialect import Dialect
from camcomp.gcode.output import Part
from camcomp.gcode.path_mode import PathMode
from camcomp.gcode.text import count_lines
from camcomp.gcode.uncorrected import below_step_warning
from camcomp.ground.datatypes import Bools, Floats, Ints
from camcomp.ground.orientation import angles_of
from camcomp.ground.records import dataclass
from camcomp.ground.source_lines import MOST_LINES, named_lines
from camcomp.ground.vectors import sizes
from camcomp.model.control import limits_of, waiting_s
from camcomp.model.cutting.assumed import ForceDoubts
from camcomp.model.cutting.spindle import spindle_warning
from camcomp.model.job import Job
from camcomp.model.stock.warnings import Remarks, stock_remarks, stock_warnings


@dataclass(frozen=True, eq=False, kw_only=True)
class JointTableRows:
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

    def __init__(self, job: Job, name: str = "", *, tolerance_um: float = np.inf, tabled: bool = True) -> None:
        """name: of the program. tolerance_um: beyond which the controller is warned of. tabled: rows are asked for."""
        self.job, self._name, self._tabled = job, name, tabled
        self.before, self.after, self.missed = ErrorSum(), ErrorSum(), ErrorSum()
        self.points = self.motions = self.lines_in = self.lines_out = self.joins = self.iterations = 0
        self.change = self.force = np.zeros(len(job.machine.actuators))
        self.tilt, self.method, self.step_mm = 0.0, "newton", 0.0  # step of the output
        self.tilt_after: float | None = None  # of programs with orientation
        self.warnings: list[str] = []
        self.null: tuple[str, ...] = ()  # figures that are stated also where they are null
        self.interpolated: Interpolation | None = None
        self.bands: BandTotals | None = None
        self._s = self._t = 0.0
        self._beyond: list[list[int]] = [[] for _ in job.machine.actuators]
        account = 1e-3 * tolerance_um
        limits = limits_of(job.config)
        self._accounts = ControlAccount(limits, account), ControlAccount(limits, account)  # before and after
        self.modes: dict[PathMode, None] = {}  # in which it cuts
        self._apart: dict[PathMode, None] = {}  # in which lines are kept from being made one
        self._resting = 0  # end points at which the control rests because of joining lines
        self.waiting_s = 0.0  # besides its moves
        self._doubts = ForceDoubts(config=job.config)
        self._remarks: Remarks = {}  # on the stock
        self._found: dict[str, None] = {}  # warnings of the correction
        self._feeds, self._moved = 0, False  # corrected feed motions, and whether any leads elsewhere than programmed
        self._still: list[int] = []  # source lines that cut while the spindle stands, the first ones

    @classmethod
    def of(cls, result: Compensated, job: Job) -> Totals:
        """Totals of a program that was corrected as a whole."""
        program, control = result.program, result.control
        out = cls(job, program.name, tolerance_um=1e3 * control.tolerance_mm, tabled=False)
        out.add(result)
        out.lines_in, out.lines_out = count_lines(program.data), count_lines(result.written.data)
        out.interpolated = result.interpolated
        if result.tilt_after is not None:
            out.tilt = out.tilt_after = float(np.fmax.reduce(result.tilt_after, initial=0.0))
        out.finish(program.language, program.warnings, waiting_s(job.config, program.dwelt_s, program.tool_changes))
        return out

    def add(self, result: Compensated, own: slice = slice(None), part: Part | None = None) -> JointTableRows:
        """Add the motions `part` of a result, None: of a whole program; own: their rows."""
        path = result.program.path
        self._add_control(result, own, part)
        path, engaged = path if part is None else path.take(slice(part.first, part.last)), result.engaged
        self.motions, self.method = self.motions + len(path), result.method
        if part is not None and engaged is not None:
            engaged = engaged.of_motions(part.first, part.last)
        for key, seen in stock_remarks(self.job.config, path, engaged).items():
            self._remarks[key] = np.union1d(self._remarks.get(key, seen[:0]), seen)
        self._doubts.add(path)
        self._found |= dict.fromkeys(result.warnings)
        self._feeds, self._moved = self._feeds + result.feeds, self._moved or result.moved
        self._still += result.without_spindle[: MOST_LINES + 1 - len(self._still)].tolist()
        return self.add_exact(result, own)

    def _add_control(self, result: Compensated, own: slice, part: Part | None) -> None:
        """Plan the moves as the controller does."""
        control, language = result.control, result.program.language
        self.modes |= dict.fromkeys(control.modes)
        if control.apart:
            self._apart |= dict.fromkeys(mode for mode in control.modes if merging(mode, language))
        self._resting += control.resting
        if part is None:
            self._accounts = control.original, control.account
            return
        before, after = self._accounts
        before.add(control.programmed.take(slice(part.first, part.last)))
        after.add(control.written.take(own), control.points.take(slice(None), own.start))

    def finish(self, language: Dialect, read: Sequence[str], waiting_s: float) -> None:
        """Collect the warnings of all parts behind those of the reader (`read`); waiting_s: besides the moves."""
        for each in self._accounts:
            each.finish()
        self.waiting_s, control = waiting_s, self._accounts[1]
        self.warnings = [*read, *warm_up_warnings(self.job)]
        self.warnings += control_warnings(
            tuple(self.modes), control.at_joins, control.elsewhere, exact_stop=language.exact_stop,
            resting=self._resting, apart=self._apart,
        )  # fmt: skip
        self.warnings += spindle_warning(np.array(self._still, np.int64))
        self.warnings += [*self.job.taken.remarks, *self._doubts.warnings(), *stock_warnings(self._remarks)]
        if self._feeds and not self._moved:
            self.warnings.append(below_step_warning(self._name, self._feeds, self.step_mm))
        self.warnings += self._found

    def add_exact(self, result: Compensated, own: slice = slice(None)) -> JointTableRows:
        """Add rows `own` of a result that was corrected exactly."""
        rows, state, first = result.rows, result.state, own.start or 0
        s0, t0 = (result.s[first - 1], result.t[first - 1]) if first else (0.0, 0.0)
        s, t = self._s + result.s[own] - s0, self._t + result.t[own] - t0
        self._s, self._t = float(s[-1]), float(t[-1])
        words = None
        if result.orienting is not None and result.written.words is not None:
            both = (result.programmed_words[own], result.written.words[own])
            words = np.column_stack([angles_of(result.orienting.form, each) for each in both])
        out = JointTableRows(
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
        self, rows: JointTableRows, *, joining: Bools, corrected: Bools, tilt: Floats, before: Floats, after: Floats,
        missed: Floats,
    ) -> None:  # fmt: skip
        """Add rows (N,), and errors (k, 3) mm between them."""
        self.points += len(rows.line)
        self.joins += int(joining.sum())
        self.change = np.fmax(self.change, _largest(rows.joints - rows.nominal, corrected))
        self.force = np.fmax(self.force, _largest(rows.drive, corrected))
        self.tilt = float(np.fmax.reduce(sizes(tilt)[corrected], initial=self.tilt))
        self.before.add(before)
        self.after.add(after)
        self.missed.add(missed)
        for a, (low, high) in enumerate(self.job.machine.limits):
            over = np.flatnonzero((rows.joints[:, a] < low) | (rows.joints[:, a] > high))
            if len(over) and len(self._beyond[a]) <= MOST_LINES:
                lines = np.unique(rows.line[over])[: MOST_LINES + 1]
                self._beyond[a] = sorted({*self._beyond[a], *lines.tolist()})[: MOST_LINES + 1]

    def _columns(self, bands: Bands | None, own: slice = slice(None)) -> Floats | None:
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

    def summary(self) -> Summary:
        """The figures of the program."""
        rotary = self.job.machine.revolute
        before, after = (each.seconds + self.waiting_s for each in self._accounts)
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
            "under_control": self._accounts[1].errors.figures(),
            **({} if self.bands is None else band_figures(self.bands, policy)),
            "interpolation": self.interpolated,
            "warnings": self.warnings,
        }
        return Summary.model_validate(
            {key: each for key, each in figures.items() if each is not None or key in self.null}
        )

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


def _largest(values: Floats, on: Bools) -> Floats:
    """Largest size (m,) in every column of some rows of values (N, m), without NaN; 0 without rows."""
    return np.array([np.fmax.reduce(np.abs(each[on]), initial=0.0) for each in values.T])


def warm_up_warnings(job: Job) -> list[str]:
    """Warnings of effects whose machine counts as warming up."""
    if job.config.process.temperature_C is not None:
        return []
    warm = dict.fromkeys(cause.name for cause in job.causes if getattr(cause.effect, "WARMS", False))
    return [f"{name}: without process: temperature_C the machine counts as warming up from 20 deg C" for name in warm]
