"""Writes random valid RS274 programs for property tests: every mode, every way to give an arc, every style of text."""

import math
from random import Random

from camcomp.dialects.rs274 import DIALECT
from camcomp.gcode.arcs import PLANES
from camcomp.gcode.interpret import Interpreter
from camcomp.gcode.setup import Setup
from camcomp.gcode.text import Text
from camcomp.gcode.words import read_line


class ProgramWriter:
    """One random program. It executes what it writes, because a valid arc depends on where the tool stands."""

    def __init__(self, random: Random, setup: Setup | None = None, exotic: bool = True) -> None:
        self.random = random
        self.exotic = exotic
        self.engine = Interpreter(Text("x", "", "latin-1", b""), setup or Setup(), DIALECT)
        self.packed = random.random() < 0.2
        self.lower = random.random() < 0.15
        self.numbered = random.random() < 0.3
        self.lines: list[str] = []

    def program(self, length: int) -> str:
        """Text with `length` statements."""
        random = self.random
        for first in ("G21 G90 G17 G94", "G0 X{} Y{} Z{}".format(*(self.number(20) for _ in range(3))), "F300 S2000"):
            self.put(first)
        for _ in range(length):
            roll = random.random()
            if roll < 0.40:
                self.straight()
            elif roll < 0.65:
                self.arc()
            elif roll < 0.75:
                self.mode()
            elif roll < 0.82 and self.exotic:
                self.offset()
            elif roll < 0.86 and self.exotic:
                self.machine()
            elif roll < 0.9:
                self.lines.append(random.choice(["(note)", "; note", "", "(G1 X99)", "M8", "M9", "T1", "G4 P0.1"]))
            else:
                self.straight(rapid=True)
        self.put("M2")
        end = random.choice(["\n", "\n", "\r\n"])
        return end.join(self.lines) + end

    @property
    def state(self):
        return self.engine.state

    def number(self, size: float) -> str:
        value = self.random.uniform(-size, size)
        digits = self.random.choice([0, 1, 2, 3, 4])
        text = f"{value:.{digits}f}"
        if float(text) == 0.0:
            text = "0"
        if "." in text and self.random.random() < 0.1:
            text = text.replace("0.", ".", 1) if text.lstrip("-").startswith("0.") else text
        if "." not in text and self.random.random() < 0.2:
            text += "."
        return ("+" + text) if text[0] not in "-" and self.random.random() < 0.03 else text

    def put(self, line: str) -> None:
        """Add a statement and execute it."""
        text = Text("x", line, "latin-1", b"")
        self.engine.text = text
        self.engine.record._starts = text.starts
        self.engine.perform(self.engine.sort(0, read_line(text, 0).words))
        if self.packed:
            line = line.replace(" ", "")
        if self.lower:
            line = line.lower()
        if self.numbered:
            line = f"N{10 * len(self.lines)}" + ("" if self.packed else " ") + line
        if self.random.random() < 0.1:
            line += self.random.choice([" (remark)", " ; remark", "\t", "  "])
        self.lines.append(line)

    def feed(self) -> str:
        state = self.state
        if state.feed_mode == 93:
            return f" F{self.random.uniform(1, 50):.2f}"
        if state.feed is None or self.random.random() < 0.1:
            return (
                f" F{self.random.choice([0.1, 0.25])}" if state.feed_mode == 95 else f" F{self.random.randint(50, 900)}"
            )
        return ""

    def code(self, code: int) -> str:
        return (
            ""
            if self.state.motion == 10 * code and self.random.random() < 0.7
            else f"G{code:0{self.random.choice([1, 2])}d} "
        )

    def straight(self, rapid: bool = False) -> None:
        random, state = self.random, self.state
        size = (5.0 if state.relative else 40.0) / state.unit
        axes = sorted(random.sample("XYZ", random.choice([1, 1, 2, 2, 3])))
        line = self.code(0 if rapid else 1) + " ".join(a + self.number(size) for a in axes)
        self.put(line + ("" if rapid else self.feed()))

    def arc(self) -> None:
        random, state = self.random, self.state
        u, v, w = PLANES[state.plane]
        unit = state.unit
        ccw = random.random() < 0.5
        line = self.code(3 if ccw else 2)
        radius = random.uniform(0.5, 20.0) / unit
        direction = random.uniform(0, 2 * math.pi)
        angle = random.choice([random.uniform(0.05, 6.2), math.pi, 2 * math.pi])
        here = [(state.position[a] - state.offset[a]) / unit for a in range(3)]
        here_uv = (here[u], here[v])
        centre = (here[u] + radius * math.cos(direction), here[v] + radius * math.sin(direction))
        turn = direction + math.pi + (angle if ccw else -angle)
        end = [centre[0] + radius * math.cos(turn), centre[1] + radius * math.sin(turn)]
        words = {}
        digits = random.choice([3, 4, 6])
        full = abs(angle - 2 * math.pi) < 1e-9
        if not full:
            base = (here[u], here[v]) if state.relative else (0.0, 0.0)
            words["XYZ"[u]], words["XYZ"[v]] = end[0] - base[0], end[1] - base[1]
        if random.random() < 0.3:
            words["XYZ"[w]] = random.uniform(-3, 3) / unit + (0.0 if state.relative else here[w])
        if not full and angle < 6.0 and random.random() < 0.4:
            # Rounding of the words must not put the end out of reach.
            reach = math.dist(here_uv, end) / 2.0 * 1.001 + 0.003
            words["R"] = math.copysign(max(radius, reach), math.pi - angle)
        else:
            base = (0.0, 0.0) if state.centre_absolute else (here[u], here[v])
            words["IJK"[u]], words["IJK"[v]] = centre[0] - base[0], centre[1] - base[1]
            if random.random() < 0.15:
                words["P"] = random.randint(1, 3)
        text = " ".join(k + (str(x) if k == "P" else f"{x:.{digits}f}") for k, x in words.items())
        self.put(line + text + self.feed())

    def mode(self) -> None:
        random, state = self.random, self.state
        choice = random.choice(["unit", "plane", "distance", "centre", "feed", "path", "with move"])
        if choice == "unit" and self.exotic and not any(state.tool_offset):
            # The stand-alone rs274 does not convert a tool offset that is in force.
            self.put("G20" if state.unit == 1.0 else "G21")
            self.put(f"F{random.randint(5, 400)}" if state.feed_mode == 94 else "G94 F200")
        elif choice == "plane":
            self.put(random.choice(["G17", "G18", "G19"]))
        elif choice == "distance":
            self.put("G90" if state.relative else "G91")
        elif choice == "centre":
            self.put("G91.1" if state.centre_absolute else "G90.1")
        elif choice == "feed":
            # rs274 forgets the feed at any G93 to G95, also where the mode is the old one.
            code = random.choice([each for each in (93, 94, 95) if each == 94 or each != state.feed_mode])
            self.put(f"G{code}" if code != 94 else f"G94 F{random.randint(50, 900)}")
        elif choice == "path":
            self.put(random.choice(["G61", "G64 P0.01", "G64", "G40", "G49", "G97 S1000", "G80"]))
        else:
            mode = "G90" if state.relative else "G91"
            size = (5.0 if mode == "G91" else 40.0) / state.unit
            self.put(f"{mode} G1 X{self.number(size)} Z{self.number(size)}" + self.feed())

    def offset(self) -> None:
        random, state = self.random, self.state
        size = 10.0 / state.unit
        words = " ".join(a + self.number(size) for a in sorted(random.sample("XYZ", random.choice([1, 2, 3]))))
        self.put(
            random.choice(
                [
                    random.choice(["G54", "G55", "G56", "G57", "G58", "G59", "G59.1", "G59.2", "G59.3"]),
                    f"G92 {words}",
                    random.choice(["G92.1", "G92.2", "G92.3"]),
                    f"G52 {words}",
                    f"G10 L2 P{random.randint(0, 9)} {words}",
                    f"G10 L20 P{random.randint(0, 9)} {words}",
                    f"G43.1 {words}" if state.unit == 1.0 else "G49",
                    random.choice(["G43 H1", "G43 H2", "G49"]) if state.unit == 1.0 else "G49",
                ]
            )
        )

    def machine(self) -> None:
        random, state = self.random, self.state
        words = " ".join(
            a + self.number(20.0 / state.unit) for a in sorted(random.sample("XYZ", random.choice([1, 3])))
        )
        if random.random() < 0.5 and not state.relative:
            self.put(f"G53 G0 {words}")
        else:
            self.put(random.choice([f"G28 {words}", f"G30 {words}", "G28"]))
