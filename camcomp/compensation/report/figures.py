"""The plots of a compensation report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from camcomp.compensation.program.compensate import Compensated
from camcomp.compensation.program.under_control import mode_name
from camcomp.compensation.program.verify import Verified
from camcomp.ground.datatypes import RAPID, Bools, Floats, Ints
from camcomp.ground.records import dataclass
from camcomp.ground.vectors import largest_of_groups, sizes
from camcomp.model.job import Job
from camcomp.report.plot import (
    BAR_MARGIN,
    INK,
    SCALE,
    SMALLEST_UM,
    STYLES,
    Figure,
    Json,
    axis,
    brief,
    broken,
    gapped,
    level,
    line,
    micrometres,
    thin,
)

AXES = "xyz"
FLOOR_UM = 1e-4  # below what a logarithmic axis can show
TITLES = {
    "target": "programmed", "chain_error": "chain errors alone", "force": "cutting force alone", "both": "both",
    "adjusted": "commanded (adjusted)",
}  # fmt: skip
NO_ERROR_MM = 1e-6  # below it chain errors have no curve of their own


@dataclass(frozen=True, eq=False, kw_only=True)
class DrawnPath:
    """Quantities drawn along the path, at the end points (N, ...) of the corrected program."""

    s: Floats  # mm
    line: Ints
    hidden: Bools  # moves that are not drawn: rapids and what passes as programmed
    target: Floats
    shift: Floats  # (N, 3) um commanded minus programmed tip
    change: Floats  # (N, m) um or mrad
    drive: Floats  # (N, m) N or N m
    before: Floats  # (N,) um, the largest error on the move that ends there; 0 where none counts
    after: Floats  # (N,) um
    driven: Floats  # (N,) um the same with what the control merges and rounds
    mode: str  # of the control

    def worst(self, size: Floats) -> int:
        """Drawn row with the largest `size` (N,)."""
        return int(np.nanargmax(np.where(self.hidden | ~np.isfinite(size), -1.0, size)))

    def curves(self, names: Sequence[str], values: Floats, decimals: int, least: float = -np.inf) -> list[Json]:
        """Curves of the columns of values (N, k) along the path; least: the smallest value that the axis can show."""
        index, gap = broken(thin(values), self.hidden)
        s = gapped(self.s, index, gap, 4)
        shown = [gapped(np.maximum(column, least), index, gap, decimals) for column in values.T]
        return [line(name, s, y, i) for i, (name, y) in enumerate(zip(names, shown, strict=True))]

    def errors(self, values: Floats, *names: str) -> list[Json]:
        """Curves of errors (N, k) um on a logarithmic axis; the last column is what the control drives."""
        return self.curves([*names, f"corrected, as the control drives it in {self.mode}"], values, 6, FLOOR_UM)


def along_path(title: str, **more: Any) -> Json:
    """Layout of a plot along the path, with the title of its vertical axis."""
    return {"xaxis": axis("path length in mm"), "yaxis": axis(title, **more)}


LOGARITHMIC: Json = {"type": "log", "dtick": 1, "exponentformat": "power"}


def drawn_path_of(result: Compensated, job: Job) -> DrawnPath:
    """Everything that is drawn along the path."""
    rows = result.rows

    def largest(error: Floats, row: Ints) -> Floats:
        return largest_of_groups(1e3 * sizes(error), row, len(rows.w))

    drive_scale = np.where(job.machine.revolute, 1e-3, 1.0)
    return DrawnPath(
        s=result.s, line=result.lines, hidden=(rows.kind == RAPID) | ~rows.corrected | rows.joining,
        target=rows.target, shift=1e3 * (result.written.end - rows.target),
        change=1e3 * (result.state.rho - result.nominal), drive=result.state.drive * drive_scale,
        before=largest(result.before, result.judged), after=largest(result.after, result.judged),
        driven=largest(result.control.error, result.control.points.move), mode=mode_name(result.control.modes),
    )  # fmt: skip


def figure_trajectories(result: Compensated, curves: Mapping[str, Floats]) -> Figure:
    """Seed Fig. 4: target, the three trajectories of the original program, and the tip path to be commanded."""
    target = curves["target"]
    named = [(TITLES[name], points) for name, points in curves.items()]
    if np.nanmax(np.abs(curves["chain_error"] - target), initial=0.0) < NO_ERROR_MM:
        named = [named[0], ("original program under load", curves["both"]), named[-1]]
    rows = result.rows
    hidden = (rows.kind == RAPID) | ~rows.corrected
    index, gap = broken(thin(np.column_stack((target, result.uncorrected - target))), hidden)
    traces = [line(name, [], [], i) for i, (name, _) in enumerate(named)]
    traces[0]["line"] = {"color": INK, "dash": "solid", "width": 2}
    base = {a: gapped(target[:, i], index, gap) for i, a in enumerate(AXES)}
    shifts = [{a: gapped((points - target)[:, i], index, gap, 6) for i, a in enumerate(AXES)} for _, points in named]
    off = [1e3 * float(np.nanmax(sizes(points - target)[~hidden], initial=0.0)) for _, points in named]
    cutting = ~hidden & rows.force.any(axis=1)
    drawn = target[cutting] if cutting.any() else target[~hidden]
    extent = float(np.ptp(drawn, axis=0).max())
    first = float(np.clip(0.12 * extent / max(1e-3 * max(off), 1e-9), 1.0, 1e4))
    words = ", ".join(f"{name} {micrometres(value)}" for (name, _), value in zip(named[1:], off[1:], strict=True))
    return Figure(
        name="trajectories",
        title="Trajectories of the tool tip",
        caption="Where the original program takes the tip, for each cause alone and for both where the machine has chain errors, and the "
        "path that is commanded instead. Deviations from the programmed path are enlarged; the slider says how much. "
        f"True largest deviations: {words}.",
        label=f"Plot of tool tip trajectories with enlarged deviations. Largest true deviations: {words}.",
        traces=traces,
        layout={"xaxis": axis(""), "yaxis": axis("", scaleanchor="x", scaleratio=1)},
        height=560,
        exaggerate={"base": base, "shifts": shifts, "planes": _planes(drawn), "first": first, "most": 1e5},
    )


def _planes(points: Floats) -> list[str]:
    """The three planes, the one with most to see first."""
    x, y, z = np.ptp(points, axis=0)
    planes = [("xy", x * y), ("xz", x * z), ("yz", y * z)]
    return [name for name, _ in sorted(planes, key=lambda each: -each[1])]


def figure_error(drawn: DrawnPath, tolerance_um: float) -> Figure:
    """Tip error along the path, original and corrected program."""
    values = np.column_stack((drawn.before, drawn.after, drawn.driven))
    curves = drawn.errors(values, "original program", "corrected program")
    curves.append(level("tolerance", [float(drawn.s[0]), float(drawn.s[-1])], tolerance_um))
    a, b, c = (drawn.worst(each) for each in (drawn.before, drawn.after, drawn.driven))
    words = (
        f"original program up to {micrometres(drawn.before[a])} (line {drawn.line[a]}), corrected program up to "
        f"{micrometres(drawn.after[b])} (line {drawn.line[b]}), as the control drives it up to {micrometres(drawn.driven[c])} "
        f"(line {drawn.line[c]}), tolerance {tolerance_um:g} µm"
    )
    return Figure(
        name="error",
        title="Tip error along the path",
        caption=f"Distance of the loaded tip from the programmed tip, on a logarithmic scale: {words}. "
        "At every end point stands the largest error on the move to it.",
        label=f"Plot of the tip error along the path: {words}.",
        traces=curves,
        layout=along_path("error in µm", **LOGARITHMIC),
    )


def figure_shift(drawn: DrawnPath) -> Figure:
    """Commanded minus programmed tip along the path."""
    size = sizes(drawn.shift)
    at = drawn.worst(size)
    words = f"up to {micrometres(size[at])}, in source line {drawn.line[at]}"
    return Figure(
        name="shift", title="Shift of the commanded tip",
        caption=f"Commanded minus programmed tip in the program frame: {words}.",
        label=f"Plot of the shift of the commanded tip in x, y and z along the path: {words}.",
        traces=drawn.curves([f"Δ{a}" for a in AXES], drawn.shift, 3), layout=along_path("shift in µm"),
    )  # fmt: skip


def figures_actuators(drawn: DrawnPath, job: Job, *, drive: bool) -> list[Figure]:
    """Changes of the actuators, or drive forces (seed Fig. 5), along the path; slides and hinges apart."""
    out = []
    for rotary in (False, True):
        which = np.flatnonzero(job.machine.revolute == rotary)
        if len(which):
            out.append(_actuators(drawn, job.machine.actuators, which, rotary, drive))
    return out


def _actuators(drawn: DrawnPath, names: tuple[str, ...], which: Ints, rotary: bool, drive: bool) -> Figure:
    values = (drawn.drive if drive else drawn.change)[:, which]
    row = drawn.worst(np.abs(values).max(axis=1))
    column = int(np.abs(values[row]).argmax())
    if drive:
        unit, what = ("N·m", "Drive torques") if rotary else ("N", "Drive forces")
        note = "What the drive exerts on its carriage under load, positive along its positive direction"
    else:
        unit, what = ("mrad", "Changes of the hinges") if rotary else ("µm", "Changes of the slides")
        note = "Commanded minus nominal actuator coordinate"
    words = f"up to {brief(abs(values[row, column]))} {unit}, actuator {names[which[column]]} in line {drawn.line[row]}"
    return Figure(
        name=f"{'drive' if drive else 'change'}-{'hinges' if rotary else 'slides'}", title=f"{what} along the path",
        caption=f"{note}: {words}.", label=f"Plot of {what.lower()} along the path, one curve per actuator: {words}.",
        traces=drawn.curves([names[a] for a in which], values, 3),
        layout=along_path(f"{'drive' if drive else 'change'} in {unit}"),
    )  # fmt: skip


def figure_path(drawn: DrawnPath) -> Figure:
    """The tool path in space, coloured by the size of the correction."""
    size = sizes(drawn.shift)
    index, gap = broken(thin(np.column_stack((drawn.target, size))), drawn.hidden)
    x, y, z = (gapped(drawn.target[:, i], index, gap, 4) for i in range(3))
    bar = {"title": {"text": "correction<br>in µm"}, "thickness": 14, "len": 0.8}
    color = np.where(np.isfinite(size[index]), size[index], 0.0)
    trace = {
        "type": "scatter3d", "mode": "lines", "x": x, "y": y, "z": z, "showlegend": False,
        "line": {"width": 6, "color": np.round(color, 3).tolist(), "colorscale": SCALE, "colorbar": bar, "showscale": True},
        "hovertemplate": "x %{x} y %{y} z %{z} mm<br>correction %{line.color} µm<extra></extra>",
    }  # fmt: skip
    low = float(np.nanmin(np.where(drawn.hidden, np.nan, size))) if (~drawn.hidden).any() else 0.0
    words = f"correction from {brief(low)} to {micrometres(size[drawn.worst(size)])}"
    return Figure(
        name="path", title="Tool path", caption=f"Feed moves of the program in space, {words}. Drag to turn.",
        label=f"Three-dimensional plot of the tool path, coloured by the size of the correction: {words}.",
        traces=[trace],
        layout={"scene": scene_of(drawn.target[~drawn.hidden]), "margin": {"l": 0, "r": 0, "t": 0, "b": 0}},
        height=520,
    )  # fmt: skip


def scene_of(points: Floats) -> dict[str, Any]:
    """Axes of one scale, a flat path with some room above and below, and an eye that sees all of it."""
    middle, span = 0.5 * (points.max(axis=0) + points.min(axis=0)), np.ptp(points, axis=0)
    half = 0.55 * np.maximum(span, 0.2 * max(float(span.max()), 1e-6))
    ranges = np.column_stack((middle - half, middle + half)).round(6).tolist()
    axes = {f"{a}axis": axis(f"{a} in mm", range=ranges[i]) for i, a in enumerate(AXES)}
    ratio = dict(zip(AXES, (half / half.max()).round(6).tolist(), strict=True))
    return axes | {"aspectmode": "manual", "aspectratio": ratio, "camera": {"eye": {"x": 0.75, "y": -1.0, "z": 0.85}}}


def figure_budget(checked: Verified, tolerance_um: float) -> Figure:
    """Contributions to the error after compensation, worst case over the program."""
    worst = {
        "solver": max(each.convergence_um for each in checked.lines),
        "rounding (bound)": max(each.rounding_um for each in checked.lines),
        "end points": max(each.vertex_um for each in checked.lines),
        "chords between them": max(each.chord_um for each in checked.lines),
        "all": max(each.residual_um for each in checked.lines),
    }
    names = list(worst)[::-1]
    values = [max(worst[name], SMALLEST_UM) for name in names]
    bars = {
        "type": "bar", "orientation": "h", "x": values, "y": names, "showlegend": False, "cliponaxis": False,
        "marker": {"color": STYLES[0][0]}, "text": [micrometres(worst[name]) for name in names], "textposition": "outside",
    }  # fmt: skip
    limit = {
        "type": "scatter", "mode": "lines", "x": [tolerance_um] * 2, "y": [names[0], names[-1]],
        "name": "tolerance", "line": {"color": STYLES[1][0], "dash": "dot", "width": 2},
    }  # fmt: skip
    words = ", ".join(f"{name} {micrometres(value)}" for name, value in worst.items())
    top = max(max(values), tolerance_um)
    span = [float(np.log10(min(values))) - 0.3, float(np.log10(top)) + 1.0]
    return Figure(
        name="parts",
        title="Error budget of the corrected program",
        caption=f"Read back from the text of the corrected program, largest value of each part: {words}.",
        label=f"Bar chart of the parts of the error that is left: {words}.",
        traces=[bars, limit],
        layout={
            "xaxis": axis("error in µm", type="log", dtick=1, range=span, exponentformat="power"),
            "yaxis": axis(""),
            "margin": BAR_MARGIN,
        },
        height=300,
    )
