"""Rewriting of a program with new end points; all characters except the changed words keep their bytes.

The writer tracks the state of the controller through its own output: rounded position, motion code and feed in force. A
word is written exactly if the controller would otherwise move differently.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from camcomp.gcode.arcplan import Move, Point, plan, turns_of
from camcomp.gcode.arcs import PLANES, SAME_POINT, ArcError, centre_of_radius
from camcomp.gcode.edits import Edits
from camcomp.gcode.flatten import flatten
from camcomp.gcode.lineedit import BLANKS, LineEditor
from camcomp.gcode.numbers import decimals, plain
from camcomp.gcode.output import Output, Part, Rewritten, Standing
from camcomp.gcode.program import I, J, K, P, Program, R, Rebase
from camcomp.gcode.robot_writer import rewrite_robot_program
from camcomp.gcode.stamp import stamp_index, stamp_line
from camcomp.gcode.text import Text
from camcomp.ground.datatypes import ARC, RAPID, Floats, Ints
from camcomp.ground.errors import ProgramError

if TYPE_CHECKING:
    from camcomp.gcode.linear_writer import LinearWriter

MIN_MOTIONS = 256  # of a program that is searched for runs of linear motions
MIN_RUN = 4  # motions; shorter runs are written one by one


def rewrite(
    program: Program, out: Output, *, resolution_mm: float, version: str, part: Part | None = None, model: str = ""
) -> Rewritten:
    """Write the moves of `out`, rounded to `resolution_mm`, into the program, with a stamp.

    A motion with one row that ends at its programmed point (within half a resolution) keeps its bytes, as do moves in
    machine coordinates and moves before X, Y and Z are all known. model: hash of machine and process. part: only these
    motions are written, without a stamp. Raises ProgramError CC137 for a line with too many functions to be rewritten.
    """
    if program.language.robot is not None:
        return rewrite_robot_program(program, out, resolution_mm=resolution_mm, version=version, model=model)
    if part is not None:
        writer = Writer(program, out, resolution_mm)
        behind = writer.run_part(part)
        data = program.text.encode(writer.edits.apply(program.text.string))
        return Rewritten(
            data=data, end=writer.ends, line=writer.lines + 1, centre=writer.centres, feed=writer.feeds, behind=behind
        )
    stamp = stamp_line(program.data, version, *program.language.comment, model)
    if out.repeats(program.path, resolution_mm):
        data = _stamped(program.text, Edits(), stamp)
        line = program.path.line[out.motion] + 1
        return Rewritten(
            data=data, end=program.path.end[out.motion], line=line, centre=program.path.centre[out.motion],
            feed=program.path.feed[out.motion],
        )  # fmt: skip
    if not program.straight:
        program = flatten(program, resolution_mm)
    writer = Writer(program, out, resolution_mm)
    writer.run()
    data = _stamped(program.text, writer.edits, stamp)
    return Rewritten(
        data=data, end=writer.ends, line=writer.lines + 2, centre=writer.centres, feed=writer.feeds, words=writer.words
    )


def _stamped(text: Text, edits: Edits, stamp: str) -> bytes:
    edits.insert(stamp_index(text), stamp + text.end_of_line(0), first=True)
    return text.encode(edits.apply(text.string))


class Writer(LineEditor):
    """Writer that collects the edits of all motions in order."""

    def __init__(self, program: Program, out: Output, resolution_mm: float) -> None:
        super().__init__(program, resolution_mm)
        self.out = out
        self.turns = program.language.writes_turns
        self.inserted = 0  # new lines so far
        self._runs: LinearWriter | None = None
        self.ours = ""  # path mode written by this writer and in force; empty: the program's
        self.stated = program.setup.path_mode  # last one of the program
        self.ends = np.empty((len(out.motion), 3))
        self.lines = np.empty(len(out.motion), np.int64)
        self.centres = np.full((len(out.motion), 3), np.nan)
        self.feeds = np.full(len(out.motion), np.nan)
        self.words = None if out.words is None else np.empty((len(out.motion), 3))

    def run(self) -> None:
        """Fill `edits`, `ends` (N, 3) and `lines` (N,), which counts from 0 and without the stamp."""
        n = len(self.path)
        bounds = np.searchsorted(self.out.motion, np.arange(n + 1))
        if (np.diff(bounds) == 0).any():
            raise ValueError(f"Output has no row for motion {int(np.argmin(np.diff(bounds)))}")
        rebases = list(self.program.rebases)
        self._find_runs(bounds)
        k = 0
        while k < n:
            while rebases and rebases[0].motion <= k:
                self._rebase(rebases.pop(0))
            k = self._advance(k, n, bounds)
        for each in rebases:
            self._rebase(each)

    def run_part(self, part: Part) -> Standing:
        """Fill `edits` for some motions, and `ends` (N, 3) for all rows; return the state of the controller after them."""
        bounds = np.concatenate(([0], np.cumsum(np.bincount(self.out.motion, minlength=len(self.path)))))
        self.ends[:] = self.out.end
        self.lines[:] = 0
        if bounds[part.first]:
            self.ends[bounds[part.first] - 1] = part.before.position
        self.position, self.code, self.feed = [*part.before.position], part.before.code, part.before.feed
        self.stated, self.ours = part.before.stated or self.stated, part.before.ours
        self._find_runs(bounds)
        k = part.first
        while k < part.last:
            k = self._advance(k, part.last, bounds)
        x, y, z = map(float, self.position)
        return Standing((x, y, z), self.code, self.feed, self.stated, self.ours)

    # --- runs of linear motions ---------------------------------------------------------------------------------

    def _find_runs(self, bounds: Ints) -> None:
        """Load the compiled writer where the program is long enough for it."""
        if len(self.path) < MIN_MOTIONS:
            return
        from camcomp.gcode.linear_writer import LinearWriter  # loads the compiler, which short programs do not wait for

        self._runs = LinearWriter(self.program, self.out, self.resolution, bounds)

    def _advance(self, k: int, last: int, bounds: Ints) -> int:
        """Write motion k, or the run of linear motions that it begins, up to `last`; the motion behind it."""
        if self._runs is not None:
            behind = min(int(self._runs.behind[k]), last)
            if behind - k >= MIN_RUN and self._holds_mode(k, int(bounds[k])):
                self._run(k, behind, bounds)
                return behind
        self._motion(k, int(bounds[k]), int(bounds[k + 1]))
        return k + 1

    def _holds_mode(self, k: int, row: int) -> bool:
        """Whether the path mode in force is that of the row, so that no line has to state it."""
        assert self.out.rest is not None and self.out.apart is not None
        mode, apart = self.program.modes[k], self.out.apart[row]
        said = mode.apart.said(float(self.sites.unit[k])) if apart else ""
        return mode is self.stated and self.ours == (self.program.language.exact_stop if self.out.rest[row] else said)

    def _run(self, a: int, b: int, bounds: Ints) -> None:
        """Motions a to b by the compiled writer."""
        assert self._runs is not None
        self.open(a)
        feed = self.feed[1] if self.feed is not None and self.feed[0] == 94 else None
        done = self._runs.write(a, b, position=self.position, code=self.code, feed=feed, half=self.half)
        rows, sites = slice(int(bounds[a]), int(bounds[b])), self.sites
        motion, joining = self.out.motion[rows], self.out.joining[rows]
        position = np.arange(rows.start, rows.stop)
        first_own = np.full(b - a, rows.stop)
        np.minimum.at(first_own, motion[~joining] - a, position[~joining])
        main = first_own[motion - a]
        new = position != main
        before = self.inserted + np.cumsum(new) - new
        self.lines[rows] = sites.row[motion] + before + (position > main)
        self.inserted += int(new.sum())
        self.ends[rows], self.feeds[rows] = done.ends, done.feeds
        self.edits.replace(int(self.text.starts[sites.row[a]]), int(self.text.ends[sites.row[b - 1]]), done.text)
        self.position, self.code, self.feed = done.position, done.code, None if done.feed is None else (94, done.feed)

    # --- one motion --------------------------------------------------------------------------------------------

    def _motion(self, k: int, first: int, last: int) -> None:
        sites, path, out = self.sites, self.path, self.out
        self.open(k)
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

    def _is_programmed(self, arc: Move) -> bool:
        """Whether an arc equals the programmed one from its programmed start, which the controller accepts as it is."""
        path, k = self.path, self.k
        if not path.kind[k] == arc.kind == ARC or abs(arc.angle - path.angle[k]) > 1e-9:
            return False
        u, v, _ = PLANES[int(self.sites.plane[k])]
        off = [*np.subtract(arc.end, path.end[k]), *np.subtract(arc.centre, path.centre[k])[[u, v]]]
        begins = np.abs(np.subtract(self.position, path.start[k])).max() <= SAME_POINT
        return bool(begins and np.abs(off).max() <= self.half)  # so that no word changes

    def _pass(self, first: int, last: int) -> None:
        """Keep the line unchanged, and update the state of the controller."""
        k = self.k
        self._path_mode(first, behind=False)
        start, end = self.path.start[k], self.path.end[k]
        if self.sites.code[k] >= 0:
            self._code_on_line(int(self.sites.code[k]))
        if self.path.kind[k] != RAPID and self.sites.feed_mode[k] != 93:
            self._feed_on_line(math.nan, 0.0)
        # The intermediate point of G28 (code -1) obeys G91; the reference point and G53 do not.
        if self.path.machine[k] and self.sites.code[k] != -1:
            self.position = self._moved_in_machine_axes(end)
        else:
            for axis in np.flatnonzero(self.sites.moved[k]):
                by = self.position[axis] - start[axis] if self.relative else 0.0
                self.position[axis] = float(end[axis] + by)
        if self.path.orientation is not None:
            self.turned = [float(each) for each in self.path.orientation.end[k]]
        self._told_words(first, last)
        self._append()
        self.ends[first:last] = self.position
        self.feeds[first:last] = self.path.feed[k]
        self.lines[first:last] = self.row + self.inserted

    def _moved_in_machine_axes(self, end: Floats) -> Point:
        """End point, program frame, of a move in machine coordinates; axes without a word keep their positions."""
        moved, setup = self.sites.moved[self.k], self.program.setup
        if setup.rotation is None:
            return [float(end[axis]) if moved[axis] else self.position[axis] for axis in range(3)]
        way = setup.in_machine_axes([end[axis] - self.position[axis] for axis in range(3)])
        back = setup.in_program_axes([each if moved[axis] else 0.0 for axis, each in enumerate(way)])
        return [float(a + b) for a, b in zip(self.position, back, strict=True)]

    # --- one row -----------------------------------------------------------------------------------------------

    def _write(self, row: int, new: bool, after: bool) -> None:
        out = self.out
        kind = int(out.kind[row])
        moves = [Move(kind, out.end[row].tolist(), out.centre[row].tolist(), float(out.angle[row]))]
        if not new and self._is_programmed(moves[0]):
            self.centres[row] = self.path.centre[self.k]
        elif kind == ARC:
            plane = int(self.sites.plane[self.k])
            end = self._landing(moves[0].end, new)
            moves = plan(
                start=self.position, move=moves[0], end=end, plane=plane, resolution=self.step, unit=self.unit,
                turns_allowed=self.turns,
            )  # fmt: skip
            if moves[-1].kind == ARC:
                self.centres[row] = self._centre_said(moves[0])
        self._path_mode(row, behind=new and after)
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
        self._told_words(row, row + 1)
        self.feeds[row] = self._feed_held(row)

    def _told_words(self, first: int, last: int) -> None:
        if self.words is not None:
            self.words[first:last] = self.turned

    def _turning(self, row: int, in_place: bool) -> list[str]:
        """New words of the orientation for a row; empty if the program's own words remain."""
        if self.out.words is not None:
            return self._turn_words(self.out.words[row].tolist(), in_place)
        if self.path.orientation is not None:
            return self._turn_words(self.path.orientation.end[self.k].tolist(), in_place)
        return []

    def _path_mode(self, row: int, behind: bool) -> None:
        """Write an exact stop before a row that has to end at standstill, and the program's path mode before the next one.

        Rows that must not be merged get the program's mode without merging. behind: the row is on a line of its own after
        that of the motion.
        """
        out, mode = self.out, self.program.modes[self.k]
        assert out.rest is not None and out.apart is not None
        if mode is not self.stated and self.ours != self.program.language.exact_stop:
            self.ours = ""
        self.stated = mode
        apart = mode.apart.said(self.unit) if out.apart[row] else ""
        ours = self.program.language.exact_stop if out.rest[row] else apart
        if ours == self.ours:
            return
        self.ours = ours
        string = self._cased(ours or mode.said(self.unit))
        eol = self.text.end_of_line(self.row)
        if behind:
            self.edits.insert(int(self.text.ends[self.row]), eol + string)
        else:
            self.edits.insert(int(self.text.starts[self.row]), string + eol)
        self.inserted += 1

    def _feed_held(self, row: int) -> float:
        """Feed in force after a row, mm/min; NaN for rapids."""
        if self.out.kind[row] == RAPID:
            return math.nan
        mode, value = self.feed or (93, 0.0)
        if mode == 93:
            wanted = float(self.out.feed[row])
            return float(self.path.feed[self.k]) if math.isnan(wanted) else wanted
        return value * float(self.path.speed[self.k]) if mode == 95 else value

    def _landing(self, point: Point, new: bool) -> Point:
        """End point of the controller for `point`: that of the rounded words, or the programmed one if all words stay."""
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
        turning = self._turning(row, in_place=False)
        if not axes and not turning and move.kind != ARC:
            # A move of its own needs a word, whose rounding may move the point by half a step.
            axes = [0]
            end[0] = start[0] if self.relative else self.offset[0] + self._value(start, 0) * self.unit
        words += ["XYZ"[axis] + self._number(self._value(end, axis)) for axis in axes] + turning
        if move.kind == ARC:
            words += self._centre_words(move)
        if move.kind != RAPID:
            words += self._feed_words(float(self.out.feed[row]), self._length(move, start, end))
        slash = "/" if self.text.line(self.row).lstrip(BLANKS).startswith("/") else ""
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
        self.fresh += self._turning(row, in_place=True)
        if move.kind == ARC:
            self._centre_on_line(move, start, end)
        elif self.path.kind[k] == ARC:
            for word in (I, J, K, R, P):
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

    def _centre_said(self, move: Move) -> Point:
        """Centre of an arc from the present position by its rounded words."""
        out = list(move.centre)
        for axis in PLANES[int(self.sites.plane[self.k])][:2]:
            base = self.offset[axis] if self.sites.centre_absolute[self.k] else self.position[axis]
            out[axis] = base + self._centre_value(move, axis) * self.unit
        return out

    def _centre_words(self, move: Move) -> list[str]:
        u, v, _ = PLANES[int(self.sites.plane[self.k])]
        words = ["IJK"[axis] + self._number(self._centre_value(move, axis)) for axis in sorted((u, v))]
        turns = turns_of(move.angle)
        return words + ([f"P{turns}"] if turns > 1 else [])

    def _radius_holds(self, move: Move, start: Point, end: Point, plane: tuple[int, int]) -> bool:
        """Whether the R word of the line gives the requested centre."""
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
            letter = I + axis
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

    # --- statements that depend on the position ----------------------------------------------------------------

    def _rebase(self, rebase: Rebase) -> None:
        """Update the words of G92 and similar statements, whose offset depends on the position, to the new position."""
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
