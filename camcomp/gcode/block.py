"""Words of one line sorted by function, with checks for contradictions."""

import math
from typing import NoReturn

from camcomp.gcode.codes import CALLS_M, CANCELS, GROUPS_M, KNOWN_M, SAVES, code_name
from camcomp.gcode.dialect import Dialect
from camcomp.gcode.naming import named
from camcomp.gcode.program import Rebase
from camcomp.gcode.record import Recorder
from camcomp.gcode.setup import Setup
from camcomp.gcode.state import ControlState
from camcomp.gcode.text import Text
from camcomp.gcode.words import Word
from camcomp.ground.errors import ProgramError


class Block:
    """Words of one line, sorted by function."""

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

    def code(self, group: int) -> int | None:
        """Code of a modal group in this block, or None."""
        found = self.groups.get(group)
        return found[0] if found else None

    def number(self, letter: str) -> float | None:
        """Value of a word, marked as used; None for a missing word."""
        word = self.words.get(letter)
        if word is None:
            return None
        self.used.add(letter)
        return word.value


class BlockReader:
    """Builds blocks from words; shared state of the interpreter, and its interface for the flow of lines."""

    straight = True  # no loops, subprograms, parameters: each line was executed at most once, unchanged

    def __init__(self, text: Text, setup: Setup, dialect: Dialect) -> None:
        self.text = text
        self.dialect = dialect
        self.state = ControlState(setup, dialect)
        self.record = Recorder(text)
        self.warnings: list[str] = []
        self.rebases: list[Rebase] = []
        self.block = Block(0)
        self._warned: set[str] = set()
        self._groups = dialect.groups
        self._refused = dialect.refused

    def warn(self, message: str, once: bool = False) -> None:
        """Keep a warning, with the line of the current block."""
        if once:
            if message in self._warned:
                return
            self._warned.add(message)
        self.warnings.append(f"{self.text.name}:{self.text.place(self.block.row).line}: {message}")

    def refuse(self, rule: str, message: str, word: Word | None = None, hint: str | None = None) -> NoReturn:
        """Raise a ProgramError at a word of the current block."""
        column = word.begin if word else self.block.column
        raise ProgramError(rule, message, at=self.text.place(self.block.row, column), hint=hint)

    def forget_cycle(self, series: bool = True) -> None:
        """Forget the words of the canned cycle in force; series: also the height at which its series began."""
        raise NotImplementedError

    def perform(self, block: Block) -> bool:
        """Execute a block; True when it ends the program."""
        raise NotImplementedError

    def sort(self, row: int, words: list[Word]) -> Block:
        """Block of the words, each letter once and each modal group once."""
        block = self.block = Block(row)
        if words and words[0].letter == "N":
            words = words[1:]
        if words:
            block.column = words[0].begin
        for word in words:
            letter = word.letter
            if letter == "G":
                self._sort_g(block, word)
            elif letter == "M":
                self._sort_m(block, word)
            elif letter == "O":
                if len(words) > 1:
                    self.refuse("CC103", "a program number stands alone on its line", word)
            elif letter == "N":
                self.refuse("CC104", "a line number stands at the start of its line", word)
            elif letter in block.words:
                self.refuse("CC104", f"two {letter} words in one block", word)
            else:
                if not math.isfinite(word.value):
                    self.refuse("CC138", f"{letter} has no finite value", word)
                block.words[letter] = word
        block.axes = [axis for axis in range(3) if "XYZ"[axis] in block.words]
        return block

    def _sort_g(self, block: Block, word: Word) -> None:
        tenths = word.value * 10.0
        if not 0.0 <= tenths < 1e6 or abs(tenths - round(tenths)) > 1e-4:
            self.refuse("CC106", f"G{word.value:g} is not a code", word)
        code = round(tenths)
        block.g.append((code, word))
        if code in self.dialect.passed or (code in CANCELS and code not in self.dialect.without):
            return
        if code in self._refused and code not in self.dialect.without:
            rule, what = self._refused[code]
            self.refuse(rule, f"{code_name(code)} is {what}", word)
        group = self._groups.get(code)
        if group is None:
            known = f"{self.dialect.title} as camcomp knows it" if code in self.dialect.without else "camcomp"
            self.refuse("CC106", f"{named(code_name(code))} is not a code that {known} has", word)
        if group == 1 and group in block.groups and 800 in (code, block.groups[1][0]):
            # `G0 G80` ends a cycle and continues with G0.
            if code != 800:
                block.groups[1] = (code, word)
            return
        if group in block.groups:
            other = named(code_name(block.groups[group][0]))
            self.refuse("CC105", f"{named(code_name(code))} and {other} exclude each other in one block", word)
        block.groups[group] = (code, word)

    def _sort_m(self, block: Block, word: Word) -> None:
        if not 0.0 <= word.value < 1e6 or abs(word.value - round(word.value)) > 1e-4:
            self.refuse("CC106", f"M{word.value:g} is not a code", word)
        code = round(word.value)
        if code in SAVES:
            self.refuse("CC135", f"M{code} saves or restores modes, which camcomp does not follow", word)
        if code in CALLS_M:
            self.refuse("CC124", f"M{code} calls or returns, which this dialect does not do", word)
        group = GROUPS_M.get(code)
        for other, _ in block.m:
            if group is not None and GROUPS_M.get(other) == group:
                self.refuse(
                    "CC105", f"{named(f'M{code}')} and {named(f'M{other}')} exclude each other in one block", word
                )
        if code not in KNOWN_M and code not in self.dialect.ends:
            self.warn(f"M{code} is passed on; camcomp takes it not to move anything", once=True)
        block.m.append((code, word))
