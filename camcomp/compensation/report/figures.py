"""The plots of a compensation report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from camcomp.compensation.program.compensate import Compensated
from camcomp.compensation.program.under_control import mode_name
from camcomp.compensation.program.verify import Verified
from camcomp.ground.datatypes import RAPID, Bools, Floats, Ints
from camcomp.ground.vectors import largest_of_groups, sizes
from camcomp.model.job import Job
from camcomp.report.plot import (
    BAR_MARGIN,
    INK,
    SCALE,
    SMALLEST_UM,
    Figure,
    Json,
    axis,
    bars,
    brief,
    broken,
    enlarged,
    gapped,
    in_space,
    level,
    limit_of_bars,
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


class DrawnPath:
    """Quantities drawn along the path, at the end points (N, ...) of the corrected program."""

    def __init__(self, result: Compensated, job: Job) -> None:
        rows, points = result.rows, result.control.points

        def largest(error: Floats, row: Ints) -> Floats:
            """The largest error (N,) um on the move that ends there; 0 where none counts."""
            return largest_of_groups(1e3 * sizes(error), row, len(rows.w))

        self.s, self.line, self.target = result.s, result.lines, rows.target
        self.hidden = (rows.kind == RAPID) | ~rows.corrected | rows.joining  # rapids and what passes as programmed
        self.shift = 1e3 * (result.written.end - rows.target)  # (N, 3) um
        self.change = 1e3 * (result.state.rho - result.nominal)  # (N, m) um or mrad
        self.drive = result.state.drive * np.where(job.machine.revolute, 1e-3, 1.0)  # (N, m) N or N m
        self.before, self.after = (largest(each, result.judged) for each in (result.before, result.after))
        self.driven = largest(result.control.account.latest, points.move)  # with what the controller merges and rounds
        self.mode = mode_name(result.control.modes)

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
        """Curves of errors (N, k) um on a logarithmic axis; the last column is the path that the controller drives."""
        return self.curves([*names, f"corrected, as the control drives it in {self.mode}"], values, 6, FLOOR_UM)

    def in_space(self, index: Ints, gap: Bools, **more: Any) -> Json:
        """The programmed path at rows `index` (k,) as a thick line in space, broken at gaps (k,)."""
        points = {a: gapped(self.target[:, i], index, gap, 4) for i, a in enumerate(AXES)}
        return {"type": "scatter3d", "mode": "lines", **points, **more}

    def figure_in_space(self, name: str, title: str, caption: str, traces: Sequence[Json]) -> Figure:
        """A figure of such lines."""
        layout = in_space(self.target[~self.hidden], (0.75, -1.0, 0.85))
        return Figure(name=name, title=title, caption=caption, traces=traces, layout=layout, height=520)


def along_path(title: str, **more: Any) -> Json:
    """Layout of a plot along the path, with the title of its vertical axis."""
    return {"xaxis": axis("path length in mm"), "yaxis": axis(title, **more)}


LOGARITHMIC: Json = {"type": "log", "dtick": 1, "exponentformat": "power"}


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
    words = ", ".join(f"{name} {micrometres(value)}" for (name, _), value in zip(named[1:], off[1:], strict=True))
    return Figure(
        name="trajectories",
        title="Trajectories of the tool tip",
        caption="Where the original program takes the tip, for each cause alone and for both where the machine has chain errors, and the "
        "path that is commanded instead. Deviations from the programmed path are enlarged; the slider says how much. "
        f"True largest deviations: {words}.",
        traces=traces,
        layout={"xaxis": axis(""), "yaxis": axis("", scaleanchor="x", scaleratio=1)},
        height=560,
        exaggerate=enlarged(base, shifts, _planes(drawn), 1e-3 * max(off), extent),
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
        traces=drawn.curves([f"Δ{a}" for a in AXES], drawn.shift, 3), layout=along_path("shift in µm"),
    )  # fmt: skip


def figures_actuators(drawn: DrawnPath, job: Job) -> list[Figure]:
    """Changes of the actuators and drive forces (seed Fig. 5) along the path; slides and hinges apart."""
    kinds = (
        ("change", drawn.change, "Commanded minus nominal actuator coordinate",
         (("slides", "µm", "Changes of the slides"), ("hinges", "mrad", "Changes of the hinges"))),
        ("drive", drawn.drive, "What the drive exerts on its carriage under load, positive along its positive direction",
         (("slides", "N", "Drive forces"), ("hinges", "N·m", "Drive torques"))),
    )  # fmt: skip
    out = []
    for kind, every, note, sorts in kinds:
        for rotary, (sort, unit, what) in enumerate(sorts):
            which = np.flatnonzero(job.machine.revolute == bool(rotary))
            if not len(which):
                continue
            names, values = [job.machine.actuators[a] for a in which], every[:, which]
            row = drawn.worst(np.abs(values).max(axis=1))
            column = int(np.abs(values[row]).argmax())
            words = (
                f"up to {brief(abs(values[row, column]))} {unit}, actuator {names[column]} in line {drawn.line[row]}"
            )
            out.append(Figure(
                name=f"{kind}-{sort}", title=f"{what} along the path", caption=f"{note}: {words}.",
                traces=drawn.curves(names, values, 3), layout=along_path(f"{kind} in {unit}"),
            ))  # fmt: skip
    return out


def figure_path(drawn: DrawnPath) -> Figure:
    """The tool path in space, coloured by the size of the correction."""
    size = sizes(drawn.shift)
    index, gap = broken(thin(np.column_stack((drawn.target, size))), drawn.hidden)
    bar = {"title": {"text": "correction<br>in µm"}, "thickness": 14, "len": 0.8}
    color = np.where(np.isfinite(size[index]), size[index], 0.0)
    trace = drawn.in_space(
        index, gap, showlegend=False,
        line={"width": 6, "color": np.round(color, 3).tolist(), "colorscale": SCALE, "colorbar": bar, "showscale": True},
        hovertemplate="x %{x} y %{y} z %{z} mm<br>correction %{line.color} µm<extra></extra>",
    )  # fmt: skip
    low = float(np.nanmin(np.where(drawn.hidden, np.nan, size))) if (~drawn.hidden).any() else 0.0
    words = f"correction from {brief(low)} to {micrometres(size[drawn.worst(size)])}"
    return drawn.figure_in_space(
        "path", "Tool path", f"Feed moves of the program in space, {words}. Drag to turn.", [trace]
    )


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
    parts = bars(values, names, [micrometres(worst[name]) for name in names])
    words = ", ".join(f"{name} {micrometres(value)}" for name, value in worst.items())
    top = max(max(values), tolerance_um)
    span = [float(np.log10(min(values))) - 0.3, float(np.log10(top)) + 1.0]
    return Figure(
        name="parts",
        title="Error budget of the corrected program",
        caption=f"Read back from the text of the corrected program, largest value of each part: {words}.",
        traces=[parts, limit_of_bars("tolerance", tolerance_um, names)],
        layout={
            "xaxis": axis("error in µm", type="log", dtick=1, range=span, exponentformat="power"),
            "yaxis": axis(""),
            "margin": BAR_MARGIN,
        },
        height=300,
    )
