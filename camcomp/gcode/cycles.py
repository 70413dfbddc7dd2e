"""Canned cycles as sequences of motions, in the order of LinuxCNC."""

import math

from camcomp.gcode.arcs import PLANES
from camcomp.gcode.block import Block
from camcomp.gcode.motions import Motions

# Depth axis among X, Y, Z by plane.
_DEPTH = {17: 2, 18: 1, 19: 0}
_TAPS = {740: 4, 840: 3}  # direction of the spindle on the way in, as M code
_BORES_BELOW = 870
# Words by cycle in addition to R, the axis words and the count of repeats: of LinuxCNC, and the further ones of Fanuc.
_WORDS = {730: "Q", 740: "P", 820: "P", 830: "Q", 840: "P", 860: "P", 870: "IJK", 890: "P"}
_SHIFTED = {760: "IJ", 870: "IJ"}


class Cycles(Motions):
    """Executes G73, G74, G76 of Fanuc and G81 to G89. `actions`: motions of the last cycle, for writing it out."""

    actions: list[tuple[str, list[float]]]  # (G0 or G1, end point) or (a statement, [])
    irreplaceable = ""  # why the last cycle cannot be written out as moves
    _began: float | None = None  # height of the tool, minus the offset, before a series

    def forget_cycle(self, series: bool = True) -> None:
        """Forget the words of the cycle in force, and with `series` the height at which its series began."""
        self._held: dict[str, float] = {}
        if series:
            self._began = None

    def cycle(self, block: Block, code: int) -> None:
        """Drill, tap or bore, once or several times."""
        state = self.state
        name = f"G{code // 10}"
        if code == 880:
            self.refuse("CC132", "G88 leaves the retraction to the operator's hand")
        if code in _TAPS and state.plane != 17:
            self.refuse("CC132", f"{name} taps in G17 only")
        if state.feed_mode == 93:
            self.refuse("CC132", f"{name} does not work with G93")
        feed = self.feed_of(block)
        depth = _DEPTH[state.plane]
        start = list(state.position)
        if self._held.setdefault("plane", state.plane) != state.plane:
            self.refuse("CC132", f"the plane changes while {name} is in force")
        # all cycles of a series refer to the height at its start
        if self._began is None:
            self._began = start[depth] - state.offset[depth]
        self._hold(block, code, depth)
        initial = self._began + state.offset[depth]
        below = code == _BORES_BELOW and self.dialect.cycles_apart
        level = self._held["R"] + (initial if state.relative else state.offset[depth])
        bottom = self._held["Z"] + (level if state.relative else state.offset[depth])
        if below and level > bottom:
            self.refuse("CC132", f"{name} bores upwards, from R below the hole to {'XYZ'[depth]}, and R lies above")
        if level < bottom and not below:
            self.refuse("CC132", f"the retract plane of {name} lies below its bottom")
        repeats = self._repeats(block)
        self.actions = []
        self.irreplaceable = "a tapping cycle" if code in _TAPS else ""
        first = True
        for _ in range(repeats):
            place = self._place(block, depth)
            if below:
                self._go(block, 0, self._at(place, depth, max(initial, level)), feed, always=repeats == 1)
                self._bore_upwards(block, place, (bottom, level, max(initial, level)), feed)
                continue
            clear = max(initial, level) if state.retract_to_start else level
            if first and initial < level:
                self._go(block, 0, self._at(state.position, depth, level), feed)
            here = state.position[depth]
            across = here if first and here > level else clear  # from below on a slanted line
            self._go(block, 0, self._at(place, depth, across), feed, always=repeats == 1 and first)
            self._go(block, 0, self._at(place, depth, level), feed)
            self._body(block, code, place, (bottom, level, clear), feed)
            first = False
        self.record.cycle(self.actions, self.irreplaceable)

    def _hold(self, block: Block, code: int, depth: int) -> None:
        """Store the words of a cycle, lengths in mm; in G91 they count from the start of its series and from R."""
        held, unit, name = self._held, self.state.unit, f"G{code // 10}"
        r = block.number("R")
        if r is not None:
            held["R"] = r * unit
        elif "R" not in held:
            self.refuse("CC132", f"{name} has no retract plane R")
        letter = "XYZ"[depth]
        z = block.words[letter].value * unit if letter in block.words else None
        if z is not None:
            held["Z"] = z
        elif "Z" not in held:
            self.refuse("CC132", f"{name} has no depth {letter}")
        for letter in "PQ" + _SHIFTED.get(code, "") if self.dialect.cycles_apart else _WORDS.get(code, ""):
            value = block.number(letter)
            if value is not None:
                held[letter] = value
        if code in _TAPS and held.get("Q"):
            self.refuse("CC132", f"{name} with Q taps in pecks, which are not followed", block.words.get("Q"))
        if code in _TAPS and not self.dialect.cycles_apart and self.state.spindle != _TAPS[code]:
            self.refuse("CC132", f"{name} needs a spindle that turns by M{_TAPS[code]}")

    def _repeats(self, block: Block) -> int:
        for letter in self.dialect.repeats:
            value = block.number(letter)
            if value is not None:
                if value != int(value) or not (0 if self.dialect.increments else 1) <= value <= 10000:
                    self.refuse("CC132", f"{letter} counts repeats, 1 or more", block.words[letter])
                return int(value)
        return 1

    def _place(self, block: Block, depth: int) -> list[float]:
        """Position of the hole, with the present position on the depth axis."""
        state = self.state
        place = list(state.position)
        for axis in block.axes:
            state.commanded[axis] = True
            if axis != depth:
                value = block.words["XYZ"[axis]].value * state.unit
                place[axis] = place[axis] + value if state.relative else value + state.offset[axis]
        return place

    @staticmethod
    def _at(place: list[float], depth: int, height: float) -> list[float]:
        point = list(place)
        point[depth] = height
        return point

    def _go(self, block: Block, code: int, end: list[float], feed: float, always: bool = False) -> None:
        if end == self.state.position and not always:
            return
        self.actions.append((f"G{code}", end))
        self.record.line_motion(block, self.state, code, end, feed if code else math.nan)

    def _body(
        self, block: Block, code: int, place: list[float], heights: tuple[float, float, float], feed: float
    ) -> None:
        bottom, level, clear = heights
        depth = _DEPTH[self.state.plane]

        def go(motion: int, height: float) -> None:
            self._go(block, motion, self._at(place, depth, height), feed)

        if code in (730, 830):
            self._peck(block, code, place, heights, feed)
            return
        if code == 870:
            self._back_bore(block, place, heights, feed)
            return
        if code == 760:
            self._bore_finely(block, place, heights, feed)
            return
        go(1, bottom)
        if code in (820, 860, 890) or code in _TAPS:
            self._dwell()
        spindle = self.state.spindle
        if code in _TAPS:
            self.actions.append((f"M{7 - _TAPS[code]}", []))
        if code == 860:
            self.actions.append(("M5", []))
        if code == 850:
            go(1, level)
        elif code == 890 or code in _TAPS:
            go(1, level if self.dialect.cycles_apart else clear)
        if code in _TAPS:
            self.actions.append((f"M{spindle}", []))
        go(0, clear)
        if code == 860:
            self.actions.append((f"M{spindle}", []))

    def _dwell(self) -> None:
        if self._held.get("P"):
            self.state.dwelt_s += self._held["P"] * self.dialect.dwell_p_s
            self.state.waits = True
            self.actions.append((f"G4 P{self._held['P']:g}", []))

    def _peck(
        self, block: Block, code: int, place: list[float], heights: tuple[float, float, float], feed: float
    ) -> None:
        bottom, level, clear = heights
        state = self.state
        depth = _DEPTH[state.plane]
        step = abs(self._held.get("Q", 0.0)) * state.unit
        if step <= 0.0 or (level - bottom) / step > 1e5:
            self.refuse("CC132", f"G{code // 10} needs its peck depth as Q")
        # LinuxCNC backs off by 0.01 inch, a hundredth of the unit in G20, which no setting changes.
        gap = self.dialect.peck_clearance_mm
        gap = gap if state.unit == 1.0 else round(gap / state.unit, 2) * state.unit
        reached = level - step
        while reached > bottom:
            self._go(block, 1, self._at(place, depth, reached), feed)
            if code == 830:
                self._go(block, 0, self._at(place, depth, level), feed)
            self._go(
                block, 0, self._at(place, depth, min(reached + gap, level) if code == 830 else reached + gap), feed
            )
            reached -= step
        self._go(block, 1, self._at(place, depth, bottom), feed)
        self._go(block, 0, self._at(place, depth, clear), feed)

    def _back_bore(self, block: Block, place: list[float], heights: tuple[float, float, float], feed: float) -> None:
        """G87: down at the shifted position with the spindle oriented, then cut upwards."""
        bottom, level, clear = heights
        state = self.state
        depth = _DEPTH[state.plane]
        if any(letter not in self._held for letter in "IJK"):
            self.refuse("CC132", "G87 needs I, J and K")
        sides = [axis for axis in (0, 1, 2) if axis != depth]
        top = self._held["K"] * state.unit + (bottom if state.relative else state.offset[depth])
        beside = list(place)
        for letter, axis in zip("IJ", sides if depth != 1 else sides[::-1], strict=True):
            beside[axis] += self._held[letter] * state.unit
        spindle = f"M{state.spindle}"

        def go(code: int, point: list[float], height: float) -> None:
            self._go(block, code, self._at(point, depth, height), feed)

        go(0, beside, level)
        self.actions += [("M5", []), ("M19", [])]
        go(0, beside, bottom)
        go(0, place, bottom)
        self.actions.append((spindle, []))
        go(1, place, top)
        go(1, place, bottom)
        self.actions += [("M5", []), ("M19", [])]
        go(0, beside, bottom)
        go(0, beside, clear)
        go(0, place, clear)
        self.actions.append((spindle, []))

    def _bore_finely(self, block: Block, place: list[float], heights: tuple[float, float, float], feed: float) -> None:
        """G76 of Fanuc: bore, stop with the spindle oriented, and leave the wall before the tool comes up."""
        bottom, _, clear = heights
        depth = _DEPTH[self.state.plane]
        beside = self._beside(place, "G76")
        spindle = f"M{self.state.spindle}"
        self._go(block, 1, self._at(place, depth, bottom), feed)
        self._dwell()
        self.actions += [("M5", []), ("M19", [])]
        self._go(block, 0, self._at(beside, depth, bottom), feed)
        self._go(block, 0, self._at(beside, depth, clear), feed)
        self._go(block, 0, self._at(place, depth, clear), feed)
        self.actions.append((spindle, []))

    def _bore_upwards(self, block: Block, place: list[float], heights: tuple[float, float, float], feed: float) -> None:
        """G87 of Fanuc: down at the shifted position to R below the hole, cut upwards to Z, back to the initial level."""
        top, level, clear = heights
        depth = _DEPTH[self.state.plane]
        beside = self._beside(place, "G87")
        spindle = f"M{self.state.spindle}"

        def go(code: int, point: list[float], height: float) -> None:
            self._go(block, code, self._at(point, depth, height), feed)

        self.actions += [("M5", []), ("M19", [])]
        go(0, beside, clear)
        go(0, beside, level)
        go(0, place, level)
        self.actions.append((spindle, []))
        go(1, place, top)
        self._dwell()
        self.actions += [("M5", []), ("M19", [])]
        go(0, beside, top)
        go(0, beside, clear)
        go(0, place, clear)
        self.actions.append((spindle, []))

    def _beside(self, place: list[float], name: str) -> list[float]:
        """A hole's position shifted away from the tool's tip: by I and J, or by Q, whose direction is a setting."""
        held, unit = self._held, self.state.unit
        u, v, _ = PLANES[self.state.plane]
        out = list(place)
        if "I" in held or "J" in held:
            for letter, axis in zip("IJ", sorted((u, v)), strict=True):
                out[axis] += held.get(letter, 0.0) * unit
        elif "Q" in held:
            out[u] += abs(held["Q"]) * unit
            self.irreplaceable = "a boring cycle whose direction of Q only the control knows"
            self.warn(
                f"{name} leaves the wall by Q along +{'XYZ'[u]}; the direction is a parameter of the control", once=True
            )
        else:
            self.refuse("CC132", f"{name} needs its shift as Q, or as I and J")
        return out
