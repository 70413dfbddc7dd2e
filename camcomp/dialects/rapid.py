"""ABB RAPID: one module (.mod, .prg) with one routine; `MoveL`, `MoveC`, `MoveJ`, `MoveAbsJ` with robtargets inline or declared.

Source: ABB, Technical reference manual, RAPID Instructions, Functions and Data types, 3HAC050917.
"""

import numpy as np

from camcomp.gcode.dialect import Dialect
from camcomp.gcode.robot_language import Edit, MoveSite, NewMove, RobotLanguage
from camcomp.gcode.robot_reader import RobotReader
from camcomp.gcode.text import Text
from camcomp.ground.datatypes import Floats
from camcomp.ground.orientation import quaternions_of, rotations_of_quaternions

COMPONENTS = ("X", "Y", "Z", "Q1", "Q2", "Q3", "Q4")
QUATERNION_DIGITS = 9  # behind the point: 2 nrad


class Rapid(RobotLanguage):
    """Poses as robtargets [[x, y, z], [q1, q2, q3, q4], configuration, external axes]."""

    components = COMPONENTS
    comment = ("!", "")
    turn_digits = QUATERNION_DIGITS

    def read(self, reader: RobotReader) -> None:
        """Every line of the module. Raises ProgramError with every mistake."""
        from camcomp.dialects._rapid_module import RapidModule  # slow import, not needed to detect other dialects

        RapidModule(reader).run()

    def poses(self, values: Floats) -> tuple[Floats, Floats]:
        """Points and rotations of x, y, z and a quaternion."""
        return values[:, :3], rotations_of_quaternions(values[:, 3:])

    def values(self, points: Floats, rotations: Floats, near: Floats) -> Floats:
        """x, y, z and the quaternion, with the sign that is nearer."""
        q = quaternions_of(rotations)
        q = np.where((np.sum(q * near[:, 3:], axis=1) < 0.0)[:, None], -q, q)
        return np.column_stack((points, q))

    def in_place(self, text: Text, site: MoveSite, move: NewMove) -> list[Edit]:
        """Other digits in an inline target; a declared target becomes an inline one, MoveC becomes MoveL."""
        out: list[Edit] = []
        if not move.keeps_kind:
            out.append((*site.instruction, "MoveL " + self._target(site, move)))
        elif site.more.declared:
            out.append((*site.more.argument, self._target(site, move)))
        else:
            turned = any(move.changed[3:])
            for k, (name, number) in enumerate(zip(COMPONENTS, move.numbers, strict=True)):
                if move.changed[k] or (k > 2 and turned):
                    out.append((*site.numbers[name], number))
        if move.rests:
            out.append((*site.blend, "fine"))
        return out

    def line(self, text: Text, site: MoveSite, move: NewMove) -> str:
        """A MoveL with the speed, zone, tool and work object of the move."""
        string, begin = text.string, int(text.starts[site.row])
        behind = string[site.instruction[1] : site.blend[0]] + ("fine" if move.rests else string[slice(*site.blend)])
        rest = string[site.blend[1] : site.more.end]
        return string[begin : site.instruction[0]] + "MoveL " + self._target(site, move) + behind + rest

    def _target(self, site: MoveSite, move: NewMove) -> str:
        n = move.numbers
        return f"[[{','.join(n[:3])}],[{','.join(n[3:])}],{site.more.rest}]"

    def stamp_index(self, text: Text) -> int:
        """Behind the line with MODULE."""
        from camcomp.dialects._rapid_module import MODULE, code_of

        for row in range(len(text)):
            if MODULE.match(code_of(text.line(row))):
                return int(text.nexts[row])
        return 0


DIALECT = Dialect(
    name="rapid",
    title="ABB RAPID",
    marks=(
        (r"^[ \t]*MODULE[ \t]+\w+", 8),
        (r"^[ \t]*Move(L|J|C|AbsJ)[ \t]", 8),
        (r"^[ \t]*(CONST|PERS|VAR)[ \t]+(robtarget|tooldata|wobjdata)\b", 8),
    ),
    endings=(".mod", ".prg"),
    robot=Rapid(),
    exact_stop="fine",
    decimals_max=6,
    comment=("!", ""),
)
