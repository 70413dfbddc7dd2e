"""Stock and tools of a machine file in the shapes that the engine works with."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from camcomp.ground import path_geometry
from camcomp.ground.datatypes import RAPID, Path
from camcomp.ground.errors import ConfigError
from camcomp.model.config.cutting_tool import BoxStock, Cutter, CylinderStock, ProgramStock, StlStock
from camcomp.model.config.spec import Config
from camcomp.model.cutting.track import PLUNGE_SINE
from camcomp.model.stock.field import MESH, ROUND
from camcomp.model.stock.memory import NO_TOOL, StockMemory
from camcomp.model.stock.shapes import POINT_DEG, StockShape, ToolShape
from camcomp.model.stock.stl_file import open_edges, triangles_of
from camcomp.model.stock.tool_frame import ToolFrame


def memory_of(config: Config, frame: ToolFrame, bounds: Bounds) -> StockMemory:
    """Uncut stock of a machine file that has one, in a frame, for a program within given bounds.

    Raises:
        ConfigError: CC295 (a tool without diameter), CC297 (STL file).
    """
    tools = {number: _tool(config, cutter, number) for number, cutter in config.tools.items() if number in bounds.tools}
    if bounds.tools - set(config.tools) or not tools:
        tools[NO_TOOL] = _tool(config, config.tool, None)
    stock = config.workpiece.stock
    assert stock is not None
    return StockMemory(frame.shape(_stock(config, bounds, tools)), tools, stock.resolution_mm)


def _tool(config: Config, cutter: Cutter, number: int | None) -> ToolShape:
    if cutter.diameter_mm is None:
        name = "the tool" if number is None else f"tool T{number}"
        at = config.at("tool") if number is None else config.at("tools", number)
        raise ConfigError("CC295", f"{name} has no diameter, so its cut in the stock is not defined", at=at)
    return ToolShape(
        cutter.type or "flat",
        cutter.diameter_mm,
        cutter.corner_radius_mm or 0.0,
        cutter.point_deg or POINT_DEG,
        cutter.flute_length_mm,
    )


def _stock(config: Config, bounds: Bounds, tools: Mapping[int, ToolShape]) -> StockShape:
    match config.workpiece.stock:
        case BoxStock() as box:
            return StockShape(np.array(box.min_mm), np.array(box.max_mm))
        case CylinderStock() as bar:
            middle, radius = np.array(bar.centre_mm), 0.5 * bar.diameter_mm
            low, high = np.append(middle - radius, bar.bottom_mm), np.append(middle + radius, bar.top_mm)
            return StockShape(low, high, ROUND)
        case StlStock() as stl:
            return _mesh(config, stl)
        case ProgramStock() as around:
            return _around(config, around, bounds, max(0.5 * each.diameter_mm for each in tools.values()))
        case _:
            raise AssertionError("the caller has made sure that there is a stock, and has read it from comments")


def _mesh(config: Config, stl: StlStock) -> StockShape:
    at = config.at("workpiece", "stock", "file")
    try:
        with open(stl.file, "rb") as file:
            triangles = triangles_of(file.read())
    except OSError as error:
        raise ConfigError("CC297", f"the stock cannot be read: {error.strerror}", at=at) from None
    except ValueError as error:
        raise ConfigError("CC297", f"the stock is no whole STL file: {error}", at=at) from None
    if not len(triangles) or not np.isfinite(triangles).all() or not (np.ptp(triangles, axis=(0, 1)) > 0.0).all():
        raise ConfigError("CC297", "the STL file holds no body", at=at)
    if (edges := open_edges(triangles)).size:
        x, y, z = edges[0]
        message = f"the STL file is no closed body: {len(edges)} edges have a triangle on one side only, as at {x:g} {y:g} {z:g}"
        raise ConfigError("CC297", message, at=at)
    return StockShape(triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1)), MESH, triangles)


def _around(config: Config, stock: ProgramStock, bounds: Bounds, radius: float) -> StockShape:
    if not np.isfinite(bounds.low).all():
        raise ConfigError("CC298", "the program feeds nowhere", at=config.at("workpiece", "stock"))
    top = stock.top_mm if stock.top_mm is not None else config.workpiece.stock_top_mm
    if top is None:
        top = 0.0 if bounds.low[2] < 0.0 else bounds.across + max(stock.margin_mm, 1e-3)
    around = np.full(2, radius + stock.margin_mm)
    low = np.append(bounds.low[:2] - around, min(bounds.low[2], top) - max(stock.margin_mm, 1e-3))
    return StockShape(low, np.append(bounds.high[:2] + around, max(top, bounds.low[2])))


class Bounds:
    """Box (3,), (3,) mm of the feed motions of a program, highest lateral feed motion (mm), and tool numbers."""

    def __init__(self) -> None:
        self.low, self.high, self.across = np.full(3, np.inf), np.full(3, -np.inf), -np.inf
        self.tools: set[int] = set()

    def add(self, path: Path) -> Bounds:
        """Extend the bounds by the feed motions of a path, and return them."""
        feeds = np.flatnonzero((path.kind != RAPID) & path.known & ~path.machine)
        self.tools |= set(np.unique(path.tool[feeds]).tolist())
        u = np.linspace(0.0, 1.0, 9)
        arcs = feeds[np.isfinite(path.centre[feeds, 0])]
        points = path_geometry.points(path, np.repeat(arcs, len(u)), np.tile(u, len(arcs)))
        reach = np.linalg.norm(path.start[arcs] - path.centre[arcs], axis=1) if len(arcs) else np.zeros(0)
        lean = np.sqrt(np.maximum(1.0 - path.axis[arcs] ** 2, 0.0))  # an arc does not bulge along its axis
        bulge = np.repeat((reach * (1.0 - np.cos(np.abs(path.angle[arcs]) / 16.0)))[:, None] * lean, len(u), axis=0)
        ends = np.concatenate((path.start[feeds], path.end[feeds], points - bulge, points + bulge))
        if len(ends):
            self.low, self.high = np.minimum(self.low, ends.min(axis=0)), np.maximum(self.high, ends.max(axis=0))
        way = path.end[feeds] - path.start[feeds]
        across = np.hypot(way[:, 0], way[:, 1]) > PLUNGE_SINE * np.linalg.norm(way, axis=1)
        lateral = feeds[across | np.isfinite(path.centre[feeds, 0])]  # a full circle ends where it begins
        self.across = max(self.across, float(path.end[lateral, 2].max(initial=-np.inf)))
        return self
