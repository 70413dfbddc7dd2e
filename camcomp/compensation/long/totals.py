"""The figures of a program that is corrected in pieces, with what its controller makes of it."""

from __future__ import annotations

import numpy as np

from camcomp.compensation.long.runs import Runs
from camcomp.compensation.program.compensate import Compensated, warm_up_warnings
from camcomp.compensation.program.control_account import ControlAccount
from camcomp.compensation.program.totals import JointTableRows, Totals
from camcomp.compensation.program.under_control import control_warnings, merging, modes_of
from camcomp.gcode.output import Part
from camcomp.gcode.path_mode import PathMode
from camcomp.gcode.uncorrected import UncorrectedFeeds, below_step_warning
from camcomp.ground.datatypes import RAPID, Bools, Floats, Ints, Path
from camcomp.ground.source_lines import MOST_LINES
from camcomp.model.control import limits_of
from camcomp.model.cutting.assumed import ForceDoubts
from camcomp.model.cutting.spindle import spindle_warning
from camcomp.model.job import Job

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

    def add_piece(self, result: Compensated, own: slice, part: Part) -> JointTableRows:
        """Add the motions `part` of a piece that was corrected exactly; own: their rows."""
        out, rows = self.add_exact(result, own), result.rows
        self._add_control(result, own, part)
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

    def _add_control(self, result: Compensated, own: slice, part: Part) -> None:
        """Plan the moves of a piece as the controller does."""
        program, control, (before, after) = result.program, result.control, self._control
        cuts = part.first + np.flatnonzero(program.path.kind[part.first : part.last] != RAPID)
        modes = modes_of(program.modes, cuts)
        self.modes |= dict.fromkeys(modes)
        if control.apart:
            self.apart |= dict.fromkeys(mode for mode in modes if merging(mode, program.language))
        before.add(control.programmed.take(slice(part.first, part.last)))
        self.resting += int(control.rest.sum())
        after.add(control.written.take(own), control.points.take(slice(None), own.start))

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
