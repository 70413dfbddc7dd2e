"""Interpretation of a program's text as the path of the tool tip.

One block at a time, in the order of execution of RS274/NGC: modes first, then settings, then the motion, then a stop.
"""

import re

from camcomp.gcode.block import Block
from camcomp.gcode.codes import (
    AXIS_USERS,
    CYCLES,
    EXACT_STOP_ONCE,
    HOMES,
    MACHINE_MOVES,
    PLAIN_M,
    STOPS,
    WAITS_G,
    WAITS_M,
    code_name,
)
from camcomp.gcode.cycles import Cycles
from camcomp.gcode.detect import dialect_of
from camcomp.gcode.flow import Flow, Siemens
from camcomp.gcode.macro import Macro
from camcomp.gcode.owords import OWords
from camcomp.gcode.program import Program
from camcomp.gcode.robot_reader import read_robot_program
from camcomp.gcode.settings import Settings
from camcomp.gcode.setup import Setup
from camcomp.gcode.text import Text
from camcomp.gcode.trace import Trace
from camcomp.gcode.uncorrected import UncorrectedFeeds, behind_end_warning, has_motion
from camcomp.gcode.words import code_of, points_in_feeds
from camcomp.ground.errors import ProgramError

_NO_AXES = frozenset((40, 921, 922, 923, 281, 301))

_IDLE = re.compile(r"%|\b[NO:]\d+|\bM0?2\b|\bM30\b|[\0\x1a]", re.IGNORECASE)


def read_program(data: bytes, *, name: str, setup: Setup | None = None, dialect: str | None = None) -> Program:
    """Read a program: path of the tool tip, and the data for rewriting its text.

    `data` is the file's content, `name` its name in messages; `dialect` is the name of a dialect, or None to detect it.
    Raises ProgramError, with the location, for every ambiguous statement and every unsupported geometry.
    """
    text = Text.read(data, name)
    setup = setup or Setup()
    language = dialect_of(text, dialect)
    if language.robot is not None:
        return read_robot_program(text, setup, language)
    reader = Interpreter(text, setup, language)
    flow = controller(reader)
    flow.run()
    path, sites = reader.record.finish()
    if len(path) == 0:
        lines = [_IDLE.sub("", code_of(text.line(row))).strip() for row in range(len(text.starts))]
        if not any(lines) or any(has_motion(each) for each in lines):
            raise ProgramError("CC100", "the program moves nothing", at=text.place(0))
        reader.warnings.append("the program moves nothing")
    else:
        feeds = UncorrectedFeeds(name)
        feeds.add(path)
        reader.warnings += feeds.warnings()
        if reader.straight:
            behind = [row for row in range(flow.end_row, len(text)) if has_motion(text.line(row))]
            reader.warnings += [behind_end_warning(name, len(behind), behind[0] + 1)] if behind else []
    return Program(
        data=data,
        name=name,
        dialect=language.name,
        path=path,
        warnings=tuple(reader.warnings),
        text=text,
        sites=sites,
        rebases=tuple(reader.rebases),
        setup=setup,
        language=language,
        feed_point=points_in_feeds(text.line(row) for row in range(len(text))),
        modes=tuple(reader.record.modes),
        straight=reader.straight and not reader.record.cycles,
        dwelt_s=reader.state.dwelt_s,
        tool_changes=reader.state.tool_changes,
    )


class Interpreter(Settings, Cycles):
    """Executes blocks and records every motion."""

    def perform(self, block: Block) -> bool:
        """Execute a block; True if it ends the program."""
        self.record.begin_line(block.row)
        self.record.waits_ahead, self.state.waits = self.state.waits, False
        zero_code, active = block.code(0), self.state.active
        motion = self._motion_of(block, zero_code)
        self.modes(block)
        if zero_code in HOMES:
            self.home(block, zero_code // 10)
        elif zero_code is not None and zero_code not in MACHINE_MOVES:
            self.settings(block, zero_code)
        m_codes = [code for code, _ in block.m]
        self.state.waits |= self._waits(block, m_codes) or self.state.active != active
        self._alone(block)
        if "TRAORI" in block.words:
            self.state.transformed = block.number("TRAORI") == 1.0
        if block.words.keys() & {"A", "B", "C", "U", "V", "W", "A3", "B3", "C3"}:
            self._spare_axes(block, motion, zero_code)
        if motion is not None:
            self.record.stops = any(code in STOPS for code in m_codes)
            if motion in CYCLES:
                self.cycle(block, motion)
            else:
                self.move(block, motion, machine=zero_code in MACHINE_MOVES)
        self._leftovers(block, m_codes)
        self.state.waits |= self.record.waits_ahead or not STOPS.isdisjoint(m_codes) or EXACT_STOP_ONCE in block.groups
        self.record.end_line()
        if any(code in self.dialect.ends for code in m_codes):
            self.state.motion = None
            return True
        return False

    def _motion_of(self, block: Block, zero_code: int | None) -> int | None:
        """Motion code of the block in tenths, or None; sets the modal one."""
        state, words = self.state, block.words
        explicit = block.code(1)
        if explicit is not None:
            begins = explicit in CYCLES and state.motion not in CYCLES
            if begins or explicit not in CYCLES or (explicit != state.motion and not self.dialect.cycles_apart):
                self.forget_cycle(series=begins or explicit not in CYCLES)
            if explicit == 800:
                state.motion = state.outside_cycles if self.dialect.cycles_apart else None
            else:
                state.motion = explicit
                self.record.code_stated = True
            if explicit not in CYCLES and explicit != 800:
                state.outside_cycles = explicit
        dynamic = block.code(8) == 431
        if dynamic and zero_code in AXIS_USERS and block.axes:
            self.refuse("CC108", f"{code_name(431)} and {code_name(zero_code or 0)} both want the axis words")
        if zero_code in AXIS_USERS or dynamic:
            homes = zero_code in (280, 300) and explicit in (0, 10) and self.dialect.home_beside_motion
            if explicit not in (None, 800) and block.axes and not homes:
                first = code_name(431 if dynamic else zero_code or 0)
                self.refuse("CC108", f"{first} and {code_name(explicit or 0)} both want the axis words")
            return None
        wants = bool(block.axes or self.orientation_words(block))
        if state.motion in (20, 30):
            wants = wants or any(letter in words for letter in "IJK") or (explicit is not None and "R" in words)
        elif explicit in CYCLES:
            wants = True
        if zero_code == 40 and explicit is None and set(self.dialect.dwell) & {"XYZ"[a] for a in block.axes}:
            wants = len(block.axes) > 1
        if not wants:
            return None
        if explicit is None and zero_code in _NO_AXES:
            self.refuse("CC108", f"axis words with {code_name(zero_code or 0)}, which has no use for them")
        if state.motion is None:
            self.refuse("CC134", "axis words without a motion code in force")
        return state.motion

    def _waits(self, block: Block, m_codes: list[int]) -> bool:
        """Whether the controller stops for a word of the block before the motion."""
        if not WAITS_M.isdisjoint(m_codes) or not WAITS_G.isdisjoint(code for code, _ in block.g):
            return True
        return "S" in block.words

    def _alone(self, block: Block) -> None:
        """Refuse axis words in a block with a passed code or G50, for which they have no defined meaning."""
        for code, word in block.g:
            if (code in self.dialect.passed or code == 500) and block.axes:
                self.refuse("CC108", f"axis words with {code_name(code)}", word)

    def _spare_axes(self, block: Block, motion: int | None, zero_code: int | None) -> None:
        """Check words of additional axes: they may keep their positions, and tables may rotate in blocks of their own.

        The orientation of a tool changes with G0 to G3 in the workpiece's coordinates.
        """
        table, offset = self.state.table, block.code(0) in (100, 520, 920)
        free = motion in (0, 10, 20, 30) and zero_code not in MACHINE_MOVES
        turning = self.orientation_words(block) if free else []
        for letter in ("A3", "B3", "C3"):
            if letter in block.words and letter not in turning:
                self.refuse(
                    "CC115", f"{letter}= turns the tool, which this machine or block does not", block.words[letter]
                )
        for letter in "ABCUVW":
            word = block.words.get(letter)
            if word is None or letter in block.used or letter in turning:
                continue
            place = word.value
            if letter in table and self.state.relative:
                place += table[letter]
            if letter not in table and word.value != 0.0:
                self.refuse("CC115", f"{letter} moves an axis that the machine does not have", word)
            if place == table.get(letter, 0.0):
                continue
            if offset or block.axes or self.state.motion not in (0, 10):
                self.refuse("CC115", f"{letter} turns while something else happens; it may only turn alone", word)
            table[letter] = place

    def _leftovers(self, block: Block, m_codes: list[int]) -> None:
        free = any(code not in PLAIN_M for code in m_codes) or any(code in self.dialect.passed for code, _ in block.g)
        for letter, word in block.words.items():
            if letter in tuple("XYZABCUVWFST") or letter in block.used or letter in self.dialect.idle_letters:
                continue
            if free and letter in ("PQLEH" if block.axes else "PQRLEHIJK"):
                continue
            self.refuse("CC109", f"{letter} is not used by anything in its block", word)


def controller(reader: Interpreter, trace: Trace | None = None) -> Flow:
    """Flow of lines in the dialect of the reader."""
    kinds: dict[str, type[Flow]] = {"o-words": OWords, "macro": Macro, "sinumerik": Siemens}
    return kinds.get(reader.dialect.flow, Flow)(reader, trace)
