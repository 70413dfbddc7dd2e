"""Statements that move the tool tip along one line or arc, or home."""

import math

from camcomp.gcode import arcs
from camcomp.gcode.block import Block, BlockReader
from camcomp.ground.orientation import LETTERS, NEAR_POLE_DEG, RPY, VECTOR

LARGEST_MM = 1.0e7  # ten kilometres: larger coordinates are typing errors
_MOST_TURNS = 1000
_NOTHING = 1.0e-9  # mm, round-off between equal points


class Motions(BlockReader):
    """Executes the motion of a block."""

    def target(self, block: Block, machine: bool = False, turns: bool = True) -> list[float]:
        """End point of the block's axis words in the program frame; marks the axes as commanded, with turns also A, B, C."""
        state = self.state
        end = list(state.position)
        given: dict[int, float] = {}
        for axis in block.axes:
            word = block.words["XYZ"[axis]]
            value = word.value * state.unit
            if abs(value) > LARGEST_MM:
                self.refuse("CC138", f"{word.letter}{word.value:g} is out of every machine's reach", word)
            if machine:
                given[axis] = value
                continue
            if word.mode == "IC" or (state.relative and word.mode != "AC"):
                end[axis] += value
                if not state.commanded[axis]:
                    self.warn(f"{word.letter} starts with a relative move; its start counts as start_mm", once=True)
            else:
                end[axis] = value + state.offset[axis]
            state.commanded[axis] = True
        if turns:
            self._turn(block)
        return state.at_machine(given) if machine else end

    def orientation_words(self, block: Block) -> list[str]:
        """Letters of the block's words of orientation."""
        state = self.state
        if not state.setup.orients:
            return []
        return [each for each in LETTERS[state.orientation_form] if each in block.words and each not in state.table]

    def _turn(self, block: Block) -> None:
        """Set the orientation of the tool by the words of the block."""
        state, letters = self.state, self.orientation_words(block)
        if not letters:
            return
        form = state.orientation_form
        if form == VECTOR:
            self._check_vector(block, letters)
        words = list(state.turned)
        for k, letter in enumerate(LETTERS[form]):
            value = block.number(letter)
            if value is not None:
                words[k] = words[k] + value if state.relative and form == RPY else value
        size = math.hypot(*words)
        if form == VECTOR:
            words = [each / size for each in words]
        elif abs(words[1]) > NEAR_POLE_DEG:
            self.refuse(
                "CC115", f"B{words[1]:g} is near the pole, where A and C turn about one axis", block.words.get("B")
            )
        state.turns_to = words
        if self.record.oriented is None:
            self.record.oriented = form

    def _check_vector(self, block: Block, letters: list[str]) -> None:
        word = block.words[letters[0]]
        if not self.state.transformed:
            self.refuse("CC115", f"{letters[0]}= without TRAORI", word)
        if len(letters) < 3 or not math.hypot(*(block.words[each].value for each in letters)) > 0.0:
            self.refuse("CC115", "the direction of the tool needs A3=, B3= and C3=, not all zero", word)

    def home(self, block: Block, code: int) -> None:
        """G28, G30: through the point of the axis words to the reference position."""
        state = self.state
        if "P" in block.words and (code, block.words["P"].mode) in self.dialect.numbered_homes:
            self._which_home(block, code)
        spare = [block.words[letter] for letter in "ABCUVW" if letter in block.words]
        if spare and not block.axes:
            if spare[0].letter in "UVW":
                self.refuse("CC115", f"{spare[0].letter} is no axis of the machine", spare[0])
            return
        # Codes of group 0 that approach a fixed point directly use the axis words only as a list of axes.
        if code in (28, 30):
            self.record.machine_motion(block, state, -1, self.target(block, turns=False))
        home = state.homes[30 if code == 30 else 28]
        end = state.at_machine({axis: home[axis] for axis in block.axes or range(3)})
        self.record.machine_motion(block, state, -2, end, moved=block.axes or [0, 1, 2])

    def _which_home(self, block: Block, code: int) -> None:
        """Check P of G30 and FP of G75: only the second reference position and the first fixed point are known."""
        known = 2 if code == 30 else 1
        if block.number("P") != known:
            word = block.words["P"]
            self.refuse("CC129", f"position {word.value:g} of G{code} is not known, only {known}", word)

    def move(self, block: Block, motion: int, machine: bool) -> None:
        """G0, G1, G2 or G3 (code in tenths)."""
        state = self.state
        if machine and (motion not in (0, 10) or state.relative):
            self.refuse("CC130", "G53 works with G0 or G1 and with G90", block.groups[0][1])
        rapid = machine and self.dialect.machine_moves_rapid
        feed = self.feed_of(block) if motion and not rapid else math.nan
        if motion in (20, 30):
            self._arc(block, motion // 10, feed)
            return
        end = self.target(block, machine, turns=not machine)
        if motion and not machine and state.turns_to != state.turned and math.dist(state.position, end) <= _NOTHING:
            self.refuse("CC115", "a cut that only turns the tool is fed in degrees; turn it with G0, or with X, Y or Z")
        if motion and not rapid and state.feed_mode == 93:
            length = math.dist(state.position, end)
            feed *= length if length > _NOTHING else 1.0
        if machine:
            self.record.machine_motion(block, state, -2 if rapid else motion // 10, end, feed=feed)
        else:
            self.record.line_motion(block, state, motion // 10, end, feed)

    def feed_of(self, block: Block) -> float:
        """Feed of a cutting motion: mm/min, or 1/min in G93."""
        state = self.state
        if state.length_off:
            self.refuse(
                "CC133",
                "a cut with D0, by which words lead the spindle nose and not the tip",
                hint="write D1 before it",
            )
        if state.feed_mode == 93 and "F" not in block.words:
            self.refuse("CC110", "G93 needs an F word in every block that cuts")
        if not state.feed:
            self.refuse("CC110", "a cutting motion without a feed")
        if state.feed_mode == 95:
            if state.speed <= 0.0:
                self.refuse("CC110", "feed per revolution (G95) without a spindle speed")
            return state.feed * state.speed
        return state.feed

    def _turns(self, block: Block) -> int:
        word = block.words.get("P")
        if word is None or (not self.dialect.turns and word.mode != "TURN"):
            return 1
        block.used.add("P")
        turns = round(word.value) + (word.mode == "TURN")
        if abs(round(word.value) - word.value) > 1e-3 or not 1 <= turns <= _MOST_TURNS:
            self.refuse("CC113", f"P of an arc is a whole number of turns, 1 to {_MOST_TURNS}", word)
        return turns

    def _arc(self, block: Block, code: int, feed: float) -> None:
        state = self.state
        u, v, w = arcs.PLANES[state.plane]
        unit = state.unit
        turns = self._turns(block)
        start3 = list(state.position)
        end3 = self.target(block)
        start, end = (start3[u] / unit, start3[v] / unit), (end3[u] / unit, end3[v] / unit)
        try:
            if "R" in block.words:
                centre = self._centre_of_radius(block, start, end, code == 3)
            else:
                centre = self._centre_of_words(block, start)
                arcs.check_radii(start, end, centre, unit != 1.0)
        except arcs.ArcError as error:
            self.refuse(error.rule, error.message)
        angle = arcs.sweep(start, end, centre, code == 3, turns)
        centre3 = list(start3)
        centre3[u], centre3[v] = centre[0] * unit, centre[1] * unit
        radius = math.hypot(start3[u] - centre3[u], start3[v] - centre3[v])
        if radius * min(abs(angle), math.tau) > LARGEST_MM:
            self.refuse("CC138", f"an arc of radius {radius:g} mm is out of every machine's reach")
        if state.feed_mode == 93:
            feed *= math.hypot(radius * angle, end3[w] - start3[w])
        self.record.arc_motion(block=block, state=state, code=code, end=end3, centre=centre3, angle=angle, feed=feed)

    def _centre_of_radius(
        self, block: Block, start: tuple[float, float], end: tuple[float, float], ccw: bool
    ) -> tuple[float, float]:
        u, v, _ = arcs.PLANES[self.state.plane]
        radius = block.words["R"]
        block.used.add("R")
        if any(letter in block.words for letter in "IJK"):
            self.refuse("CC112", "an arc has both R and I, J, K", radius)
        if u not in block.axes and v not in block.axes:
            self.refuse("CC112", "an arc given by R has no end point in its plane", radius)
        return arcs.centre_of_radius(start, end, radius.value, ccw, self.state.unit != 1.0)

    def _centre_of_words(self, block: Block, start: tuple[float, float]) -> tuple[float, float]:
        state = self.state
        plane = arcs.PLANES[state.plane][:2]
        letters = ["IJK"[axis] for axis in plane]
        # A zero for the third letter, as some posts write it, has no meaning.
        block.used |= {letter for letter in "IJK" if letter in block.words and block.words[letter].value == 0.0}
        missing = [letter for letter in letters if letter not in block.words]
        if len(missing) == 2 or (state.centre_absolute and missing):
            self.refuse("CC112", f"the arc has no centre: {' and '.join(missing)} or R is missing")
        centre = []
        for axis, letter, here in zip(plane, letters, start, strict=True):
            value = block.number(letter) or 0.0
            mode = block.words[letter].mode if letter in block.words else ""
            absolute = mode == "AC" or (state.centre_absolute and mode != "IC")
            centre.append(value + state.offset[axis] / state.unit if absolute else value + here)
        return centre[0], centre[1]
