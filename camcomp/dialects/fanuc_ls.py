"""Fanuc TP programs as ASCII (.ls): `J`, `L` and `C` to the positions of /POS; a changed position that others use gets a number of its own.

Sources: FANUC, R-30iB operator's manual (B-83284EN), chapters 4 and 9; real files of public repositories for the layout.
"""

import re

import numpy as np

from camcomp.gcode.dialect import Dialect
from camcomp.gcode.robot_language import Edit, MoveSite, NewMove, RobotLanguage
from camcomp.gcode.robot_reader import RobotReader
from camcomp.gcode.text import Text
from camcomp.ground.datatypes import Floats
from camcomp.ground.orientation import RPY, rotations_of, words_of

COMPONENTS = ("X", "Y", "Z", "W", "P", "R")
_NEW = re.compile(r"P\[@(\d+)((?: [-+.\deE]+){6})\]")


class FanucLs(RobotLanguage):
    """Poses as X, Y, Z mm and W, P, R deg about the fixed axes x, y, z: Rz(R) Ry(P) Rx(W)."""

    components = COMPONENTS
    comment = ("   :  !", " ;")
    comment_width = 32

    def read(self, reader: RobotReader) -> None:
        """Every statement of the program. Raises ProgramError with every mistake."""
        from camcomp.dialects._ls_program import LsProgram  # slow import, not needed to detect other dialects

        LsProgram(reader).run()

    def poses(self, values: Floats) -> tuple[Floats, Floats]:
        """Points and rotations of X, Y, Z, W, P, R."""
        return values[:, :3], rotations_of(RPY, values[:, 3:])

    def values(self, points: Floats, rotations: Floats, near: Floats) -> Floats:
        """X, Y, Z, W, P, R of poses."""
        return np.column_stack((points, words_of(RPY, rotations, near[:, 3:])))

    def in_place(self, text: Text, site: MoveSite, move: NewMove) -> list[Edit]:
        """Other digits in /POS, or a new position where moves share one; C becomes L, its second line an empty statement."""
        out: list[Edit] = []
        written = site.more
        if not move.keeps_kind and written.second is not None:
            out.append((site.instruction[0], int(text.ends[site.row]), self._statement(text, site, move)))
            out.append((*written.second, " ;"))
            return out
        if not move.keeps_kind:
            out.append((site.instruction[0], site.instruction[0] + 1, "L"))
        if written.shared:
            out.append((*written.target, _new_position(site, move)))
        else:
            for name, number, changed in zip(COMPONENTS, move.numbers, move.changed, strict=True):
                if changed:
                    out.append((*site.numbers[name], number))
        if move.rests:
            out.append((*site.blend, "FINE"))
        return out

    def line(self, text: Text, site: MoveSite, move: NewMove) -> str:
        """An L to a new position, with the speed of the move; its statement has no number, which the loader gives anew."""
        return "   :" + self._statement(text, site, move)

    def _statement(self, text: Text, site: MoveSite, move: NewMove) -> str:
        string, written = text.string, site.more
        speed = string[written.target[1] : site.blend[0]]
        behind = string[site.blend[1] : written.end]
        blend = "FINE" if move.rests else string[slice(*site.blend)]
        return f"L {_new_position(site, move)}{speed}{blend}{behind};"

    def finish(self, string: str) -> str:
        """New positions get numbers, and their lines at the end of /POS."""
        if not _NEW.search(string):
            return string
        from camcomp.dialects._ls_program import POSITION

        blocks = {int(each[1]): each for each in POSITION.finditer(string)}
        eol = "\r\n" if "\r\n" in string else "\n"
        number, made, known = max(blocks), [], dict[tuple[str, str], int]()

        def named(found: re.Match[str]) -> str:
            nonlocal number
            key = (found[1], found[2])
            if key not in known:
                number += 1
                known[key] = number
                made.append(_block(blocks[int(found[1])], number, found[2].split()))
            return f"P[{known[key]}]"

        string = _NEW.sub(named, string)
        last = list(POSITION.finditer(string))[-1].end()
        return string[:last] + "".join(eol + each for each in made) + string[last:]

    def stamp_index(self, text: Text) -> int:
        """Behind the line with /MN."""
        for row in range(len(text)):
            if text.line(row).strip().upper() == "/MN":
                return int(text.nexts[row])
        return 0


def _new_position(site: MoveSite, move: NewMove) -> str:
    return f"P[@{site.more.number} {' '.join(move.numbers)}]"


def _block(pattern: re.Match[str], number: int, values: list[str]) -> str:
    """The text of a position with another number and other values."""
    body = pattern[2]
    for name, value in zip(COMPONENTS, values, strict=True):
        body = re.sub(rf"(\b{name}[ \t]*=[ \t]*)[-+.\deE]+", lambda found, v=value: found[1] + v, body, count=1)
    return f"P[{number}]{{{body}}};"


DIALECT = Dialect(
    name="fanuc_ls",
    title="Fanuc LS",
    marks=((r"^[ \t]*/PROG\b", 10), (r"^[ \t]*/(MN|POS|END)[ \t\r]*$", 6)),
    endings=(".ls",),
    robot=FanucLs(),
    exact_stop="FINE",
    decimals_max=6,
    comment=("   :  !", " ;"),
)
