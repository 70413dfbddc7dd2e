"""The part of a compensation report that says how far to trust it."""

from __future__ import annotations

from itertools import groupby

import numpy as np

from camcomp.compensation.bands.outcome import LITTLE, Bands
from camcomp.compensation.program.result import Summary
from camcomp.compensation.report.figures import LOGARITHMIC, DrawnPath, along_path
from camcomp.ground.datatypes import Bools
from camcomp.report.page import Section, Table
from camcomp.report.plot import STYLES, Figure, Json, brief, broken, micrometres, thin

KINDS = ("trusted", "doubtful", "shrunk", "left alone")


def band_section(drawn: DrawnPath, bands: Bands, figures: Summary) -> Section:
    """Bands along the path, where the correction is trusted, and which input makes how much."""
    expected = figures.expected
    assert expected is not None and figures.band is not None  # there are bands
    low, high = expected.rms_ci95_um
    text = (
        f"Numbers of the machine file are uncertain. Machines drawn from them leave {micrometres(expected.rms_um)} rms after "
        f"compensation (95 % of the machines: {brief(low)} to {micrometres(high)}); 95 % of all points stay below "
        f"{micrometres(expected.p95_um)}. {figures.advice}."
    )
    rows: list[list[str | tuple[float, str]]] = [
        [each.input, (each.share, f"{100.0 * each.share:.1f}")] for each in figures.band
    ]
    table = Table("What makes the band: share of the mean square", ("uncertain input", "share %"), rows, sortable=True)
    return Section(
        name="bands",
        title="How far to trust it",
        text=[text],
        figures=[_figure_band(drawn, bands), _figure_trust(drawn, bands)],
        tables=[table],
    )


def kinds_of(bands: Bands) -> dict[str, Bools]:
    """End points (N,) by what became of their correction: all of it was taken and gains more than it may leave, or not."""
    band, gain, share = bands.band_um(), bands.gain_um(), bands.share
    alone, whole = share <= LITTLE, share >= 1.0 - LITTLE
    doubtful = whole & (band > gain)
    return dict(zip(KINDS, (whole & ~doubtful, doubtful, ~alone & ~whole, alone), strict=True))


def _figure_band(drawn: DrawnPath, bands: Bands) -> Figure:
    band = bands.band_um()
    values = np.column_stack((drawn.before, drawn.after, band, drawn.driven))
    names = ("original program", "corrected, model exact", "corrected, 95 % of machines below")
    before, after, upper, driven = drawn.errors(np.where(values > 0.0, values, np.nan), *names)
    between = _area(after["x"], after["y"], upper["y"])
    at = drawn.worst(band)
    words = f"up to {micrometres(band[at])}, in source line {drawn.line[at]}"
    return Figure(
        name="band",
        title="Band around the residual",
        caption=f"Between what the corrected program leaves if every number of the machine file is right, and the error that 95 % of the "
        f"machines within the stated spreads stay below: {words}. What the control merges and rounds is a curve of its own. Logarithmic scale.",
        traces=[between, after, driven, upper, before],
        layout=along_path("error in µm", **LOGARITHMIC),
    )


def _area(x: list[float | None], low: list[float | None], high: list[float | None]) -> Json:
    """The area between two curves, section by section where both are drawn."""
    across: list[float | None] = []
    along: list[float | None] = []
    for drawn, section in groupby(zip(x, low, high, strict=True), lambda each: None not in each):
        if drawn:
            at, bottom, top = zip(*section, strict=True)
            across += [*at, *at[::-1], None]
            along += [*bottom, *top[::-1], None]
    return {
        "type": "scatter", "mode": "lines", "fill": "toself", "fillcolor": "rgba(128,128,128,0.25)",
        "line": {"width": 0}, "name": "between the two", "x": across, "y": along, "hoverinfo": "skip",
    }  # fmt: skip


def _figure_trust(drawn: DrawnPath, bands: Bands) -> Figure:
    traces, told = [], []
    shown = ~drawn.hidden
    whole = max(int(shown.sum()), 1)
    order, gap = broken(thin(drawn.target), drawn.hidden)
    for i, (name, mine) in enumerate(kinds_of(bands).items()):
        count = int((mine & shown).sum())
        if not count:
            continue
        told.append(f"{name} {100.0 * count / whole:.0f} %")
        start = np.concatenate((mine[1:], [False])) & ~mine  # a move is drawn from the point before it
        off = gap | ~(mine | start)[order]
        traces.append(drawn.in_space(
            order, off, name=name, showlegend=True, line={"width": 6, "color": STYLES[i][0]},
            hovertemplate=f"{name}<br>x %{{x}} y %{{y}} z %{{z}} mm<extra></extra>",
        ))  # fmt: skip
    words = ", ".join(told) or "nothing is cut"
    caption = (
        "Trusted: all of the correction is taken, and at least 95 % of the machines gain more than it may leave. Doubtful: all "
        "of it is taken, and the band exceeds the gain. Shrunk and left alone: what the policy of the machine file made of "
        f"it. Of the end points: {words}."
    )
    return drawn.figure_in_space("trust", "Where the correction is trusted", caption, traces)
