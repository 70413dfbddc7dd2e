"""Programs in time for the truth plants: a reader for plain G-code and the speed profile of the reference controller.

Every line is run with a trapezoidal speed (1500 mm/s² up and down) and an exact stop at its end, or, where the control looks
ahead, only where the path bends by more than 5°; t = 0 is the start of the first feed move.  The reader knows what the plants' own programs and corrected ones contain: G0-G3, I, J and K
relative to the start, absolute millimetres, modal words, comments, N words.  Anything else is an error, never a guess.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

ACCELERATION = 1500.0  # mm/s²
RAPID = 200.0  # mm/s, never logged
SMOOTH = np.cos(np.deg2rad(5.0))  # of the bend that a control that looks ahead passes without a stop
_WORD = re.compile(r"([A-Z])\s*([-+]?(?:\d+\.?\d*|\.\d+))")
_PLANES = {
    17: (0, 1),
    18: (2, 0),
    19: (1, 2),
}  # axes of a plane, so that turning from the first to the second is positive
_HARMLESS_G = {21, 40, 49, 54, 64, 80, 90, 94, 91.1}


@dataclass(frozen=True)
class Move:
    """One motion: end points (3,) mm, arc centre (2,) in the plane of `axes` and signed sweep (0 for lines), speed mm/s."""

    line: int
    feed: bool
    start: np.ndarray
    end: np.ndarray
    centre: np.ndarray
    sweep: float
    speed: float
    axes: tuple[int, int] = (0, 1)

    @property
    def length(self) -> float:
        """Path length, mm."""
        if self.sweep == 0.0:
            return float(np.linalg.norm(self.end - self.start))
        radius = float(np.hypot(*(self.start[list(self.axes)] - self.centre)))
        third = 3 - sum(self.axes)
        return float(np.hypot(radius * self.sweep, self.end[third] - self.start[third]))

    def at(self, share: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Points and unit directions (n, 3) at shares (n,) of the way."""
        chord = self.end - self.start
        tip, along = self.start + share[:, None] * chord, np.tile(chord / self.length, (len(share), 1))
        if self.sweep != 0.0:
            plane = list(self.axes)
            out = self.start[plane] - self.centre
            c, d = np.cos(share * self.sweep), np.sin(share * self.sweep)
            arm = np.stack([c * out[0] - d * out[1], d * out[0] + c * out[1]], 1)
            tip[:, plane] = self.centre + arm
            along[:, plane] = np.stack([-arm[:, 1], arm[:, 0]], 1) * self.sweep / self.length
        return tip, along

    def leads_into(self, other: Move) -> bool:
        """Whether both are feed moves and the path goes on smoothly."""
        here, there = self.at(np.ones(1))[1][0], other.at(np.zeros(1))[1][0]
        return self.feed and other.feed and float(here @ there) > SMOOTH


def read(text: str, start: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> list[Move]:
    """Moves of a program; raises ValueError on words it does not know."""
    moves: list[Move] = []
    here, motion, feed, plane = np.array(start, float), 0, 0.0, (0, 1)
    for number, source in enumerate(text.splitlines(), 1):
        bare = re.sub(r"\([^)]*\)|;.*|%.*", "", source).upper()
        words = _WORD.findall(bare)
        if _WORD.sub("", bare).strip():
            raise ValueError(f"line {number}: {source!r} is not understood")
        values: dict[str, float] = {}
        for letter, digits in words:
            value = float(digits)
            if letter == "G":
                if value in (0, 1, 2, 3):
                    motion = int(value)
                elif value in _PLANES:
                    plane = _PLANES[value]
                elif value not in _HARMLESS_G:
                    raise ValueError(f"line {number}: G{digits} is not known to this plant")
            elif letter == "F":
                feed = value / 60
            elif letter not in "NMSTHD":
                values[letter] = value
        if not values:
            continue
        end = np.array([values.pop(k, here[i]) for i, k in enumerate("XYZ")])
        centre, sweep = np.zeros(2), 0.0
        if motion in (2, 3):
            axes = list(plane)
            centre = here[axes] + [values.pop("IJK"[i], 0.0) for i in axes]
            a = np.arctan2(*(here[axes] - centre)[::-1])
            b = np.arctan2(*(end[axes] - centre)[::-1])
            sweep = (b - a) % (2 * np.pi)
            sweep = sweep if sweep > 1e-9 else 2 * np.pi
            if motion == 2:
                sweep = sweep - 2 * np.pi if sweep < 2 * np.pi - 1e-9 else -2 * np.pi
        if values:
            raise ValueError(f"line {number}: {values} left over")
        if motion and feed <= 0:
            raise ValueError(f"line {number}: no feed")
        move = Move(number, motion > 0, here, end, centre, sweep, feed if motion else RAPID, plane)
        if move.length > 0:
            moves.append(move)
        here = end
    return moves


class Timeline:
    """Where the program is at any time of the controller's clock (s)."""

    def __init__(self, moves: list[Move], acceleration: float = ACCELERATION, *, looks_ahead: bool = False) -> None:
        """Plans runs of moves from stop to stop; without looking ahead every move is one."""
        self.moves, self.acceleration = moves, acceleration
        length = np.array([m.length for m in moves])
        goes_on = [looks_ahead and a.leads_into(b) for a, b in pairwise(moves)]
        self.run = np.cumsum([0, *(not each for each in goes_on)])  # (moves,) the run of each
        self.reached = np.concatenate([[0.0], np.cumsum(length)])
        self.length = np.bincount(self.run, length)
        speed = self.length / np.bincount(self.run, length / [m.speed for m in moves])
        self.peak = np.minimum(speed, np.sqrt(self.length * acceleration))
        self.ramp = self.peak / acceleration
        self.took = self.ramp + self.length / self.peak
        feeds = np.flatnonzero([m.feed for m in moves])
        self.begin = np.concatenate([[0.0], np.cumsum(self.took)])
        self.begin -= self.begin[self.run[feeds[0]]]
        self.log_end = float(self.begin[self.run[feeds[-1]] + 1])

    def sample(self, t: np.ndarray) -> dict[str, np.ndarray]:
        """At times t (n,): tip (n, 3) mm, along (n, 3) unit feed direction, speed (n,) mm/s, line (n,), feeds, cuts (n,) bool.

        cuts: the motion is a feed move that travels in the XY plane; a plunge does not.
        """
        k = np.clip(np.searchsorted(self.begin, t, side="right") - 1, 0, len(self.length) - 1)
        u = np.clip(t - self.begin[k], 0.0, self.took[k])
        ramp, peak, a = self.ramp[k], self.peak[k], self.acceleration
        left = self.took[k] - u
        s = np.where(
            u < ramp,
            0.5 * a * u**2,
            np.where(left < ramp, self.length[k] - 0.5 * a * left**2, peak * (u - ramp / 2)),
        )
        speed = np.minimum(peak, a * np.minimum(u, left))
        first = np.searchsorted(self.run, k)
        way = self.reached[first] + s
        last = np.searchsorted(self.run, k, side="right") - 1
        i = np.clip(np.searchsorted(self.reached, way, side="right") - 1, first, last)
        tip, along = np.zeros((len(t), 3)), np.zeros((len(t), 3))
        flat = np.zeros(len(t), bool)
        for j in np.unique(i):
            move, rows = self.moves[j], i == j
            tip[rows], along[rows] = move.at((way[rows] - self.reached[j]) / move.length)
            flat[rows] = move.feed and float(np.hypot(*along[rows][0, :2])) > 1e-6
        line, feeds = (np.array([getattr(m, name) for m in self.moves])[i] for name in ("line", "feed"))
        return {"tip": tip, "along": along, "speed": speed, "line": line, "feeds": feeds, "cuts": flat}
