"""The walls that a program leaves in its stock, seen from above: as meant, and as the bent tool cuts them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from camcomp.compensation.program.loaded_cut import loaded_cut, meant_cut, nodes_of
from camcomp.gcode.program import Program
from camcomp.ground.datatypes import Floats
from camcomp.ground.records import dataclass
from camcomp.model.job import Job
from camcomp.model.stock.walls import Wall, offsets, walls_of
from camcomp.report.page import Section
from camcomp.report.plot import INK, Figure, Json, axis, brief, line, numbers, thin

MOST_NODES = 40_000  # a few minutes
RESTLESS = 0.01  # of all places
_SHOWN = 0.06  # of the drawing: how large the largest offset is drawn at first
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
    return Section(name="walls", title="Walls", text=text, figures=[figure_walls(found), figure_along(found)])


def figure_walls(found: CutWalls) -> Figure:
    """All walls from above; a slider enlarges by how much they are off."""
    rows = _rows(found)
    base = {a: _joined([w.points[r, i] for w, r in zip(found.walls, rows, strict=True)]) for i, a in enumerate("xy")}
    heights = _joined([np.full(len(r), w.level) for w, r in zip(found.walls, rows, strict=True)], 3)
    traces: list[Json] = [line("as meant", [], [], 0, hoverinfo="skip")]
    traces[0]["line"] = {"color": INK, "dash": "solid", "width": 1.5}
    shifts: list[Json] = [{}]
    for k, (name, off) in enumerate(zip(found.names, found.off, strict=True)):
        ways = [-1e-3 * off[i][r, None] * w.inward[r] for i, (w, r) in enumerate(zip(found.walls, rows, strict=True))]
        traces.append(
            line(name, [], [], k, customdata=_pairs([off[i][r] for i, r in enumerate(rows)], heights),
                 hovertemplate="off by %{customdata[0]} µm<br>at Z %{customdata[1]}")
        )  # fmt: skip
        shifts.append({a: _joined([way[:, i] for way in ways], 6) for i, a in enumerate("xy")})
    corners = np.concatenate([w.points for w in found.walls])
    extent, largest = float(np.ptp(corners, axis=0).max()), max(_largest(off) for off in found.off)
    words = walls_summary(found)
    return Figure(
        name="walls-above",
        title="Walls from above",
        caption=f"Walls as meant, and as the bent tool leaves them, enlarged; the slider says how much. Off {words}.",
        label=f"Drawing of the walls from above with enlarged deviations: {words}.",
        traces=traces,
        layout={"xaxis": axis(""), "yaxis": axis("", scaleanchor="x", scaleratio=1)},
        height=560,
        exaggerate={
            "base": base, "shifts": shifts, "planes": ["xy"],
            "first": float(np.clip(_SHOWN * extent / max(1e-3 * largest, 1e-9), 1.0, 1e4)), "most": 1e5,
        },
    )  # fmt: skip


def figure_along(found: CutWalls) -> Figure:
    """By how much walls are off, along them, one wall behind the other."""
    rows, begin, way = _rows(found), 0.0, []
    for wall, r in zip(found.walls, rows, strict=True):
        way.append(begin + wall.length[r])
        begin += float(wall.length[-1])
    x = _joined(way, 3)
    curves = [
        line(name, x, _joined([off[i][r] for i, r in enumerate(rows)], 2), k)
        for k, (name, off) in enumerate(zip(found.names, found.off, strict=True))
    ]
    words = walls_summary(found)
    return Figure(
        name="walls-along",
        title="Along the walls",
        caption=f"By how much the walls are off, one behind the other: {words}.",
        label=f"Plot of the offset of the walls along their way: {words}.",
        traces=curves,
        layout={"xaxis": axis("way along the walls in mm"), "yaxis": axis("material left in µm")},
    )


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


def _largest(off: list[Floats]) -> float:
    return float(np.nanmax(np.abs(np.concatenate(off)), initial=0.0))


def _rows(found: CutWalls) -> list[np.ndarray]:
    """Points of every wall that are drawn."""
    most = max(4000 // max(len(found.walls), 1), 50)
    return [thin(np.column_stack((w.points, *(off[i] for off in found.off))), most) for i, w in enumerate(found.walls)]


def _joined(parts: list[Floats], decimals: int = 4) -> list[float | None]:
    """Curves one behind the other with gaps between them."""
    out: list[float | None] = []
    for part in parts:
        out += [*numbers(part, decimals), None]
    return out[:-1]


def _pairs(off: list[Floats], height: list[float | None]) -> list[list[float | None]]:
    return [[a, b] for a, b in zip(_joined(off, 1), height, strict=True)]
