"""The figures of a corrected program, added up part by part: of one that was corrected as a whole, or in pieces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from camcomp.compensation.bands.outcome import Bands, BandTotals, band_figures
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
from camcomp.compensation.program.under_control import mode_name
from camcomp.gcode.path_mode import PathMode
from camcomp.gcode.text import count_lines
from camcomp.ground.datatypes import Bools, Floats, Ints
from camcomp.ground.orientation import angles_of
from camcomp.ground.source_lines import MOST_LINES, named_lines
from camcomp.ground.vectors import sizes
from camcomp.model.control import waiting_s
from camcomp.model.job import Job


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

    NULL: tuple[str, ...] = ()  # figures that are stated also where they are null

    def __init__(self, job: Job, *, tabled: bool = True) -> None:
        """tabled: rows are asked for."""
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
        self.driven = ErrorSum()  # under the controller
        self.times = (0.0, 0.0)  # s of the moves, before and after
        self.modes: dict[PathMode, None] = {}  # in which it cuts
        self.waiting_s = 0.0  # besides its moves

    @classmethod
    def of(cls, result: Compensated, job: Job) -> Totals:
        """Totals of a program that was corrected as a whole."""
        program, control = result.program, result.control
        out = cls(job, tabled=False)
        out.add_exact(result)
        out.motions, out.method, out.warnings = len(program.path), result.method, result.warnings
        out.lines_in, out.lines_out = count_lines(program.data), count_lines(result.written.data)
        out.modes, out.times = dict.fromkeys(control.modes), (control.before_s, control.after_s)
        out.driven.add(control.error)
        out.waiting_s = waiting_s(job.config, program.dwelt_s, program.tool_changes)
        out.interpolated = result.interpolated
        if result.tilt_after is not None:
            out.tilt = out.tilt_after = float(np.fmax.reduce(result.tilt_after, initial=0.0))
        return out

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
        change = np.abs(rows.joints - rows.nominal)[corrected]
        self.change = np.fmax(self.change, np.fmax.reduce(change, axis=0, initial=0.0))
        self.force = np.fmax(self.force, np.fmax.reduce(np.abs(rows.drive)[corrected], axis=0, initial=0.0))
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
            "interpolation": self.interpolated,
            "warnings": self.warnings,
        }
        return Summary.model_validate(
            {key: each for key, each in figures.items() if each is not None or key in self.NULL}
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
