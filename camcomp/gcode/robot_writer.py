"""Writes a robot program with other poses: the same statements with other numbers, and straight cuts where it bends.

The writer follows the control through its own output, so that a component is written exactly where the control would
otherwise hold another value.
"""

from __future__ import annotations

import numpy as np

from camcomp.gcode.edits import Edits
from camcomp.gcode.numbers import plain
from camcomp.gcode.output import Output, Rewritten
from camcomp.gcode.program import Program
from camcomp.gcode.robot_language import NewMove
from camcomp.gcode.robot_reader import groups
from camcomp.gcode.stamp import stamp_parts
from camcomp.ground.datatypes import ARC, Bools, Floats, Ints
from camcomp.ground.orientation import TURN, pole_free_words, rotations_of


def rewrite_robot_program(
    program: Program, out: Output, *, resolution_mm: float, version: str, model: str
) -> Rewritten:
    """The program with the moves of `out`, rounded, and stamped; a move that ends where it was programmed keeps its bytes."""
    language = program.language.robot
    assert language is not None
    writer = RobotWriter(program, out, resolution_mm)
    writer.run()
    (opening, closing), eol = language.comment, program.text.end_of_line(0)
    stamp = [
        opening + each + closing + eol for each in stamp_parts(program.data, version, model, language.comment_width)
    ]
    at = language.stamp_index(program.text)
    row = int(np.searchsorted(program.text.starts, at, side="right")) - 1 if at else 0
    writer.edits.insert(at, "".join(stamp), first=True)
    text = language.finish(writer.edits.apply(program.text.string))
    shift = 1 + len(stamp) * (writer.source_row >= row).astype(np.int64)
    return Rewritten(
        data=program.text.encode(text), end=writer.ends, line=writer.lines + shift, centre=writer.centres,
        feed=program.path.feed[out.motion], words=writer.words,
    )  # fmt: skip


class RobotWriter:
    """Goes through the moves in order and collects the edits."""

    def __init__(self, program: Program, out: Output, resolution_mm: float) -> None:
        language = program.language.robot
        turned = program.path.orientation
        assert language is not None and turned is not None and program.robot_frames is not None
        self.program, self.out, self.language, self.rigid = program, out, language, program.robot_frames
        self.text, self.path, self.sites = program.text, program.path, program.robot_moves
        self.edits = Edits()
        n = len(out.motion)
        self.digits = language.digits(program.language.digits(resolution_mm, 1.0))
        self.half = 0.5 * 10.0 ** -np.array(self.digits, float) * (1.0 + 1e-9)
        self.wanted = out.words if out.words is not None else turned.end[out.motion]
        self.numbers = self._components(out.motion, out.end, self.wanted)
        self.ends, self.words = self._led_to()
        self.centres = np.full((n, 3), np.nan)
        self.source_row = np.array([self.sites[k].row for k in out.motion], np.int64)
        self.lines = np.empty(n, np.int64)  # from 0, without the stamp
        self.inserted = 0
        self.held: Floats | None = None  # components that the control holds behind the last move; None: not known
        self.frames: tuple[int, int] | None = None

    def _components(self, motion: Ints, ends: Floats, words: Floats) -> Floats:
        """Components (N, c) of tips (N, 3) with words (N, 3), rounded as they are written."""
        out = np.empty((len(motion), len(self.language.components)))
        D = rotations_of(TURN, words)
        for base, tool, rows in groups([self.sites[k] for k in motion]):
            points, turned = self.rigid.from_program(ends[rows], D[rows], base, tool)
            near = np.array([self.sites[motion[i]].near for i in rows])
            out[rows] = self.language.values(points, turned, near)
        return np.column_stack([np.round(out[:, c], d) for c, d in enumerate(self.digits)])

    def _led_to(self) -> tuple[Floats, Floats]:
        """Tips (N, 3) and words (N, 3) to which the rounded components lead."""
        motion = self.out.motion
        ends, D = np.empty((len(motion), 3)), np.empty((len(motion), 3, 3))
        for base, tool, rows in groups([self.sites[k] for k in motion]):
            ends[rows], D[rows] = self.rigid.to_program(*self.language.poses(self.numbers[rows]), base, tool)
        words = pole_free_words(D)
        words += 360.0 * np.round((self.wanted - words) / 360.0)
        return ends, words

    def run(self) -> None:
        """Fill `edits`, `ends`, `words` and `lines`."""
        bounds = np.searchsorted(self.out.motion, np.arange(len(self.path) + 1)).tolist()
        for k in range(len(self.path)):
            first, last = bounds[k], bounds[k + 1]
            if first == last:
                raise ValueError(f"Output has no row for motion {k}")
            self._motion(k, first, last)

    def _motion(self, k: int, first: int, last: int) -> None:
        site, out = self.sites[k], self.out
        key = (id(site.base), id(site.tool))
        if key != self.frames:
            self.held, self.frames = None, key
        if self._passes(k, first, last):
            self._pass(k, first)
            return
        main = next((row for row in range(first, last) if not out.joining[row]), first)
        for row in range(first, main):
            self._line(k, row, before=True)
        move = self._new(k, main, in_place=True)
        for begin, end, new in self.language.in_place(self.text, site, move):
            self.edits.replace(begin, end, new)
        self.lines[main] = site.row + self.inserted
        for row in range(main + 1, last):
            self._line(k, row, before=False)

    def _passes(self, k: int, first: int, last: int) -> bool:
        """Whether the statement already gives the wanted values."""
        path, out, site = self.path, self.out, self.sites[k]
        if path.machine[k]:
            return True
        if last - first > 1 or out.kind[first] != path.kind[k] or (out.rest is not None and out.rest[first]):
            return False
        if path.kind[k] == ARC:
            return True  # its ends are those of the program, or it would come out as lines
        wanted = self.numbers[first]
        stays = np.abs(wanted - np.array(site.near)) <= self.half
        named = np.array([each in site.numbers for each in self.language.components])
        return bool((stays & (named | self._holds(wanted))).all())

    def _holds(self, wanted: Floats) -> Bools:
        """Components (c,) that the control holds already."""
        return np.zeros(len(wanted), np.bool_) if self.held is None else np.abs(self.held - wanted) <= self.half

    def _pass(self, k: int, row: int) -> None:
        site, orientation = self.sites[k], self.path.orientation
        assert orientation is not None
        self.ends[row], self.words[row] = self.path.end[k], orientation.end[k]
        self.centres[row] = self.path.centre[k]
        self.lines[row] = site.row + self.inserted
        self.held = None if site.said is None else np.array(site.said, float)

    def _new(self, k: int, row: int, in_place: bool) -> NewMove:
        """Words to write for a row; the control holds it from then on."""
        wanted, held = self.numbers[row], self._holds(self.numbers[row])
        fresh = ~held
        if in_place:
            fresh = np.array([each not in self.sites[k].numbers for each in self.language.components]) & ~held
        elif not fresh.any():
            fresh[0] = True  # a line of its own names something
        kind, was = int(self.out.kind[row]), int(self.path.kind[k])
        numbers = [plain(float(v), d, point=False) for v, d in zip(wanted, self.digits, strict=True)]
        self.held = wanted
        rests = self.out.rest is not None and bool(self.out.rest[row])
        changed = np.abs(wanted - np.array(self.sites[k].near)) > self.half
        return NewMove(
            keeps_kind=kind == was != ARC, numbers=numbers, fresh=fresh.tolist(), changed=changed.tolist(), rests=rests
        )

    def _line(self, k: int, row: int, before: bool) -> None:
        site = self.sites[k]
        string = self.language.line(self.text, site, self._new(k, row, in_place=False))
        eol = self.text.end_of_line(site.row)
        if before:
            self.edits.insert(int(self.text.starts[site.row]), string + eol)
            self.lines[row] = site.row + self.inserted
        else:
            self.edits.insert(int(self.text.ends[site.row]), eol + string)
            self.lines[row] = site.row + self.inserted + 1
        self.inserted += 1
