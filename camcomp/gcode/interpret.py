"""A program's text becomes the path that it asks of the tool tip.

One block at a time, in the order of execution of RS274/NGC: modes first, then settings, then the motion, then a stop.
Everything about a block is checked before it moves anything.
"""

import math
from typing import NoReturn

from camcomp.diagnostics import ProgramError
from camcomp.gcode import arcs
from camcomp.gcode.codes import (
    AXIS_USERS,
    CANCELS,
    CYCLES,
    ENDS,
    GROUPS,
    GROUPS_M,
    KNOWN_M,
    PLAIN_M,
    REFUSED,
    STOPS,
    WORK_OFFSETS,
    code_name,
)
from camcomp.gcode.program import Program, Rebase, Setup
from camcomp.gcode.record import Recorder
from camcomp.gcode.state import State
from camcomp.gcode.text import Text
from camcomp.gcode.words import Word, read_line

_LARGEST = 1.0e7  # mm; a machine of ten kilometres is a typing mistake
_MODE_GROUPS = frozenset((2, 3, 4, 5, 6, 8, 12))
_NO_AXES = frozenset((40, 921, 922, 923, 281, 301))


def read_program(data: bytes, *, name: str, setup: Setup | None = None, dialect: str | None = None) -> Program:
    """Path of the tool tip, and what is needed to write the program again.

    `data` is the file's content, `name` its name in messages. Raises ProgramError, with the place, for every statement
    that cannot be read with certainty or whose geometry camcomp cannot follow.
    """
    text = Text.read(data, name)
    reader = Interpreter(text, setup or Setup())
    reader.run()
    path, sites = reader.record.finish()
    if len(path) == 0:
        raise ProgramError("CC100", "the program moves nothing", at=text.place(0))
    return Program(
        data=data,
        name=name,
        dialect=dialect or "rs274",
        path=path,
        warnings=tuple(reader.warnings),
        text=text,
        sites=sites,
        rebases=tuple(reader.rebases),
    )


class Block:
    """The words of one line, sorted by what they do."""

    __slots__ = ("axes", "column", "g", "groups", "m", "row", "used", "words")

    def __init__(self, row: int) -> None:
        self.row = row
        self.words: dict[str, Word] = {}
        self.g: list[tuple[int, Word]] = []
        self.m: list[tuple[int, Word]] = []
        self.groups: dict[int, tuple[int, Word]] = {}
        self.axes: list[int] = []
        self.used: set[str] = set()
        self.column = 0


class Interpreter:
    """Executes the lines of one text and records every motion."""

    def __init__(self, text: Text, setup: Setup) -> None:
        self.text = text
        self.state = State(setup)
        self.record = Recorder(text)
        self.warnings: list[str] = []
        self.rebases: list[Rebase] = []
        self._warned: set[str] = set()
        self.block = Block(0)

    # --- program flow ------------------------------------------------------------------------------------------

    def run(self) -> None:
        """Execute from the first line to the program's end."""
        text = self.text
        percent = False
        for row in range(len(text)):
            line = text.line(row)
            if line.strip(" \t\0\x1a").startswith("%"):
                if percent or len(self.record):
                    break
                percent = True
                continue
            if self.execute(row):
                break

    def execute(self, row: int) -> bool:
        """Execute line `row`; True when the program ends there."""
        words, deleted, warning = read_line(self.text, row)
        if warning:
            self.warn(row, warning)
        if not words or (deleted and self.state.setup.skip_deleted):
            return False
        block = self.block = self.sort(row, words)
        if not (block.g or block.m or block.words):
            return False
        return self.perform(block)

    def warn(self, row: int, message: str, once: bool = False) -> None:
        """Keep a warning, with its line."""
        if once:
            if message in self._warned:
                return
            self._warned.add(message)
        self.warnings.append(f"{self.text.name}:{row + 1}: {message}")

    def refuse(self, rule: str, message: str, word: Word | None = None, hint: str | None = None) -> NoReturn:
        """Raise a ProgramError at a word of the current block."""
        column = word.begin if word else self.block.column
        raise ProgramError(rule, message, at=self.text.place(self.block.row, column), hint=hint)

    # --- checks ------------------------------------------------------------------------------------------------

    def sort(self, row: int, words: list[Word]) -> Block:
        """Block of the words, each letter once and each modal group once."""
        block = self.block = Block(row)
        first = True
        for word in words:
            letter = word.letter
            if letter == "N" and first:
                first = False
                continue
            if first or not block.column:
                block.column = word.begin
            first = False
            if letter == "G":
                self._sort_g(block, word)
            elif letter == "M":
                self._sort_m(block, word)
            elif letter == "O":
                if len(words) > 1 + (words[0].letter == "N"):
                    self.refuse("CC103", "a program number stands alone on its line", word)
            elif letter in block.words:
                self.refuse("CC104", f"two {letter} words in one block", word)
            elif letter == "N":
                self.refuse("CC104", "a line number stands at the start of its line", word)
            else:
                if not math.isfinite(word.value):
                    self.refuse("CC138", f"{letter} has no finite value", word)
                block.words[letter] = word
        block.axes = [axis for axis in range(3) if "XYZ"[axis] in block.words]
        return block

    def _sort_g(self, block: Block, word: Word) -> None:
        code = round(word.value * 10.0)
        if abs(word.value * 10.0 - code) > 1e-6 or code < 0:
            self.refuse("CC106", f"G{word.value:g} is not a code", word)
        if code in REFUSED and code not in CANCELS:
            rule, what = REFUSED[code]
            self.refuse(rule, f"{code_name(code)} is {what}", word)
        if code in CANCELS:
            block.g.append((code, word))
            return
        group = GROUPS.get(code)
        if group is None:
            self.refuse("CC106", f"{code_name(code)} is not a code that camcomp knows", word)
        if group in block.groups:
            other = code_name(block.groups[group][0])
            self.refuse("CC105", f"{code_name(code)} and {other} exclude each other in one block", word)
        block.groups[group] = (code, word)
        block.g.append((code, word))

    def _sort_m(self, block: Block, word: Word) -> None:
        code = round(word.value)
        if abs(word.value - code) > 1e-6 or code < 0:
            self.refuse("CC106", f"M{word.value:g} is not a code", word)
        group = GROUPS_M.get(code)
        for other, _ in block.m:
            if group is not None and GROUPS_M.get(other) == group:
                self.refuse("CC105", f"M{code} and M{other} exclude each other in one block", word)
        if code not in KNOWN_M:
            self.warn(block.row, f"M{code} is passed on; camcomp takes it not to move anything", once=True)
        block.m.append((code, word))

    # --- execution ---------------------------------------------------------------------------------------------

    def perform(self, block: Block) -> bool:
        """Execute a block; True when it ends the program."""
        state = self.state
        self.record.begin_line(block.row)
        zero_code = block.groups[0][0] if 0 in block.groups else None
        motion = self._motion_of(block, zero_code)
        self._modes(block)
        if zero_code is not None:
            self._settings(block, zero_code)
        m_codes = [code for code, _ in block.m]
        stops = any(code in STOPS for code in m_codes)
        if motion is not None:
            self.record.stops = stops
            self._move(block, motion, machine=zero_code == 530)
        self._leftovers(block, m_codes)
        self.record.end_line()
        if any(code in ENDS for code in m_codes):
            state.motion = None
            return True
        return False

    def _motion_of(self, block: Block, zero_code: int | None) -> int | None:
        """Motion code that the block executes, or None; sets the modal one."""
        state = self.state
        explicit = block.groups[1][0] if 1 in block.groups else None
        if explicit is not None:
            state.motion = None if explicit == 800 else explicit // 10
            self.record.code_stated = True
        dynamic = block.groups.get(8, (0, None))[0] == 431
        taken = zero_code in AXIS_USERS or dynamic
        if explicit is not None and explicit != 800 and taken and block.axes:
            self.refuse(
                "CC108",
                f"{code_name(431 if dynamic else zero_code or 0)} and {code_name(explicit)} both want the axis words",
                block.groups[1][1],
            )
        if taken:
            return None
        wants = bool(block.axes)
        if explicit in (20, 30) and any(letter in block.words for letter in "IJKR"):
            wants = True
        if explicit is None and state.motion in (2, 3) and any(each in block.words for each in "IJK"):
            wants = True
        if not wants:
            return None
        if explicit is None and zero_code in _NO_AXES:
            self.refuse("CC108", f"axis words with {code_name(zero_code or 0)}, which has no use for them")
        if state.motion is None:
            self.refuse("CC134", "axis words without a motion code in force")
        return state.motion

    def _modes(self, block: Block) -> None:
        state, groups, words = self.state, block.groups, block.words
        changed = False
        for group in _MODE_GROUPS:
            changed = changed or group in groups
        self.record.modes_changed = changed or (state.feed_mode == 95 and "S" in words)
        if 6 in groups:
            state.unit = 25.4 if groups[6][0] == 200 else 1.0
        if 5 in groups:
            mode = groups[5][0] // 10
            if mode != state.feed_mode:
                state.feed_mode, state.feed = mode, None
        if "F" in words:
            self._feed(words["F"])
        if "S" in words:
            state.speed = words["S"].value
            if state.speed < 0.0:
                self.refuse("CC138", "negative spindle speed", words["S"])
        self._tool(block)
        if 2 in groups:
            state.plane = groups[2][0] // 10
        if 8 in groups:
            self._tool_length(block, groups[8][0])
        if 12 in groups:
            state.active = WORK_OFFSETS[groups[12][0]] - 1
        if 3 in groups:
            state.relative = groups[3][0] == 910
        if 4 in groups:
            state.centre_absolute = groups[4][0] == 901
        if 10 in groups:
            state.retract_to_start = groups[10][0] == 980
        if 8 in groups or 12 in groups:
            state.update()

    def _feed(self, word: Word) -> None:
        state = self.state
        if word.value < 0.0 or (word.value == 0.0 and state.feed_mode == 93):
            self.refuse("CC110", "the feed has to be positive", word)
        state.feed = word.value if state.feed_mode == 93 else word.value * state.unit
        self.record.feed_stated = True

    def _tool(self, block: Block) -> None:
        state, words = self.state, block.words
        if "T" in words:
            number = words["T"].value
            if number < 0.0 or number != int(number):
                self.refuse("CC133", "a tool number is a whole number, not negative", words["T"])
            state.next_tool = int(number)
        for code, word in block.m:
            if code == 6:
                state.tool = state.next_tool
            elif code == 61:
                if "Q" not in words:
                    self.refuse("CC133", "M61 needs the tool number as Q", word)
                state.tool = int(words["Q"].value)

    def _tool_length(self, block: Block, code: int) -> None:
        state, words = self.state, block.words
        if code == 490:
            state.tool_offset = [0.0, 0.0, 0.0]
        elif code == 431:
            for axis in block.axes:
                state.tool_offset[axis] = words["XYZ"[axis]].value * state.unit
        else:
            number = state.tool
            if "H" in words:
                block.used.add("H")
                number = int(words["H"].value)
                if number != words["H"].value or number < 0:
                    self.refuse("CC133", "H is a whole number, not negative", words["H"])
            length = state.tools.get(number, 0.0)
            if number and number not in state.tools:
                message = f"tool {number} is not in the tool table; its length offset counts as 0"
                self.warn(block.row, message, once=True)
            state.tool_offset = [0.0, 0.0, length if number else 0.0]

    # --- settings ----------------------------------------------------------------------------------------------

    def _settings(self, block: Block, code: int) -> None:
        if code == 40:
            if not set("PXU") & set(block.words):
                self.refuse("CC131", "G4 has no time", block.groups[0][1])
            block.used.add("P")
        elif code == 100:
            self._set_offset(block)
        elif code in (280, 300):
            self._home(block, code // 10)
        elif code in (281, 301):
            self._store_home(block, code // 10)
        elif code in (520, 920):
            self._shift(block, code)
        elif code in (921, 922, 923):
            state = self.state
            if code == 921:
                state.saved_shift = [0.0, 0.0, 0.0]
            state.shift = list(state.saved_shift) if code == 923 else [0.0, 0.0, 0.0]
            self.record.modes_changed = True
            state.update()

    def _shift(self, block: Block, code: int) -> None:
        state = self.state
        if not block.axes:
            self.refuse("CC129", f"{code_name(code)} without axis words", block.groups[0][1])
        for axis in block.axes:
            value = block.words["XYZ"[axis]].value * state.unit
            if code == 520:
                state.shift[axis] = value
            else:
                state.shift[axis] += state.position[axis] - value - state.offset[axis]
        if code == 920:
            self._rebase(block)
        state.saved_shift = list(state.shift)
        state.update()

    def _rebase(self, block: Block) -> None:
        base = int(self.text.starts[block.row])
        axes = []
        values = [0.0, 0.0, 0.0]
        for axis in block.axes:
            word = block.words["XYZ"[axis]]
            axes.append((axis, base + word.begin, base + word.end))
            values[axis] = word.value
        value = (values[0], values[1], values[2])
        self.rebases.append(Rebase(len(self.record), block.row, tuple(axes), value, self.state.unit))

    def _set_offset(self, block: Block) -> None:
        state, words = self.state, block.words
        word = block.groups[0][1]
        kind = words["L"].value if "L" in words else None
        number = words["P"].value if "P" in words else None
        block.used |= {"L", "P"}
        if kind not in (2, 20) or number is None or number != int(number) or not 0 <= number <= 9:
            self.refuse("CC129", "of G10, camcomp knows L2 and L20 with P0 to P9", word)
        if "R" in words:
            block.used.add("R")
            if words["R"].value != 0.0:
                self.refuse("CC118", "G10 with R rotates the coordinates", words["R"])
        index = int(number) - 1 if number else state.active
        for axis in block.axes:
            value = words["XYZ"[axis]].value * state.unit
            if kind == 2:
                state.work[index][axis] = value
            else:
                machine = state.position[axis] + state.zero[axis]
                state.work[index][axis] = machine - state.shift[axis] - state.tool_offset[axis] - value
        if kind == 20:
            self._rebase(block)
        state.update()

    def _home(self, block: Block, code: int) -> None:
        state = self.state
        middle = self._target(block)
        self.record.machine_motion(block, state, -1, middle)
        end = list(middle)
        for axis in block.axes or range(3):
            end[axis] = state.homes[code][axis] - state.zero[axis]
            state.commanded[axis] = True
        self.record.machine_motion(block, state, -1, end, moved=block.axes or [0, 1, 2])

    def _store_home(self, block: Block, code: int) -> None:
        state = self.state
        state.homes[code] = [state.position[axis] + state.zero[axis] for axis in range(3)]
        self.rebases.append(Rebase(len(self.record), block.row, (), (0.0, 0.0, 0.0), state.unit))

    # --- motion ------------------------------------------------------------------------------------------------

    def _target(self, block: Block, machine: bool = False) -> list[float]:
        """End point in the program frame of the block's axis words."""
        state = self.state
        end = list(state.position)
        for axis in block.axes:
            word = block.words["XYZ"[axis]]
            value = word.value * state.unit
            if abs(value) > _LARGEST:
                self.refuse("CC138", f"{word.letter}{word.value:g} is out of every machine's reach", word)
            if machine:
                end[axis] = value - state.zero[axis]
            elif state.relative:
                end[axis] += value
                if not state.commanded[axis]:
                    self.warn(
                        block.row, f"{word.letter} starts with a relative move; its start counts as start_mm", once=True
                    )
            else:
                end[axis] = value + state.offset[axis]
            state.commanded[axis] = True
        return end

    def _move(self, block: Block, motion: int, machine: bool) -> None:
        state = self.state
        if machine and (motion not in (0, 1) or state.relative):
            self.refuse("CC130", "G53 works with G0 or G1 and with G90", block.groups[0][1])
        if motion * 10 in CYCLES:
            self.refuse("CC132", f"canned cycle G{motion} is not read here")
        feed = math.nan
        if motion != 0:
            feed = self._feed_of(block)
        if motion in (2, 3):
            self._arc(block, motion, feed)
            return
        end = self._target(block, machine)
        if motion and state.feed_mode == 93:
            feed *= math.dist(state.position, end) or 1.0
        if machine:
            self.record.machine_motion(block, state, motion, end, feed=feed)
        else:
            self.record.line_motion(block, state, motion, end, feed)

    def _feed_of(self, block: Block) -> float:
        """Feed of a cutting motion: mm/min, or 1/min in G93."""
        state = self.state
        if state.feed_mode == 93 and "F" not in block.words:
            self.refuse("CC110", "G93 needs an F word in every block that cuts")
        if not state.feed:
            self.refuse("CC110", "a cutting motion without a feed")
        if state.feed_mode == 95:
            if state.speed <= 0.0:
                self.refuse("CC110", "feed per revolution (G95) without a spindle speed")
            return state.feed * state.speed
        return state.feed

    def _arc(self, block: Block, motion: int, feed: float) -> None:
        state, words = self.state, block.words
        u, v, w = arcs.PLANES[state.plane]
        letters = ("IJK"[u], "IJK"[v])
        inch = state.unit != 1.0
        code = block.groups[1][1] if 1 in block.groups else None
        start3 = list(state.position)
        end3 = self._target(block)
        unit = state.unit
        block.used |= {"R", "P", *letters}
        turns = 1
        if "P" in words:
            turns = round(words["P"].value)
            if abs(turns - words["P"].value) > 1e-3 or turns < 1:
                self.refuse("CC113", "P of an arc is a whole number of turns, 1 or more", words["P"])
        start, end = (start3[u] / unit, start3[v] / unit), (end3[u] / unit, end3[v] / unit)
        try:
            if "R" in words:
                if any(letter in words for letter in "IJK"):
                    self.refuse("CC112", "an arc has both R and I, J, K", words["R"])
                if u not in block.axes and v not in block.axes:
                    self.refuse("CC112", "an arc given by R has no end point in its plane", words["R"])
                centre = arcs.centre_of_radius(start, end, words["R"].value, motion == 3, inch)
            else:
                given = [letter for letter in letters if letter in words]
                if not given or (state.centre_absolute and len(given) < 2):
                    missing = " and ".join(letter for letter in letters if letter not in words)
                    self.refuse("CC112", f"the arc has no centre: {missing} or R is missing", code)
                values = [words[letter].value if letter in words else 0.0 for letter in letters]
                if state.centre_absolute:
                    values = [values[0] + state.offset[u] / unit, values[1] + state.offset[v] / unit]
                    centre = (values[0], values[1])
                else:
                    centre = (start[0] + values[0], start[1] + values[1])
                arcs.check_radii(start, end, centre, inch)
        except arcs.ArcError as error:
            self.refuse(error.rule, error.message, code)
        angle = arcs.sweep(start, end, centre, motion == 3, turns)
        centre3 = list(start3)
        centre3[u], centre3[v] = centre[0] * unit, centre[1] * unit
        if state.feed_mode == 93:
            radius = math.hypot(start3[u] - centre3[u], start3[v] - centre3[v])
            feed *= math.hypot(radius * angle, end3[w] - start3[w])
        self.record.arc_motion(block, state, motion, end3, centre3, angle, feed)

    def _leftovers(self, block: Block, m_codes: list[int]) -> None:
        words = block.words
        for letter in "ABCUVW":
            if letter in words and words[letter].value != 0.0:
                self.refuse("CC115", f"{letter} moves an axis that the machine does not have", words[letter])
        free = any(code not in PLAIN_M for code in m_codes)
        path_control = block.groups.get(13, (0, None))[0] == 640
        for letter, word in words.items():
            if letter in "XYZABCUVWFSTDN" or letter in block.used:
                continue
            if free and letter in "PQRLEHIJK":
                continue
            if path_control and letter in "PQ":
                continue
            self.refuse("CC109", f"{letter} is not used by anything in its block", word)
