"""The report of a compensation, for people who want to see before they trust."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import PurePath

import numpy as np

from camcomp.compensation.program.compensate import Compensated
from camcomp.compensation.program.result import Summary
from camcomp.compensation.program.totals import Totals
from camcomp.compensation.program.verify import Verified, verify
from camcomp.compensation.report.band_section import band_section
from camcomp.compensation.report.figures import (
    DrawnPath,
    figure_budget,
    figure_error,
    figure_path,
    figure_shift,
    figure_trajectories,
    figures_actuators,
)
from camcomp.compensation.report.machine_drawing import figure_machine
from camcomp.compensation.report.tables import trajectories
from camcomp.compensation.report.wall_drawing import wall_section
from camcomp.gcode.interpret import read_program
from camcomp.ground.datatypes import Floats
from camcomp.ground.vectors import largest_of_groups, sizes
from camcomp.model.config.in_force import values_in_force
from camcomp.model.control import setup_of
from camcomp.model.job import Job
from camcomp.report.inputs import Input, inputs_section
from camcomp.report.page import Page, Section, Table, render
from camcomp.report.plot import brief, micrometres

MOST_LINES = 1000
BUDGET = (
    "Solver: what the iteration itself leaves. Rounding: half the last digit written, in the worst case. "
    "End points: error at the ends of the moves. Chords: what the straight lines between them add."
)


def compensation_html(result: Compensated, totals: Totals, tolerance_um: float, inputs: Sequence[Input]) -> bytes:
    """One HTML file.

    The trajectories are solved here, and the corrected program is read back from its text and verified. Raises
    ConfigError CC216 when the plot library is not installed.
    """
    job, figures, failed = totals.job, totals.summary(), totals.failed_checks(tolerance_um)
    written = read_program(
        result.written.data, name=result.program.name, setup=setup_of(job.config), dialect=result.program.dialect
    )
    checked = verify(written, result.program, job)
    drawn = DrawnPath(result, job)
    name = PurePath(result.program.name).name
    before, after = figures.before.max_um, figures.after.max_um
    if failed:
        verdict = "The corrected program is written, but a check failed: " + "; ".join(text for _, text in failed) + "."
    else:
        verdict = (
            f"By the model the original program leaves up to {micrometres(before)} at the tip, the corrected one "
            f"{micrometres(after)}; the tolerance is {tolerance_um:g} µm."
        )
        taken = figures.taken
        if taken and (less := taken.shrunk + taken.left_alone):
            verdict += (
                f" That is on purpose: with the policy {taken.policy} {less} of {taken.points} points take less than the "
                "whole correction, because the numbers of the machine file are too uncertain there."
            )
    notes = [f"{rule}: {text}" for rule, text in failed] + [str(each) for each in figures.warnings]
    any_feed = bool((~drawn.hidden).any())
    sections = [Section(name="warnings", title="Warnings", items=notes)] if notes else []
    if any_feed:
        if result.bands is not None:
            sections.append(band_section(drawn, result.bands, figures))
        sections += _plots(result, job, drawn, checked=checked, tolerance_um=tolerance_um)
        programs = [("original program", result.program), ("corrected program", written)]
        if walls := wall_section(job, result.program, programs):
            sections.append(walls)
        sections.append(Section(name="lines", title="Line by line", tables=[_lines(drawn, job, checked)]))
    sections += [_machine(job), inputs_section(inputs, result.written.data)]
    page = Page(
        title=f"{name} on {job.config.robot.name}",
        subtitle=f"Compensation report: method {result.method}; {figures.lines_in} lines and {figures.segments_in} motions become "
        f"{figures.lines_out} lines and {figures.points} end points",
        verdict=verdict,
        good=not failed,
        caution=_caution(figures, tolerance_um),
        cards=[
            *_cards(figures, tolerance_um),
            *_travel(drawn, result.state.rho, job),
            ("Warnings", str(len(notes)), "read them below" if notes else "nothing to look at"),
        ],
        sections=sections,
    )
    return render(page)


def _caution(figures: Summary, tolerance_um: float) -> str:
    """A sentence where the path that the controller drives is farther off than the program."""
    left = figures.under_control.max_um
    if left <= max(tolerance_um, figures.after.max_um):
        return ""
    where = f"On the path that the controller drives in {figures.control_mode} up to {micrometres(left)} remain"
    if figures.control_mode_stated:
        return f"{where}; see the warnings."
    return f"{where}: this mode is assumed. State it as control: path_mode, and the program is written for it."


def _cards(figures: Summary, tolerance_um: float) -> list[tuple[str, str, str]]:
    mode = figures.control_mode + ("" if figures.control_mode_stated else " (assumed)")
    times, before = figures.cycle_time_s, figures.before
    cards = [
        ("Tip error before", f"{micrometres(before.max_um)}", f"rms {micrometres(before.rms_um)}"),
        ("Tip error after", f"{micrometres(figures.after.max_um)}", f"tolerance {tolerance_um:g} µm"),
        (f"As the controller drives, {mode}", f"{micrometres(figures.under_control.max_um)}",
         f"tip error, rms {micrometres(figures.under_control.rms_um)}; with the corners that it rounds, also at joining lines"),
        ("Cycle time", f"{brief(times.after)} s", f"before {brief(times.before)} s; with pauses (G4)"),
    ]  # fmt: skip
    acts = {"stock": "by the stock", "stated": "as stated", "none": "on every feed move"}
    cards.append(("Assumed force", acts[figures.force.engagement], figures.force.text))
    if expected := figures.expected:
        cards.append(
            ("Expected", f"{micrometres(expected.p95_um)}", "95 % of all points, machine within the stated spreads")
        )
    for most, what, unit in (
        (figures.actuator_change_max_mm, "Largest correction at a slide", "mm"),
        (1e3 * (figures.actuator_change_max_rad or 0.0), "Largest correction at a hinge", "mrad"),
        (figures.actuator_force_max_N, "Largest drive force", "N"),
        (1e-3 * (figures.actuator_torque_max_Nmm or 0.0), "Largest drive torque", "N·m"),
    ):
        if most:
            cards.append((what, f"{brief(most)} {unit}", ""))
    tilt = figures.platform_tilt_max_mrad
    left = tilt > 1e-6 and figures.tilt_after_mrad is None
    cards.append(("Platform tilt", f"{brief(tilt)} mrad", "X, Y and Z do not correct it" if left else ""))
    cards.append(("Joining lines", str(figures.joining_lines), "where the correction jumps"))
    return cards


def _travel(drawn: DrawnPath, rho: Floats, job: Job) -> list[tuple[str, str, str]]:
    """Smallest distance of an actuator to its travel limits, empty without limits; rho (N, m): commanded."""
    low, high = np.array(job.machine.limits, float).T
    ends = np.flatnonzero(np.isfinite(high - low))
    if not len(ends) or not np.isfinite(rho[:, ends]).any():
        return []
    share = np.minimum(rho - low, high - rho)[:, ends] / (high - low)[ends]
    row, nearest = np.unravel_index(int(np.nanargmin(share)), share.shape)
    a = ends[nearest]
    rotary = bool(job.machine.revolute[a])
    size = float(min(rho[row, a] - low[a], high[a] - rho[row, a]))
    text = f"{brief(np.degrees(size))} deg" if rotary else f"{brief(size)} mm"
    return [("Travel left", text, f"actuator {job.machine.actuators[a]}, line {drawn.line[row]}")]


def _plots(result: Compensated, job: Job, drawn: DrawnPath, checked: Verified, tolerance_um: float) -> list[Section]:
    machine, found = figure_machine(result, job, drawn), trajectories(result, job)
    paths = [figure_trajectories(result, found), figure_path(drawn)]
    errors = [figure_error(drawn, tolerance_um), figure_shift(drawn)]
    budget = [figure_budget(checked, tolerance_um)] if checked.lines else []
    return [
        *([Section(name="drawing", title="The machine", figures=[machine])] if machine else []),
        Section(name="paths", title="Trajectories", figures=paths),
        Section(name="errors", title="Tip error and shift", figures=errors),
        Section(name="actuators", title="Actuators", figures=figures_actuators(drawn, job)),
        Section(name="budget", title="Error budget", text=[BUDGET], figures=budget),
    ]


def _lines(drawn: DrawnPath, job: Job, checked: Verified) -> Table:
    """Largest values per source line; of long programs those with the largest corrections."""
    left = {each.line: each.residual_um for each in checked.lines}
    size = sizes(drawn.shift)
    shown = ~drawn.hidden
    numbers = np.unique(drawn.line[shown])
    if len(numbers) > MOST_LINES:
        peak = largest_of_groups(size[shown], drawn.line[shown], int(numbers.max()) + 1)
        numbers = np.sort(numbers[np.argsort(-peak[numbers], kind="stable")[:MOST_LINES]])
        caption = f"The {MOST_LINES} source lines with the largest corrections"
    else:
        caption = "Source lines with feed moves; largest values in each"
    units = ["mrad" if rotary else "µm" for rotary in job.machine.revolute]
    loads = ["N·m" if rotary else "N" for rotary in job.machine.revolute]
    heads = ["line", "end points", "error before µm", "error after µm", "shift µm"]
    heads += [f"Δ{a} {unit}" for a, unit in zip(job.machine.actuators, units, strict=True)]
    heads += [f"drive {a} {unit}" for a, unit in zip(job.machine.actuators, loads, strict=True)]
    order = np.flatnonzero(shown)
    order = order[np.argsort(drawn.line[order], kind="stable")]
    first = np.searchsorted(drawn.line[order], numbers, "left")
    last = np.searchsorted(drawn.line[order], numbers, "right")
    rows = []
    for number, a, b in zip(numbers, first, last, strict=True):
        at = order[a:b]
        values = [drawn.before[at].max(), left.get(int(number), float(drawn.after[at].max())), size[at].max()]
        for of in (drawn.change, drawn.drive):
            values += [column[np.abs(column).argmax()] for column in of[at].T]
        rows.append([(float(number), str(number)), (float(b - a), str(b - a)), *((float(v), brief(v)) for v in values)])
    return Table(caption, heads, rows, sortable=True)


def _machine(job: Job) -> Section:
    rows = [[name, text, place] for name, text, place in values_in_force(job.config)]
    table = Table("Every value in force and where it stands", ("key", "value", "written in"), rows)
    source = job.config.robot.source
    text = [f"{job.config.robot.name}; source: {source}" if source else job.config.robot.name]
    return Section(name="machine", title="Machine", text=text, tables=[table])
