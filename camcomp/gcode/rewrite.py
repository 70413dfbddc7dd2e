"""Writes a program with other end points: only the words that have to change do, everything else keeps its bytes.

The writer follows the control through its own output: where the tool stands after rounding, and which motion code and
feed are in force. So a word is written exactly where the control would otherwise do something else.
"""

import math

import numpy as np

from camcomp.datatypes import ARC, RAPID
from camcomp.diagnostics import ProgramError
from camcomp.gcode.arcplan import Move, Point, plan, turns_of
from camcomp.gcode.arcs import PLANES, ArcError, centre_of_radius
from camcomp.gcode.edits import Edits
from camcomp.gcode.flatten import flatten
from camcomp.gcode.numbers import decimals, plain, significant
from camcomp.gcode.output import Output, Rewritten
from camcomp.gcode.program import F, G, P, Program, R, Rebase
from camcomp.gcode.stamp import stamp_index, stamp_line
from camcomp.gcode.text import Text

_FEED_SLACK = 1.0e-3
_SHAPE_WORDS = (0, 1, 2, 3, 4, 5, R, P)  # words that say where a motion goes
_BLANKS = " \t"


def rewrite(program: Program, out: Output, *, resolution_mm: float, version: str) -> Rewritten:
    """The program with the moves of `out`, rounded to `resolution_mm`, and stamped.

    A motion with one row that ends where it was programmed (within half a resolution) keeps its bytes, as do moves in
    machine coordinates and moves before X, Y and Z are all known. Raises ProgramError CC137 where a line does too much
    at once to be written anew.
    """
    stamp = stamp_line(program.data, version, *program.language.comment)
    if unchanged(program, out, resolution_mm):
        data = _stamped(program.text, Edits(), stamp)
        line = program.path.line[out.motion] + 1
        return Rewritten(data=data, end=program.path.end[out.motion], line=line)
    if not program.straight:
        program = flatten(program, resolution_mm)
    writer = Writer(program, out, resolution_mm)
    writer.run()
    return Rewritten(data=_stamped(program.text, writer.edits, stamp), end=writer.ends, line=writer.lines + 2)


def _stamped(text: Text, edits: Edits, stamp: str) -> bytes:
    edits.insert(stamp_index(text), stamp + text.end_of_line(0), first=True)
    return text.encode(edits.apply(text.string))


def unchanged(program: Program, out: Output, resolution_mm: float) -> bool:
    """True when `out` asks for the program as it is, within half a resolution and 0.1 % of the feed."""
    path, half = program.path, 0.5 * resolution_mm * (1.0 + 1e-9)
    if len(out.motion) != len(path) or (out.motion != np.arange(len(path))).any() or (out.kind != path.kind).any():
        return False
    free = path.known & ~path.machine
    if (np.abs(out.end - path.end)[free] > half).any():
        return False
    arcs = free & (path.kind == ARC)
    bent = np.abs(out.centre - path.centre)[arcs] * (1.0 - path.axis[arcs])
    if not (bent <= half).all() or (np.abs(out.angle - path.angle)[arcs] > 1e-9).any():
        return False
    fed = free & (path.kind != RAPID) & ~np.isnan(out.feed)
    return bool((np.abs(out.feed - path.feed)[fed] <= _FEED_SLACK * path.feed[fed]).all())


class Writer:
    """Goes through the motions in order and collects the edits."""

    def __init__(self, program: Program, out: Output, resolution_mm: float) -> None:
        self.program, self.out = program, out
        self.text, self.sites, self.path = program.text, program.sites, program.path
        self.edits = Edits()
        self.resolution = resolution_mm
        self.turns = program.language.writes_turns
        self.half = 0.5 * resolution_mm * (1.0 + 1e-9)
        self.position: Point = self.path.start[0].tolist()
        self.code: int | None = None  # motion code in force in the output
        self.feed: tuple[int, float] | None = None  # feed mode and value in force in the output
        self.inserted = 0  # new lines so far
        self.ends = np.empty((len(out.motion), 3))
        self.lines = np.empty(len(out.motion), np.int64)
        self.k = 0

    def run(self) -> None:
        """Fill `edits`, `ends` (N, 3) and `lines` (N,), which counts from 0 and without the stamp."""
        n = len(self.path)
        bounds = np.searchsorted(self.out.motion, np.arange(n + 1)).tolist()
        rebases = list(self.program.rebases)
        for k in range(n):
            while rebases and rebases[0].motion <= k:
                self._rebase(rebases.pop(0))
            if bounds[k] == bounds[k + 1]:
                raise ValueError(f"Output has no row for motion {k}")
            self._motion(k, bounds[k], bounds[k + 1])
        for each in rebases:
            self._rebase(each)

    # --- one motion --------------------------------------------------------------------------------------------

    def _motion(self, k: int, first: int, last: int) -> None:
        sites, path, out = self.sites, self.path, self.out
        self.k = k
        self.row = int(sites.row[k])
        self.begin, self.finish = sites.begin[k].tolist(), sites.finish[k].tolist()
        self.unit, self.offset = float(sites.unit[k]), sites.offset[k].tolist()
        self.relative = bool(sites.relative[k])
        self.digits = decimals(self.resolution, self.unit)
        self.fresh: list[str] = []  # words to append to the line
        # What the text stated since the previous motion is in force, or is about to be.
        if sites.code_stated[k]:
            self.code = None if self.begin[G] >= 0 else int(sites.code[k])
        if sites.feed_stated[k]:
            self.feed = None if self.begin[F] >= 0 else self._programmed_feed()
        if not path.known[k] or path.machine[k] or sites.code[k] < 0:
            self._pass(first, last)
            return
        if sites.fixed[k] and not self._is_same(first, last):
            self._refuse("several motions stand in this line")
        rows = range(first, last)
        if sites.stops[k]:
            main = last - 1
        else:
            main = next((row for row in rows if not out.joining[row]), first)
        if main > first and sites.modes_changed[k]:
            if sites.stops[k]:
                self._refuse("the line changes a mode and stops the program")
            self._strip()
            for row in rows:
                self._write(row, new=True, after=True)
            return
        for row in range(first, main):
            self._write(row, new=True, after=False)
        self._write(main, new=False, after=True)
        for row in range(main + 1, last):
            self._write(row, new=True, after=True)

    def _refuse(self, why: str) -> None:
        raise ProgramError("CC137", f"the motion has to be replaced, and {why}", at=self.text.place(self.row))

    def _is_same(self, first: int, last: int) -> bool:
        shift = np.abs(self.out.end[first] - self.path.end[self.k]).max()
        start = np.abs(np.array(self.position) - self.path.start[self.k]).max()
        return last - first == 1 and max(shift, start) <= self.half

    def _pass(self, first: int, last: int) -> None:
        """Keep the line as it is, and follow the control through it."""
        k = self.k
        start, end = self.path.start[k], self.path.end[k]
        if self.sites.code[k] >= 0:
            self._code_on_line(int(self.sites.code[k]))
        if self.path.kind[k] != RAPID and self.sites.feed_mode[k] != 93:
            self._feed_on_line(math.nan, 0.0)
        for axis in range(3):
            if self.sites.moved[k, axis]:
                # Of G28, the point on the way (code -1) obeys G91; home does not, and neither does G53.
                obeys = self.sites.code[k] == -1 or not self.path.machine[k]
                if self.relative and obeys:
                    self.position[axis] += end[axis] - start[axis]
                else:
                    self.position[axis] = float(end[axis])
        self._append()
        self.ends[first:last] = self.position
        self.lines[first:last] = self.row + self.inserted

    def _strip(self) -> None:
        """Take the motion out of its line; what else the line says stays."""
        gone = [*_SHAPE_WORDS, G] + ([F] if self.sites.feed_mode[self.k] == 93 else [])
        for word in gone:
            self._remove(word)
        if self.begin[F] >= 0 and self.sites.feed_mode[self.k] != 93:
            self.feed = self._programmed_feed()
        self.code = None

    # --- one row -----------------------------------------------------------------------------------------------

    def _write(self, row: int, new: bool, after: bool) -> None:
        out = self.out
        kind = int(out.kind[row])
        moves = [Move(kind, out.end[row].tolist(), out.centre[row].tolist(), float(out.angle[row]))]
        if kind == ARC:
            plane = int(self.sites.plane[self.k])
            end = self._landing(moves[0].end, new)
            moves = plan(self.position, moves[0], end, plane, self.resolution, self.unit, self.turns)
        at_line = 0
        if not new and self.sites.stops[self.k]:
            at_line = len(moves) - 1
        for number, each in enumerate(moves):
            if new:
                self._line(each, row, before=not after)
            elif number == at_line:
                self._in_place(each, row)
            else:
                self._line(each, row, before=number < at_line)
        self.ends[row] = self.position

    def _landing(self, point: Point, new: bool) -> Point:
        """Where the control goes for `point`: to the rounded words, or where no word has to change, as it was."""
        k, here = self.k, self.position
        base = here if self.relative else self.offset
        end = []
        for axis in range(3):
            stays = here[axis]
            if not new and self.begin[axis] >= 0:
                programmed = float(self.path.end[k, axis])
                stays = stays + programmed - float(self.path.start[k, axis]) if self.relative else programmed
            if abs(stays - point[axis]) > self.half:
                stays = base[axis] + round((point[axis] - base[axis]) / self.unit, self.digits) * self.unit
            end.append(stays)
        return end

    def _line(self, move: Move, row: int, before: bool) -> None:
        """A move on a line of its own, before or after the motion's line."""
        words = []
        code = self._code_of(move)
        if code != self.code:
            words.append(f"G{code}")
            self.code = code
        start, end = self.position, self._landing(move.end, new=True)
        axes = [axis for axis in range(3) if end[axis] != start[axis]]
        if not axes and move.kind != ARC:
            # A move of its own has a word, and the word may lead half a step away.
            axes = [0]
            end[0] = start[0] if self.relative else self.offset[0] + self._value(start, 0) * self.unit
        words += ["XYZ"[axis] + self._number(self._value(end, axis)) for axis in axes]
        if move.kind == ARC:
            words += self._centre_words(move)
        if move.kind != RAPID:
            words += self._feed_words(float(self.out.feed[row]), self._length(move, start, end))
        slash = "/" if self.text.line(self.row).lstrip(_BLANKS).startswith("/") else ""
        string = slash + self._gap().join(map(self._cased, words))
        eol = self.text.end_of_line(self.row)
        if before:
            self.edits.insert(int(self.text.starts[self.row]), string + eol)
            self.lines[row] = self.row + self.inserted
        else:
            self.edits.insert(int(self.text.ends[self.row]), eol + string)
            self.lines[row] = self.row + self.inserted + 1
        self.inserted += 1
        self.position = end

    def _in_place(self, move: Move, row: int) -> None:
        """The move on the motion's own line."""
        k = self.k
        start, end = self.position, self._landing(move.end, new=False)
        self._code_on_line(self._code_of(move))
        for axis in range(3):
            stays = start[axis]
            if self.begin[axis] >= 0:
                programmed = float(self.path.end[k, axis])
                stays = stays + programmed - float(self.path.start[k, axis]) if self.relative else programmed
            if end[axis] == stays:
                continue
            number = self._number(self._value(end, axis))
            if self.begin[axis] >= 0:
                self._replace(axis, number)
            else:
                self.fresh.append("XYZ"[axis] + number)
        if move.kind == ARC:
            self._centre_on_line(move, start, end)
        elif self.path.kind[k] == ARC:
            for word in (3, 4, 5, R, P):
                self._remove(word)
        if move.kind != RAPID:
            self._feed_on_line(float(self.out.feed[row]), self._length(move, start, end))
        self._append()
        self.position = end
        self.lines[row] = self.row + self.inserted

    # --- arcs --------------------------------------------------------------------------------------------------

    def _centre_value(self, move: Move, axis: int) -> float:
        base = self.offset[axis] if self.sites.centre_absolute[self.k] else self.position[axis]
        return round((move.centre[axis] - base) / self.unit, self.digits)

    def _centre_words(self, move: Move) -> list[str]:
        u, v, _ = PLANES[int(self.sites.plane[self.k])]
        words = ["IJK"[axis] + self._number(self._centre_value(move, axis)) for axis in sorted((u, v))]
        turns = turns_of(move.angle)
        return words + ([f"P{turns}"] if turns > 1 else [])

    def _radius_holds(self, move: Move, start: Point, end: Point, plane: tuple[int, int]) -> bool:
        """Whether the R word of the line leads to the centre that is wanted."""
        number = self.text.string[self.begin[R] + 1 : self.finish[R]].rpartition("=")[2].lstrip("rR ")
        a, b = ((point[plane[0]] / self.unit, point[plane[1]] / self.unit) for point in (start, end))
        try:
            centre = centre_of_radius(a, b, float(number), move.angle > 0.0, self.unit != 1.0)
        except (ArcError, ValueError):
            return False
        return all(
            abs(found * self.unit - move.centre[axis]) <= self.half for found, axis in zip(centre, plane, strict=True)
        )

    def _centre_on_line(self, move: Move, start: Point, end: Point) -> None:
        k = self.k
        u, v, _ = PLANES[int(self.sites.plane[k])]
        was_arc = int(self.path.kind[k]) == ARC
        if self.begin[R] >= 0:
            if self._radius_holds(move, start, end, (u, v)):
                return
            self._remove(R)
        for axis in sorted((u, v)):
            letter = 3 + axis
            if was_arc and self.begin[R] < 0:
                stays = float(self.path.centre[k, axis])
                if not self.sites.centre_absolute[k]:
                    stays += start[axis] - self.path.start[k, axis]
                if abs(stays - move.centre[axis]) <= self.half:
                    continue
            number = self._number(self._centre_value(move, axis))
            if self.begin[letter] >= 0:
                self._replace(letter, number)
            else:
                self.fresh.append("IJK"[axis] + number)
        turns = turns_of(move.angle)
        if self.begin[P] >= 0 and turns != turns_of(float(self.path.angle[k])):
            if turns > 1:
                self._replace(P, str(turns))
            else:
                self._remove(P)
        elif self.begin[P] < 0 and turns > 1:
            self.fresh.append(f"P{turns}")

    # --- feed and motion code ----------------------------------------------------------------------------------

    def _code_of(self, move: Move) -> int:
        if move.kind == ARC:
            return 3 if move.angle > 0.0 else 2
        return 0 if move.kind == RAPID else 1

    def _code_on_line(self, code: int) -> None:
        if self.begin[G] >= 0:
            if code != self.sites.code[self.k]:
                width = self.finish[G] - self.begin[G] - 1
                self._replace(G, f"{code:0{min(width, 2)}d}")
        elif self.code != code:
            first = min(self.begin[word] for word in (*_SHAPE_WORDS, F) if self.begin[word] >= 0)
            self.edits.insert(first, self._cased(f"G{code}") + self._gap())
        self.code = code

    def _programmed_feed(self) -> tuple[int, float] | None:
        mode, feed = int(self.sites.feed_mode[self.k]), float(self.sites.modal_feed[self.k])
        return None if math.isnan(feed) else (mode, feed)

    def _wanted_feed(self, feed: float, length: float) -> tuple[int, float]:
        """Feed mode and value (G94 mm/min, G95 mm/rev, G93 1/min) for a tip speed in mm/min."""
        mode = int(self.sites.feed_mode[self.k])
        feed = float(self.path.feed[self.k]) if math.isnan(feed) else feed
        if math.isnan(feed):
            raise ValueError(f"Output row of motion {self.k}: a cut in the place of a rapid needs a feed")
        if mode == 93:
            return mode, feed / length if length > 1e-6 else float(self.sites.modal_feed[self.k])
        return mode, feed / float(self.path.speed[self.k]) if mode == 95 else feed

    def _feed_words(self, feed: float, length: float) -> list[str]:
        """F word for a new line, where the feed in force is another one."""
        mode, value = self._wanted_feed(feed, length)
        held = self.feed[1] if mode != 93 and self.feed is not None and self.feed[0] == mode else math.inf
        if abs(value - held) <= _FEED_SLACK * held and held < math.inf:
            return []
        self.feed = None if mode == 93 else (mode, value)
        return ["F" + significant(value if mode == 93 else value / self.unit)]

    def _feed_on_line(self, feed: float, length: float) -> None:
        if self.begin[F] < 0:
            self.fresh += self._feed_words(feed, length)
            return
        mode, programmed = int(self.sites.feed_mode[self.k]), float(self.sites.modal_feed[self.k])
        value = self._wanted_feed(feed, length)[1]
        if abs(value - programmed) <= _FEED_SLACK * programmed:
            value = programmed
        else:
            self._replace(F, significant(value if mode == 93 else value / self.unit))
        self.feed = None if mode == 93 else (mode, value)

    def _length(self, move: Move, start: Point, end: Point) -> float:
        if move.kind != ARC:
            return math.dist(start, end)
        u, v, w = PLANES[int(self.sites.plane[self.k])]
        radius = math.hypot(start[u] - move.centre[u], start[v] - move.centre[v])
        return math.hypot(radius * move.angle, end[w] - start[w])

    # --- numbers and words -------------------------------------------------------------------------------------

    def _value(self, point: Point, axis: int) -> float:
        """Number of the word that leads to `point` from the present position."""
        base = self.position[axis] if self.relative else self.offset[axis]
        return round((point[axis] - base) / self.unit, self.digits)

    def _number(self, value: float) -> str:
        return plain(value, self.digits)

    def _cased(self, word: str) -> str:
        lower = any(self.begin[each] >= 0 and self.text.string[self.begin[each]].islower() for each in _SHAPE_WORDS)
        return word.lower() if lower else word

    def _gap(self) -> str:
        """What stands between the words of this line: nothing in packed lines, else a blank."""
        string, starts = self.text.string, [each for each in self.begin if each >= 0]
        line = int(self.text.starts[self.row])
        packed = any(each > line and string[each - 1].isdigit() for each in starts)
        return "" if packed else " "

    def _replace(self, word: int, new: str) -> None:
        self.edits.replace(self.begin[word] + 1, self.finish[word], new)

    def _remove(self, word: int) -> None:
        begin = self.begin[word]
        if begin < 0:
            return
        floor = int(self.text.starts[self.row])
        while begin > floor and self.text.string[begin - 1] in _BLANKS:
            begin -= 1
        self.edits.replace(begin, self.finish[word], "")

    def _append(self) -> None:
        """Add the new words behind the last word of the motion."""
        if self.fresh:
            last = max(self.finish[word] for word in (*_SHAPE_WORDS, G) if self.finish[word] >= 0)
            gap = self._gap()
            self.edits.insert(last, "".join(gap + self._cased(word) for word in self.fresh))
            self.fresh = []

    # --- statements that depend on the position ----------------------------------------------------------------

    def _rebase(self, rebase: Rebase) -> None:
        """G92 and its like set an offset from where the tool stands: state where it stands now."""
        if rebase.motion:
            programmed = self.path.end[rebase.motion - 1]
        else:
            programmed = self.path.start[0]
        moved = [self.position[axis] - float(programmed[axis]) for axis in range(3)]
        if not rebase.axes and max(map(abs, moved)) > 0.0:
            raise ProgramError(
                "CC137", "a corrected position would be stored as home position", at=self.text.place(rebase.row)
            )
        digits = decimals(self.resolution, rebase.unit) + 4
        for axis, begin, finish in rebase.axes:
            if abs(moved[axis]) > 1e-9:
                value = rebase.value[axis] + moved[axis] / rebase.unit
                self.edits.replace(begin + 1, finish, plain(value, digits))
