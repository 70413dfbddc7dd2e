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

Json = dict[str, Any]


@dataclass(frozen=True, kw_only=True)
class Figure:
    """One plot of a page. label: for screen readers, by default title and caption; caption: below the plot.

    exaggerate: base curve and shifts of a plot whose deviations a slider enlarges: one base for all curves in one of
    `planes`, or in space a base for each curve and no planes (see assets/page.js).
    """

    name: str
    title: str
    caption: str
    label: str = ""
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
