"""Machined surface of a stock: heights over a grid, as a table or as a body of triangles."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
# numba infers the types of these functions; written by hand they would only be repeated.

from __future__ import annotations

import numpy as np

from camcomp.ground.compiled import entry
from camcomp.ground.datatypes import Floats
from camcomp.ground.records import dataclass
from camcomp.model.stock.field import height
from camcomp.model.stock.memory import StockMemory
from camcomp.model.stock.sweeps import NOWHERE

MOST_POINTS = 4_000_000  # of a surface
FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("unused", "<u2")])


@dataclass(frozen=True, eq=False)
class Surface:
    """Heights z (ny, nx) mm over points x (nx,), y (ny,) mm in the program frame; NaN outside the material.

    bottom: of the stock, mm.
    """

    x: Floats
    y: Floats
    z: Floats
    bottom: float

    def to_csv(self) -> bytes:
        """CSV text with one row x_mm, y_mm, z_mm per point of the material."""
        rows, columns = np.nonzero(np.isfinite(self.z))
        points = np.column_stack((self.x[columns], self.y[rows], self.z[rows, columns]))
        lines = ["x_mm,y_mm,z_mm", *(f"{a:.4f},{b:.4f},{c:.6f}" for a, b, c in points.tolist())]
        return ("\n".join(lines) + "\n").encode()

    def to_stl(self) -> bytes:
        """Binary STL of the body between the surface and the bottom of the stock, without cells that are cut through."""
        z = np.where(np.isfinite(self.z), self.z, self.bottom)
        solid = z > self.bottom
        cell = solid[:-1, :-1] & solid[1:, :-1] & solid[:-1, 1:] & solid[1:, 1:]
        i, j = np.nonzero(cell)
        top = [self._points(i + a, j + b, z) for a, b in ((0, 0), (0, 1), (1, 1), (1, 0))]
        base = [np.column_stack((each[:, :2], np.full(len(i), self.bottom))) for each in top]
        parts = [
            (top[0], top[1], top[2]),
            (top[0], top[2], top[3]),
            (base[0], base[2], base[1]),
            (base[0], base[3], base[2]),
        ]
        beside = np.pad(cell, 1)
        for k, (a, b) in enumerate(((0, 1), (1, 2), (2, 3), (3, 0))):  # the sides below, right, above, left of a cell
            di, dj = ((-1, 0), (0, 1), (1, 0), (0, -1))[k]
            rim = ~beside[i + 1 + di, j + 1 + dj]
            parts.append((top[a][rim], base[a][rim], base[b][rim]))
            parts.append((top[a][rim], base[b][rim], top[b][rim]))
        corners = np.concatenate([np.stack(each, axis=1) for each in parts])
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        size = np.linalg.norm(normal, axis=1, keepdims=True)
        out = np.zeros(len(corners), FACET)
        out["normal"] = np.divide(normal, size, out=np.zeros_like(normal), where=size > 0.0)
        out["corners"] = corners
        return b"camcomp: cut surface, mm".ljust(80) + np.uint32(len(out)).tobytes() + out.tobytes()

    def _points(self, i: np.ndarray, j: np.ndarray, z: Floats) -> Floats:
        return np.column_stack((self.x[j], self.y[i], z[i, j]))


@entry
def read_heights(nodes, x, y, out):
    """Fill out (ny, nx) with the heights of the material over points, mm."""
    for i in range(y.shape[0]):
        for j in range(x.shape[0]):
            out[i, j] = height(nodes, x[j], y[i], -NOWHERE)


def surface_of(memory: StockMemory) -> Surface:
    """Surface of the material, sampled at about the distance of the field's nodes."""
    memory.settle()
    low, high = memory.bounds
    bottom, size = float(low[2]), (high - low)[:2]
    step = max(memory.cell, float(np.sqrt(np.prod(size) / MOST_POINTS)))
    x, y = (np.linspace(a, b, max(round((b - a) / step), 1) + 1) for a, b in zip(low[:2], high[:2], strict=True))
    z = np.empty((len(y), len(x)))
    read_heights(memory.nodes, x, y, z)
    return Surface(x, y, np.where(z > bottom, z, np.nan), bottom)
