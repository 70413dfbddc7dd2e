"""Figures as data for plotly.js: traces, axes, thinning. Colours are names of the page's variables, one set per theme."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from camcomp.ground.datatypes import Bools, Floats, Ints
from camcomp.ground.records import dataclass, field

MOST_POINTS = 3000  # points kept of a long curve
# Curves differ by dash as well as by colour, so that a print in grey can be read.
STYLES = tuple(
    (f"var(--c{i + 1})", dash) for i, dash in enumerate(("solid", "dash", "dot", "dashdot", "longdash", "longdashdot"))
)
INK = "var(--ink)"
# From small to large; blue to yellow with rising lightness, which every kind of sight can order.
SCALE = [[0, "var(--m0)"], [0.5, "var(--m1)"], [1, "var(--m2)"]]

SMALLEST_UM = 0.01  # smallest length shown in texts
BAR_MARGIN = {"l": 70, "r": 60, "t": 34, "b": 50}  # px, with room for the label of the longest bar
MARGIN_IN_SPACE = 0.1  # of the largest extent, around a drawing in space
ENLARGED, MOST_ENLARGED = (
    0.1,
    1e5,
)  # share of its drawing that a deviation has at first, and the largest factor of a slider

Json = dict[str, Any]


@dataclass(frozen=True, kw_only=True)
class Figure:
    """One plot of a page, with a caption below it; screen readers read title and caption.

    exaggerate: base curve and shifts of a plot whose deviations a slider enlarges: one base for all curves in one of
    `planes`, or in space a base for each curve and no planes (see assets/page.js).
    """

    name: str
    title: str
    caption: str
    traces: Sequence[Json] = ()
    layout: Mapping[str, Any] = field(default_factory=dict)
    height: int = 340
    exaggerate: Json | None = None

    def as_json(self) -> Json:
        """Data of the plot for the script of the page."""
        out: Json = {"name": self.name, "traces": list(self.traces), "layout": dict(self.layout), "height": self.height}
        return out | ({"exaggerate": self.exaggerate} if self.exaggerate else {})


def numbers(values: Floats, decimals: int = 5) -> list[float | None]:
    """Values for JSON, with null for values that are not finite, which plotly draws as gaps."""
    rounded = np.round(np.asarray(values, float), decimals) + 0.0
    return [value if np.isfinite(value) else None for value in rounded.tolist()]


def thin(values: Floats, most: int = MOST_POINTS) -> Ints:
    """Indices (k,) of at most about `most` rows of values (n, c): the least and greatest of every column per section."""
    n, columns = values.shape
    if n <= most:
        return np.arange(n)
    sections = max(most // (2 * columns + 2), 1)
    kept = {0, n - 1}
    filled = np.where(np.isfinite(values), values, 0.0)
    bounds = np.linspace(0, n, sections + 1).astype(int)
    for a, b in pairwise(bounds.tolist()):
        part = filled[a:b]
        kept.update((a, b - 1, *(a + part.argmin(axis=0)), *(a + part.argmax(axis=0))))
    return np.array(sorted(int(i) for i in kept))


def broken(rows: Ints, hidden: Bools) -> tuple[Ints, Bools]:
    """Indices of `rows` with a repeated one at every hidden move between two, and mask of these gaps."""
    count = np.cumsum(hidden)
    gap = np.flatnonzero(np.diff(count[rows]) > 0) + 1
    return np.insert(rows, gap, rows[gap]), np.insert(np.zeros(len(rows), np.bool_), gap, True)


def gapped(values: Floats, index: Ints, gap: Bools, decimals: int = 5) -> list[float | None]:
    """Values at `index`, with null for gaps."""
    return numbers(np.where(gap, np.nan, values[index]), decimals)


def line(name: str, x: Sequence[Any], y: Sequence[Any], style: int, *, hover: str = "", **more: Any) -> Json:
    """A curve in the `style`-th colour and dash."""
    color, dash = STYLES[style % len(STYLES)]
    out: Json = {"type": "scatter", "mode": "lines", "name": name, "x": x, "y": y}
    out["line"] = {"color": color, "dash": dash, "width": 2}
    if hover:
        out["hovertemplate"] = hover
    return out | more


def level(name: str, x: Sequence[float], y: float) -> Json:
    """A horizontal line for a limit or a noise floor."""
    style = {"color": INK, "dash": "dot", "width": 1.5}
    return {"type": "scatter", "mode": "lines", "name": name, "x": list(x), "y": [y] * len(x), "line": style}


def axis(title: str, **more: Any) -> Json:
    """An axis with a title."""
    return {"title": {"text": title}, **more}


def bars(values: Sequence[float], names: Sequence[str], texts: Sequence[str]) -> Json:
    """Horizontal bars with a text behind each."""
    return {
        "type": "bar", "orientation": "h", "x": list(values), "y": list(names), "text": list(texts), "textposition": "outside",
        "marker": {"color": STYLES[0][0]}, "cliponaxis": False, "showlegend": False,
    }  # fmt: skip


def limit_of_bars(name: str, value: float | None, names: Sequence[str]) -> Json:
    """A vertical line across the bars of these names."""
    style = {"color": STYLES[1][0], "dash": "dot", "width": 2}
    ends = {"x": [value, value], "y": [names[0], names[-1]]}
    return {"type": "scatter", "mode": "lines", "name": name, "line": style, **ends}


def in_space(points: Floats, eye: tuple[float, float, float]) -> Json:
    """Layout of a drawing in space: axes of one scale around points (n, 3) mm, seen from `eye`."""
    middle, half = 0.5 * (points.max(axis=0) + points.min(axis=0)), 0.5 * np.ptp(points, axis=0)
    half = half + MARGIN_IN_SPACE * max(2.0 * float(half.max()), 1e-6)
    ranges = np.column_stack((middle - half, middle + half)).round(6).tolist()
    share = half / half.max()
    axes = {
        f"{a}axis": axis(f"{a} in mm", range=ranges[i], nticks=max(round(7 * share[i]), 2)) for i, a in enumerate("xyz")
    }
    scene = {
        "aspectmode": "manual", "aspectratio": dict(zip("xyz", share.round(6).tolist(), strict=True)),
        "camera": {"eye": dict(zip("xyz", eye, strict=True))},
    }  # fmt: skip
    return {"scene": axes | scene, "margin": {"l": 0, "r": 0, "t": 0, "b": 0}}


def enlarged(base: Any, shifts: Sequence[Json], planes: Sequence[str], deviation: float, extent: float) -> Json:
    """Curves and shifts of a figure whose largest deviation (mm) a slider enlarges within the extent (mm) of the drawing."""
    first = float(np.clip(ENLARGED * extent / max(deviation, 1e-9), 1.0, MOST_ENLARGED))
    return {"base": base, "shifts": shifts, "planes": planes, "first": first, "most": MOST_ENLARGED}


def brief(value: float, digits: int = 3) -> str:
    """Number as text with `digits` significant digits, without exponent from 1e-4 to 1e6."""
    if value == 0.0 or not np.isfinite(value):
        return "0" if value == 0.0 else "–"
    if 1e-4 <= abs(value) < 1e6:
        places = max(digits - 1 - int(np.floor(np.log10(abs(value)))), 0)
        return f"{value:.{places}f}"
    return f"{value:.{digits - 1}e}"


def micrometres(value: float) -> str:
    """Length in um as text, at least SMALLEST_UM."""
    return f"below {SMALLEST_UM:g} µm" if 0.0 <= value < SMALLEST_UM else f"{brief(value)} µm"


def format_together(value: float, low: float, high: float) -> list[str]:
    """Texts of a value and the ends of its interval, with two significant digits of the interval's width."""
    doubt = 0.5 * (high - low)
    if not doubt > 0.0 or not np.isfinite(doubt) or doubt < 1e-4:
        return [brief(each) for each in (value, low, high)]
    places = max(1 - int(np.floor(np.log10(doubt))), 0)
    return [f"{each:.{places}f}" for each in (value, low, high)]
