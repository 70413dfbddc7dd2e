"""KUKA Robot Language: one module (.src) without control flow; `PTP`, `LIN` and `CIRC` with poses written inline.

Sources: KUKA System Software 8.3, operating and programming instructions for system integrators, chapters 10 (motions) and
12 (KRL syntax); KUKA, Expert Programming KSS 5.x, chapters 3 and 4.
"""

import re
from collections.abc import Sequence

import numpy as np

from camcomp.gcode.dialect import Dialect
from camcomp.gcode.robot_frames import zyx_rotations
from camcomp.gcode.robot_language import Edit, MoveSite, NewMove, RobotLanguage
from camcomp.gcode.robot_reader import RobotReader
from camcomp.gcode.text import Text
from camcomp.ground.datatypes import Floats
from camcomp.ground.orientation import RPY, words_of

POSE = ("X", "Y", "Z", "A", "B", "C")


class Krl(RobotLanguage):
    """Poses as aggregates {X ..., Y ..., Z ..., A ..., B ..., C ...}: R = Rz(A) Ry(B) Rx(C)."""

    components = POSE
    comment = (";", "")

    def read(self, reader: RobotReader) -> None:
        """Every line of the module. Raises ProgramError with every mistake."""
        from camcomp.dialects._krl_module import KrlModule  # slow import, not needed to detect other dialects

        KrlModule(reader).run()

    def poses(self, values: Floats) -> tuple[Floats, Floats]:
        """Points and rotations of X, Y, Z, A, B, C."""
        return values[:, :3], zyx_rotations(values[:, 3:])

    def values(self, points: Floats, rotations: Floats, near: Floats) -> Floats:
        """X, Y, Z, A, B, C of poses."""
        return np.column_stack((points, words_of(RPY, rotations, near[:, :2:-1])[:, ::-1]))

    def in_place(self, text: Text, site: MoveSite, move: NewMove) -> list[Edit]:
        """Other digits in the aggregate; a CIRC becomes a LIN."""
        out: list[Edit] = []
        if not move.keeps_kind:
            word = text.string[site.instruction[0] : site.instruction[1]]
            out.append((*site.instruction, ("lin " if word[0].islower() else "LIN ") + _aggregate(move, [True] * 6)))
        else:
            for name, number, changed in zip(POSE, move.numbers, move.changed, strict=True):
                if name in site.numbers and changed:
                    out.append((*site.numbers[name], number))
            extra = "".join(
                f",{name} {number}" for name, number, fresh in zip(POSE, move.numbers, move.fresh, strict=True) if fresh
            )
            if extra:
                out.append((site.close, site.close, extra))
        if move.rests:
            out.append((*site.blend, ""))
        return out

    def line(self, text: Text, site: MoveSite, move: NewMove) -> str:
        """A LIN with the components that the control does not hold."""
        string, begin = text.string, int(text.starts[site.row])
        indent = string[begin : site.instruction[0]]
        word = "lin " if string[site.instruction[0]].islower() else "LIN "
        blend = "" if move.rests else re.sub(r"C_PTP[ \t]*", "", string[slice(*site.blend)], flags=re.IGNORECASE)
        return indent + word + _aggregate(move, move.fresh) + (blend.rstrip() if blend.strip() else "")

    def stamp_index(self, text: Text) -> int:
        """Behind the line with DEF: in front of it no comment may stand on a line of its own."""
        from camcomp.dialects._krl_module import DEF, code_of

        for row in range(len(text)):
            if DEF.match(code_of(text.line(row))):
                return int(text.nexts[row])
        return 0


def _aggregate(move: NewMove, which: Sequence[bool]) -> str:
    parts = [f"{name} {number}" for name, number, on in zip(POSE, move.numbers, which, strict=True) if on]
    return "{" + ",".join(parts) + "}"


DIALECT = Dialect(
    name="krl",
    title="KUKA KRL",
    marks=(
        (r"^&(ACCESS|REL|PARAM)\b", 10),
        (r"^[ \t]*DEF[ \t]+\w+[ \t]*\([ \t]*\)", 8),
        (r"^[ \t]*(PTP|LIN)[ \t]*\{", 6),
        (r"^[ \t]*\$(BASE|TOOL|VEL\.CP|APO\.CDIS)[ \t]*=", 6),
    ),
    endings=(".src",),
    robot=Krl(),
    exact_stop="exact positioning",
    decimals_max=6,
    comment=(";", ""),
)
