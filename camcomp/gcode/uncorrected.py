"""Which feed moves of a program pass uncorrected, because the reader does not know where the tool is or where they lead."""

from __future__ import annotations

import re

from camcomp.gcode.words import code_of
from camcomp.ground.datatypes import RAPID, Bools, Path
from camcomp.ground.records import dataclass, field

RULE = "CC146"
BEFORE_XYZ = "come before X, Y and Z have all been commanded"
IN_MACHINE_AXES = "are given in machine coordinates"
FROM_UNKNOWN = "come from a place that the program does not state"
# Lines with a motion, also those that are never executed.
_MOVES = re.compile(r"(?!.*G[ \t]*0*(4|10|52|92)(?!\d)).*[XYZ][ \t]*[-+.\d\[#=]", re.IGNORECASE)


def has_motion(line: str) -> bool:
    """Whether a line of an NC program has words of a motion outside of comments."""
    return bool(_MOVES.match(code_of(line).strip()))


@dataclass(eq=False)
class UncorrectedFeeds:
    """Feed moves that pass uncorrected, counted part by part of a program by their reason."""

    name: str  # of the program, in messages
    feeds: int = 0
    _found: dict[str, tuple[int, int]] = field(default_factory=dict)  # reason: count, first source line

    def add(self, path: Path, from_unknown: Bools | None = None) -> None:
        """Count the next motions of a path. from_unknown (n,): their start is not stated."""
        feed = path.kind != RAPID
        self.feeds += int(feed.sum())
        reasons = {BEFORE_XYZ: ~path.known & ~path.machine, IN_MACHINE_AXES: path.machine}
        if from_unknown is not None:
            reasons[FROM_UNKNOWN] = from_unknown
        for reason, which in reasons.items():
            lines = path.line[feed & which]
            if len(lines):
                count, first = self._found.get(reason, (0, int(lines[0])))
                self._found[reason] = (count + len(lines), first)

    def warnings(self) -> list[str]:
        """One warning per reason, with the share of the feed moves and the first source line."""
        return [
            f"{self.name}:{first}: {count} of {self.feeds} feed moves {reason}, and pass uncorrected [{RULE}]"
            for reason, (count, first) in self._found.items()
        ]


def behind_end_warning(name: str, count: int, first: int) -> str:
    """Warning for lines with motions behind the end of a program; the first is source line `first`."""
    return f"{name}:{first}: lines with moves behind the end of the program ({count}) are not run, and pass uncorrected [{RULE}]"


def below_step_warning(name: str, feeds: int, step_mm: float) -> str:
    """Warning for a program whose corrections are all lost in rounding to steps of step_mm."""
    return (
        f"{name}: all {feeds} feed moves pass uncorrected: by the model their corrections are below the step of "
        f"{step_mm:g} mm [{RULE}]"
    )
