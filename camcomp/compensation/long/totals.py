"""The figures of a long program, added up piece by piece, and the proof of its interpolation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from camcomp.compensation.long.plain import Done, PlainCorrector
from camcomp.compensation.long.plain_run import PlainRun
from camcomp.compensation.program.compensate import Compensated
from camcomp.compensation.program.result import ErrorSize, Interpolation, Summary
from camcomp.ground.datatypes import LINE, Bools, Floats, Ints
from camcomp.model.cutting.spindle import MOST_LINES, spindle_warning
from camcomp.model.job import Job
from camcomp.model.statics.target import correct, settle

BOUND_UM = 0.05  # no point may differ by more from its exact solution
SAMPLE = 1000  # points that are solved exactly


@dataclass(frozen=True, eq=False)
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

    def __init__(self, job: Job, digest: str, size: int) -> None:
        """Digest and size are those of the program; they decide which points are checked."""
        self.job = job
        self.before, self.after = _Errors(), _Errors()
        self.points = self.motions = self.lines_out = self.joins = self.iterations = 0
        self.change = self.force = np.zeros(len(job.machine.actuators))
        self.tilt = 0.0
        self.warnings: list[str] = []
        self.interpolated: Interpolation | None = None
        self._s = self._t = 0.0
        self._beyond: list[list[int]] = [[] for _ in job.machine.actuators]
        self._random = np.random.default_rng(int(digest[:16], 16))
        self._share = min(1.0, 3.0 * SAMPLE * 24.0 / max(size, 1))  # a line has some 24 bytes
        self._sample: list[Floats] = []
        self._still: list[int] = []  # source lines that cut while the spindle stands, the first ones

    # --- pieces --------------------------------------------------------------------------------------------------

    def plain(self, run: PlainRun, done: Done, corrector: PlainCorrector) -> Batch:
        """Adds a run of plain lines."""
        rows, answers, m = done.rows, done.answers, len(self.job.machine.actuators)
        plain, frame = run.plain, self.job.frame
        way = plain.end - plain.start
        length = np.sqrt(np.einsum("ni,ni->n", way, way))
        s = self._s + (np.cumsum(length) - length)[rows.move] + rows.w * length[rows.move]
        feed = plain.feed[rows.move]
        feed = np.where(np.isnan(feed), self.job.config.process.feed_mm_per_min or np.nan, feed)
        moving = (plain.kind[rows.move] == LINE) & (feed > 0.0)
        t = self._t + np.cumsum(np.where(moving, np.diff(s, prepend=self._s) / np.where(moving, feed, 1.0) * 60.0, 0.0))
        self._s, self._t = self._s + float(length.sum()), float(t[-1])
        drive, joints = answers.rest[:, 3 : 3 + m], corrector.joints(done)
        self._common(run.motions, rows.joining, np.ones(len(s), np.bool_), plain.row[rows.move] + run.row0 + 1, answers.nominal,
                     joints, drive, answers.rest[:, :3], done.before, done.after)  # fmt: skip
        if run.state.sense == 0.0:
            self._stands(np.unique(plain.row[rows.move[rows.force.any(axis=1)]]) + run.row0 + 1)
        force = frame.vectors(rows.force)
        chosen = np.flatnonzero(self._random.random(len(s)) < self._share)
        if len(chosen):
            off = frame.vectors(done.written - done.commanded + rows.shift)
            parts = (frame.to_machine(rows.target), force, answers.correction, answers.unloaded, joints, drive, off)
            self._sample.append(np.concatenate([each[chosen] for each in parts], axis=1))
        return Batch(
            plain.row[rows.move] + run.row0 + 1, s, t, rows.target, done.written, force, answers.nominal, joints, drive
        )

    def odd(self, result: Compensated, own: Bools, motions: int) -> Batch:
        """Adds a piece that was corrected exactly; own (N,): its rows without the context's."""
        first = int(np.flatnonzero(own)[0])
        s0, t0 = (result.s[first - 1], result.t[first - 1]) if first else (0.0, 0.0)
        s, t = self._s + result.s[own] - s0, self._t + result.t[own] - t0
        self._s, self._t = float(s[-1]), float(t[-1])
        state, rows = result.state, result.rows
        corrected = rows.corrected[own]
        self._common(motions, rows.joining[own], corrected, result.lines[own], result.nominal[own], state.rho[own], state.drive[own],
                     state.tilt[own], result.before, result.after)  # fmt: skip
        self.iterations = max(self.iterations, result.iterations)
        self._stands(result.without_spindle)
        force = self.job.frame.vectors(rows.force[own])
        return Batch(result.lines[own], s, t, rows.target[own], result.written.end[own], force, result.nominal[own], state.rho[own],
                     state.drive[own])  # fmt: skip

    def _common(
        self, motions: int, joining: Bools, corrected: Bools, line: Ints, nominal: Floats, joints: Floats, drive: Floats,
        tilt: Floats, before: Floats, after: Floats,
    ) -> None:  # fmt: skip
        self.points += len(line)
        self.motions += motions
        self.joins += int(joining.sum())
        if corrected.any():
            self.change = np.fmax(self.change, np.abs(joints - nominal)[corrected].max(axis=0))
            self.force = np.fmax(self.force, np.abs(drive)[corrected].max(axis=0))
            self.tilt = max(self.tilt, float(np.sqrt(np.einsum("ni,ni->n", tilt, tilt)[corrected].max())))
        self.before.add(before)
        self.after.add(after)
        for a, (low, high) in enumerate(self.job.machine.limits):
            over = np.flatnonzero((joints[:, a] < low) | (joints[:, a] > high))
            if len(over) and len(self._beyond[a]) < 10:
                self._beyond[a] = sorted({*self._beyond[a], *np.unique(line[over])[:10].tolist()})[:10]

    def _stands(self, lines: Ints) -> None:
        self._still += lines[: MOST_LINES + 1 - len(self._still)].tolist()

    # --- the end -------------------------------------------------------------------------------------------------

    def finish(self, corrector: PlainCorrector, warnings: list[str]) -> None:
        """Solves the sample exactly and keeps the largest differences."""
        self.warnings = list(dict.fromkeys(warnings))
        if self.joins:
            self.warnings.append(
                f"{self.joins} joining lines where the cutting force jumps; they are not part of before and after"
            )
        self.warnings += spindle_warning(np.array(self._still, np.int64))
        known, m = corrector.field, len(self.job.machine.actuators)
        if known is None or not self._sample:
            return
        sample = np.concatenate(self._sample)
        sample = sample[self._random.permutation(len(sample))[:SAMPLE]]
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
            bound_um=BOUND_UM,
            checked=len(p),
            worst_um=worst if np.isfinite(worst) else float("inf"),
            worst_drive_force=float(np.nan_to_num(np.abs(written.drive - drive), nan=np.inf).max()),
            tiles=len(known.tiles.half),
            exact_solutions=known.solved + 3 * len(p) + 2 * corrector.exact,
        )

    def summary(self) -> Summary:
        """The figures, as report.tables.summary has them for short programs, and those of the interpolation."""
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
                "lines_out": self.lines_out,
                "before": self.before.figures(),
                "after": self.after.figures(),
                **sizes,
                "iterations_max": self.iterations,
                "method": "newton",
                "platform_tilt_max_mrad": 1e3 * self.tilt,
                "joining_lines": self.joins,
                "interpolation": self.interpolated,
                "warnings": self.warnings,
            }
        )

    def failed_checks(self, tolerance_um: float) -> list[tuple[str, str]]:
        """Rule id and text of every check that the program does not pass."""
        out = []
        worst = 1e3 * self.after.most
        if not worst <= tolerance_um * (1.0 + 1e-9):
            out.append(("CC601", f"{worst:.3f} um are left, more than the tolerance of {tolerance_um:g} um"))
        for a, name in enumerate(self.job.machine.actuators):
            if self._beyond[a]:
                low, high = self.job.machine.limits[a]
                unit, k = ("deg", 180.0 / np.pi) if self.job.machine.revolute[a] else ("mm", 1.0)
                lines = ", ".join(map(str, self._beyond[a]))
                out.append(
                    (
                        "CC602",
                        f"actuator {name} leaves its travel {k * low:g} to {k * high:g} {unit} at source lines {lines}",
                    )
                )
        if self.interpolated and not self.interpolated.worst_um <= BOUND_UM:
            text = (
                f"{self.interpolated.worst_um:.3f} um between interpolated and exact points, more than {BOUND_UM:g} um"
            )
            out.append(("CC607", text))
        return out
