"""In which frame can a height field follow a stock under a tool that is turned?

Heights are measured along Z, and the tool has to point along Z. Where a program turns the tool, the stock and the path
are turned to the middle of the tool's axes during its cuts, from which no cut may lean by more than JOIN_ANGLE: directions
that close count as one for the cutting force, too.
"""

from __future__ import annotations

import numpy as np

from camcomp.ground.datatypes import RAPID, Floats, Path
from camcomp.ground.errors import ConfigError
from camcomp.ground.orientation import smallest_rotations
from camcomp.ground.records import dataclass, replace
from camcomp.model.config.spec import Config
from camcomp.model.cutting.track import JOIN_ANGLE
from camcomp.model.stock.field import BOX, MESH, ROUND
from camcomp.model.stock.front import EDGE
from camcomp.model.stock.shapes import StockShape

UPRIGHT = 1e-6  # of the sine between tool and Z of the frame
_STEPS = 200  # of the search for the middle of the axes (Badoiu, Clarkson 2003): within 0.5 % of their spread
_CORNERS = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
_FACES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))


@dataclass(frozen=True, eq=False)
class ToolFrame:
    """rotation (3, 3): program axes to those of the field. lean: largest angle (rad) of a cutting tool to its Z."""

    rotation: Floats
    lean: float

    def turned(self, path: Path) -> Path:
        """The path in the axes of the field."""
        if self.is_program:
            return path
        R = self.rotation.T
        return replace(path, start=path.start @ R, end=path.end @ R, centre=path.centre @ R, axis=path.axis @ R)

    @property
    def is_program(self) -> bool:
        """Whether the axes are those of the program."""
        return np.array_equal(self.rotation, np.eye(3))

    def shape(self, stock: StockShape) -> StockShape:
        """A stock in the axes of the field; one that is turned becomes a mesh."""
        if self.is_program:
            return stock
        mesh = (_triangles(stock) if stock.mesh is None else stock.mesh) @ self.rotation.T
        return StockShape(mesh.min(axis=(0, 1)), mesh.max(axis=(0, 1)), MESH, mesh)


def tool_frame_of(config: Config, tool_axis: Floats, path: Path | None = None) -> ToolFrame:
    """The frame for a path; None: for programs without words of orientation. tool_axis (3,): that of the machine without words of orientation, program frame.

    Raises ConfigError CC296 where no frame serves all cuts.
    """
    if path is None or path.orientation is None:
        if np.linalg.norm(np.asarray(tool_axis)[:2]) > UPRIGHT:
            message = "a stock is followed by a height field, for which the tool has to stand along the program's Z"
            raise ConfigError("CC296", message, at=config.at("workpiece", "stock"))
        return ToolFrame(np.eye(3), 0.0)
    cuts = np.flatnonzero((path.kind != RAPID) & path.known & ~path.machine)
    rows, u = np.concatenate((cuts, cuts)), np.repeat([0.0, 1.0], len(cuts))
    axes = path.orientation.rotations(rows, u) @ np.asarray(tool_axis, float)
    up = np.array([0.0, 0.0, 1.0])
    if len(axes) and _lean(axes, up).max() > JOIN_ANGLE:
        up = _middle(axes)
    lean = _lean(axes, up)
    if lean.max(initial=0.0) > JOIN_ANGLE * (1.0 + 1e-9):
        line = int(path.line[rows[int(np.argmax(lean))]])
        message = (
            f"a stock is followed where the tool keeps one direction within {np.degrees(JOIN_ANGLE):g} deg; "
            f"in line {line} it leans by {np.degrees(lean.max()):.2f} deg from the middle of all cuts"
        )
        raise ConfigError("CC296", message, at=config.at("workpiece", "stock"))
    return ToolFrame(np.eye(3) if up[2] == 1.0 else smallest_rotations(up[None])[0].T, float(lean.max(initial=0.0)))


def _lean(axes: Floats, up: Floats) -> Floats:
    """Angles (n,) rad between axes (n, 3) and up (3,)."""
    return np.asarray(np.arctan2(np.linalg.norm(np.cross(axes, up), axis=1), axes @ up))


def _middle(axes: Floats) -> Floats:
    """Centre (3,) of the smallest ball around axes (n, 3), as a unit vector."""
    centre = axes.mean(axis=0)
    for k in range(_STEPS):
        farthest = axes[int(np.argmax(np.sum((axes - centre) ** 2, axis=1)))]
        centre = centre + (farthest - centre) / (k + 2.0)
    return np.asarray(centre / max(float(np.linalg.norm(centre)), 1e-300))


def _triangles(stock: StockShape) -> Floats:
    """Triangles (f, 3, 3) mm of a box or an upright cylinder."""
    if stock.form == BOX:
        corner = stock.low + _CORNERS * (stock.high - stock.low)
        return np.array([corner[[f[0], f[i], f[i + 1]]] for f in _FACES for i in (1, 2)])
    assert stock.form == ROUND
    radius = 0.5 * float((stock.high - stock.low)[0])
    n = int(np.ceil(np.pi / np.sqrt(2.0 * EDGE / max(radius, EDGE))))
    turn = np.arange(n + 1) * (2.0 * np.pi / n)
    rim = 0.5 * (stock.low + stock.high)[:2] + radius * np.column_stack((np.cos(turn), np.sin(turn)))
    low, high = (np.column_stack((rim, np.full(n + 1, z))) for z in (stock.low[2], stock.high[2]))
    middle = [np.tile(each[:-1].mean(axis=0), (n, 1)) for each in (low, high)]
    faces = [(low[:-1], high[:-1], high[1:]), (low[:-1], high[1:], low[1:])]
    faces += [(low[1:], low[:-1], middle[0]), (high[:-1], high[1:], middle[1])]
    return np.concatenate([np.stack(each, axis=1) for each in faces])
