"""Statements of a Fanuc LS program, executed in order; the sources are those of the dialect."""

import re
from collections.abc import Callable
from typing import Any

from camcomp.gcode.path_mode import PathMode
from camcomp.gcode.robot_frames import IDENTITY
from camcomp.gcode.robot_language import MoveSite
from camcomp.gcode.robot_reader import EXACT, RobotReader
from camcomp.ground.datatypes import ARC, LINE, RAPID
from camcomp.ground.errors import ProgramError, raise_all
from camcomp.ground.records import dataclass

JOINTS = ("J1", "J2", "J3", "J4", "J5", "J6")
_SECTION = re.compile(r"^[ \t]*/(MN|POS|END)[ \t\r]*$", re.MULTILINE | re.IGNORECASE)
POSITION = re.compile(r"P\[(\d+)(?::[^\]]*)?\][ \t]*\{(.*?)\}[ \t]*;", re.DOTALL | re.IGNORECASE)
_NUMBER = r"[-+]?(?:\d{1,12}\.?\d*|\.\d+)"
_VALUE = re.compile(rf"\b([XYZWPR]|[JE]\d)[ \t]*=[ \t]*({_NUMBER})[ \t]*(mm|deg)\b", re.IGNORECASE)
_FIELD = re.compile(r"\b([XYZWPR]|[JE]\d)[ \t]*=", re.IGNORECASE)
_FRAME = re.compile(r"\b(UF|UT)[ \t]*:[ \t]*(\d+|F)", re.IGNORECASE)
_STATEMENT = re.compile(r"[ \t]*\d*[ \t]*:(.*);[ \t]*\Z")
_CONTINUED = re.compile(r"[ \t]*\d*[ \t]*:(.*?)[ \t]*\Z")
_MOVE = re.compile(r"[ \t]*([JLCA])[ \t]+(P\[(\d+)(?::[^\]]*)?\])[ \t]*(.*?)[ \t]*\Z", re.IGNORECASE)
_SECOND = re.compile(r"[ \t]*(P\[(\d+)(?::[^\]]*)?\])[ \t]*(.*?)[ \t]*\Z", re.IGNORECASE)
_SPEED = re.compile(rf"({_NUMBER})[ \t]*(%|mm/sec|cm/min|inch/min)(?=[ \t]|\Z)[ \t]*", re.IGNORECASE)
_END = re.compile(r"(FINE|CNT[ \t]*\d+)(?=[ \t]|\Z)(?:[ \t]+ACC[ \t]*\d+(?=[ \t]|\Z))?[ \t]*", re.IGNORECASE)
_CHOSEN = re.compile(r"[ \t]*(UFRAME_NUM|UTOOL_NUM)(?:\[GP1\])?[ \t]*=[ \t]*(\d+)[ \t]*\Z", re.IGNORECASE)
_WAIT = re.compile(rf"[ \t]*WAIT[ \t]+({_NUMBER})[ \t]*\(sec\)[ \t]*\Z", re.IGNORECASE)
_IDLE = re.compile(
    r"[ \t]*(?:(?:!|--|//).*|\$WAITTM\w*[ \t]*=.*|(?:[DRGA]O|F)\[.*|OVERRIDE[ \t]*=.*|PAYLOAD\[.*|MESSAGE\[.*|TIMER\[.*|LBL\[.*|WAIT[ \t].*|PAUSE|END|COL .*)?[ \t]*\Z",
    re.IGNORECASE,
)
_CALL = re.compile(r"[ \t]*(?:CALL|RUN)[ \t]+(\w+)", re.IGNORECASE)
_FEED = {"mm/sec": 60.0, "cm/min": 10.0, "inch/min": 25.4}  # mm/min


@dataclass(frozen=True)
class LsMove:
    """Parts of the text of a move: number of its position, whether other moves use it, spans of `P[n]` and of the second line."""

    number: int
    shared: bool
    target: tuple[int, int]
    end: int  # behind the statement, in front of its semicolon
    second: tuple[int, int] | None = None  # of an arc: behind the colon to the end of the line


@dataclass(frozen=True)
class _Position:
    values: dict[str, float]
    spans: dict[str, tuple[int, int]]
    frames: dict[str, str]


class LsProgram:
    """Executes the statements of one program in order."""

    def __init__(self, reader: RobotReader) -> None:
        self.reader, self.text = reader, reader.text
        self.positions: dict[int, _Position] = {}
        self.uses: dict[int, int] = {}
        self.chosen: dict[str, int] = {}  # UF and UT
        self.external: dict[str, float] = {}

    def run(self) -> None:
        """Positions first, for they stand behind the statements; a mistake does not hide the next."""
        string, sections = self.text.string, {each[1].upper(): each for each in _SECTION.finditer(self.text.string)}
        if "MN" not in sections or "POS" not in sections or sections["POS"].start() < sections["MN"].end():
            raise ProgramError("CC144", "the program has no /MN with a /POS behind it", at=self.text.place(0))
        begin, end = sections["MN"].end(), sections["POS"].start()
        rows = range(self.reader.row_of(begin) + 1, self.reader.row_of(end))
        errors: list[ProgramError] = []
        for found in POSITION.finditer(string, sections["POS"].end()):
            self._collect(errors, self._position, found)
        for found in re.finditer(r"P\[(\d+)", string[begin:end], re.IGNORECASE):
            self.uses[int(found[1])] = self.uses.get(int(found[1]), 0) + 1
        row = rows.start
        while row < rows.stop:
            if self.text.line(row).strip():
                two = row + 1 < rows.stop and re.match(
                    r"[ \t]*\d*[ \t]*:[ \t]*[CA][ \t]", self.text.line(row), re.IGNORECASE
                )
                self._collect(errors, self._arc if two else self._statement, row)
                row += 1 if two else len(self._continued(row))
            row += 1
        raise_all(errors[:20])
        for key, name in (("UF", "UFRAME_NUM"), ("UT", "UTOOL_NUM")):
            if key not in self.chosen:
                self.reader.warn(f"{name} is not stated; the frame of the machine file is taken")

    def _collect(self, errors: list[ProgramError], step: Callable[[Any], None], what: Any) -> None:
        try:
            step(what)
        except ProgramError as error:
            errors.append(error)

    def _position(self, found: re.Match[str]) -> None:
        number, at = int(found[1]), found.start()
        if number in self.positions:
            self.reader.refuse("CC144", f"P[{number}] stands twice", at)
        if re.search(r"\bGP[2-9]\b", found[2]):
            self.reader.refuse("CC144", "a second motion group", at, "post one group")
        values, spans = {}, {}
        for each in _VALUE.finditer(found[2]):
            key = each[1].upper()
            values[key], spans[key] = float(each[2]), (found.start(2) + each.start(2), found.start(2) + each.end(2))
        named = {each[1].upper() for each in _FIELD.finditer(found[2])}
        for names in (self.reader.language.components, JOINTS):
            if set(names) <= values.keys() and named <= values.keys():
                break
        else:
            self.reader.refuse("CC144", f"P[{number}] does not hold the numbers X, Y, Z, W, P, R or J1 to J6", at)
        self.positions[number] = _Position(
            values, spans, {each[1].upper(): each[2] for each in _FRAME.finditer(found[2])}
        )

    def _continued(self, row: int) -> list[str]:
        """The lines `: ...` that go on with the statement of a row."""
        out: list[str] = []
        line = self.text.line(row)
        while not line.rstrip().endswith(";") and row + len(out) + 1 < len(self.text):
            line = self.text.line(row + len(out) + 1)
            if not line.lstrip().startswith(":"):
                break
            out.append(line.lstrip()[1:])
        return out

    def _statement(self, row: int) -> None:
        reader, line, begin = self.reader, self.text.line(row), int(self.text.starts[row])
        if (more := self._continued(row)) and not re.match(r"[ \t]*\d*[ \t]*:[ \t]*[JL][ \t]", line, re.IGNORECASE):
            line = " ".join((line.rstrip(), *more))
        elif more:
            place = begin + len(line) - len(line.lstrip())
            reader.refuse("CC144", "a move over several lines", place, "write J and L on one line, with the semicolon")
        at = begin + len(line) - len(line.lstrip())
        found = _STATEMENT.match(line)
        if found is None:
            reader.refuse(
                "CC144",
                f"'{line.strip()[:40]}' is no statement 'n: ... ;'",
                at,
                "write the number, a colon, the statement, a semicolon",
            )
        body, place = found[1], begin + found.start(1)
        place += len(body) - len(body.lstrip())
        if move := _MOVE.match(body):
            self._move(row, move, begin + found.start(1), begin + found.end(1), place)
        elif chosen := _CHOSEN.match(body):
            self._choose("UF" if chosen[1].upper() == "UFRAME_NUM" else "UT", int(chosen[2]), place)
        elif wait := _WAIT.match(body):
            reader.dwelt_s += float(wait[1])
            reader.waits = True
        elif called := _CALL.match(body):
            reader.warn(f"{called[1]} is not followed; it must not move the tool")
            reader.waits = True
        elif _IDLE.match(body):
            reader.waits |= body.strip().upper().startswith(("WAIT", "PAUSE"))
        else:
            reader.refuse(
                "CC144",
                f"'{body.strip()[:40]}' is not followed",
                place,
                "post J, L and C to positions of /POS, without registers and control flow",
            )

    def _choose(self, key: str, number: int, at: int) -> None:
        known, name = (
            (self.reader.frames.bases, "base_frames") if key == "UF" else (self.reader.frames.tools, "tool_frames")
        )
        if number and number not in known:
            self.reader.refuse(
                "CC145", f"{key} {number} is not in the machine file", at, f"state control: {name}: {{{number}: ...}}"
            )
        frame = known[number] if number else IDENTITY
        if key == "UT":
            self.reader.set_tool(frame, at)
        else:
            self.reader.base = frame
        self.chosen[key] = number

    def _arc(self, row: int) -> None:
        """C over two lines: the auxiliary point, and the end with speed and termination."""
        reader, line, begin = self.reader, self.text.line(row), int(self.text.starts[row])
        found, second = _CONTINUED.match(line), _STATEMENT.match(self.text.line(row + 1))
        at = begin + len(line) - len(line.lstrip())
        if found is None or second is None:
            reader.refuse("CC144", "C needs two lines, with an auxiliary point and an end point", at)
        one, two = _MOVE.match(found[1]), _SECOND.match(second[1])
        if one is None or two is None or one[4] or one[1].upper() == "A":
            reader.refuse("CC144", "C needs two lines, with an auxiliary point and an end point", at)
        base, place = int(self.text.starts[row + 1]) + second.start(1), begin + found.start(1) + one.start(1)
        middle = self._values(int(one[3]), begin + found.start(1) + one.start(2), cut=True)
        blend = self._how(two[3], base + two.start(3), "C")
        number = int(two[2])
        self._values(number, base + two.start(1), cut=True)
        target = (base + two.start(1), base + two.end(1))
        written = LsMove(
            number, self.uses[number] > 1, target, base + len(second[1]), (base, int(self.text.ends[row + 1]))
        )
        reader.move(ARC, *self._site(row, (place, target[1]), number, blend, written), middle=middle)

    def _move(self, row: int, move: re.Match[str], base: int, end: int, at: int) -> None:
        kind, number = move[1].upper(), int(move[3])
        if kind in "AC":
            self.reader.refuse(
                "CC144", f"{kind} on one line", at, "write C over two lines, with an auxiliary point and an end point"
            )
        blend = self._how(move[4], base + move.start(4), kind)
        target = (base + move.start(2), base + move.end(2))
        if number in self.positions and JOINTS[0] in self.positions[number].values:
            if kind != "J":
                self.reader.refuse("CC144", f"{kind} to joint angles", at, "use J, or a Cartesian position")
            self.reader.waits = True
            self.reader.unknown_move("joint angles of this control count J3 from the horizontal")
            return
        self._values(number, target[0], cut=kind != "J")
        written = LsMove(number, self.uses[number] > 1, target, end)
        site, values = self._site(row, (at, target[1]), number, blend, written)
        self.reader.move(RAPID if kind == "J" else LINE, site, values)

    def _values(self, number: int, at: int, *, cut: bool) -> list[float]:
        """Components of a position in the frames that are chosen."""
        found = self.positions.get(number)
        if found is None:
            self.reader.refuse(
                "CC144", f"P[{number}] is not in /POS", at, "write the position in /POS; PR[] is not read"
            )
        if JOINTS[0] in found.values:
            self.reader.refuse("CC144", f"P[{number}] holds joint angles", at)
        for key, value in found.frames.items():
            if value.upper() != "F" and int(value) != self.chosen.get(key, int(value)):
                text = f"P[{number}] belongs to {key} {value}, and {key} {self.chosen[key]} is chosen"
                self.reader.refuse("CC145", text, at, "the control stops there; choose the frame of the position")
        for key, angle in found.values.items():
            if key[0] == "E" and self.external.get(key, angle) != angle and cut:
                self.reader.refuse("CC115", f"{key} moves an external axis during a cut", at, "move it with J")
            if key[0] == "E":
                self.external[key] = angle
        return [found.values[each] for each in self.reader.language.components]

    def _site(
        self, row: int, instruction: tuple[int, int], number: int, blend: tuple[int, int], written: LsMove
    ) -> tuple[MoveSite, list[float]]:
        values = self._values(number, written.target[0], cut=False)
        spans = self.positions[number].spans
        site = MoveSite(
            row=row, instruction=instruction, numbers={each: spans[each] for each in self.reader.language.components}, close=instruction[1], blend=blend,
            base=self.reader.base, tool=self.reader.tool, near=tuple(values), said=tuple(values), more=written,
        )  # fmt: skip
        return site, values

    def _how(self, words: str, at: int, kind: str) -> tuple[int, int]:
        """Speed and termination of a move; the span of the latter."""
        refuse, units = self.reader.refuse, "N %" if kind == "J" else "N mm/sec, N cm/min or N inch/min"
        if not words or words.upper().startswith(("FINE", "CNT")):
            refuse("CC110", f"{kind} without a speed", at, f"write {units} behind the position")
        speed = _SPEED.match(words)
        if speed is None or (speed[2].lower() in _FEED) == (kind == "J"):
            refuse("CC144", f"'{words.split()[0][:30]}' is no speed of {kind} that is followed", at, f"write {units}")
        end = _END.match(words, speed.end())
        if end is None:
            text = words[speed.end() :][:30] or "nothing"
            refuse("CC144", f"{text} in place of FINE or CNTn", at + speed.end(), "write FINE or CNTn, n a number")
        if rest := words[end.end() :]:
            refuse("CC144", f"'{rest[:30]}' is not followed", at + end.end(), "post moves without options")
        if kind != "J":
            self.reader.feed = float(speed[1]) * _FEED[speed[2].lower()]
        word = end[1].upper()
        self.reader.mode = EXACT if word == "FINE" else PathMode(own_name=word)
        return at + end.start(1), at + end.end(1)
