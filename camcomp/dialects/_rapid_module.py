"""Statements of a RAPID module, executed in order; the source is that of the dialect."""

import re
from typing import Any

import numpy as np

from camcomp.gcode.path_mode import ROUNDING_DISTANCE, PathMode
from camcomp.gcode.robot_frames import IDENTITY, CoordinateFrame
from camcomp.gcode.robot_language import BLANKS, MoveSite
from camcomp.gcode.robot_reader import EXACT, RobotReader
from camcomp.ground.datatypes import ARC, LINE, RAPID
from camcomp.ground.errors import ProgramError, raise_all
from camcomp.ground.orientation import rotations_of_quaternions
from camcomp.ground.records import dataclass

MODULE = re.compile(r"\s*MODULE\s+\w+", re.IGNORECASE)
FASTEST_ZONE_MM = {0: 0.3}  # z0; zN is a zone of N mm
_NUMBER = re.compile(r"\s*([-+]?(?:\d{1,12}\.?\d*|\.\d+)(?:E[-+]?\d{1,2})?)\s*", re.IGNORECASE)
_DECLARED = re.compile(
    r"\s*(?:(?:LOCAL|TASK)\s+)?(?:CONST|PERS|VAR)\s+(\w+)\s+(\w+)\s*(?::=\s*(.*?))?\s*;\s*\Z", re.IGNORECASE
)
_MOVE = re.compile(r"\s*(MoveL|MoveC|MoveJ|MoveAbsJ)\s+(.*?)\s*;\s*\Z", re.IGNORECASE)
_WAIT = re.compile(r"\s*WaitTime\s+(?:\\InPos\s*,\s*)?(\S+?)\s*;\s*\Z", re.IGNORECASE)
_SKIPPED = re.compile(
    r"\s*(?:ConfL|ConfJ|AccSet|SetDO|SetAO|SetGO|Set|Reset|PulseDO|TPWrite|TPErase|GripLoad|ActUnit|PathResol|WaitRob|WaitDI|WaitDO"
    r"|WaitUntil|Stop|PDispOff|EOffsOff|SingArea\s*\\Off|CirPathMode\s*\\ObjectFrame|VelSet\s+100\s*,.*)(?!\w)",
    re.IGNORECASE,
)
_FLOW = re.compile(
    r"\s*(?:IF|ELSE|ELSEIF|ENDIF|FOR|ENDFOR|WHILE|ENDWHILE|TEST|CASE|DEFAULT|ENDTEST|GOTO|RETURN|TRAP|FUNC|RECORD|EXIT)(?!\w)",
    re.IGNORECASE,
)
_OTHER_MOVE = re.compile(
    r"\s*(?:Move\w+|Trigg\w+|Search\w+|SingArea|CirPathMode|VelSet|ArcL|ArcC|EOffs\w*|PDisp\w*|Sync\w+)(?!\w)",
    re.IGNORECASE,
)
_HINTS = {"singarea": "use SingArea \\Off", "cirpathmode": "use CirPathMode \\ObjectFrame"}
_UNFINISHED = re.compile(r"[^;]*[\[,(=][^;]*\Z")  # a list or an argument without the semicolon
_CALL = re.compile(r"\s*(\w+)\b[^:=]*;\s*\Z")
_STARTS = re.compile(r"\s*(?:PROC\s+\w+\s*\((.*)\)|ENDPROC|ENDMODULE|%%%|VERSION:.*|LANGUAGE:.*)\s*\Z", re.IGNORECASE)


def code_of(line: str) -> str:
    """A line without its comment; strings keep their exclamation marks."""
    quoted = False
    for k, sign in enumerate(line):
        quoted ^= sign == '"'
        if sign == "!" and not quoted:
            return line[:k]
    return line


@dataclass(frozen=True)
class Written:
    """Parts of the text of a move. rest: configuration and external axes as written; end: index behind the statement."""

    declared: bool
    argument: tuple[int, int]
    rest: str
    end: int


@dataclass(frozen=True)
class Nested:
    """A value [a, [b, c], ...]: numbers with their spans, or the text of what is none."""

    items: tuple[Any, ...]
    span: tuple[int, int]

    def numbers(self) -> list[float]:
        """The numbers of a list without lists in it. Raises ValueError where it holds something else."""
        return [_number(each) for each in self.items]


def _number(item: Any) -> float:
    if isinstance(item, Nested) or not (found := _NUMBER.fullmatch(item[0])):
        raise ValueError("not a number")
    return float(found[1])


def _span(item: Any) -> tuple[int, int]:
    """Where an item of a list stands."""
    span: tuple[int, int] = item.span if isinstance(item, Nested) else item[1]
    return span


def parse(string: str, at: int) -> Nested | None:
    """The nested list that a string is, with spans counted from `at`; None where it is none."""
    stack: list[list[Any]] = []
    begins: list[int] = []
    k, word = 0, 0
    for k, sign in enumerate(string):
        if sign in ",]" and stack and string[word:k].strip():
            piece = string[word:k]
            first = at + word + len(piece) - len(piece.lstrip())
            stack[-1].append((piece.strip(), (first, first + len(piece.strip()))))
        if sign == "[":
            stack.append([])
            begins.append(at + k)
        elif sign == "]":
            if not stack:
                return None
            done = Nested(tuple(stack.pop()), (begins.pop(), at + k + 1))
            if not stack:
                return done if not string[k + 1 :].strip() else None
            stack[-1].append(done)
        if sign in "[],":
            word = k + 1
    return None


def _split(string: str) -> list[tuple[int, int]]:
    """Spans of the arguments between commas that stand in no list."""
    depth, begin, out = 0, 0, []
    for k, sign in enumerate(string):
        depth += (sign in "[(") - (sign in "])")
        if sign == "," and depth == 0:
            out.append((begin, k))
            begin = k + 1
    return [*out, (begin, len(string))]


class RapidModule:
    """Executes the statements of one module in order."""

    def __init__(self, reader: RobotReader) -> None:
        self.reader, self.text = reader, reader.text
        self.data: dict[str, tuple[str, Nested]] = {}  # type and value by name
        self.frames: dict[tuple[str, str], CoordinateFrame] = {}
        self.external: list[float] | None = None
        self.routines = 0

    def run(self) -> None:
        """Declarations first, for they may stand behind the routine; a mistake does not hide the next."""
        errors: list[ProgramError] = []
        for step in (self._declaration, self._line):
            for row in range(len(self.text)):
                try:
                    step(row, code_of(self.text.line(row)), int(self.text.starts[row]))
                except ProgramError as error:
                    errors.append(error)
            if len(errors) >= 20:
                break
        raise_all(errors[:20])

    def _declaration(self, row: int, code: str, begin: int) -> None:
        found = _DECLARED.match(code)
        if found is None or found[3] is None:
            return
        value = parse(found[3], begin + found.start(3))
        if value is not None:
            self.data[found[2].lower()] = (found[1].lower(), value)

    def _line(self, row: int, code: str, begin: int) -> None:
        reader, at = self.reader, begin + len(code) - len(code.lstrip())
        if not code.strip(BLANKS) or _DECLARED.match(code) or MODULE.match(code):
            return
        if found := _STARTS.match(code):
            if found[1] is not None:
                self.routines += 1
                if self.routines > 1 or found[1].strip():
                    reader.refuse("CC144", "a second routine, or one with parameters", at, "post one routine")
        elif found := _MOVE.match(code):
            self._move(row, begin, found)
        elif found := _WAIT.match(code):
            if not (number := _NUMBER.fullmatch(found[1])):
                reader.refuse("CC131", "WaitTime without a number", at, "write the time as a number")
            reader.dwelt_s += max(float(number[1]), 0.0)
            reader.waits = True
        elif _SKIPPED.match(code):
            reader.waits |= code.strip().lower().startswith(("wait", "stop"))
        elif re.match(r"\s*Move\w+\s*\\", code, re.IGNORECASE):
            reader.refuse(
                "CC144", f"'{code.strip()[:20]}' has an option that is not followed", at, "post moves without it"
            )
        elif _FLOW.match(code):
            reader.refuse(
                "CC144", "control flow, which is not followed", at, "post one routine from its first line to its last"
            )
        elif _UNFINISHED.match(code):
            reader.refuse(
                "CC144", f"'{code.strip()[:40]}' goes on in the next line", at, "write every statement on one line"
            )
        elif _OTHER_MOVE.match(code):
            hint = _HINTS.get(code.split()[0].split("\\")[0].lower(), "post MoveL, MoveC, MoveJ and MoveAbsJ")
            reader.refuse("CC144", f"'{code.strip()[:40]}' is not followed", at, hint)
        elif found := _CALL.match(code):
            reader.warn(f"{found[1]} is not followed; it must not move the tool")
            reader.waits = True
        else:
            reader.refuse("CC144", f"'{code.strip()[:40]}' is no statement that is followed", at)

    def _move(self, row: int, begin: int, found: re.Match[str]) -> None:
        kind, at, base = found[1].lower(), begin + found.start(1), begin + found.start(2)
        if ";" in found[2]:
            self.reader.refuse(
                "CC144", "two statements on one line", base + found[2].index(";"), "write one on each line"
            )
        spans = _split(found[2])
        targets = 2 if kind == "movec" else 1
        if len(spans) != targets + 3:
            self.reader.refuse("CC144", f"{found[1]} has {len(spans)} arguments, not {targets + 3}", at)
        places = [(base + a, base + b) for a, b in spans]
        words = [self.text.string[a:b].strip() for a, b in places]
        self._speed(self._trimmed(places[targets]))
        zone = self._trimmed(places[targets + 1])
        self.reader.mode = self._zone(words[targets + 1], zone[0])
        tool, *options = words[targets + 2].split("\\")
        self._frames(tool.strip(), [each.strip() for each in options], places[targets + 2][0])
        argument = self._trimmed(places[targets - 1])
        end = begin + found.end(2) + 1 + len(self.text.string[begin + found.end(2) :].split(";")[0])
        if kind == "moveabsj":
            self._joints(row, (at, argument[1]), argument, zone, end)
            return
        values, site = self._target(row, (at, argument[1]), argument, zone, end)
        if kind == "movec":
            middle, _ = self._target(row, (at, argument[1]), self._trimmed(places[0]), zone, end)
            self.reader.warn("along MoveC the tool is taken to turn in the work object (CirPathMode \\ObjectFrame)")
            self.reader.move(ARC, site, values, middle=middle)
        else:
            self.reader.move(RAPID if kind == "movej" else LINE, site, values)

    def _trimmed(self, span: tuple[int, int]) -> tuple[int, int]:
        piece = self.text.string[slice(*span)]
        begin = span[0] + len(piece) - len(piece.lstrip())
        return begin, begin + len(piece.strip())

    def _value(self, span: tuple[int, int], kind: str) -> tuple[Nested, bool]:
        """The list that an argument is or names, and whether it is declared."""
        word = self.text.string[slice(*span)]
        if (value := parse(word, span[0])) is not None:
            return value, False
        found = self.data.get(word.lower())
        if computed := re.match(r"\w+(?=\()|[\w\[\],.]*(\\\w+)", word):
            text, hint = computed[1] or computed[0] + "()", f"write the {kind} as numbers, without it"
            self.reader.refuse(
                "CC144", f"{text} is not followed", span[0] + computed.start(1 if computed[1] else 0), hint
            )
        if found is None or found[0] != kind:
            self.reader.refuse(
                "CC144",
                f"{word[:40]} is no {kind} of this module",
                span[0],
                f"declare the {kind} in the module, or write it inline",
            )
        return found[1], True

    def _target(
        self, row: int, instruction: tuple[int, int], argument: tuple[int, int], zone: tuple[int, int], end: int
    ) -> tuple[list[float], MoveSite]:
        value, declared = self._value(argument, "robtarget")
        try:
            point, turn, conf, external = value.items
            values = [*point.numbers(), *turn.numbers()]
            axes = self._named(external, "extjoint").numbers()
            size = float(np.linalg.norm(values[3:]))
            if len(values) != 7 or len(point.items) != 3 or abs(size - 1.0) > 0.01:
                raise ValueError
            values[3:] = [each / size for each in values[3:]]  # as the control does: posts round to a few digits
        except (ValueError, AttributeError):
            self.reader.refuse(
                "CC144",
                "no robtarget of numbers",
                argument[0],
                "write [[x,y,z],[q1,q2,q3,q4],[cf1,cf4,cf6,cfx],[9E9,...]], the quaternion of size 1",
            )
        self._named(conf, "confdata")
        self._external(axes, instruction[0])
        rest = ",".join(self.text.string[slice(*_span(each))] for each in (conf, external))
        places = [each[1] for each in (*point.items, *turn.items)]
        site = MoveSite(
            row=row, instruction=instruction, numbers=dict(zip(self.reader.language.components, places, strict=True)), close=argument[1], blend=zone,
            base=self.reader.base, tool=self.reader.tool, near=tuple(values), said=tuple(values),
            more=Written(declared, argument, rest, end),
        )  # fmt: skip
        return values, site

    def _named(self, item: Any, kind: str) -> Nested:
        """The list that a part of a target is or names."""
        return item if isinstance(item, Nested) else self._value(item[1], kind)[0]

    def _external(self, axes: list[float], at: int) -> None:
        """External axes may move between cuts, and stand while the tool cuts."""
        rapid = self.text.string[at : at + 5].lower() == "movej"
        if self.external is not None and self.external != axes:
            if not rapid:
                self.reader.refuse("CC115", "an external axis moves during a cut", at, "move it with MoveJ")
            self.reader.warn("external axes move; the machine file has to state the arm where it stands then")
        self.external = axes

    def _joints(
        self, row: int, instruction: tuple[int, int], argument: tuple[int, int], zone: tuple[int, int], end: int
    ) -> None:
        word = self.text.string[slice(*argument)].split("\\")[0].rstrip()
        value, declared = self._value((argument[0], argument[0] + len(word)), "jointtarget")
        try:
            angles = value.items[0].numbers()
        except (ValueError, AttributeError, IndexError):
            self.reader.refuse("CC144", "no jointtarget of numbers", argument[0])
        site = MoveSite(
            row=row, instruction=instruction, numbers={}, close=argument[1], blend=zone, base=self.reader.base,
            tool=self.reader.tool, near=(0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0), more=Written(declared, argument, "", end),
        )  # fmt: skip
        self.reader.joint_move(site, angles)

    def _speed(self, span: tuple[int, int]) -> None:
        """vN: N mm/s, or the first number of speeddata."""
        word, at = self.text.string[slice(*span)], span[0]
        if found := re.fullmatch(r"v(\d+)", word, re.IGNORECASE):
            self.reader.feed = 60.0 * float(found[1])
        elif word.lower() == "vmax":
            self.reader.feed = 300_000.0
        else:
            value, _ = self._value(span, "speeddata")
            try:
                self.reader.feed = 60.0 * value.numbers()[0]
            except (ValueError, IndexError):
                self.reader.refuse("CC110", "a speed that is no number", at)

    def _zone(self, word: str, at: int) -> PathMode:
        """fine, zN: N mm, or zonedata."""
        if word.lower() == "fine":
            return EXACT
        if found := re.fullmatch(r"z(\d+)", word, re.IGNORECASE):
            size = FASTEST_ZONE_MM.get(int(found[1]), float(found[1]))
        else:
            value, _ = self._value((at, at + len(word)), "zonedata")
            try:
                if value.items[0][0].upper() == "TRUE":
                    return EXACT
                size = _number(value.items[1])
            except (ValueError, AttributeError, IndexError, TypeError):
                self.reader.refuse(
                    "CC144", "no zonedata of numbers", at, "write [FALSE,pzone_tcp,...] in mm, fine or zN"
                )
        return PathMode(
            tolerance_mm=size, code=ROUNDING_DISTANCE, own_name=word if len(word) < 20 else f"zone {size:g} mm"
        )

    def _frames(self, tool: str, options: list[str], at: int) -> None:
        """The tool and the work object of a move."""
        self.reader.set_tool(self._frame("tooldata", tool, at), at)
        name = "wobj0"
        for each in options:
            if found := re.fullmatch(r"WObj\s*:=\s*(\w+)", each, re.IGNORECASE):
                name = found[1]
            elif not each.lower().startswith(("tload", "noeoffs")):
                self.reader.refuse("CC144", f"\\{each[:20]} is not followed", at)
        self.reader.base = self._frame("wobjdata", name, at)

    def _frame(self, kind: str, name: str, at: int) -> CoordinateFrame:
        key = (kind, name.lower())
        if key in self.frames:
            return self.frames[key]
        if key[1] in ("tool0", "wobj0"):
            found = IDENTITY
        else:
            declared = self.data.get(key[1])
            if declared is None or declared[0] != kind:
                self.reader.refuse(
                    "CC145", f"{name} is not declared in the module", at, f"declare the {kind} with numbers"
                )
            found = self._of_data(kind, declared[1], name, at)
        self.frames[key] = found
        return found

    def _of_data(self, kind: str, value: Nested, name: str, at: int) -> CoordinateFrame:
        try:
            held = value.items[0][0].upper() == "TRUE"
            frames = [_frame_of(each) for each in (value.items[1:2] if kind == "tooldata" else value.items[3:5])]
        except (ValueError, AttributeError, IndexError, TypeError):
            self.reader.refuse("CC145", f"{name} is no {kind} of numbers", at)
        if held != (kind == "tooldata"):
            self.reader.refuse("CC145", f"{name}: the robot holds the part", at, "post for a tool that the robot holds")
        out = frames[0]
        for inner in frames[1:]:
            out = CoordinateFrame(out.rotation @ inner.rotation, out.origin + out.rotation @ inner.origin)
        return out


def _frame_of(pose: Nested) -> CoordinateFrame:
    origin, turn = (np.array(each.numbers()) for each in pose.items)
    if origin.shape != (3,) or turn.shape != (4,) or abs(float(np.linalg.norm(turn)) - 1.0) > 0.01:
        raise ValueError("no pose")
    return CoordinateFrame(rotations_of_quaternions(turn[None])[0], origin)
