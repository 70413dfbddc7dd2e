"""Blocks for an arc that give the intended arc although their words are rounded.

A block states the end of an arc, not its sweep. Where rounding makes start and end coincide, a tiny arc would become a full
circle; where it separates them, a full circle would become a tiny arc. Both are divided or replaced by lines here.
"""

import math
from typing import NamedTuple

from camcomp.gcode.arcs import PLANES, SAME_POINT, SPIRAL_INCH, SPIRAL_MM, SPIRAL_RELATIVE, sweep
from camcomp.ground.datatypes import ARC, LINE

_FULL = 2.0 * math.pi
_CHORD = 0.05  # rad
Point = list[float]


class Move(NamedTuple):
    """One block of the output; lengths in mm, program frame."""

    kind: int
    end: Point
    centre: Point
    angle: float


def turns_of(angle: float) -> int:
    """Full or partial turns of a sweep: 1 up to a full circle."""
    return max(1, math.ceil(abs(angle) / _FULL - 1e-6))


def plan(
    start: Point,
    move: Move,
    end: Point,
    plane: int,
    resolution: float,
    *,
    unit: float = 1.0,
    turns_allowed: bool = True,
) -> list[Move]:
    """Blocks for an arc from `start` to `end`, the points of its rounded words.

    One block if it is unambiguous, else several arcs of at most half a turn, or a line for an arc of a few steps of the
    resolution.
    """
    u, v, _ = PLANES[plane]
    radius = math.hypot(start[u] - move.centre[u], start[v] - move.centre[v])
    turns = turns_of(move.angle)
    s, e, c = (start[u], start[v]), (end[u], end[v]), (move.centre[u], move.centre[v])
    slack = 8.0 * resolution
    if _uneven(s, e, c, unit):
        # The tool does not start on the arc; short lines connect the two radii.
        short = divide(start, move, plane, math.ceil(abs(move.angle) / _CHORD))
        return [Move(LINE, each.end, [math.nan] * 3, 0.0) for each in short]
    if radius > slack and (turns == 1 or turns_allowed) and math.dist(e, c) > slack:
        seen = sweep(s, e, c, move.angle > 0.0, turns)
        same = math.dist(s, e) <= SAME_POINT
        # Words that differ by less than the controller's arithmetic do not define a full circle safely.
        near = not same and math.dist(s, e) < 0.5 * resolution
        if abs(seen - move.angle) * radius <= slack and not near:
            return [move]
    if abs(move.angle) * radius <= 4.0 * slack:
        return [Move(LINE, move.end, [math.nan] * 3, 0.0)]
    pieces = max(2, math.ceil(abs(move.angle) / math.pi))
    return divide(start, move, plane, pieces)


def _uneven(s: tuple[float, float], e: tuple[float, float], c: tuple[float, float], unit: float) -> bool:
    first, last = math.dist(s, c) / unit, math.dist(e, c) / unit
    off = abs(first - last)
    return off > 0.5 * (SPIRAL_MM if unit == 1.0 else SPIRAL_INCH) and off > 0.5 * SPIRAL_RELATIVE * max(first, last)


def divide(start: Point, move: Move, plane: int, pieces: int) -> list[Move]:
    """Divide an arc into equal parts; radius and height change linearly from start to end."""
    u, v, w = PLANES[plane]
    c = (move.centre[u], move.centre[v])
    first = math.hypot(start[u] - c[0], start[v] - c[1])
    last = math.hypot(move.end[u] - c[0], move.end[v] - c[1])
    begin = math.atan2(start[v] - c[1], start[u] - c[0])
    moves = []
    for k in range(1, pieces + 1):
        share = k / pieces
        angle = begin + share * move.angle
        radius = first + share * (last - first)
        end = list(move.end)
        if k < pieces:
            end[u], end[v] = c[0] + radius * math.cos(angle), c[1] + radius * math.sin(angle)
            end[w] = start[w] + share * (move.end[w] - start[w])
        moves.append(Move(ARC, end, move.centre, move.angle / pieces))
    return moves
