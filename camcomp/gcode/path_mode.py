"""Path modes G60, G61, G61.1, G64, G641: exact stop at the ends of moves, or tolerance of blended corners."""

import re
from collections.abc import Sequence
from functools import cached_property

import numpy as np

from camcomp.gcode.codes import EXACT_STOPS, code_name
from camcomp.ground.datatypes import Ints
from camcomp.ground.records import dataclass, replace

NUMBER = r"\d+(?:\.\d*)?|\.\d+"
ROUNDING_DISTANCE = 6410  # Sinumerik: corners are blended from ADIS mm before them on
PATTERN = rf"^G(61|61\.1|64)( P({NUMBER}))?( Q({NUMBER}))?$"


@dataclass(frozen=True, kw_only=True)
class PathMode:
    """A mode of the modal group 13, lengths in mm."""

    exact: bool = False  # G61, G61.1, G60 of Sinumerik: every move ends at standstill
    tolerance_mm: float = 0.0  # P of G64, ADIS of G641: largest deviation at a corner; 0: determined by the speed
    merge_mm: float = 0.0  # Q of G64, else P: lines that are straight within it become one; 0: never
    code: int = 640
    stated: bool = True  # False: not stated, the default of controllers
    own_name: str = ""  # in the language of a robot

    @cached_property
    def name(self) -> str:
        """Text of the mode in a program, in mm."""
        return self.own_name or self.said(1.0)

    @property
    def apart(self) -> "PathMode":
        """The mode without merging of lines."""
        return replace(self, merge_mm=0.0)

    def said(self, unit: float) -> str:
        """Text of the mode in a program, in units of `unit` mm."""
        name = code_name(self.code)
        if self.code == ROUNDING_DISTANCE:
            return f"{name} ADIS={self.tolerance_mm / unit:g}"
        words = [f"P{self.tolerance_mm / unit:g}"] if self.tolerance_mm or self.merge_mm else []
        words += [f"Q{self.merge_mm / unit:g}"] if self.merge_mm != self.tolerance_mm else []
        return " ".join([name, *words])


def numbered(modes: Sequence[PathMode]) -> tuple[list[PathMode], Ints]:
    """The modes of statements that differ, and which one is that of each motion (n,)."""
    if not modes or modes.count(modes[0]) == len(modes):
        return list(modes[:1]), np.zeros(len(modes), np.int64)
    ids = np.fromiter(map(id, modes), np.int64, len(modes))
    _, first, which = np.unique(ids, return_index=True, return_inverse=True)
    return [modes[k] for k in first], which


def path_mode(code: int, tolerance: float | None, merge: float | None) -> PathMode:
    """The mode of a code in tenths with its P (or ADIS) and Q in mm; None: not given."""
    if code in EXACT_STOPS:
        return PathMode(exact=True, code=code)
    allowed = tolerance or 0.0
    same = 0.0 if code == ROUNDING_DISTANCE else allowed
    return PathMode(tolerance_mm=allowed, merge_mm=same if merge is None else merge, code=code)


def stated_mode(text: str) -> PathMode:
    """The mode of a text of PATTERN, lengths in mm."""
    found = re.match(PATTERN, text)
    assert found is not None
    code, p, q = found[1], found[3], found[5]
    return path_mode(round(10 * float(code)), float(p) if p else None, float(q) if q else None)
