"""Circles that the runs drove, as a ball-bar shows them: both directions on one plot, and the values of ISO 230-4."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from camcomp.diagnosis.report.run_view import RunView
from camcomp.ground.datatypes import Floats, Path
from camcomp.report.page import Section, Table
from camcomp.report.plot import INK, Figure, Json, axis, brief, line, numbers

MOST_CIRCLES = 4
_NEAR_MM = 0.5  # of the circle: set-points that far off are on another path
_WHOLE = np.radians(350.0)  # a program that turns so far drives a circle
_WIDEST_DEG = 15.0  # between rows of a circle that counts as measured
_FEWEST_ROWS = 48
_ANGLES = np.radians(np.arange(360) + 0.5)
OUTWARD = np.column_stack((np.cos(_ANGLES), np.sin(_ANGLES)))  # at every degree
_TIP = ("tip x", "tip y", "tip z")
_ISO = (
    "G is the circular deviation of one direction, G(b) that of both, each about its own least-squares centre; F max and "
    "F min are the largest and least deviation of the radius from the programmed one about the programmed centre (ISO 230-4, "
    "mean over every degree, or over two rows where they lie wider). Runs that cut show the machine under load, which the standard leaves out."
)


@dataclass(frozen=True, eq=False)
class Circle:
    """A nominal circle in the program frame: centre (3,), radius mm, the axes of the plane it lies in."""

    centre: Floats
    radius: float
    plane: tuple[int, int]

    @property
    def name(self) -> str:
        """Radius, plane and centre."""
        a, b = ("XYZ"[i] for i in self.plane)
        at = ", ".join(f"{value + 0.0:.4g}" for value in self.centre)
        return f"R {self.radius:.4g} mm in {a}{b} about ({at})"


@dataclass(frozen=True, eq=False)
class Turn:
    """A circle driven in one direction in one run, at every degree (360,).

    off: measured radius minus the programmed one, um, about the programmed centre; before, after: measured minus
    modelled, radial, um.
    """

    circle: Circle
    run: str
    counter_clockwise: bool
    cutting: bool
    off: Floats
    before: Floats
    after: Floats

    @property
    def points(self) -> Floats:
        """Where the tip was (360, 2), mm from the programmed centre."""
        radius: Floats = self.circle.radius + 1e-3 * self.off
        return np.asarray(radius[:, None] * OUTWARD)


def turns_of(views: Sequence[RunView]) -> list[Turn]:
    """Every full circle of every run whose tip was measured, in the order of the runs."""
    out = []
    for view in views:
        if view.program is None or view.channels != _TIP:
            continue
        for circle in _circles(view.program):
            out += [turn for way in (True, False) if (turn := _turn(view, circle, way)) is not None]
    return out


def _circles(path: Path) -> list[Circle]:
    """The circles on which a program turns at least once, whole, on one level; arcs in pieces count together."""
    angle: dict[str, float] = {}
    found: dict[str, Circle] = {}
    for k in np.flatnonzero(np.isfinite(path.centre[:, 0]) & path.known & ~path.machine):
        a, b = (i for i in range(3) if not path.axis[k, i])
        level = 3 - a - b
        if abs(path.end[k, level] - path.start[k, level]) > 1e-6:
            continue
        circle = Circle(path.centre[k], float(np.linalg.norm(path.start[k] - path.centre[k])), (a, b))
        found.setdefault(circle.name, circle)
        angle[circle.name] = angle.get(circle.name, 0.0) + abs(float(path.angle[k]))
    return [circle for name, circle in found.items() if angle[name] > _WHOLE]


def _turn(view: RunView, circle: Circle, counter_clockwise: bool) -> Turn | None:
    """The rows of a run on a circle in one direction; None where they make no whole turn."""
    a, b = circle.plane
    level = 3 - a - b
    told = view.commanded - circle.centre
    angle = np.arctan2(told[:, b], told[:, a])
    near = np.abs(np.hypot(told[:, a], told[:, b]) - circle.radius) < _NEAR_MM
    near &= np.abs(told[:, level]) < _NEAR_MM
    step = np.gradient(np.unwrap(np.where(np.isfinite(angle), angle, 0.0)))
    near &= (step > 0.0) if counter_clockwise else (step < 0.0)
    near &= np.isfinite(view.before).all(axis=1) & np.isfinite(angle)
    outward = np.column_stack((np.cos(angle), np.sin(angle)))
    measured = view.position + 1e-3 * view.before - circle.centre
    off = 1e3 * (np.hypot(measured[:, a], measured[:, b]) - circle.radius)
    rows = [off, *(np.sum(each[:, [a, b]] * outward, axis=1) for each in (view.before, view.after))]
    at = np.degrees(angle[near]) % 360.0
    if len(at) < _FEWEST_ROWS or np.diff(np.sort(at), append=at.min() + 360.0).max() > _WIDEST_DEG:
        return None
    mean = [_every_degree(at, each[near]) for each in rows]
    return Turn(circle, view.name, counter_clockwise, view.cutting, *mean)


def _every_degree(at: Floats, values: Floats) -> Floats:
    """Values (n,) at angles (n,) deg as means over sectors of two rows or a degree, whichever is wider, at (360,) degrees."""
    sectors = int(np.clip(len(at) // 2, 24, 360))
    k = np.minimum((at * sectors / 360.0).astype(int), sectors - 1)
    count = np.bincount(k, minlength=sectors)
    seen = count > 0
    centre, mean = (np.bincount(k, each, sectors)[seen] / count[seen] for each in (at, values))
    return np.asarray(np.interp(np.arange(360) + 0.5, centre, mean, period=360.0))


def circular_deviation(points: Sequence[Floats]) -> float:
    """Range of the radii of points (n, 2) mm about the centre of their least-squares circle, um (ISO 230-4, G and G(b))."""
    all_points = np.concatenate(points)
    known = all_points[np.isfinite(all_points).all(axis=1)]
    middle = known.mean(axis=0)
    p = known - middle
    for _ in range(8):  # Gauss-Newton on the distances; the first step is a tenth of the radius at most
        r = np.hypot(*p.T)
        matrix = np.column_stack((p / r[:, None], np.ones(len(p))))
        step = np.linalg.lstsq(matrix, r, rcond=None)[0]
        p = p - step[:2]
        if np.linalg.norm(step[:2]) < 1e-9:
            break
    return 1e3 * float(np.ptp(np.hypot(*p.T)))


def circles_section(views: Sequence[RunView]) -> Section | None:
    """The part of a report on circles; None where no run drove one."""
    turns = turns_of(views)
    groups: dict[str, list[Turn]] = {}
    for turn in turns:
        groups.setdefault(turn.circle.name, []).append(turn)
    if not groups:
        return None
    order = sorted(groups, key=lambda name: -max(float(np.nanmax(np.abs(t.before))) for t in groups[name]))
    figures = [_figure(name, groups[name], i) for i, name in enumerate(order[:MOST_CIRCLES], 1)]
    return Section("circles", "On the circle", figures=figures, text=[_ISO], tables=[_values(groups, order)])


def _values(groups: dict[str, list[Turn]], order: Sequence[str]) -> Table:
    rows = []
    for name in order:
        for cutting in (False, True):
            turns = [each for each in groups[name] if each.cutting == cutting]
            both = len({each.counter_clockwise for each in turns}) == 2
            for turn in turns:
                values = [circular_deviation([turn.points])]
                if both:
                    values.append(circular_deviation([each.points for each in turns]))
                values += [float(np.nanmax(turn.off)), float(np.nanmin(turn.off))]
                cells = [(value, brief(value)) for value in values]
                rows.append([
                    name, turn.run, _way(turn), "cutting" if cutting else "in air", cells[0], cells[1] if both else "–",
                    *cells[-2:],
                ])  # fmt: skip
    heads = ("circle", "run", "direction", "load", "G µm", "G(b) µm", "F max µm", "F min µm")
    return Table("Circular deviations", heads, rows)


def _way(turn: Turn) -> str:
    return "counter-clockwise" if turn.counter_clockwise else "clockwise"


def _figure(name: str, turns: Sequence[Turn], number: int) -> Figure:
    """Radial gap round a circle, both directions, before and with the causes found; a slider enlarges it."""
    circle = turns[0].circle
    degrees = np.append(np.arange(360), 0)
    outward = OUTWARD[degrees]
    axes = ["xyz"[i] for i in circle.plane]
    base = {each: numbers(circle.radius * outward[:, i], 5) for i, each in enumerate(axes)}
    traces = [line(f"nominal circle, R {circle.radius:.4g} mm", [], [], 0)]
    traces[0]["line"] = {"color": INK, "dash": "solid", "width": 1.5}
    shifts: list[dict[str, list[float | None]]] = [{}]
    largest = max(float(np.nanmax(np.abs(turn.before))) for turn in turns)
    ring = _round_up(largest)
    drawn: list[tuple[str, Floats, Json]] = [
        (f"ring at +{ring:g} µm", np.full(361, ring), {"color": INK, "dash": "dot", "width": 1})
    ]
    for counter_clockwise in (True, False):
        mine = [turn for turn in turns if turn.counter_clockwise == counter_clockwise]
        if not mine:
            continue
        style = 0 if counter_clockwise else 1
        for what, faint in (("measured", False), ("with the causes found", True)):
            values = np.array([turn.after if faint else turn.before for turn in mine])
            known = np.isfinite(values)
            mean = np.where(known.any(axis=0), np.nansum(values, axis=0) / np.maximum(known.sum(axis=0), 1), np.nan)
            more = {"color": f"var(--c{style + 1 + 2 * faint})", "dash": ("solid", "dash")[style], "width": 2}
            drawn.append((f"{_way(mine[0])}, {what}", mean[degrees], more))
    for label, radial, style_of in drawn:
        traces.append(line(label, [], [], 0) | {"line": style_of})
        shifts.append({each: numbers(1e-3 * radial * outward[:, i], 6) for i, each in enumerate(axes)})
    runs = ", ".join(dict.fromkeys(turn.run for turn in turns))
    words = f"up to {brief(largest)} µm"
    first = float(np.clip(250.0 * circle.radius / max(largest, 1e-3), 1.0, 1e5))
    return Figure(
        f"circle-{number}",
        f"Circle {name}",
        f"Measured minus modelled in the direction of the radius, outwards where the tip ran too far out: {words}. Runs "
        f"{runs}. The slider says how much it is enlarged; the dotted ring lies {ring:g} µm outside the circle.",
        f"Polar plot of the radial gap on the circle {name}, both directions: {words}.",
        traces,
        {"xaxis": axis(""), "yaxis": axis("", scaleanchor="x", scaleratio=1)},
        height=560,
        exaggerate={"base": base, "shifts": shifts, "planes": ["".join(axes)], "first": first, "most": 1e6},
    )


def _round_up(value: float) -> float:
    """The least of 1, 2, 5, 10, ... that is not below."""
    power = 10.0 ** np.floor(np.log10(max(value, 1e-3)))
    return float(next(m * power for m in (1.0, 2.0, 5.0, 10.0) if m * power >= value * (1 - 1e-9)))
