"""Circles of the runs as polar plots of a ball-bar: both directions in one plot, and the values of ISO 230-4."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from camcomp.diagnosis.circles import OUTWARD, Turn, turns_of
from camcomp.diagnosis.report.run_view import MOST_DRAWN, RunView
from camcomp.diagnosis.report.words import cell
from camcomp.diagnosis.result.standards import CircularTest
from camcomp.ground.datatypes import Floats
from camcomp.report.page import Section, Table
from camcomp.report.plot import INK, Figure, Json, axis, brief, line, numbers

_TIP = ("tip x", "tip y", "tip z")
_ISO = (
    "G is the circular deviation of one direction, G(b) that of both, each about its own least-squares centre; F max and "
    "F min are the largest and least deviation of the radius from the programmed one about the programmed centre (ISO 230-4, "
    "mean over every degree, or over two rows where they lie wider). Runs that cut show the machine under load, which the standard leaves out."
)


@dataclass(frozen=True, eq=False)
class RadialGap:
    """Radial gap, measured minus modelled, of a circle in one direction in one run, um at every degree (360,)."""

    run: str
    turn: Turn
    before: Floats
    after: Floats
    cutting: bool


def gaps_of(views: Sequence[RunView]) -> list[RadialGap]:
    """Radial gaps of all full circles with a measured tip, in the order of the runs."""
    out = []
    for view in views:
        if view.program is not None and view.channels == _TIP:
            for turn in turns_of(view.program, view.commanded, view.before):
                out.append(RadialGap(view.name, turn, turn.radial(view.before), turn.radial(view.after), view.cutting))
    return out


def circles_section(views: Sequence[RunView], tests: Sequence[CircularTest]) -> Section | None:
    """Section of the report on circles, or None without a circle. tests: values of ISO 230-4."""
    groups: dict[tuple[str, bool], list[RadialGap]] = {}
    for gap in gaps_of(views):
        groups.setdefault((gap.turn.circle.name, gap.cutting), []).append(gap)
    if not groups and not tests:
        return None
    order = sorted(groups, key=lambda key: -max(float(np.nanmax(np.abs(gap.before))) for gap in groups[key]))
    figures = [_figure(groups[key], i) for i, key in enumerate(order[:MOST_DRAWN], 1)]
    rank = {key: i for i, key in enumerate(order)}
    shown = sorted(tests, key=lambda test: rank.get((test.circle, test.cutting), len(order)))
    return Section(
        name="circles", title="On the circle", figures=figures, text=[_ISO], tables=[_values(shown)] if shown else []
    )


def _values(tests: Sequence[CircularTest]) -> Table:
    rows = []
    for test in tests:
        both = "–" if test.G_both_um is None else cell(test.G_both_um)
        for turn in test.turns:
            single, *ends = map(cell, (turn.G_um, turn.F_max_um, turn.F_min_um))
            rows.append([test.circle, turn.run, turn.direction, _load(test.cutting), single, both, *ends])
    heads = ("circle", "run", "direction", "load", "G µm", "G(b) µm", "F max µm", "F min µm")
    return Table("Circular deviations", heads, rows)


def _load(cutting: bool) -> str:
    return "cutting" if cutting else "in air"


def _figure(gaps: Sequence[RadialGap], number: int) -> Figure:
    """Radial gap round a circle, both directions, before and with the causes found; a slider enlarges it."""
    circle = gaps[0].turn.circle
    name = f"{circle.name}, {_load(gaps[0].cutting)}"
    degrees = np.append(np.arange(360), 0)
    outward = OUTWARD[degrees]
    axes = ["xyz"[i] for i in circle.plane]
    base = {each: numbers(circle.radius * outward[:, i], 5) for i, each in enumerate(axes)}
    traces = [line(f"nominal circle, R {circle.radius:.4g} mm", [], [], 0)]
    traces[0]["line"] = {"color": INK, "dash": "solid", "width": 1.5}
    shifts: list[dict[str, list[float | None]]] = [{}]
    largest = max(float(np.nanmax(np.abs(gap.before))) for gap in gaps)
    ring = _round_up(largest)
    drawn: list[tuple[str, Floats, Json]] = [
        (f"ring at +{ring:g} µm", np.full(361, ring), {"color": INK, "dash": "dot", "width": 1})
    ]
    explained = any(not np.array_equal(gap.before, gap.after) for gap in gaps)
    for counter_clockwise in (True, False):
        mine = [gap for gap in gaps if gap.turn.counter_clockwise == counter_clockwise]
        if not mine:
            continue
        style = 0 if counter_clockwise else 1
        for what, faint in (("measured", False), ("with the causes found", True))[: 1 + explained]:
            values = np.array([gap.after if faint else gap.before for gap in mine])
            known = np.isfinite(values)
            mean = np.where(known.any(axis=0), np.nansum(values, axis=0) / np.maximum(known.sum(axis=0), 1), np.nan)
            more = {"color": f"var(--c{style + 1 + 2 * faint})", "dash": ("solid", "dash")[style], "width": 2}
            drawn.append((f"{mine[0].turn.way}, {what}", mean[degrees], more))
    for label, radial, style_of in drawn:
        traces.append(line(label, [], [], 0) | {"line": style_of})
        shifts.append({each: numbers(1e-3 * radial * outward[:, i], 6) for i, each in enumerate(axes)})
    runs = ", ".join(dict.fromkeys(gap.run for gap in gaps))
    words = f"up to {brief(largest)} µm"
    first = float(np.clip(250.0 * circle.radius / max(largest, 1e-3), 1.0, 1e5))
    return Figure(
        name=f"circle-{number}",
        title=f"Circle {name}",
        caption=f"Measured minus modelled in the direction of the radius, outwards where the tip ran too far out: {words}. Runs "
        f"{runs}. The slider says how much it is enlarged; the dotted ring lies {ring:g} µm outside the circle.",
        traces=traces,
        layout={"xaxis": axis(""), "yaxis": axis("", scaleanchor="x", scaleratio=1)},
        height=560,
        exaggerate={"base": base, "shifts": shifts, "planes": ["".join(axes)], "first": first, "most": 1e6},
    )


def _round_up(value: float) -> float:
    """The smallest of 1, 2, 5, 10, ... that is at least `value`."""
    power = 10.0 ** np.floor(np.log10(max(value, 1e-3)))
    return float(next(m * power for m in (1.0, 2.0, 5.0, 10.0) if m * power >= value * (1 - 1e-9)))
