"""State of the output between two pieces of a long program."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from camcomp.gcode.output import Standing
from camcomp.ground.datatypes import Floats


@dataclass
class OutputState:
    """State of the output at the end of a piece; program frame."""

    written: Floats  # (3,) mm where the written program stands
    commanded: Floats  # (3,) mm the same before rounding
    code: float = -1.0  # motion code in force in the output, -1: not known
    feed: float = np.nan  # feed in force, mm/min; NaN: not known
    apart: bool | None = False  # lines are kept from being made one; None: not known

    def standing(self) -> Standing:
        """The same for the writer of other lines."""
        x, y, z = self.written.tolist()
        return Standing(
            (x, y, z), None if self.code < 0.0 else int(self.code), None if np.isnan(self.feed) else (94, self.feed)
        )

    def take(self, behind: Standing, commanded: Floats) -> None:
        """Go on behind other lines."""
        self.written, self.commanded = np.array(behind.position), commanded.copy()
        self.code = -1.0 if behind.code is None else float(behind.code)
        self.feed = behind.feed[1] if behind.feed is not None and behind.feed[0] == 94 else np.nan
        self.apart = None if self.apart is not False else False
