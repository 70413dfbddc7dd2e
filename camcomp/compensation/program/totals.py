"""The figures and warnings of a corrected program, added up part by part: corrected as a whole, or in pieces."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from camcomp.compensation.bands.outcome import BandTotals, band_figures
from camcomp.compensation.program.compensate import Compensated
from camcomp.compensation.program.result import (
    ErrorSum,
    Interpolation,
    Summary,
    interpolation_failed,
    job_figures,
    worse_than_before,
)
from camcomp.compensation.program.under_control import ControlAccount, control_figures, control_warnings, merging
from camcomp.gcode.dialect import Dialect
from camcomp.gcode.output import Part
from camcomp.gcode.path_mode import PathMode
from camcomp.gcode.text import count_lines
from camcomp.gcode.uncorrected import below_step_warning
from camcomp.ground.datatypes import Bools, Floats, Ints
from camcomp.ground.orientation import angles_of
from camcomp.ground.records import dataclass
from camcomp.ground.source_lines import MOST_LINES, named_lines
from camcomp.ground.vectors import chosen, distinct, sizes
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
        self.before, self.after, self.missed_um = ErrorSum(), ErrorSum(), 0.0
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
        path, state, out = result.program.path, result.state, self._rows(result, own)
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
        corrected = result.rows.corrected[own]
        self.points += len(out.line)
        self.joins += int(result.rows.joining[own].sum())
        self.change = np.fmax(self.change, _largest(out.joints - out.nominal, corrected))
        self.force = np.fmax(self.force, _largest(out.drive, corrected))
        self.tilt = float(np.fmax.reduce(chosen(sizes(state.tilt[own]), corrected), initial=self.tilt))
        self.before.add(result.before)
        most = self.after.add(result.after)
        if result.missed is not result.after:
            most = ErrorSum().add(result.missed)
        self.missed_um = max(self.missed_um, most)
        self._add_beyond(out)
        self.iterations = max(self.iterations, result.iterations)
        self.step_mm = max(self.step_mm, result.program.step_mm(self.job.config.control.resolution_mm))
        return out

    def _add_control(self, result: Compensated, own: slice, part: Part | None) -> None:
        """Plan the moves as the controller does."""
        control, language = result.control, result.program.language
        self.modes |= dict.fromkeys(control.modes)
        if control.apart:
            self._apart |= dict.fromkeys(mode for mode in control.modes if merging(mode, language))
        self._resting += int(control.rest.sum())
        if part is None:
            self._accounts = control.original, control.account
            return
        before, after = self._accounts
        before.add(control.programmed.take(slice(part.first, part.last)))
        after.add(control.written.take(own), control.points.behind(-own.start))

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

    def _rows(self, result: Compensated, own: slice) -> JointTableRows:
        """Rows `own` of a result, behind those before."""
        rows, state, first = result.rows, result.state, own.start or 0
        s0, t0 = (result.s[first - 1], result.t[first - 1]) if first else (0.0, 0.0)
        s, t = self._s + result.s[own] - s0, self._t + result.t[own] - t0
        if len(s):
            self._s, self._t = float(s[-1]), float(t[-1])
        return JointTableRows(
            line=result.lines[own], s=s, t=t, target=rows.target[own], written=result.written.end[own],
            force=result.force[own], nominal=result.nominal[own], joints=state.rho[own], drive=state.drive[own],
            behind=self._behind(result, own),
        )  # fmt: skip

    def _behind(self, result: Compensated, own: slice) -> Floats | None:
        """Columns behind the others, if the table needs them: bands, with a stock the engagement, words of the orientation."""
        bands, parts = result.bands, []
        if bands is not None:
            self.bands = bands.totals if self.bands is None else self.bands.join(bands.totals)
        if not self._tabled:
            return None
        if bands is not None:
            parts.append(bands.columns(with_share=self.job.config.compensation.policy != "full")[own])
        if self.job.config.workpiece.stock is not None:
            parts.append(result.rows.engagement[own])
        if result.orienting is not None:
            both = (result.programmed_words, result.written.words)
            parts += [angles_of(result.orienting.form, each[own]) for each in both if each is not None]
        return np.column_stack(parts) if parts else None

    def _add_beyond(self, rows: JointTableRows) -> None:
        """Note the lines on which actuators leave their travel."""
        for a, (low, high) in enumerate(self.job.machine.limits):
            over = rows.line[(rows.joints[:, a] < low) | (rows.joints[:, a] > high)]
            self._beyond[a] = sorted({*self._beyond[a], *distinct(over)})[: MOST_LINES + 1]

    def summary(self) -> Summary:
        """The figures of the program."""
        rotary = self.job.machine.revolute
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
            **control_figures(tuple(self.modes), self._accounts, (self.waiting_s, self.waiting_s)),
            **({} if self.bands is None else band_figures(self.bands, policy)),
            "interpolation": self.interpolated,
            "warnings": self.warnings,
        }
        return Summary.model_construct(
            **{key: each for key, each in figures.items() if each is not None or key in self.null}
        )

    def failed_checks(self, tolerance_um: float) -> list[tuple[str, str]]:
        """Rule id and text of every check that the program does not pass."""
        out, machine = [], self.job.machine
        worst = self.missed_um
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
    return np.array([np.fmax.reduce(np.abs(each), initial=0.0) for each in chosen(values, on).T])


def warm_up_warnings(job: Job) -> list[str]:
    """Warnings of effects whose machine counts as warming up."""
    if job.config.process.temperature_C is not None:
        return []
    warm = dict.fromkeys(cause.name for cause in job.causes if getattr(cause.effect, "WARMS", False))
    return [f"{name}: without process: temperature_C the machine counts as warming up from 20 deg C" for name in warm]
