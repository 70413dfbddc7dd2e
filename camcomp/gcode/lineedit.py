"""Editing of one line of the program: its words, feed and motion code in force, and the new numbers."""

import math

from camcomp.gcode.arcplan import Move, Point, turns_of
from camcomp.gcode.arcs import PLANES, sweep
from camcomp.gcode.edits import Edits
from camcomp.gcode.numbers import plain, significant
from camcomp.gcode.output import FEED_SLACK
from camcomp.gcode.program import A, B, C, F, G, I, J, K, P, Program, R, X, Y, Z
from camcomp.ground import orientation
from camcomp.ground.datatypes import ARC, RAPID

TURNS = (A, B, C)
SHAPE_WORDS = (X, Y, Z, I, J, K, R, P, *TURNS)  # words that define the geometry of a motion
BLANKS = " \t"
TURN_DIGITS = {orientation.RPY: 6, orientation.VECTOR: 9}  # 0.02 urad and less


class LineEditor:
    """Tracks the state of the controller through the output, and changes words in the line of one motion at a time."""

    def __init__(self, program: Program, resolution_mm: float) -> None:
        self.program = program
        self.text, self.sites, self.path = program.text, program.sites, program.path
        self.edits = Edits()
        self.resolution = resolution_mm
        self.position: Point = self.path.start[0].tolist()
        self.form = self.path.orientation.form if self.path.orientation is not None else orientation.RPY
        self.turned = list(orientation.UPRIGHT[self.form])  # words of the orientation in force in the output
        self.code: int | None = None  # motion code in force in the output
        self.feed: tuple[int, float] | None = None  # feed mode and value in force in the output

    def open(self, k: int) -> None:
        """Turn to the line of motion `k`."""
        sites = self.sites
        self.k = k
        self.row = int(sites.row[k])
        self.begin: list[int] = sites.begin[k].tolist()
        self.finish: list[int] = sites.finish[k].tolist()
        self.unit, self.offset = float(sites.unit[k]), sites.offset[k].tolist()
        self.feed_unit = float(sites.feed_unit[k])
        self.relative = bool(sites.relative[k])
        self.digits = self.program.language.digits(self.resolution, self.unit)
        self.step = self.program.language.step_mm(self.resolution, self.unit)
        self.half = 0.5 * self.step * (1.0 + 1e-9)
        self.fresh: list[str] = []  # words to append to the line
        # Codes stated since the previous motion are in force, or will be.
        if sites.code_stated[k]:
            self.code = None if self.begin[G] >= 0 else int(sites.code[k])
        if sites.feed_stated[k]:
            cuts = self.path.kind[k] != RAPID  # the F word of a rapid is kept
            self.feed = None if self.begin[F] >= 0 and cuts else self._programmed_feed()

    def _strip(self) -> None:
        """Remove the words of the motion from its line, and keep the others."""
        gone = [*SHAPE_WORDS, G] + ([F] if self.sites.feed_mode[self.k] == 93 else [])
        for word in gone:
            self._remove(word)
        if self.begin[F] >= 0 and self.sites.feed_mode[self.k] != 93:
            self.feed = self._programmed_feed()
        self.code = None

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
            first = min(self.begin[word] for word in (*SHAPE_WORDS, F) if self.begin[word] >= 0)
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

    def _feed_number(self, mode: int, value: float) -> str:
        return significant(value if mode == 93 else value / self.feed_unit, point=self.program.feed_point)

    def _feed_words(self, feed: float, length: float) -> list[str]:
        """F word for a new line, if the feed in force differs."""
        mode, value = self._wanted_feed(feed, length)
        held = self.feed[1] if mode != 93 and self.feed is not None and self.feed[0] == mode else math.inf
        if abs(value - held) <= FEED_SLACK * held and held < math.inf:
            return []
        self.feed = None if mode == 93 else (mode, value)
        return ["F" + self._feed_number(mode, value)]

    def _feed_on_line(self, feed: float, length: float) -> None:
        if self.begin[F] < 0:
            self.fresh += self._feed_words(feed, length)
            return
        mode, programmed = int(self.sites.feed_mode[self.k]), float(self.sites.modal_feed[self.k])
        value = self._wanted_feed(feed, length)[1]
        if abs(value - programmed) <= FEED_SLACK * programmed:
            value = programmed
        else:
            self._replace(F, self._feed_number(mode, value))
        self.feed = None if mode == 93 else (mode, value)

    def _length(self, move: Move, start: Point, end: Point) -> float:
        if move.kind != ARC:
            return math.dist(start, end)
        u, v, w = PLANES[int(self.sites.plane[self.k])]
        radius = math.hypot(start[u] - move.centre[u], start[v] - move.centre[v])
        # The sweep for the controller, which differs from the requested one if the arc starts elsewhere.
        a, b, c = ((point[u], point[v]) for point in (start, end, move.centre))
        angle = sweep(a, b, c, move.angle > 0.0, turns_of(move.angle))
        return math.hypot(radius * angle, end[w] - start[w])

    # --- numbers and words -------------------------------------------------------------------------------------

    def _value(self, point: Point, axis: int) -> float:
        """Number of the word for `point` from the present position."""
        base = self.position[axis] if self.relative else self.offset[axis]
        return round((point[axis] - base) / self.unit, self.digits)

    def _number(self, value: float) -> str:
        return plain(value, self.digits)

    def _turn_words(self, wanted: list[float], in_place: bool) -> list[str]:
        """Words for the orientation `wanted` (3), rounded; those of the line are replaced."""
        relative = self.relative and self.form == orientation.RPY
        ends = (
            [float(each) for each in self.path.orientation.end[self.k]]
            if self.path.orientation is not None
            else self.turned
        )
        starts = (
            [float(each) for each in self.path.orientation.start[self.k]]
            if self.path.orientation is not None
            else self.turned
        )
        digits, words = self.turn_digits, []
        half = 0.5 * 10.0**-digits * (1.0 + 1e-9)
        goes = list(self.turned)
        for axis in range(3):
            if in_place and self.begin[TURNS[axis]] >= 0:
                goes[axis] = self.turned[axis] + ends[axis] - starts[axis] if relative else ends[axis]
        fresh = [abs(now - then) > half for now, then in zip(goes, wanted, strict=True)]
        if self.form == orientation.VECTOR and any(fresh):
            fresh = [True] * 3  # a direction is one value
        for axis, letter in enumerate(orientation.LETTERS[self.form]):
            if not fresh[axis]:
                continue
            base = self.turned[axis] if relative else 0.0
            value = round(wanted[axis] - base, digits)
            goes[axis] = base + value
            text = f"{letter}={plain(value, digits)}" if len(letter) > 1 else letter + plain(value, digits)
            if in_place and self.begin[TURNS[axis]] >= 0:
                self.edits.replace(self.begin[TURNS[axis]], self.finish[TURNS[axis]], self._cased(text))
            else:
                words.append(text)
        self.turned = goes
        return words

    @property
    def turn_digits(self) -> int:
        """Decimals of an angle in degrees, or of a component of a direction."""
        return min(TURN_DIGITS[self.form], self.program.language.decimals_max)

    def _cased(self, word: str) -> str:
        lower = any(self.begin[each] >= 0 and self.text.string[self.begin[each]].islower() for each in SHAPE_WORDS)
        return word.lower() if lower else word

    def _gap(self) -> str:
        """Separator between the words of this line: empty in packed lines, else a blank."""
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
        while begin > floor and self.text.string[begin - 1] in BLANKS:
            begin -= 1
        self.edits.replace(begin, self.finish[word], "")

    def _append(self) -> None:
        """Add the new words behind the last word of the motion."""
        if self.fresh:
            last = max(self.finish[word] for word in (*SHAPE_WORDS, G) if self.finish[word] >= 0)
            gap = self._gap()
            self.edits.insert(last, "".join(gap + self._cased(word) for word in self.fresh))
            self.fresh = []
