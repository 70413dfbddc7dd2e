"""G60, G61, G61.1, G64, G641: whether a control stops at the ends of moves, and how far it may leave the path when it does not."""

import re
from dataclasses import dataclass, replace
from functools import cached_property

from camcomp.gcode.codes import EXACT_STOPS, code_name

NUMBER = r"\d+(?:\.\d*)?|\.\d+"
ROUNDING_DISTANCE = 6410  # Sinumerik: corners are rounded from ADIS mm before them on
PATTERN = rf"^G(61|61\.1|64)( P({NUMBER}))?( Q({NUMBER}))?$"


@dataclass(frozen=True)
class PathMode:
    """A mode of the modal group 13, lengths in mm."""

    exact: bool = False  # G61, G61.1, G60 of Sinumerik: every move ends at rest
    tolerance_mm: float = 0.0  # P of G64, ADIS of G641: how far a corner may be cut; 0: as far as the speed asks for
    merge_mm: float = 0.0  # Q of G64, else P: lines that are straight within it become one; 0: never
    code: int = 640
    stated: bool = True  # False: nobody said so, it is what a control does when it is switched on

    @cached_property
    def name(self) -> str:
        """As a program says it, in mm."""
        return self.said(1.0)

    @property
    def apart(self) -> "PathMode":
        """The same without making one line of several."""
        return replace(self, merge_mm=0.0)

    def said(self, unit: float) -> str:
        """As a program says it, in units of so many mm."""
        name = code_name(self.code)
        if self.code == ROUNDING_DISTANCE:
            return f"{name} ADIS={self.tolerance_mm / unit:g}"
        words = [f"P{self.tolerance_mm / unit:g}"] if self.tolerance_mm or self.merge_mm else []
        words += [f"Q{self.merge_mm / unit:g}"] if self.merge_mm != self.tolerance_mm else []
        return " ".join([name, *words])


def path_mode(code: int, tolerance: float | None, merge: float | None) -> PathMode:
    """The mode of a code in tenths with its P (or ADIS) and Q in mm; None: not given."""
    if code in EXACT_STOPS:
        return PathMode(exact=True, code=code)
    allowed = tolerance or 0.0
    same = 0.0 if code == ROUNDING_DISTANCE else allowed
    return PathMode(tolerance_mm=allowed, merge_mm=same if merge is None else merge, code=code)


def stated_mode(text: str) -> PathMode:
    """The mode that a text of PATTERN names, lengths in mm."""
    found = re.match(PATTERN, text)
    assert found is not None
    code, p, q = found[1], found[3], found[5]
    return path_mode(round(10 * float(code)), float(p) if p else None, float(q) if q else None)
