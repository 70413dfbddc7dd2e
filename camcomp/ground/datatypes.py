"""Shared data types: structs of read-only float64 arrays with motions along the first axis."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from camcomp.ground.records import Rows, dataclass

if TYPE_CHECKING:
    from camcomp.ground.orientation import Orientation

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

RAPID, LINE, ARC = 0, 1, 2
STANDARD_GRAVITY = 9.80665  # m/s2

_FORMS: dict[str, tuple[type, tuple[int, ...]]] = {
    "line": (np.int64, ()),
    "kind": (np.int8, ()),
    "start": (np.float64, (3,)),
    "end": (np.float64, (3,)),
    "centre": (np.float64, (3,)),
    "axis": (np.float64, (3,)),
    "angle": (np.float64, ()),
    "feed": (np.float64, ()),
    "speed": (np.float64, ()),
    "turn": (np.float64, ()),
    "tool": (np.int64, ()),
    "known": (np.bool_, ()),
    "machine": (np.bool_, ()),
    "waits": (np.bool_, ()),
}


def frozen(values: ArrayLike, dtype: type = np.float64) -> NDArray[Any]:
    """Read-only view of `values` as an array of `dtype`; the caller's own array keeps its write flag."""
    array: NDArray[Any] = np.asarray(values, dtype=dtype, order="C").view()
    array.flags.writeable = False
    return array


@dataclass(frozen=True, eq=False, kw_only=True)
class Curves(Rows):
    """Lines and arcs (n,) of the tool tip, mm, program frame."""

    kind: NDArray[np.int8]  # (n,) RAPID, LINE or ARC
    start: Floats  # (n, 3) mm
    end: Floats  # (n, 3) mm
    centre: Floats  # (n, 3) mm, arc centre at the height of the start; NaN for lines and rapids
    axis: Floats  # (n, 3) unit normal of the arc plane: +X, +Y or +Z of G19, G18, G17; 0 for lines and rapids
    angle: Floats  # (n,) rad about `axis`, + = counter-clockwise seen from its tip; extra turns add 2 pi


@dataclass(frozen=True, eq=False, kw_only=True)
class Path(Curves):
    """Programmed path of the tool tip: n motions in program order, independent of the dialect.

    Points are tool tips in mm in the program frame of G54 at program start; all other offsets are resolved. Raises
    ValueError for arrays without one row per motion.
    """

    line: Ints  # (n,) source line, counted from 1
    feed: Floats  # (n,) mm/min of the tip; NaN for rapids
    speed: Floats  # (n,) spindle, rev/min
    turn: Floats  # (n,) direction of the spindle: +1 clockwise (M3), -1 (M4), 0 stopped (M5, S0), NaN: not stated
    tool: Ints  # (n,) tool number
    known: Bools  # (n,) X, Y and Z have all been commanded by the end of this motion
    machine: Bools  # (n,) move in machine coordinates (G53, G28, G30)
    waits: Bools | None = None  # (n,) the controller stops before it (G4, S, M3 to M9, another offset); None: all False

    orientation: Orientation | None = None  # of the tool; None: the program states none

    def __post_init__(self) -> None:
        n = np.shape(self.line)[0]
        if self.waits is None:
            object.__setattr__(self, "waits", np.zeros(n, np.bool_))
        for name, (dtype, row) in _FORMS.items():
            array = frozen(getattr(self, name), dtype)
            if array.shape != (n, *row):
                raise ValueError(f"Path.{name} has shape {array.shape}, not {(n, *row)}")
            object.__setattr__(self, name, array)

    def __len__(self) -> int:
        return int(self.line.shape[0])
