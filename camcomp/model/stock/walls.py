"""Walls of a stock at one height, and their distance from the walls of another stock."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
# numba infers the types of these functions; written by hand they would only be repeated.

from __future__ import annotations

import numpy as np

from camcomp.ground.compiled import entry
from camcomp.ground.datatypes import Bools, Floats
from camcomp.ground.records import dataclass
from camcomp.model.stock.field import height
from camcomp.model.stock.memory import StockMemory
from camcomp.model.stock.surface import Surface, surface_of
from camcomp.model.stock.sweeps import NOWHERE

WIDEST_MM, SCAN_MM = 1.0, 0.02  # range and step of the search for a wall
HALVINGS = 24
MOST_FLOORS = 6
FLAT_MM, LEAST_SHARE = 0.02, 0.005  # width of the bins of heights, and least share of the cut area that is a floor


@dataclass(frozen=True, eq=False)
class Wall:
    """Points along a wall with normals that point into the material. closed: the last point is the first one."""

    level: float
    points: Floats  # (n, 2) mm
    inward: Floats  # (n, 2)
    closed: bool

    @property
    def length(self) -> Floats:
        """Length (n,) mm along the wall to every point."""
        steps = np.linalg.norm(np.diff(self.points, axis=0), axis=1)
        return np.concatenate(([0.0], np.cumsum(steps)))


@entry
def read_points(nodes, points, out):
    """Fill out (n,) with the heights of the material over points (n, 2), mm."""
    for i in range(points.shape[0]):
        out[i] = height(nodes, points[i, 0], points[i, 1], -NOWHERE)


def heights(memory: StockMemory, points: Floats) -> Floats:
    """Heights (n,) mm of the material over points (n, 2) mm; -NOWHERE outside the stock."""
    out = np.empty(len(points))
    read_points(memory.nodes, np.ascontiguousarray(points), out)
    return out


def floors(surface: Surface, top: float) -> list[float]:
    """Heights (mm) of the level floors of a surface, ascending, and of the stock's top; its lowest point if it has none."""
    z = surface.z[np.isfinite(surface.z)]
    cut = z[z < top - FLAT_MM]
    if not len(cut):
        return [top]
    number, count = np.unique(np.round(cut / FLAT_MM), return_counts=True)
    level = number[count > LEAST_SHARE * len(cut)] * FLAT_MM
    apart = np.append(True, np.diff(level) > 2.0 * FLAT_MM) if len(level) else np.zeros(0, bool)
    found = level[apart].tolist()
    if not 0 < len(found) <= MOST_FLOORS:
        found = [float(cut.min())]
    return [*found, top]


def walls_of(memory: StockMemory) -> list[Wall]:
    """Walls of a stock half-way between neighbouring floors, the upper ones first."""
    surface = surface_of(memory)
    levels = floors(surface, float(memory.bounds[1][2]))
    out = []
    for low, high in zip(levels[-2::-1], levels[:0:-1], strict=True):
        out += _walls_at(memory, surface, 0.5 * (low + high))
    return out


def offsets(wall: Wall, memory: StockMemory) -> Floats:
    """Excess material (n,) mm of a stock at a wall, negative where more was cut; NaN without a wall within WIDEST_MM."""
    n = len(wall.points)
    stands = _standing(memory, wall, np.zeros(n))
    out = np.full(n, np.nan)
    inner, outer = np.zeros(n), np.zeros(n)
    looking = np.ones(n, np.bool_)
    for reach in np.arange(SCAN_MM, WIDEST_MM + SCAN_MM, SCAN_MM):  # outwards from material, inwards from air
        beside = np.where(stands, -reach, reach)
        found = looking & (_standing(memory, wall, beside) != stands)
        other = np.where(stands, -(reach - SCAN_MM), reach - SCAN_MM)
        inner[found], outer[found] = np.where(stands, other, beside)[found], np.where(stands, beside, other)[found]
        looking &= ~found
        if not looking.any():
            break
    for _ in range(HALVINGS):
        middle = 0.5 * (inner + outer)
        on = _standing(memory, wall, middle)
        inner, outer = np.where(on, middle, inner), np.where(on, outer, middle)
    out[~looking] = -inner[~looking]
    return out


def _standing(memory: StockMemory, wall: Wall, inwards: Floats) -> Bools:
    found: Bools = heights(memory, wall.points + inwards[:, None] * wall.inward) > wall.level
    return found


def _walls_at(memory: StockMemory, surface: Surface, level: float) -> list[Wall]:
    """Contours of the material above a level, with points where they cross the lines of the grid."""
    solid = np.where(np.isfinite(surface.z), surface.z, -np.inf) > level
    x, y = surface.x, surface.y
    at: dict[tuple[int, int, int], int] = {}  # side of a cell (0 along x, 1 along y; row, column): number of the point
    ends: list[tuple[tuple[float, float], tuple[float, float]]] = []
    for kind, (di, dj) in enumerate(((0, 1), (1, 0))):
        rows, columns = solid.shape[0] - di, solid.shape[1] - dj
        i, j = np.nonzero(solid[:rows, :columns] != solid[di:, dj:])
        for a, b in zip(i.tolist(), j.tolist(), strict=True):
            at[kind, a, b] = len(ends)
            ends.append(
                ((x[b], y[a]), (x[b + dj], y[a + di])) if solid[a, b] else ((x[b + dj], y[a + di]), (x[b], y[a]))
            )
    if not ends:
        return []
    inside, outside = np.array(ends).transpose(1, 0, 2)
    for _ in range(HALVINGS):
        middle = 0.5 * (inside + outside)
        on = (heights(memory, middle) > level)[:, None]
        inside, outside = np.where(on, middle, inside), np.where(on, outside, middle)
    return [_wall(memory, level, inside[rows], closed) for rows, closed in _chains(_neighbours(at))]


def _neighbours(at: dict[tuple[int, int, int], int]) -> dict[int, list[int]]:
    """Neighbours of every point within a cell; a cell that a wall crosses twice counts as two corners."""
    cells: dict[tuple[int, int], list[int]] = {}
    for (kind, i, j), number in at.items():
        for cell in ((i, j), (i - 1, j) if kind == 0 else (i, j - 1)):
            cells.setdefault(cell, []).append(number)
    out: dict[int, list[int]] = {number: [] for number in at.values()}
    for each in cells.values():
        for a, b in zip(each[::2], each[1::2], strict=False):
            out[a].append(b)
            out[b].append(a)
    return out


def _chains(beside: dict[int, list[int]]) -> list[tuple[list[int], bool]]:
    """Chains of neighbouring points, and whether each is closed."""
    out, left = [], set(beside)
    for start in sorted(beside, key=lambda each: (len(beside[each]), each)):  # open ends first
        if start not in left:
            continue
        chain, at = [start], start
        left.discard(start)
        while following := [each for each in beside[at] if each in left]:
            at = following[0]
            left.discard(at)
            chain.append(at)
        out.append((chain, len(chain) > 2 and start in beside[at]))
    return [each for each in out if len(each[0]) > 2]


def _wall(memory: StockMemory, level: float, points: Floats, closed: bool) -> Wall:
    """Wall with normals of the chords around every point."""
    if closed:
        points = np.vstack((points, points[:1]))
        along = np.vstack((points[1] - points[-2], points[2:] - points[:-2], points[1] - points[-2]))
    else:
        along = np.gradient(points, axis=0)
    normal = np.column_stack((-along[:, 1], along[:, 0]))
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    step = 2.0 * SCAN_MM
    into = heights(memory, points + step * normal) > level
    if np.mean(into) < 0.5:
        normal = -normal
    return Wall(level, points, normal, closed)
