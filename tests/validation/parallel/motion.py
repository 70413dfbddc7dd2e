"""What happens between the set-points of a recording and the carriages, millisecond by millisecond.

Shares with the contract the definitions and signs of its effects (section 5) and the force in the path frame. The servo
is a velocity loop inside a position loop, play is a sum of play operators (a contact that yields), friction is LuGre
with a Stribeck rise, the drives warm up as a network of two time constants. Units: mm, N, s, rad.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

import numpy as np
from numba import njit
from scipy.signal import cont2discrete, lfilter

from tests.validation.parallel.machine import Machine
from tests.validation.recordings import recording

STEP = 1e-3
STRIBECK, STRIBECK_SPEED = 0.12, 1.5  # relative rise of friction at creep; mm/s
WIDTHS = np.array([0.85, 0.95, 1.0, 1.05, 1.15])  # of the play operators, relative; their mean is the stated width


@dataclass
class Track:
    """One run at 1 kHz: where the tip was commanded to be and what acted then."""

    name: str
    program: str
    cutting: bool
    started_s: float
    t: np.ndarray
    tip: np.ndarray  # (n, 3) mm
    line: np.ndarray
    fed: np.ndarray  # (n,) the line executed is a feed move that is no plunge
    feed: np.ndarray  # (n,) it is any feed move
    along: np.ndarray  # (n, 2) unit vector of the feed in the plane
    force: np.ndarray  # (n, 3) N, nominal, on the tool in the machine frame
    rho: np.ndarray  # (n, c) set-points, mm
    minutes: np.ndarray  # (n,) of cutting so far in the experiment
    temperature: np.ndarray  # (n,) of the drives
    cache: dict = field(default_factory=dict)


def feed_lines(program: str) -> tuple[set[int], set[int]]:
    """Source lines (1-based) of feed moves, and those of them that are no plunges; motion words are modal."""
    feeds, cuts, mode = set(), set(), 0
    for number, text in enumerate(program.splitlines(), 1):
        words = re.findall(r"G([0-3])(?![\d.])", text)
        if words:
            mode = int(words[-1])
        if mode and re.search(r"[XYZ]-?[\d.]", text):
            feeds.add(number)
            if re.search(r"[XY]-?[\d.]", text):
                cuts.add(number)
    return feeds, cuts


def directions(tip: np.ndarray) -> np.ndarray:
    """Unit vector of the motion in the plane (n, 2); at standstill the last one stays."""
    pace = np.zeros((len(tip), 2))
    pace[1:-1] = tip[2:, :2] - tip[:-2, :2]
    speed = np.linalg.norm(pace, axis=1)
    moving = speed > 2e-4
    last = np.maximum.accumulate(np.where(moving, np.arange(len(tip)), 0))
    return pace[last] / np.maximum(speed[last], 1e-9)[:, None]


def path_force(along: np.ndarray, triple: np.ndarray) -> np.ndarray:
    """Fr to the right of the feed, Ft along it, Fz up the tool: (n, 3) N."""
    right = np.stack([along[:, 1], -along[:, 0]], 1)
    plane = triple[0] * right + triple[1] * along
    return np.concatenate([plane, np.full((len(along), 1), triple[2])], 1)


def track(machine: Machine, name: str, cutting: bool, started: float, minutes: float, warming: dict) -> Track:
    """The recording NAME as a run that starts at `started` s, after `minutes` of cutting."""
    source = recording.load(name)
    feeds, cuts = feed_lines(source.program)
    fed = np.isin(source.line, list(cuts))
    along = directions(source.tip)
    force = path_force(along, machine.force) * (fed & cutting)[:, None]
    spent = minutes + np.cumsum(fed & cutting) * STEP / 60
    clock = started + source.t
    fast, slow = np.exp(-clock / (0.2 * warming["warm_up_s"])), np.exp(-clock / warming["warm_up_s"])
    temperature = 20 + warming["rise_K"] * (1 - 0.1 * fast - 0.9 * slow)
    return Track(name, source.program, cutting, started, source.t, source.tip, source.line, fed,
                 np.isin(source.line, list(feeds)), along, force, machine.inverse(source.tip)[0], spent,
                 temperature)  # fmt: skip


def following_error(set_points: np.ndarray, lag: float) -> np.ndarray:
    """Set-point minus encoder (n,) mm: position loop of gain 1/lag around a velocity loop eight times as fast."""
    inner = lag / 8
    system = (np.array([[0.0, 1.0], [-1 / (lag * inner), -1 / inner]]), np.array([[0.0], [1 / inner]]),
              np.array([[1.0, 0.0]]), np.zeros((1, 1)))  # fmt: skip
    a, b, c, _, _ = cont2discrete(system, STEP, "zoh")
    # error = c (zI - a)^-1 b . speed, the speed being constant within a millisecond
    over = np.array([1, -np.trace(a), np.linalg.det(a)])
    first, second = (c @ b).item(), (c @ a @ b).item()
    under = np.array([0, first, second - np.trace(a) * first])
    speed = np.diff(set_points, append=set_points[-1]) / STEP
    return lfilter(under, over, speed)


@njit(cache=True)
def play(motor: np.ndarray, width: float, relative: np.ndarray) -> np.ndarray:
    """Carriage minus motor (n,) mm for play of the full width."""
    out = np.zeros(len(motor))
    for share in relative:
        half, at = 0.5 * width * share, motor[0]
        for n in range(len(motor)):
            at = min(max(at, motor[n] - half), motor[n] + half)
            out[n] += (at - motor[n]) / len(relative)
    return out


@njit(cache=True)
def lugre(motor: np.ndarray, force: float, presliding: float, rise: float, creep: float) -> np.ndarray:
    """Friction against the motion (n,) N, positive while the carriage moves along +."""
    out, bristle = np.zeros(len(motor)), 0.0
    for n in range(1, len(motor)):
        step = motor[n] - motor[n - 1]
        limit = presliding * (1 + rise * np.exp(-((step / 1e-3 / creep) ** 2)))
        way = np.sign(step) * limit
        bristle = way + (bristle - way) * np.exp(-abs(step) / limit) if step != 0 else bristle
        out[n] = force * bristle / presliding
    return out
