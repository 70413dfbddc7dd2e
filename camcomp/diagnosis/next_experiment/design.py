"""Parameters of a proposed motion: position, plane, radius, feed, direction, load, dwell; and its program."""

from __future__ import annotations

from dataclasses import dataclass, replace
from textwrap import wrap

import numpy as np

from camcomp.ground.datatypes import Floats

PLANES = {"XY": ("G17", (0, 1)), "XZ": ("G18", (0, 2)), "YZ": ("G19", (1, 2))}
_WORDS = {0: "I", 1: "J", 2: "K"}
_SENSES = {1: ("G3", "counter-clockwise"), -1: ("G2", "clockwise")}
REMARK = 120  # characters of a line that all controllers read
SETUP_MIN = 3.0  # to load a program, start the log and check it
STOCK_MIN = 10.0  # to clamp material for a cut
SOON_S = 60.0  # after the last run, at the earliest


@dataclass(frozen=True, kw_only=True)
class MotionDesign:
    """A full circle in a plane, or a straight line forth and back through its centre; then a standstill.

    centre mm and radius mm (half the length of a line), program frame; feed mm/min; turns: directions of the circles in
    order, +1 counter-clockwise seen from the plane's positive axis; along: unit direction of a line; cutting: whether it
    cuts; wait_s: from the end of the last run to its start; dwell_s: logged standstill at its end.
    """

    centre: tuple[float, float, float]
    radius: float
    feed: float
    plane: str = "XY"
    turns: tuple[int, ...] = (1, -1)
    along: tuple[float, float, float] | None = None
    cutting: bool = False
    wait_s: float = SOON_S
    dwell_s: float = 0.0

    def tidy(self) -> MotionDesign:
        """The design in round numbers: 0.1 mm, three digits of feed."""
        x, y, z = (round(v, 1) + 0.0 for v in self.centre)  # no -0
        feed = float(f"{self.feed:.3g}")
        return replace(self, centre=(x, y, z), radius=max(round(self.radius, 1), 0.1), feed=feed)

    @property
    def length(self) -> float:
        """Path length, mm."""
        return 4.0 * self.radius if self.along else 2.0 * np.pi * self.radius * len(self.turns)

    @property
    def minutes(self) -> float:
        """Machine time in minutes, including set-up."""
        still = (self.dwell_s + self.wait_s - SOON_S) / 60.0
        return SETUP_MIN + STOCK_MIN * self.cutting + self.length / self.feed + still

    def points(self, count: int = 16) -> Floats:
        """Points (count, 3) mm on its path, program frame."""
        u = np.linspace(-1.0, 1.0, count)[:, None]
        if self.along:
            return np.asarray(np.array(self.centre) + self.radius * u * np.array(self.along), float)
        a, b = PLANES[self.plane][1]
        out = np.tile(np.array(self.centre), (count, 1))
        out[:, a] += self.radius * np.cos(np.pi * u[:, 0])
        out[:, b] += self.radius * np.sin(np.pi * u[:, 0])
        return out

    @property
    def action(self) -> str:
        """Text of the motion."""
        x, y, z = (f"{v:g}" for v in self.centre)
        load = "cutting" if self.cutting else "in the air, without cutting"
        place = f"about X{x} Y{y} Z{z}, {load}, F{self.feed:.0f}"
        if self.along:
            first, last = np.round(self.points(2), 1) + 0.0
            ends = [" ".join(f"{axis}{v:.1f}" for axis, v in zip("XYZ", p, strict=True)) for p in (first, last)]
            text = f"straight line from {ends[0]} to {ends[1]} and back, {load}, F{self.feed:.0f}"
        else:
            both = "both directions" if len(set(self.turns)) > 1 else _SENSES[self.turns[0]][1]
            text = f"circle of radius {self.radius:g} mm in the {self.plane} plane, {both}, {place}"
        if self.dwell_s:
            text += f", then stand still for {self.dwell_s / 60.0:.0f} minutes and log"
        if self.wait_s > SOON_S:
            text += f", {self.wait_s / 60.0:.0f} minutes after the last run"
        return text

    def program(self, say: str) -> str:
        """NC text (RS274); say: comment at its start."""
        g, (a, b) = PLANES[self.plane]
        start = self.points(2)[0] if self.along else np.array(self.centre) + self.radius * np.eye(3)[a]
        lines = [f"G0 {_point(start)}"]
        if self.along:
            lines += [f"G1 {_point(self.points(2)[1])} F{self.feed:.0f}", f"G1 {_point(start)} F{self.feed:.0f}"]
        else:
            middle = f"{_WORDS[a]}{-self.radius:.4f} {_WORDS[b]}0"
            lines += [f"{_SENSES[turn][0]} {_point(start)} {middle} F{self.feed:.0f}" for turn in self.turns]
        if self.dwell_s:
            lines.append(f"G4 P{self.dwell_s:.0f}")
        text = "".join(f"{line}\n" for line in lines)
        said = wrap(say.replace("(", "").replace(")", ""), REMARK)
        remarks = "".join(f"({line})\n" for line in ("experiment proposed by camcomp", *said))
        return f"{remarks}G21 G90 {g} G54\n{text}M2\n"


def _point(p: Floats) -> str:
    return f"X{p[0]:.4f} Y{p[1]:.4f} Z{p[2]:.4f}"
