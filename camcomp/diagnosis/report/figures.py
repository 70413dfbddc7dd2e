"""The plots of a diagnosis report."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from camcomp.diagnosis.report.run_view import RunView, rms
from camcomp.diagnosis.report.words import percent
from camcomp.diagnosis.result.types import UnseenShrinkage, Where
from camcomp.report.plot import (
    BAR_MARGIN,
    INK,
    MOST_POINTS,
    SCALE,
    STYLES,
    Figure,
    Json,
    axis,
    bars,
    brief,
    level,
    limit_of_bars,
    line,
    numbers,
    thin,
)


def figure_ladder(shrink: UnseenShrinkage, floor: float | None) -> Figure:
    """The gap on withheld runs with one cause after the other added to the model; floor: noise floor, um, or None."""
    names = ["as it was", *(f"+ {step.label}" for step in shrink.steps)]
    values = [shrink.before_rms_um, *(step.after_rms_um for step in shrink.steps)]
    steps = bars(values[::-1], names[::-1], [f"{brief(v)} µm" for v in values[::-1]])
    noise = limit_of_bars("noise floor", floor, names[::-1])
    words = ", ".join(f"{name} {brief(value)} µm" for name, value in zip(names, values, strict=True))
    known = "not known" if floor is None else f"{brief(floor)} µm"
    return Figure(
        name="ladder",
        title="Shrinkage ladder",
        caption=f"Root mean square of the gap on runs that the fit has not seen, with one cause after the other put into the "
        f"model: {words}. Noise floor {known}.",
        traces=[steps] if floor is None else [steps, noise],
        layout={
            "xaxis": axis("gap in µm (rms)", range=[0.0, 1.15 * max(*values, floor or 0.0)]),
            "yaxis": axis(""),
            "margin": BAR_MARGIN,
        },
        height=150 + 42 * len(names),
    )


def figure_signed(view: RunView, number: int) -> Figure:
    """The signed gap of one run over time, channel by channel, before and after."""
    index = thin(np.column_stack((view.before, view.after)))
    x = numbers(view.time[index], 4)
    curves = []
    for c, channel in enumerate(view.channels):
        color = STYLES[c % len(STYLES)][0]
        for i, (name, values) in enumerate(view.curves):
            style = {"color": color, "dash": ("solid", "dot")[i], "width": (2, 1.5)[i]}
            curves.append(line(f"{channel}, {name}", x, numbers(values[index, c], 3), c) | {"line": style})
    means = [float(np.nanmean(each)) if np.isfinite(each).any() else 0.0 for each in view.before.T]
    words = ", ".join(f"{channel} {brief(mean)} µm" for channel, mean in zip(view.channels, means, strict=True))
    return Figure(
        name=f"time-{number}",
        title=f"Run {view.name}: gap along the time, with its sign",
        caption=f"Measured minus modelled in each direction; mean before: {words}. {_told(view)}",
        traces=curves,
        layout={"xaxis": axis("time in s"), "yaxis": axis("gap in µm", zerolinecolor=INK)},
    )


def figure_size(view: RunView, number: int, floor: float | None) -> Figure:
    """The size of the gap of one run over path length, before and after."""
    sizes = [(name, np.linalg.norm(values, axis=1)) for name, values in view.curves]
    index = thin(np.column_stack([size for _, size in sizes]))
    x = numbers(view.path[index], 4)
    curves = [line(name, x, numbers(size[index], 3), i) for i, (name, size) in enumerate(sizes)]
    if floor is not None:
        curves.append(level("noise floor", [float(view.path[0]), float(view.path[-1])], floor))
    words = "rms " + ", ".join(f"{brief(rms(size))} µm {name}" for name, size in sizes)
    words += "" if view.explained else ", and no cause found takes any of it"
    return Figure(
        name=f"path-{number}",
        title=f"Run {view.name}: size of the gap along the path",
        caption=f"Size of measured minus modelled: {words}. {_told(view)}",
        traces=curves,
        layout={"xaxis": axis("path length in mm"), "yaxis": axis("gap in µm", rangemode="tozero")},
        height=300,
    )


def _told(view: RunView) -> str:
    return f"This run was {'not used for the fit' if view.held_out else 'used for the fit'}."


def figure_map(views: Sequence[RunView]) -> Figure:
    """Map of the gap on the workpiece, before and after, with a common colour scale."""
    position = np.concatenate([view.position for view in views])
    before, after = (np.concatenate([view.sizes[i] for view in views]) for i in range(2))
    known = np.isfinite(position).all(axis=1) & np.isfinite(before)
    position, before, after = position[known], before[known], after[known]
    step = max(len(position) // MOST_POINTS, 1)
    position, before, after = position[::step], before[::step], after[::step]
    spans = np.ptp(position, axis=0)
    h, v = sorted(np.argsort(-spans, kind="stable")[:2])
    top = float(np.quantile(before, 0.99)) if len(before) else 1.0
    traces: list[Json] = []
    explained = any(view.explained for view in views)
    for i, (name, size) in enumerate((("before", before), ("with the causes found", after))[: 1 + explained]):
        marker: Json = {"size": 5, "color": numbers(size, 2), "colorscale": SCALE, "cmin": 0.0, "cmax": round(top, 3)}
        if i == explained:
            marker |= {"colorbar": {"title": {"text": "gap<br>in µm"}, "thickness": 14}}
        traces.append({
            "type": "scatter", "mode": "markers", "name": name, "x": numbers(position[:, h], 3), "y": numbers(position[:, v], 3),
            "marker": marker, "xaxis": "x2" if i else "x", "yaxis": "y2" if i else "y", "showlegend": False,
            "hovertemplate": "%{x} %{y} mm: %{marker.color} µm<extra>" + name + "</extra>",
        })  # fmt: skip
    a, b = "xyz"[h], "xyz"[v]
    layout = {"xaxis": axis(f"{a} in mm"), "yaxis": axis(f"{b} in mm", scaleanchor="x")}
    words = f"rms {brief(rms(before))} µm"
    if explained:
        layout |= {
            "xaxis": axis(f"{a} in mm (before)", domain=[0.0, 0.47]),
            "xaxis2": axis(f"{a} in mm (with the causes found)", domain=[0.53, 1.0], matches="x"),
            "yaxis2": axis("", anchor="x2", matches="y", showticklabels=False),
        }
        words = f"before and with the causes found: from {words} to {brief(rms(after))} µm"
    return Figure(
        name="map",
        title="Map on the workpiece",
        caption=f"Every measured row where the tip was, coloured by the size of the gap, {words}.",
        traces=traces,
        layout=layout,
        height=430,
    )


def figure_shares(where: Where) -> Figure | None:
    """Shares of the gap by axis, actuator and covariate."""
    groups = [("axis", where.axes), ("actuator", where.actuators)]
    groups.append(("depends on", {each.covariate: each.share for each in where.drivers}))
    rows = [(f"{kind} {name}", share) for kind, part in groups for name, share in part.items()][::-1]
    if not any(share for _, share in rows):
        return None
    parts = bars(
        [100.0 * share for _, share in rows], [name for name, _ in rows], [percent(share) for _, share in rows]
    )
    words = ", ".join(f"{name} {100 * share:.0f} %" for name, share in rows[::-1] if share)
    return Figure(
        name="shares",
        title="By axis and actuator, and what it depends on",
        caption="Share of the gap's energy above the noise by axis of the workpiece and, read as motion of the carriages, by "
        f"actuator; below, how much of the gap follows each quantity: {words}. These may overlap.",
        traces=[parts],
        layout={"xaxis": axis("share in %", range=[0, 115]), "yaxis": axis(""), "margin": BAR_MARGIN},
        height=120 + 26 * len(rows),
    )
