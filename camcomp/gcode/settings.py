"""Statements without motion that change the meaning of later words: units, modes, offsets, feed, tool."""

from camcomp.gcode.block import Block, BlockReader
from camcomp.gcode.codes import code_name
from camcomp.gcode.path_mode import ROUNDING_DISTANCE, path_mode
from camcomp.gcode.program import Rebase
from camcomp.gcode.spelling import RS274, SINUMERIK
from camcomp.gcode.words import Word

_INCH = (200, 700, 7000)
_LENGTHS_ALONE = (700, 710)  # Sinumerik: feeds stay in the units of the machine, mm; G700 and G710 change both
_TURNS = {3: 1.0, 4: -1.0, 5: 0.0}
_MODE_GROUPS = (2, 3, 4, 5, 6, 8, 12)


class Settings(BlockReader):
    """Executes the modes and settings of a block, in the order of RS274/NGC."""

    def modes(self, block: Block) -> None:
        """Execute all modal codes except the motion code."""
        state, groups, words = self.state, block.groups, block.words
        changed = any(group in groups for group in _MODE_GROUPS)
        self.record.modes_changed = changed or (state.feed_mode == 95 and "S" in words)
        if 6 in groups:
            state.unit = 25.4 if groups[6][0] in _INCH else 1.0
            state.feed_unit = 1.0 if groups[6][0] in _LENGTHS_ALONE else state.unit
        if 5 in groups:
            mode = groups[5][0] // 10
            if mode != state.feed_mode:
                state.feed_mode, state.feed = mode, None
        dwells = block.code(0) == 40
        if "F" in words and not (dwells and "F" in self.dialect.dwell):
            self._feed(words["F"])
        if "S" in words and not (dwells and "S" in self.dialect.dwell):
            state.speed = words["S"].value
            state.no_speed = state.speed == 0.0
            if state.speed < 0.0:
                self.refuse("CC138", "negative spindle speed", words["S"])
        self._tool(block)
        if 2 in groups:
            state.plane = groups[2][0] // 10
        if 8 in groups:
            self._tool_length(block, groups[8][0])
        elif "H" in words and self.dialect.modal_length and state.length_on:
            self._tool_length(block, 430)
        if 12 in groups:
            self._work_offset(block, *groups[12])
        if 3 in groups:
            state.relative = groups[3][0] == 910
        if 4 in groups:
            state.centre_absolute = groups[4][0] == 901
        if 13 in groups:
            self._path_mode(block, groups[13][0])
        if 10 in groups:
            state.retract_to_start = groups[10][0] == 980
        state.update()

    def _path_mode(self, block: Block, code: int) -> None:
        """Set the path mode: G64 with P and Q if the controller has them, G641 with the modal ADIS."""
        state, letters = self.state, "PQ" if self.dialect.merges and code == 640 else ""
        p, q = ((block.number(each) if each in letters else None) for each in "PQ")
        if code == ROUNDING_DISTANCE:
            p = block.number("ADIS")
            state.rounding = p = state.rounding if p is None else p
        state.path_mode = path_mode(code, *(None if each is None else each * state.unit for each in (p, q)))

    def _feed(self, word: Word) -> None:
        state = self.state
        if word.value < 0.0 or (word.value == 0.0 and state.feed_mode == 93):
            self.refuse("CC110", "the feed has to be positive", word)
        state.feed = word.value if state.feed_mode == 93 else word.value * state.feed_unit
        self.record.feed_stated = True

    def _whole(self, letter: str, word: Word) -> int:
        if word.value < 0.0 or word.value != int(word.value):
            self.refuse("CC133", f"{letter} is a whole number, not negative", word)
        return int(word.value)

    def _tool(self, block: Block) -> None:
        state, words = self.state, block.words
        if "D" in words and self.dialect.spelling is SINUMERIK:
            state.length_off = words["D"].value == 0.0
        if "T" in words:
            state.next_tool = self._whole("T", words["T"])
        for code, word in block.m:
            if code == 6:
                state.tool = state.next_tool
                state.tool_changes += 1
            elif code == 61:
                if "Q" not in words:
                    self.refuse("CC133", "M61 needs the tool number as Q", word)
                state.tool = self._whole("Q", words["Q"])
            elif code in (3, 4, 5):
                state.spindle, state.turn = code, _TURNS[code]

    def _tool_length(self, block: Block, code: int) -> None:
        state, words = self.state, block.words
        state.length_on = code != 490
        if code == 490:
            if block.number("H"):
                self.refuse("CC133", "G49 switches the length offset off, and H names one", words["H"])
            state.tool_offset = [0.0, 0.0, 0.0]
        elif code == 431:
            for axis in block.axes:
                state.tool_offset[axis] = words["XYZ"[axis]].value * state.unit
        else:
            number = state.tool
            if "H" in words:
                block.used.add("H")
                number = self._whole("H", words["H"])
            length = state.tools.get(number, 0.0)
            if number and number not in state.tools:
                self.warn(
                    f"tool {number} has no length in `control: tool_lengths_mm`; its offset counts as 0", once=True
                )
            state.tool_offset = [0.0, 0.0, length if number else 0.0]

    def _work_offset(self, block: Block, code: int, word: Word) -> None:
        extended = code == 541 or (code == 540 and self.dialect.extended_offsets and "P" in block.words)
        if not extended:
            self.state.active = self.state.offset_index[code]
            return
        number = block.number("P")
        if number is None or number != int(number) or not 1 <= number <= len(self.state.work) - 9:
            self.refuse("CC129", "G54.1 needs the number of the work offset as P", word)
        self.state.active = 8 + int(number)

    def settings(self, block: Block, code: int) -> None:
        """Execute a code of group 0 without motion."""
        state = self.state
        if code == 40:
            given = [(letter, block.number(letter)) for letter in dict.fromkeys(self.dialect.dwell + "P")]
            times = [(letter, value) for letter, value in given if value is not None]
            if len(times) != 1:
                self.refuse("CC131", f"G4 has {'two times' if times else 'no time'}", block.groups[0][1])
            self.dwell(*times[0])
        elif code == 100:
            self._set_offset(block)
        elif code in (281, 301):
            state.homes[code // 10] = state.machine_position
            self.rebases.append(Rebase(len(self.record), block.row, (), (0.0, 0.0, 0.0), state.unit))
        elif code in (520, 920):
            self._shift(block, code)
        elif code in (921, 922, 923):
            if code == 921:
                state.saved_shift = [0.0, 0.0, 0.0]
            state.shift = list(state.saved_shift) if code == 923 else [0.0, 0.0, 0.0]
            self.record.modes_changed = True
        state.update()

    def dwell(self, letter: str, value: float) -> None:
        """Wait for the time of a word of G4."""
        if letter == "S":
            seconds = 60.0 * value / self.state.speed if self.state.speed > 0.0 else 0.0
        else:
            seconds = value * (self.dialect.dwell_p_s if letter == "P" else 1.0)
        self.state.dwelt_s += max(seconds, 0.0)

    def _shift(self, block: Block, code: int) -> None:
        state = self.state
        if not block.axes and not any(letter in block.words for letter in "ABCUVW"):
            self.refuse("CC129", f"{code_name(code)} without axis words", block.groups[0][1])
        for axis in block.axes:
            value = block.words["XYZ"[axis]].value * state.unit
            if code == 920:
                state.shift[axis] += state.position[axis] - value - state.offset[axis]
            elif self.dialect.own_local_frame:
                state.local[axis] = value
            else:
                state.shift[axis] = value
        if code == 920:
            self._rebase(block)
        state.saved_shift = list(state.shift)

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

    def _set_tool(self, block: Block, number: float) -> None:
        """G10 L1: an entry of the tool table; it counts from the next G43 on."""
        block.number("R")  # tool radius
        if number != int(number) or number < 1:
            self.refuse("CC133", "P of G10 L1 is a tool number", block.words["P"])
        if "Z" in block.words:
            self.state.tools[int(number)] = block.words["Z"].value * self.state.unit

    def _set_offset(self, block: Block) -> None:
        state, words = self.state, block.words
        word = block.groups[0][1]
        kind, number = block.number("L"), block.number("P")
        if (
            kind == 1
            and number is not None
            and set(block.words) <= {"L", "P", "Z", "R"}
            and self.dialect.spelling is RS274
        ):
            self._set_tool(block, number)
            return
        extended = kind == 20 and self.dialect.extended_offsets
        last = len(state.work) - 9 if extended else 9
        if kind not in (2, 20) or number is None or number != int(number) or not 0 <= number <= last:
            self.refuse("CC129", f"of G10, camcomp knows L1, L2 and L20 with P0 to P{last}", word)
        if block.number("R"):
            self.refuse("CC118", "G10 with R rotates the coordinates", words["R"])
        index = int(number) - 1 if number else state.active
        if extended:
            index = 8 + int(number)
        state.waits |= index == state.active
        here: dict[int, float] = {}
        for axis in block.axes:
            value = words["XYZ"[axis]].value * state.unit
            if kind == 2 or extended:
                adds = self.dialect.relative_offsets and state.relative
                state.work[index][axis] = state.work[index][axis] + value if adds else value
            else:
                others = state.shift[axis] + state.local[axis] + state.tool_offset[axis]
                here[axis] = state.position[axis] - others - value
        state.set_work(index, here)
        if kind == 20 and not extended:
            self._rebase(block)
