"""Programs in time for the truth plants: a reader for plain G-code and the speed profile of the reference controller.

Every line is run with a trapezoidal speed (1500 mm/s² up and down) and an exact stop at its end; t = 0 is the start of the
first feed move.  The reader knows what the plants' own programs and corrected ones contain: G0-G3 in the XY plane, I and J
relative to the start, absolute millimetres, modal words, comments, N words.  Anything else is an error, never a guess.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

ACCELERATION = 1500.0  # mm/s²
RAPID = 200.0  # mm/s, never logged
_WORD = re.compile(r"([A-Z])\s*([-+]?(?:\d+\.?\d*|\.\d+))")
_HARMLESS_G = {17, 21, 40, 49, 54, 64, 80, 90, 94, 91.1}


@dataclass(frozen=True)
class Move:
    """One motion: end points (3,) mm, arc centre (2,) and signed sweep (0 for lines), speed mm/s."""

    line: int
    feed: bool
    start: np.ndarray
    end: np.ndarray
    centre: np.ndarray
    sweep: float
    speed: float

    @property
    def length(self) -> float:
        """Path length, mm."""
        if self.sweep == 0.0:
            return float(np.linalg.norm(self.end - self.start))
        radius = float(np.hypot(*(self.start[:2] - self.centre)))
        return float(np.hypot(radius * self.sweep, self.end[2] - self.start[2]))


def read(text: str, start: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> list[Move]:
    """Moves of a program; raises ValueError on words it does not know."""
    moves: list[Move] = []
    here, motion, feed = np.array(start, float), 0, 0.0
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
            centre = here[:2] + [values.pop("I", 0.0), values.pop("J", 0.0)]
            a = np.arctan2(*(here[:2] - centre)[::-1])
            b = np.arctan2(*(end[:2] - centre)[::-1])
            sweep = (b - a) % (2 * np.pi)
            sweep = sweep if sweep > 1e-9 else 2 * np.pi
            if motion == 2:
                sweep = sweep - 2 * np.pi if sweep < 2 * np.pi - 1e-9 else -2 * np.pi
        if values:
            raise ValueError(f"line {number}: {values} left over")
        if motion and feed <= 0:
            raise ValueError(f"line {number}: no feed")
        move = Move(number, motion > 0, here, end, centre, sweep, feed if motion else RAPID)
        if move.length > 0:
            moves.append(move)
        here = end
    return moves


class Timeline:
    """Where the program is at any time of the controller's clock (s)."""

    def __init__(self, moves: list[Move], acceleration: float = ACCELERATION) -> None:
        """Plans every move on its own: exact stop at every end."""
        self.moves, self.acceleration = moves, acceleration
        self.length = np.array([m.length for m in moves])
        self.speed = np.array([m.speed for m in moves])
        self.peak = np.minimum(self.speed, np.sqrt(self.length * acceleration))
        self.ramp = self.peak / acceleration
        self.took = self.ramp + self.length / self.peak
        first = next(i for i, m in enumerate(moves) if m.feed)
        last = max(i for i, m in enumerate(moves) if m.feed)
        self.begin = np.concatenate([[0.0], np.cumsum(self.took)])
        self.begin -= self.begin[first]
        self.log_end = float(self.begin[last + 1])

    def sample(self, t: np.ndarray) -> dict[str, np.ndarray]:
        """At times t (n,): tip (n, 3) mm, along (n, 3) unit feed direction, speed (n,) mm/s, line (n,), feeds, cuts (n,) bool.

        cuts: the motion is a feed move that travels in the XY plane; a plunge does not.
        """
        i = np.clip(np.searchsorted(self.begin, t, side="right") - 1, 0, len(self.moves) - 1)
        u = np.clip(t - self.begin[i], 0.0, self.took[i])
        ramp, took, peak, a = self.ramp[i], self.took[i], self.peak[i], self.acceleration
        left = took - u
        s = np.where(
            u < ramp,
            0.5 * a * u**2,
            np.where(left < ramp, self.length[i] - 0.5 * a * left**2, peak * (u - ramp / 2)),
        )
        speed = np.minimum(peak, a * np.minimum(u, left))
        tip, along = np.zeros((len(t), 3)), np.zeros((len(t), 3))
        flat = np.zeros(len(t), bool)
        for k in np.unique(i):
            m, rows = self.moves[k], i == k
            share = (s[rows] / self.length[k])[:, None]
            if m.sweep == 0.0:
                tip[rows] = m.start + share * (m.end - m.start)
                along[rows] = (m.end - m.start) / self.length[k]
            else:
                out = m.start[:2] - m.centre
                c, d = np.cos(share * m.sweep), np.sin(share * m.sweep)
                arm = np.concatenate([c * out[0] - d * out[1], d * out[0] + c * out[1]], 1)
                tip[rows, :2] = m.centre + arm
                tip[rows, 2] = m.start[2] + share[:, 0] * (m.end[2] - m.start[2])
                turn = np.stack([-arm[:, 1], arm[:, 0]], 1) * m.sweep / self.length[k]
                along[rows, :2] = turn
                along[rows, 2] = (m.end[2] - m.start[2]) / self.length[k]
            flat[rows] = m.feed and float(np.hypot(*along[rows][0, :2])) > 1e-6
        line, feeds = (np.array([getattr(m, name) for m in self.moves])[i] for name in ("line", "feed"))
        return {"tip": tip, "along": along, "speed": speed, "line": line, "feeds": feeds, "cuts": flat}
