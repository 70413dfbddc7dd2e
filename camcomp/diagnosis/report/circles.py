"""Circles of the runs as polar plots of a ball-bar: both directions in one plot, and the values of ISO 230-4."""

from __future__ import annotations

from collections.abc import Sequence

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


def circles_of(views: Sequence[RunView]) -> list[tuple[RunView, Turn]]:
    """All full circles with a measured tip and their runs, in the order of the runs."""
    seen = [(view, view.program) for view in views if view.channels == _TIP]
    return [
        (view, turn)
        for view, program in seen
        if program is not None
        for turn in turns_of(program, view.commanded, view.before)
    ]


def circles_section(views: Sequence[RunView], tests: Sequence[CircularTest]) -> Section | None:
    """Section of the report on circles, or None without a circle. tests: values of ISO 230-4."""
    groups: dict[tuple[str, bool], list[tuple[RunView, Turn]]] = {}
    for view, turn in circles_of(views):
        groups.setdefault((turn.circle.name, view.cutting), []).append((view, turn))
    if not groups and not tests:
        return None
    order = sorted(groups, key=lambda key: -_largest(groups[key]))
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


def _largest(driven: Sequence[tuple[RunView, Turn]]) -> float:
    """Largest radial gap, measured minus modelled, um."""
    return max(float(np.nanmax(np.abs(turn.radial(view.before)))) for view, turn in driven)


def _figure(driven: Sequence[tuple[RunView, Turn]], number: int) -> Figure:
    """Radial gap round a circle, both directions, before and with the causes found; a slider enlarges it."""
    circle = driven[0][1].circle
    name = f"{circle.name}, {_load(driven[0][0].cutting)}"
    degrees = np.append(np.arange(360), 0)
    outward = OUTWARD[degrees]
    axes = ["xyz"[i] for i in circle.plane]
    base = {each: numbers(circle.radius * outward[:, i], 5) for i, each in enumerate(axes)}
    traces = [line(f"nominal circle, R {circle.radius:.4g} mm", [], [], 0)]
    traces[0]["line"] = {"color": INK, "dash": "solid", "width": 1.5}
    shifts: list[dict[str, list[float | None]]] = [{}]
    largest = _largest(driven)
    ring = _round_up(largest)
    drawn: list[tuple[str, Floats, Json]] = [
        (f"ring at +{ring:g} µm", np.full(361, ring), {"color": INK, "dash": "dot", "width": 1})
    ]
    explained = any(view.explained for view, _ in driven)
    for counter_clockwise in (True, False):
        mine = [(view, turn) for view, turn in driven if turn.counter_clockwise == counter_clockwise]
        if not mine:
            continue
        style = 0 if counter_clockwise else 1
        for what, faint in (("measured", False), ("with the causes found", True))[: 1 + explained]:
            values = np.array([turn.radial(view.after if faint else view.before) for view, turn in mine])
            known = np.isfinite(values)
            mean = np.where(known.any(axis=0), np.nansum(values, axis=0) / np.maximum(known.sum(axis=0), 1), np.nan)
            more = {"color": f"var(--c{style + 1 + 2 * faint})", "dash": ("solid", "dash")[style], "width": 2}
            drawn.append((f"{mine[0][1].way}, {what}", mean[degrees], more))
    for label, radial, style_of in drawn:
        traces.append(line(label, [], [], 0) | {"line": style_of})
        shifts.append({each: numbers(1e-3 * radial * outward[:, i], 6) for i, each in enumerate(axes)})
    runs = ", ".join(dict.fromkeys(view.name for view, _ in driven))
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
