"""What a program is to become, and what became of it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from camcomp.datatypes import LINE, Bools, Floats, Ints, Path, frozen


@dataclass(frozen=True, eq=False)
class Output:
    """The moves to be written, N rows in order; every motion of the program has at least one row."""

    motion: Ints  # (N,) index into the program's path, not decreasing
    kind: NDArray[np.int8]  # (N,) RAPID, LINE or ARC
    end: Floats  # (N, 3) mm, program frame
    centre: Floats  # (N, 3) mm, for arcs
    angle: Floats  # (N,) rad, signed, for arcs; the axis is that of the motion
    feed: Floats  # (N,) mm/min; NaN: as programmed
    joining: Bools  # (N,) a line added between two motions, before or after the motion's own rows

    def __post_init__(self) -> None:
        n = len(self.motion)
        for name, dtype, row in (
            ("motion", np.int64, ()),
            ("kind", np.int8, ()),
            ("end", np.float64, (3,)),
            ("centre", np.float64, (3,)),
            ("angle", np.float64, ()),
            ("feed", np.float64, ()),
            ("joining", np.bool_, ()),
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


@dataclass(frozen=True, eq=False)
class Rewritten:
    """The program as written, N rows as in Output."""

    data: bytes  # stamped
    end: Floats  # (N, 3) mm, program frame: where the words, rounded as they are, lead
    line: Ints  # (N,) line of the output, from 1
