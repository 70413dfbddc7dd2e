"""Input of a force model: the cut at n points of a path, as a struct of arrays."""

import numpy as np

from camcomp.ground.datatypes import Bools, Floats, Ints, frozen
from camcomp.ground.records import dataclass, field
from camcomp.model.cutting.engaged import EngagementArcs


@dataclass(frozen=True, eq=False, kw_only=True)
class Cut:
    """n points at which the tool cuts; rapids and air moves are not among them.

    Missing data (NaN, None) are allowed here; a force model that needs them raises an error. Raises ValueError for arrays
    without one row per point.
    """

    tangent: Floats  # (n, 3) unit feed direction, program frame
    tool_axis: Floats  # (3,) unit, program frame, pointing away from the workpiece
    feed: Floats  # (n,) mm/min along the path
    speed: Floats  # (n,) spindle, rev/min
    depth: Floats  # (n,) mm axial depth; NaN: not known; <= 0: above the stock
    width: Floats  # (n,) mm radial width; NaN: slot
    arc_length: Floats  # (n,) mm along the program path
    line: Ints  # (n,) source line
    diameter_mm: float | None = None
    teeth: int | None = None
    to_machine: Floats = field(default_factory=lambda: np.eye(3))  # (3, 3) program axes to machine axes
    # (n,) the point counts as the end of a motion, not as the start of the next; empty: all False
    ends: Bools = field(default_factory=lambda: np.zeros(0, np.bool_))
    # (n,) direction of the spindle by the program, +1 clockwise, -1, 0 stopped, NaN not stated; empty: all NaN
    turn: Floats = field(default_factory=lambda: np.zeros(0))
    # Engagement arcs if the stock is known; depth and width are then the highest material and its extent
    arcs: EngagementArcs | None = None

    def __post_init__(self) -> None:
        n = np.shape(self.line)[0]
        if not np.size(self.turn):
            object.__setattr__(self, "turn", np.full(n, np.nan))
        rows = {"tangent": (n, 3), "tool_axis": (3,), "to_machine": (3, 3)}
        for name in ("tangent", "tool_axis", "feed", "speed", "depth", "width", "arc_length", "to_machine", "turn"):
            array = frozen(getattr(self, name))
            if array.shape != rows.get(name, (n,)):
                raise ValueError(f"Cut.{name} has shape {array.shape}, not {rows.get(name, (n,))}")
            object.__setattr__(self, name, array)
        object.__setattr__(self, "line", frozen(self.line, np.int64))
        object.__setattr__(self, "ends", frozen(self.ends if np.size(self.ends) else np.zeros(n), np.bool_))

    def __len__(self) -> int:
        return int(self.line.shape[0])
