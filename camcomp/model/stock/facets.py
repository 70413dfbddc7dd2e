"""Topmost triangle of a mesh over every node of a height field."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
# numba infers the types of these functions; written by hand they would only be repeated.

from __future__ import annotations

import math
from typing import Any

import numpy as np

from camcomp.ground.compiled import entry
from camcomp.ground.datatypes import Floats
from camcomp.model.stock.field import CELL, GX, GY, over_facet
from camcomp.model.stock.shapes import StockShape
from camcomp.model.stock.sweeps import NOWHERE


@entry
def lay_facets(mesh, place, facet, top):
    """Fill facet (ny, nx) with the number (from 1) of the highest triangle at every node, and top (ny, nx) with its height."""
    for f in range(mesh.shape[0]):
        x0, x1, y0, y1 = NOWHERE, -NOWHERE, NOWHERE, -NOWHERE
        for c in range(3):
            x0, x1 = min(x0, mesh[f, c, 0]), max(x1, mesh[f, c, 0])
            y0, y1 = min(y0, mesh[f, c, 1]), max(y1, mesh[f, c, 1])
        first = max(math.ceil((x0 - place[GX]) / place[CELL]), 0)
        last = min(math.floor((x1 - place[GX]) / place[CELL]), facet.shape[1] - 1)
        for i in range(max(math.ceil((y0 - place[GY]) / place[CELL]), 0),
                       min(math.floor((y1 - place[GY]) / place[CELL]), facet.shape[0] - 1) + 1):  # fmt: skip
            for j in range(first, last + 1):
                z = over_facet(mesh, f, place[GX] + j * place[CELL], place[GY] + i * place[CELL])
                if z > -NOWHERE and (facet[i, j] == 0 or z > top[i, j]):
                    facet[i, j] = f + 1
                    top[i, j] = z


def facets_on(stock: StockShape, place: Floats, size: Any) -> tuple[Any, Floats]:
    """Number of the topmost triangle at every node (ny, nx), and the triangles (f, 3, 3) mm; (1, 1) and (0, 3, 3) without a mesh."""
    if stock.mesh is None:
        return np.zeros((1, 1), np.int32), np.zeros((0, 3, 3))
    facet = np.zeros((int(size[1]), int(size[0])), np.int32)
    mesh = np.ascontiguousarray(stock.mesh)
    lay_facets(mesh, place, facet, np.zeros(facet.shape))
    return facet, mesh
