"""The walls that a program leaves in its stock, seen from above: as meant, and as the bent tool cuts them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import PurePath

import numpy as np

from camcomp.compensation.program.loaded_cut import loaded_cut, meant_cut, nodes_of, refuse_without_stock
from camcomp.gcode.program import Program
from camcomp.ground.datatypes import Floats
from camcomp.ground.records import dataclass
from camcomp.model.job import Job
from camcomp.model.stock.walls import Wall, offsets, walls_of
from camcomp.report.inputs import Input, inputs_section
from camcomp.report.page import Page, Section, render
from camcomp.report.plot import INK, Figure, Json, axis, brief, enlarged, line, numbers, thin

MOST_NODES = 40_000  # a few minutes
RESTLESS = 0.01  # of all places
_WORDS = (
    "Half-way between the floors, from above. The tip is followed as it bends, step by step, and what it leaves standing the next pass "
    "meets. A wall is off by its distance square to the wall that was meant: above zero material is left, below zero too "
    "much is gone."
)


@dataclass(frozen=True, eq=False)
class CutWalls:
    """Walls as meant, and by how much (um) each of some programs leaves them off; NaN where no wall is near."""

    walls: list[Wall]
    names: list[str]
    off: list[list[Floats]]  # of every program, of every wall
    restless: float  # largest share of the places at which force and tip did not come to rest


def cut_walls(job: Job, meant: Program, programs: Sequence[tuple[str, Program]]) -> CutWalls:
    """Walls that the loaded machine cuts by each program, compared with the walls of `meant` on a rigid machine."""
    walls = walls_of(meant_cut(job, meant))
    off, restless = [], 0.0
    for _, program in programs:
        cut = loaded_cut(job, program)
        cut.memory.settle()
        off.append([1e3 * offsets(wall, cut.memory) for wall in walls])
        restless = max(restless, float(np.mean(cut.unrest > 0.0)) if len(cut.unrest) else 0.0)
    return CutWalls(walls, [name for name, _ in programs], off, restless)


def wall_section(job: Job, meant: Program, programs: Sequence[tuple[str, Program]]) -> Section | None:
    """Both drawings of the walls; None without a stock or a wall."""
    if job.config.workpiece.stock is None or job.conditions.model is None:
        return None
    if max(nodes_of(program) for _, program in programs) > MOST_NODES:
        refused = "The program is too long to lead the bent tool through it here; camcomp simulate --surface does."
        return Section(name="walls", title="Walls", text=[refused])
    found = cut_walls(job, meant, programs)
    if not any(np.isfinite(each).any() for each in found.off[0]):
        return None
    text = [_WORDS]
    if found.restless > RESTLESS:
        text.append(
            f"At {100.0 * found.restless:.0f} % of the places force and tip do not come to rest: walls are rough there."
        )
    return Section(name="walls", title="Walls", text=text, figures=_figures(found))


def _figures(found: CutWalls) -> list[Figure]:
    """All walls from above, where a slider enlarges by how much they are off, and that along them, one behind the other."""
    points, inward, way, level, off = np.split(_drawn(found), [2, 4, 5, 6], axis=1)
    traces: list[Json] = [line("as meant", [], [], 0, hoverinfo="skip")]
    traces[0]["line"] = {"color": INK, "dash": "solid", "width": 1.5}
    shifts, curves, height = [dict[str, list[float | None]]()], [], numbers(level[:, 0], 3)
    for k, name in enumerate(found.names):
        told = [list(each) for each in zip(numbers(off[:, k], 1), height, strict=True)]
        hover = "off by %{customdata[0]} µm<br>at Z %{customdata[1]}"
        traces.append(line(name, [], [], k, customdata=told, hovertemplate=hover))
        shift = -1e-3 * off[:, k, None] * inward
        shifts.append({a: numbers(shift[:, i], 6) for i, a in enumerate("xy")})
        curves.append(line(name, numbers(way[:, 0], 3), numbers(off[:, k], 2), k))
    corners = np.concatenate([wall.points for wall in found.walls])
    largest = max(float(np.nanmax(np.abs(np.concatenate(each)), initial=0.0)) for each in found.off)
    base, extent = {a: numbers(points[:, i], 4) for i, a in enumerate("xy")}, float(np.ptp(corners, axis=0).max())
    words = walls_summary(found)
    above = Figure(
        name="walls-above", title="Walls from above",
        caption=f"Walls as meant, and as the bent tool leaves them, enlarged; the slider says how much. Off {words}.",
        traces=traces, layout={"xaxis": axis(""), "yaxis": axis("", scaleanchor="x", scaleratio=1)}, height=560,
        exaggerate=enlarged(base, shifts, ["xy"], 1e-3 * largest, extent),
    )  # fmt: skip
    along = Figure(
        name="walls-along", title="Along the walls",
        caption=f"By how much the walls are off, one behind the other: {words}.",
        traces=curves, layout={"xaxis": axis("way along the walls in mm"), "yaxis": axis("material left in µm")},
    )  # fmt: skip
    return [above, along]


def walls_summary(found: CutWalls) -> str:
    """Wall errors of every program in words: rms and largest, µm."""
    parts = []
    for name, off in zip(found.names, found.off, strict=True):
        every = np.concatenate(off)
        known = np.isfinite(every)
        k = int(np.argmax(np.where(known, np.abs(every), -1.0)))
        x, y = np.concatenate([w.points for w in found.walls])[k]
        rms = float(np.sqrt(np.mean(every[known] ** 2)))
        lost = "" if known.all() else f", {100.0 * np.mean(~known):.0f} % not found within 1 mm"
        parts.append(f"{name}: rms {brief(rms)} µm, most {brief(every[k])} µm at X {x:.1f} Y {y:.1f}{lost}")
    return "; ".join(parts)


def _drawn(found: CutWalls) -> Floats:
    """Drawn points of all walls, one behind the other, with a row of NaN between two.

    Columns: x, y, both components of the normal, way along the walls, height, and by how much each program is off.
    """
    most, begin, parts = max(4000 // max(len(found.walls), 1), 50), 0.0, list[Floats]()
    for i, wall in enumerate(found.walls):
        off = np.column_stack([each[i] for each in found.off])
        level = np.full(len(off), wall.level)
        columns = np.column_stack((wall.points, wall.inward, begin + wall.length, level, off))
        parts += [columns[thin(np.column_stack((wall.points, off)), most)], np.full((1, columns.shape[1]), np.nan)]
        begin += float(wall.length[-1])
    return np.concatenate(parts[:-1])


def walls_html(job: Job, program: Program, inputs: Sequence[Input]) -> bytes:
    """The page of a simulated cut: the walls that the bent tool leaves.

    Raises ConfigError CC298 without a stock, CC216 when the plot library is not installed.
    """
    refuse_without_stock(job)
    section = wall_section(job, program, [("as written", program)])
    drawn = section is not None and bool(section.figures)
    lines = int(np.unique(program.path.line).size)
    verdict = "No wall is left that could be drawn."
    if drawn:
        verdict = "Walls as the loaded machine leaves them; how far they are off stands below the drawings."
    page = Page(
        title=f"{PurePath(program.name).name} on {job.config.robot.name}",
        subtitle=f"Simulated cut: what the loaded machine leaves of the stock, {lines} lines with motions",
        verdict=verdict,
        good=drawn,
        cards=[],
        sections=[section or Section(name="walls", title="Walls", text=[verdict]), inputs_section(inputs)],
        word="Cut" if drawn else "",
    )
    return render(page)
