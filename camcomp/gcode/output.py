"""Requested moves of a corrected program, and the result of writing them."""

import numpy as np
from numpy.typing import NDArray

from camcomp.gcode.path_mode import PathMode
from camcomp.ground.datatypes import ARC, LINE, RAPID, Bools, Floats, Ints, Path, frozen
from camcomp.ground.records import dataclass

FEED_SLACK = 1.0e-3  # relative difference of a feed below which no F word is written


@dataclass(frozen=True, eq=False, kw_only=True)
class Output:
    """Moves to be written, N rows in order; every motion of the program has at least one row."""

    motion: Ints  # (N,) index into the program's path, not decreasing
    kind: NDArray[np.int8]  # (N,) RAPID, LINE or ARC
    end: Floats  # (N, 3) mm, program frame
    centre: Floats  # (N, 3) mm, for arcs
    angle: Floats  # (N,) rad, signed, for arcs; the axis is that of the motion
    feed: Floats  # (N,) mm/min; NaN: as programmed
    joining: Bools  # (N,) a line added between two motions, before or after the motion's own rows
    rest: Bools | None = None  # (N,) ends at standstill in any path mode; None: all False
    apart: Bools | None = None  # (N,) the controller must not merge it with other lines; None: by the path mode
    words: Floats | None = None  # (N, 3) of the orientation; None: those of the program, if any

    def __post_init__(self) -> None:
        n = len(self.motion)
        for each in ("rest", "apart"):
            if getattr(self, each) is None:
                object.__setattr__(self, each, np.zeros(n, np.bool_))
        for name, dtype, row in (
            ("motion", np.int64, ()),
            ("kind", np.int8, ()),
            ("end", np.float64, (3,)),
            ("centre", np.float64, (3,)),
            ("angle", np.float64, ()),
            ("feed", np.float64, ()),
            ("joining", np.bool_, ()),
            ("rest", np.bool_, ()),
            ("apart", np.bool_, ()),
        ):
            array = frozen(getattr(self, name), dtype)
            if array.shape != (n, *row):
                raise ValueError(f"Output.{name} has shape {array.shape}, not {(n, *row)}")
            object.__setattr__(self, name, array)

    @classmethod
    def same(cls, path: Path) -> "Output":
        """Every motion as programmed."""
        n = len(path)
        return cls(
            motion=np.arange(n),
            kind=path.kind,
            end=path.end,
            centre=path.centre,
            angle=path.angle,
            feed=np.full(n, np.nan),
            joining=np.zeros(n, bool),
        )

    def repeats(self, path: Path, resolution_mm: float) -> bool:
        """Whether these moves equal the path within half a resolution and FEED_SLACK of the feed."""
        half = 0.5 * resolution_mm * (1.0 + 1e-9)
        n = len(path)
        if self.words is not None:
            return False
        if len(self.motion) != n or (self.motion != np.arange(n)).any() or (self.kind != path.kind).any():
            return False
        free = path.known & ~path.machine
        if (np.abs(self.end - path.end)[free] > half).any():
            return False
        arcs = free & (path.kind == ARC)
        bent = np.abs(self.centre - path.centre)[arcs] * (1.0 - path.axis[arcs])
        if not (bent <= half).all() or (np.abs(self.angle - path.angle)[arcs] > 1e-9).any():
            return False
        fed = free & (path.kind != RAPID) & ~np.isnan(self.feed)
        return bool((np.abs(self.feed - path.feed)[fed] <= FEED_SLACK * path.feed[fed]).all())

    @classmethod
    def lines(cls, motion: Ints, end: Floats) -> "Output":
        """Straight cuts at the programmed feed."""
        n = len(motion)
        return cls(
            motion=motion,
            kind=np.full(n, LINE, np.int8),
            end=end,
            centre=np.full((n, 3), np.nan),
            angle=np.zeros(n),
            feed=np.full(n, np.nan),
            joining=np.zeros(n, bool),
        )


@dataclass(frozen=True)
class Standing:
    """State of the controller at a point of the output: tool tip, motion code, feed mode and value; None: unknown."""

    position: tuple[float, float, float]  # mm, program frame
    code: int | None = None
    feed: tuple[int, float] | None = None
    stated: PathMode | None = None  # path mode that the program stated last; None: that of its setup
    ours: str = ""  # path mode written by the writer of corrected programs and in force; empty: the program's


@dataclass(frozen=True)
class Part:
    """Motions first to last - 1 of a program, to be written after other output. The others keep their lines."""

    first: int
    last: int
    before: Standing


@dataclass(frozen=True, eq=False, kw_only=True)
class Rewritten:
    """The written program, N rows as in Output."""

    data: bytes  # stamped, unless it is a part
    end: Floats  # (N, 3) mm, program frame: end points of the rounded words
    line: Ints  # (N,) line of the output, from 1
    centre: Floats  # (N, 3) mm, of rows written as arcs, rounded; else NaN
    feed: Floats  # (N,) mm/min in force, NaN for rapids
    behind: Standing | None = None  # of a part
    words: Floats | None = None  # (N, 3) of the orientation, as rounded
