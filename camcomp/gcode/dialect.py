"""Type of the records in camcomp/dialects: differences between the languages of controllers, as data."""

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING

from camcomp.gcode.codes import ENDS, GROUPS, REFUSED
from camcomp.gcode.numbers import decimals
from camcomp.gcode.spelling import Spelling
from camcomp.ground.records import dataclass, field

if TYPE_CHECKING:
    from camcomp.gcode.robot_language import RobotLanguage


@dataclass(frozen=True, kw_only=True)
class Dialect:
    """The language of a family of controllers. Codes count in tenths (G59.1 is 591)."""

    name: str
    title: str
    endings: tuple[str, ...] = ()  # of file names that are this dialect's alone
    marks: tuple[tuple[str, int], ...] = ()  # regular expression (multi-line, case ignored), weight for detection
    spelling: Spelling | None = None  # of expressions; None: no expressions
    flow: str = ""  # subprograms, loops, jumps: "o-words", "macro" (Fanuc), or none
    more: Mapping[int, int] = field(default_factory=dict)  # codes beyond the common ones, with their modal group
    reasons: Mapping[int, tuple[str, str]] = field(default_factory=dict)  # codes that are refused, with rule and reason
    without: frozenset[int] = frozenset()  # common codes that this controller does not have
    passed: frozenset[int] = frozenset()  # codes that do not change the geometry, nor how other words are read
    ends: frozenset[int] = ENDS  # M codes at which a program ends
    initial_motion: int | None = None
    retract_to_start: bool = True  # G98 is in force at the start
    turns: bool = True  # P of an arc counts turns
    exact_stop: str = "G61"  # code for a stop at the end of moves
    writes_turns: bool = True  # and may be written for arcs that are made
    increments: bool = False  # numbers without a point may count increments
    machine_moves_rapid: bool = False  # G53 moves at rapid speed, whatever motion code is in force
    home_beside_motion: bool = False  # `G0 G28 Z0`: the axis words are those of G28
    numbered_homes: frozenset[tuple[int, str]] = frozenset()  # codes whose P (mode of the word) is a position
    dwell: str = "P"  # letters that may give the time of G4
    dwell_p_s: float = 1.0  # worth of one unit of its P; X, U and F count seconds, S revolutions of the spindle
    modal_length: bool = False  # H changes the tool length offset without G43 in its block
    own_local_frame: bool = False  # G52 and G92 add up instead of sharing one offset
    extended_offsets: bool = False  # G54.1 P1 ..., G10 L20 sets them
    more_offsets: Mapping[int, str] = field(default_factory=dict)  # codes and names of further work offsets
    relative_offsets: bool = False  # G10 L2 adds to the offset in G91
    repeats: str = "L"  # letters that may give the number of repeats of a cycle
    cycles_apart: bool = (
        False  # cycles are a modal group of their own, as on Fanuc: G80 leaves the motion code in force that
    )
    # was so before, and the words of a cycle hold for those that follow it
    peck_clearance_mm: float = 0.254
    idle_letters: str = "DN"  # letters without influence on the path
    merges: bool = False  # G64 has the tolerance of corners as P and that of merged lines as Q
    brackets_comment: bool = True  # `(...)` is a comment
    comment: tuple[str, str] = ("(", ")")
    decimals_max: int = 9  # behind the point of a length, in either unit
    robot: "RobotLanguage | None" = None  # reads and writes a language of robots; None: words of NC blocks

    @property
    def groups(self) -> dict[int, int]:
        """Modal group of every code of the controller."""
        return {code: group for code, group in {**GROUPS, **self.more}.items() if code not in self.without}

    @property
    def refused(self) -> dict[int, tuple[str, str]]:
        """Codes that are refused, with rule and reason."""
        own = {**self.more, **dict.fromkeys(self.passed, 0)}
        return {**{code: why for code, why in REFUSED.items() if code not in own}, **self.reasons}

    def digits(self, resolution_mm: float, unit_mm: float) -> int:
        """Decimals of a length: those of the resolution, at most decimals_max."""
        return min(decimals(resolution_mm, unit_mm), self.decimals_max)

    def step_mm(self, resolution_mm: float, unit_mm: float) -> float:
        """Step of written lengths, mm: the resolution, or a step of the last digit if that is coarser."""
        return max(resolution_mm, unit_mm * 10.0 ** -self.digits(resolution_mm, unit_mm))

    def weight(self, text: str) -> int:
        """Sum of the weights of this dialect's marks in a text."""
        flags = re.MULTILINE | re.IGNORECASE
        return sum(score for pattern, score in self.marks if re.search(pattern, text, flags))
