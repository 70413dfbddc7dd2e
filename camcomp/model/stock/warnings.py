"""Contradictions between the engagement in a stock and the process that a machine file states."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from camcomp.ground import path_geometry
from camcomp.ground.datatypes import Bools, Floats, Ints, Path
from camcomp.ground.source_lines import named_lines
from camcomp.model.config.spec import Config
from camcomp.model.cutting.engaged import Engaged

SHARE, HAIR_MM = 0.01, 0.005  # tolerance of a stated depth or width


Remarks = dict[str, Ints]  # text of a remark to its source lines, ascending


def stock_remarks(config: Config, path: Path, engaged: Engaged | None) -> Remarks:
    """Remarks on contradictions along a path with known engagement; empty without a stock."""
    if engaged is None:
        return {}
    on = np.flatnonzero(engaged.turn > 0.0)
    motion, depth = engaged.motion[on], engaged.depth[on]
    process, top = config.process, config.workpiece.stock_top_mm
    off: dict[str, Bools] = {}
    if process.depth_mm is not None:
        off["the depth in the stock is used, not process: depth_mm (remove the key or correct the stock),"] = _off(
            depth, process.depth_mm
        )
    if process.width_mm is not None:
        wide = _widths(config, path, engaged, on)
        off["the width in the stock is used, not process: width_mm (remove the key or correct the stock),"] = _off(
            wide, process.width_mm
        )
    if top is not None:
        height = path_geometry.points(path, motion, engaged.u[on])[:, 2]
        off["the top of the stock is used, not workpiece: stock_top_mm (remove the key or correct the stock),"] = _off(
            depth, top - height
        )
    flutes = {number: each.flute_length_mm for number, each in config.tools.items()}
    length = _by_tool(path.tool[motion], flutes, config.tool.flute_length_mm, np.inf)
    off["material is left above the flutes of the tool"] = depth > length + HAIR_MM
    return {text: np.unique(path.line[motion[rows]]) for text, rows in off.items() if rows.any()}


def stock_warnings(remarks: Remarks) -> list[str]:
    """The remarks as warnings."""
    return [f"{text} at {named_lines(lines)}" for text, lines in remarks.items()]


def _widths(config: Config, path: Path, engaged: Engaged, on: Ints) -> Floats:
    """Extent of the cut across the feed, mm."""
    diameters = {number: each.diameter_mm for number, each in config.tools.items()}
    own = config.tool.diameter_mm
    diameter = _by_tool(path.tool[engaged.motion[on]], diameters, own, np.nan)
    out: Floats = engaged.arcs.take(on).reach(len(on)) * 0.5 * diameter
    return out


def _by_tool(tool: Ints, of: Mapping[int, float | None], other: float | None, unknown: float) -> Floats:
    """Value (n,) of the tool at every place; `other` for tools without an entry, `unknown` where there is none."""
    numbers, which = np.unique(tool, return_inverse=True)
    return np.array([of.get(int(t), other) or unknown for t in numbers], float)[which]


def _off(found: Floats, stated: Floats | float) -> Bools:
    out: Bools = np.abs(found - stated) > SHARE * np.abs(stated) + HAIR_MM
    return out
