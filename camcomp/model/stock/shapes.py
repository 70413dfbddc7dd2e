"""Shapes of tools and of the uncut stock, in the form that the height field takes."""

from __future__ import annotations

import numpy as np

from camcomp.ground.datatypes import Floats
from camcomp.ground.records import dataclass
from camcomp.model.stock.field import BOX
from camcomp.model.stock.front import EDGE, FLOOR
from camcomp.model.stock.sweeps import BALL, BULL, DRILL, FLAT

KINDS = {"flat": FLAT, "ball": BALL, "bull": BULL, "drill": DRILL}
SLIMMER = 1e-7  # mm
POINT_DEG = 118.0  # of a drill


@dataclass(frozen=True)
class ToolShape:
    """Shape of a tool; flute_mm: length of its cutting edges, None: unknown."""

    kind: str
    diameter_mm: float
    corner_mm: float = 0.0
    point_deg: float = POINT_DEG
    flute_mm: float | None = None

    def rows(self) -> list[list[float]]:
        """Rows of the tool and of the same tool slimmer by EDGE, in columns of sweeps.py.

        Material is sampled EDGE inside the tool and FLOOR over its surface. The slim tool is lifted just so much that the
        skin between both counts as material on slanted surfaces too.
        """
        radius = 0.5 * self.diameter_mm
        corner = radius if self.kind == "ball" else self.corner_mm if self.kind == "bull" else 0.0
        cone = float(np.tan(np.radians(0.5 * self.point_deg)))
        less = min(EDGE + SLIMMER, 0.5 * radius)
        slim = [radius - less, KINDS[self.kind], corner - less if self.kind == "ball" else corner, cone]
        higher = {"flat": 0.0, "ball": less, "bull": 0.0, "drill": less / cone}[self.kind]
        lift = 0.0 if self.kind == "flat" else higher + FLOOR + SLIMMER
        return [[radius, KINDS[self.kind], corner, cone, 0.0], [*slim, lift]]

    def rise(self, aside: float) -> float:
        """Height of the surface over the tip (mm) at a distance from the axis (mm); infinite beyond the radius."""
        radius, _, corner, cone, _ = self.rows()[0]
        if aside > radius:
            return np.inf
        if self.kind == "drill":
            return aside / cone
        inside = max(aside - (radius - corner), 0.0)
        return float(corner - np.sqrt(corner**2 - inside**2))


@dataclass(frozen=True, eq=False)
class StockShape:
    """Uncut stock in the program frame: corners low, high (3,) mm; mesh (f, 3, 3) mm, triangles of a stock from a file."""

    low: Floats
    high: Floats
    form: int = BOX
    mesh: Floats | None = None
