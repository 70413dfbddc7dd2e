"""Error curves of joints with their bands and measured ranges."""

from __future__ import annotations

import numpy as np

from camcomp.diagnosis.result.types import CurveCause, DiagnosisResult, ErrorCurve
from camcomp.report.page import Section, Table
from camcomp.report.plot import STYLES, Figure, Json, axis, brief, line, numbers

TEXT = (
    "What each joint stands off its encoder over a turn. The band holds the curve with 95 % at every angle; it is wide where "
    "no pose had the joint, and there nothing is taken out."
)


def joints_section(result: DiagnosisResult) -> Section | None:
    """Section with the curves of the joints, or None."""
    causes = [each for each in result.causes if isinstance(each, CurveCause)]
    if not causes:
        return None
    shrunk = result.shrinkage
    text = [TEXT]
    if shrunk is not None and shrunk.covered_share is not None and shrunk.covered_rms_um is not None:
        text.append(
            f"{100.0 * shrunk.covered_share:.0f} % of the unseen poses have every such joint at angles that were seen: "
            f"{brief(shrunk.covered_rms_um)} µm are left there, {brief(shrunk.after_rms_um)} µm on all of them."
        )
    rows = []
    for c in causes:
        size, seen = c.parameters["amplitude_rad"], f"{100.0 * c.curve.seen_share:.0f} %"
        low, high = size.ci95
        interval = f"{1e6 * low:.0f} to {1e6 * high:.0f}"
        rows.append([str(c.target), f"{1e6 * size.value:.0f}", interval, seen, _intervals(c.curve)])
    table = Table("Curves of the joints", ("joint", "amplitude µrad", "95 %", "of a turn seen", "seen at deg"), rows)
    figures = [_curve(str(c.target), c.curve) for c in causes]
    return Section(
        name="joints", title="Errors of the joints over their turn", text=text, figures=figures, tables=[table]
    )


def _intervals(curve: ErrorCurve) -> str:
    return ", ".join(f"{low:.0f} to {high:.0f}" if high - low >= 1.0 else f"{low:.0f}" for low, high in curve.seen_deg)


def _curve(name: str, curve: ErrorCurve) -> Figure:
    """One joint from -180 to 180 deg."""
    turn = (np.array(curve.angle_deg) + 180.0) % 360.0 - 180.0
    order = np.argsort(turn)
    angle = turn[order]
    error, half = 1e6 * np.array(curve.error_rad)[order], 1.96e6 * np.array(curve.sd_rad)[order]
    seen = np.any([(angle - low) % 360.0 <= high - low for low, high in curve.seen_deg], axis=0)
    x = numbers(angle, 1)
    edge: Json = {"type": "scatter", "mode": "lines", "x": x, "line": {"width": 0}, "hoverinfo": "skip"}
    band: list[Json] = [
        edge | {"y": numbers(error - half, 1), "showlegend": False, "name": "low"},
        edge | {"y": numbers(error + half, 1), "name": "95 % band", "fill": "tonexty", "fillcolor": "rgba(128,128,128,0.25)"},
    ]  # fmt: skip
    bottom = float((error - half).min())
    marks: Json = {
        "type": "scatter", "mode": "markers", "name": "seen by poses", "x": numbers(angle[seen], 1), "y": [bottom] * int(seen.sum()),
        "marker": {"symbol": "square", "size": 5, "color": STYLES[2][0]},
    }  # fmt: skip
    words = f"seen over {100.0 * curve.seen_share:.0f} % of its turn, largest error {brief(float(np.abs(error).max()))} µrad"
    return Figure(
        name=f"joint-{name}",
        title=f"Joint {name}",
        caption=f"Error over the angle, {words}.",
        traces=[*band, line("taken out", x, numbers(np.where(seen, error, np.nan), 2), 0), marks],
        layout={"xaxis": axis("angle in deg", range=[-180, 180], dtick=45), "yaxis": axis("error in µrad")},
        height=280,
    )
