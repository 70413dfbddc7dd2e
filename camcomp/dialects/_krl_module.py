"""Statements of a KRL module, executed in order; the sources are those of the dialect."""

import re
from collections.abc import Callable, Sequence

from camcomp.gcode.path_mode import ROUNDING_DISTANCE, PathMode
from camcomp.gcode.robot_frames import IDENTITY, CoordinateFrame
from camcomp.gcode.robot_language import BLANKS, MoveSite
from camcomp.gcode.robot_reader import EXACT, RobotReader
from camcomp.ground.datatypes import ARC, LINE, RAPID
from camcomp.ground.errors import ProgramError, raise_all

AXES = ("A1", "A2", "A3", "A4", "A5", "A6")
_OTHERS = frozenset(("S", "T", *(f"E{n}" for n in range(1, 7))))
_NUMBER = r"[-+]?(?:\d{1,12}\.?\d*|\.\d+)(?:[eE][-+]?\d{1,2})?"
_VALUE = re.compile(rf"\s*({_NUMBER})\s*\Z")
_FIELD = re.compile(
    rf"\s*([A-Za-z_]\w*)\s+({_NUMBER}|'[BH]?\s*[0-9A-Fa-f]+'|#?\w[\w.$\[\]]*)\s*(?:,|\Z)", re.IGNORECASE
)
_AGGREGATE = re.compile(r"\s*\{(?:\s*[A-Za-z]\w*\s*:)?([^{}]*)\}", re.IGNORECASE)
_NAMED = re.compile(r"\s*(BASE|TOOL)_DATA\s*\[\s*(\d+)\s*\]\s*\Z", re.IGNORECASE)
_MOVE = re.compile(r"[ \t]*(PTP|LIN|CIRC)(?![A-Za-z0-9_])", re.IGNORECASE)
_BLEND = re.compile(r"[ \t]*((?:C_(?:DIS|VEL|ORI|PTP|SPL)(?![A-Za-z0-9_])[ \t]*){1,2})\Z", re.IGNORECASE)
_SWEEP = re.compile(rf"\s*,\s*CA\s+({_NUMBER})", re.IGNORECASE)
_ASSIGNED = re.compile(r"\s*(\$?[A-Za-z_][\w.]*(?:\[[^\]]*\])?)\s*=(?!=)\s*(.*?)\s*\Z", re.IGNORECASE)
_CALL = re.compile(r"\s*([A-Za-z_]\w*)\s*\((.*)\)\s*\Z")
_SIGNAL = re.compile(r"\s*SIGNAL\s+(\w+)\s+\$\w+\[", re.IGNORECASE)
_BAS = re.compile(r"\s*#(\w+)\s*(?:,\s*(.*?))?\s*\Z")
DEF = re.compile(r"[ \t]*(?:GLOBAL[ \t]+)?DEF[ \t]+[A-Za-z_]\w*[ \t]*\(([^)]*)\)[ \t]*\Z", re.IGNORECASE)

_UNFOLLOWED = (
    (r"SPLINE|SLIN|SPTP|SCIRC|SPL|ENDSPLINE|SLIN_REL|SPTP_REL|SCIRC_REL", "a spline", "post LIN and CIRC"),
    (r"LIN_REL|PTP_REL|CIRC_REL", "a relative move", "post poses in the base"),
    (r"IF|ELSE|ENDIF|FOR|ENDFOR|WHILE|ENDWHILE|LOOP|ENDLOOP|REPEAT|UNTIL|SWITCH|CASE|DEFAULT|ENDSWITCH|GOTO|EXIT|RETURN",
     "control flow", "post one module that runs from its first line to its last"),
    (r"TRIGGER", "TRIGGER counts from a point to which lines may be added", "switch between two moves"),
    (r"DEFFCT|DEFDAT|ENDDAT|ENDFCT|IMPORT|STRUC|ENUM", "a declaration of other modules", "post one .src with inline poses"),
    (r"ASYPTP|ASYSTOP|ASYCANCEL|BRAKE|RESUME", "an asynchronous move or stop", ""),
)  # fmt: skip
_UNFOLLOWED_AT = [
    (re.compile(rf"\s*(?:{words})(?![\w=\[.])", re.IGNORECASE), what, hint) for words, what, hint in _UNFOLLOWED
]
_PASSED = re.compile(
    r"\s*(?:EXT|EXTFCT|DECL|INT|REAL|BOOL|CHAR|POS|E6POS|AXIS|E6AXIS|FRAME|(?:GLOBAL\s+)?INTERRUPT|CONTINUE|ANOUT|ANIN|PULSE)(?![\w=.\[])",
    re.IGNORECASE,
)
# Variables of the system that leave the path as it is.
_IDLE = re.compile(
    r"\$(?:VEL\.ORI[12]|VEL_AXIS|VEL_EXTAX|ACC|ACC_AXIS|ACC_EXTAX|ACC\.\w+|APO\.C(?:PTP|ORI)|APO_DIS_PTP|ADVANCE|OUT|ANOUT|OV_PRO|BWDSTART"
    r"|H_POS|LOAD|ACT_BASE|ACT_TOOL|ACT_ADVANCE|FILTER|TIMER|TIMER_STOP|FLAG|CYCFLAG|GEAR_JERK|JERK|RED_VEL|RED_ACC|PAL_MODE"
    r"|LOOP_MSG|MSG_T|TECHIN|TECHVAL|ORI_CHECK|CP_VEL_TYPE|TORQMON_DEF|PRO_MODE)(?:\[[^\]]*\])?\Z|(?:PDAT|LDAT)_ACT\Z",
    re.IGNORECASE,
)
_TOLD_IDLE = frozenset(
    ("INITMOV", "ACC_CP", "ACC_PTP", "VEL_PTP", "PTP_DAT", "PTP_PARAMS", "ACC_GLUE", "OV_PRO", "EX_BASE")
)


_STATED = {"$ORI_TYPE": ("#VAR",), "$CIRC_TYPE": ("#BASE",), "$IPO_MODE": ("#BASE",)}


def code_of(line: str) -> str:
    """A line without its comment; strings keep their semicolons."""
    if ";" not in line:
        return line
    quoted = False
    for k, sign in enumerate(line):
        quoted ^= sign == '"'
        if sign == ";" and not quoted:
            return line[:k]
    return line


class KrlModule:
    """Executes the statements of one module in order."""

    def __init__(self, reader: RobotReader) -> None:
        self.reader, self.text, self.names = reader, reader.text, reader.language.components
        self.begun = self.ended = False
        self.held: list[float] | None = None  # X to C behind the last move
        self.angles: list[float] | None = None  # A1 to A6
        self.apo_mm = 0.0  # $APO.CDIS
        self.numbers: dict[str, int] = {}  # of FDAT_ACT
        frames = reader.frames
        self.known = {"BASE": dict(frames.bases), "TOOL": dict(frames.tools)}  # by BASE_DATA[n], TOOL_DATA[n]
        self.signals: set[str] = set()
        self.circ_stated = False
        self.external: dict[str, float] = {}  # E1 to E6
        self.base_stated = self.tool_stated = False

    def run(self) -> None:
        """All lines; a mistake does not hide the next."""
        errors: list[ProgramError] = []
        for row in range(len(self.text)):
            try:
                self._line(row)
            except ProgramError as error:
                errors.append(error)
                if len(errors) == 20:
                    break
        if not self.begun and not errors:
            errors.append(ProgramError("CC144", "the module has no DEF", at=self.text.place(0)))
        raise_all(errors)
        for stated, name in ((self.base_stated, "$BASE"), (self.tool_stated, "$TOOL")):
            if not stated:
                self.reader.warn(f"{name} is not stated before the moves; that of the machine file is taken")

    def _line(self, row: int) -> None:
        begin = int(self.text.starts[row])
        code = code_of(self.text.line(row))
        stripped = code.strip(BLANKS)
        if not stripped or stripped.startswith("&"):
            return
        at = begin + len(code) - len(code.lstrip())
        if self.ended:
            self.reader.refuse("CC144", "a statement behind the END of the module", at, "post one routine")
        if found := DEF.match(code):
            if self.begun:
                self.reader.refuse("CC144", "a second routine", at, "post one routine")
            if found[1].strip():
                self.reader.refuse("CC144", "a routine with parameters", at, "post a routine without parameters")
            self.begun = True
            return
        if not self.begun:
            self.reader.refuse("CC144", "a statement in front of DEF", at)
        if stripped.upper() == "END":
            self.ended = True
            return
        self._statement(row, begin, code, at)

    def _statement(self, row: int, begin: int, code: str, at: int) -> None:
        reader = self.reader
        if found := _MOVE.match(code):
            self._move(row, begin, code, found)
            return
        for pattern, what, hint in _UNFOLLOWED_AT:
            if pattern.match(code):
                reader.refuse("CC119" if what == "a spline" else "CC144", f"{what}, which is not followed", at, hint)
        if found := _ASSIGNED.match(code):
            self._assign(begin, found, at)
        elif found := _SIGNAL.match(code):
            self.signals.add(found[1].upper())
        elif re.match(r"\s*(WAIT|HALT)(?!\w)", code, re.IGNORECASE):
            self._wait(code, at)
        elif _PASSED.match(code):
            return
        elif found := _CALL.match(code):
            self._call(begin, found, at)
        else:
            reader.refuse("CC144", f"'{code.strip()[:40]}' is no statement that is followed", at)

    def _wait(self, code: str, at: int) -> None:
        reader, found = self.reader, re.match(rf"\s*WAIT\s+SEC\s+({_NUMBER})\s*\Z", code, re.IGNORECASE)
        if found:
            reader.dwelt_s += max(float(found[1]), 0.0)
        elif re.match(r"\s*WAIT\s+SEC", code, re.IGNORECASE):
            reader.refuse("CC131", "WAIT SEC without a number", at, "write the time as a number")
        reader.waits = True

    # --- settings ----------------------------------------------------------------------------------------------

    def _assign(self, begin: int, found: re.Match[str], at: int) -> None:
        name, value = found[1].upper(), found[2]
        where = begin + found.start(2)
        if name in ("$BASE", "$TOOL"):
            self._set_frame(name, value, where)
        elif data := _NAMED.match(name):
            self.known[data[1]][int(data[2])] = self._frame(name, value, where)
        elif name in ("$VEL.CP", "$APO.CDIS", "$APO.CVEL"):
            self._set_number(name, value, where)
        elif name in ("$VEL", "$APO"):
            for key, span in self._fields(value, where)[0].items():
                if f"{name}.{key}" in ("$VEL.CP", "$APO.CDIS"):
                    self._set_number(f"{name}.{key}", self.text.string[slice(*span)], span[0])
        elif name == "FDAT_ACT":
            if not _AGGREGATE.match(value):
                self.reader.refuse("CC144", f"FDAT_ACT={value[:30]} is data of another file", where,
                                   "write FDAT_ACT={TOOL_NO n,BASE_NO n,IPO_FRAME #BASE}, or $BASE and $TOOL with numbers")  # fmt: skip
            fields = self._fields(value, where, names=None)[0]
            for key in ("TOOL_NO", "BASE_NO"):
                if key in fields:
                    number = self.text.string[slice(*fields[key])]
                    if not number.isascii() or not number.isdigit():
                        self.reader.refuse(
                            "CC144", f"{key} {number[:20]} is no number", fields[key][0], "write 0 to 32"
                        )
                    self.numbers[key] = int(number)
        elif name in _STATED:
            if value.upper() not in _STATED[name]:
                hint = f"use {name}={_STATED[name][0]}"
                self.reader.refuse("CC115", f"{name}={value} turns the tool in a way that is not followed", where, hint)
            self.circ_stated |= name == "$CIRC_TYPE"
        elif not _IDLE.match(name) and name not in self.signals:
            self.reader.refuse(
                "CC144", f"{found[1]} is a variable that is not followed", at, "post numbers in place of variables"
            )

    def _set_number(self, name: str, value: str, at: int) -> None:
        if not (found := _VALUE.match(value)):
            self.reader.refuse("CC144", f"{name} is not given as a number", at, "post numbers in place of variables")
        number = float(found[1])
        if name == "$VEL.CP":
            self._set_speed(number, at)
        elif name == "$APO.CDIS":
            self.apo_mm = number

    def _set_speed(self, metres_per_s: float, at: int) -> None:
        if not 0.0 < metres_per_s <= 10.0:
            self.reader.refuse(
                "CC110",
                f"the speed {metres_per_s:g} m/s is not between 0 and 10",
                at,
                "$VEL.CP is in m/s: 0.02 is 1200 mm/min",
            )
        self.reader.feed = 60_000.0 * metres_per_s

    def _set_frame(self, name: str, value: str, at: int) -> None:
        if value.upper() in ("$NULLFRAME", "$WORLD"):
            frame = IDENTITY
        elif found := _NAMED.match(value):
            self._take_numbered(name, found[1].upper(), int(found[2]), at)
            return
        else:
            frame = self._frame(name, value, at)
        self._take(name, frame, at)

    def _frame(self, name: str, value: str, at: int) -> CoordinateFrame:
        if not _AGGREGATE.match(value):
            also = f" or {name[1:]}_DATA[n]" if name[0] == "$" else ""
            hint = f"write {{X ..., Y ..., Z ..., A ..., B ..., C ...}}{also}"
            self.reader.refuse("CC145", f"{name} is not given as numbers", at, hint)
        numbers = self._numbers(value, at, self.names)
        if len(numbers) < 6:
            self.reader.refuse("CC145", f"{name} does not state all of X, Y, Z, A, B, C", at)
        values = [numbers[each] for each in self.names]
        return CoordinateFrame.of(values[:3], values[3:])

    def _take_numbered(self, name: str, kind: str, number: int, at: int) -> None:
        """A frame of the machine file; number 0 is none."""
        if kind != name[1:]:
            self.reader.refuse("CC145", f"{kind}_DATA is not for {name}", at)
        known = self.known[kind]
        if number and number not in known:
            key = "base_frames" if kind == "BASE" else "tool_frames"
            self.reader.refuse(
                "CC145",
                f"{kind}_DATA[{number}] is not in the machine file",
                at,
                f"state control: {key}: {{{number}: ...}}",
            )
        self._take(name, known[number] if number else IDENTITY, at)

    def _take(self, name: str, frame: CoordinateFrame, at: int) -> None:
        if name == "$TOOL":
            self.reader.set_tool(frame, at)
            self.tool_stated = True
        else:
            self.reader.base, self.base_stated = frame, True
        self.held = None

    def _call(self, begin: int, found: re.Match[str], at: int) -> None:
        name, inside = found[1].upper(), found[2]
        if name != "BAS":
            self.reader.warn(f"{found[1]}() is not followed; it must not move the tool")
            self.reader.waits = True
            return
        told = _BAS.match(inside)
        if told is None:
            self.reader.refuse("CC144", "BAS without a command", at)
        command, value, where = told[1].upper(), told[2] or "", begin + found.start(2)
        if command in ("TOOL", "BASE") and value.isdigit():
            self._take_numbered("$" + command, command, int(value), where)
        elif command == "FRAMES":
            for key in ("TOOL", "BASE"):
                self._take_numbered("$" + key, key, self.numbers.get(key + "_NO", 0), where)
        elif command in ("VEL_CP", "CP_PARAMS") and (number := _VALUE.match(value)):
            self._set_speed(float(number[1]), where)
        elif command not in _TOLD_IDLE:
            self.reader.refuse(
                "CC144", f"BAS(#{told[1]}) is not followed", at, "set $VEL.CP, $BASE and $TOOL with numbers"
            )

    # --- moves -------------------------------------------------------------------------------------------------

    def _fields(
        self, string: str, at: int, names: frozenset[str] | None = frozenset()
    ) -> tuple[dict[str, tuple[int, int]], int]:
        """Spans of the values of an aggregate at a character, and the index of its closing brace."""
        found = _AGGREGATE.match(string)
        if found is None:
            self.reader.refuse(
                "CC144", "not an aggregate of numbers", at, "write the pose inline: {X ..., Y ..., Z ...}"
            )
        inside, k, out = found[1], 0, dict[str, tuple[int, int]]()
        base = at + found.start(1)
        while inside[k:].strip():
            part = _FIELD.match(inside, k)
            if part is None:
                self.reader.refuse("CC144", f"'{inside[k:].strip()[:30]}' is no component with a number", base + k)
            key = part[1].upper()
            if names and key not in names:
                self.reader.refuse("CC144", f"{part[1]} is no component of this aggregate", base + part.start(1))
            if key in out:
                self.reader.refuse("CC144", f"{part[1]} stands twice", base + part.start(1))
            out[key] = (base + part.start(2), base + part.end(2))
            k = part.end()
        return out, at + found.end() - 1

    def _numbers(self, string: str, at: int, names: Sequence[str]) -> dict[str, float]:
        """Numbers of an aggregate by component."""
        spans = self._fields(string, at, frozenset(names) | _OTHERS)[0]
        return self._values(spans, names)

    def _values(self, spans: dict[str, tuple[int, int]], names: Sequence[str]) -> dict[str, float]:
        out = {}
        for key in names:
            if key not in spans:
                continue
            if not (number := _VALUE.match(self.text.string[slice(*spans[key])])):
                self.reader.refuse(
                    "CC144", f"{key} is not given as a number", spans[key][0], "post numbers in place of variables"
                )
            out[key] = float(number[1])
        return out

    def _move(self, row: int, begin: int, code: str, word: re.Match[str]) -> None:
        kind, at = word[1].upper(), begin + word.start(1)
        rest = code[word.end() :]
        blend = _BLEND.search(rest)
        body = rest[: blend.start()] if blend else rest
        body = body.rstrip()
        if kind == "PTP" and body.strip().upper() in ("$AXIS_ACT", "$POS_ACT"):
            return
        first = begin + word.end()
        end = first + len(body)
        span = (end, first + blend.end(1) - len(blend[1]) + len(blend[1].rstrip())) if blend else (end, end)
        targets = [self._target(body, first, at)]
        sweep = None
        self._follow_external(kind, targets[0][0])
        if kind == "CIRC":
            used = targets[0][1] + 1 - first
            if not (comma := re.match(r"\s*,", body[used:])):
                self.reader.refuse(
                    "CC112", "CIRC needs an auxiliary point and an end point", at, "write CIRC {...},{...}"
                )
            targets.append(self._target(body[used + comma.end() :], first + used + comma.end(), at))
        used = targets[-1][1] + 1 - first
        if kind == "CIRC" and (told := _SWEEP.match(body, used)):
            sweep, used = float(told[1]), told.end()
        if body[used:].strip():
            extra = body[used:].strip()
            self.reader.refuse("CC144", f"'{extra[:30]}' behind the target is not followed", end - len(extra))
        self.reader.mode = self._mode(blend[1].split() if blend else [])
        site = self._site(row, (at, end), targets[-1], span)
        if set(targets[-1][0]) & set(AXES[:6]) and not set(targets[-1][0]) & {"X", "Y", "Z"}:
            self._joints(kind, site, targets[-1][0], at)
        else:
            self._cartesian(kind, site, targets, sweep, at)

    def _follow_external(self, kind: str, spans: dict[str, tuple[int, int]]) -> None:
        """External axes may move between cuts, and stand while the tool cuts."""
        for key, value in self._values(spans, [each for each in sorted(_OTHERS) if each[0] == "E"]).items():
            if self.external.get(key, value) != value:
                if kind != "PTP":
                    self.reader.refuse(
                        "CC115", f"{key} moves an external axis during a cut", spans[key][0], "move it with PTP"
                    )
                self.reader.warn(f"{key} moves; the machine file has to state the arm where it stands then")
            self.external[key] = value

    def _site(
        self,
        row: int,
        instruction: tuple[int, int],
        target: tuple[dict[str, tuple[int, int]], int],
        blend: tuple[int, int],
    ) -> Callable[..., MoveSite]:
        spans, close = target
        numbers = {name: spans[name] for name in self.names if name in spans}

        def site(near: Sequence[float], said: Sequence[float] | None) -> MoveSite:
            return MoveSite(
                row=row, instruction=instruction, numbers=numbers, close=close, blend=blend, base=self.reader.base,
                tool=self.reader.tool, near=tuple(near), said=said,
            )  # fmt: skip

        return site

    def _target(self, string: str, at: int, move: int) -> tuple[dict[str, tuple[int, int]], int]:
        if not _AGGREGATE.match(string):
            name = string.strip().split(",")[0][:30] or "nothing"
            self.reader.refuse("CC144", f"the target is {name}, not a pose written inline", move,
                               "post poses inline; positions of a .dat file are not read")  # fmt: skip
        spans, close = self._fields(string, at)
        pose = set(self.names)
        allowed = (pose if spans.keys() & pose else set(AXES)) | _OTHERS
        if wrong := sorted(spans.keys() - allowed):
            self.reader.refuse("CC144", f"{wrong[0]} is no component of a target", spans[wrong[0]][0])
        if not spans:
            self.reader.refuse("CC144", "an empty target", move)
        return spans, close

    def _joints(self, kind: str, site: Callable[..., MoveSite], spans: dict[str, tuple[int, int]], at: int) -> None:
        if kind != "PTP":
            self.reader.refuse("CC144", f"{kind} to joint angles", at, "use PTP, or a pose")
        given = self._values(spans, AXES)
        if len(given) < 6 and self.angles is None:
            self.reader.refuse("CC144", "not all of A1 to A6 are known", at, "name all six")
        self.angles = [given[each] if each in given else (self.angles or [0.0] * 6)[k] for k, each in enumerate(AXES)]
        self.reader.joint_move(site([0.0] * 6, None), self.angles)
        self.held = None

    def _cartesian(
        self, kind: str, site: Callable[..., MoveSite], targets: list[tuple[dict[str, tuple[int, int]], int]], sweep: float | None, at: int
    ) -> None:  # fmt: skip
        poses = []
        for spans, _ in targets:
            given = self._values(spans, self.names)
            if len(given) < 6 and self.held is None:
                missing = ", ".join(each for each in self.names if each not in given)
                self.reader.refuse(
                    "CC134",
                    f"{missing} are not known here",
                    at,
                    "behind joint angles, another frame or CA, name X, Y, Z, A, B and C",
                )
            poses.append(
                [given[each] if each in given else (self.held or [0.0] * 6)[k] for k, each in enumerate(self.names)]
            )
        end = poses[-1]
        if kind == "CIRC":
            if not self.circ_stated:
                self.reader.warn("$CIRC_TYPE is not stated; along CIRC the tool is taken to turn in the base (#BASE)")
            self.held = None if sweep is not None else end
            self.reader.move(ARC, site(end, self.held), end, middle=poses[0], sweep_deg=sweep)
        else:
            self.held = end
            self.reader.move(RAPID if kind == "PTP" else LINE, site(end, end), end)
        self.angles = None

    def _mode(self, blend: list[str]) -> PathMode:
        """How the end of a move is rounded."""
        words = [each.upper() for each in blend]
        if not words:
            return EXACT
        if "C_DIS" in words:
            return PathMode(tolerance_mm=self.apo_mm, code=ROUNDING_DISTANCE, own_name=f"C_DIS {self.apo_mm:g} mm")
        return PathMode(own_name=" ".join(words))
