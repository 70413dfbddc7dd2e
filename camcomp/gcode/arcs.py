"""Circular and helical moves: centre and sweep from the words of a block.

Plane coordinates (u, v) are right-handed about the plane's axis: X, Y about Z for G17; Z, X about Y for G18; Y, Z about
X for G19. So a counter-clockwise arc (G3) has a positive sweep in every plane.
"""

import math

# Indices of u, v and of the axis among X, Y, Z.
PLANES: dict[int, tuple[int, int, int]] = {17: (0, 1, 2), 18: (2, 0, 1), 19: (1, 2, 0)}

# Tolerances of LinuxCNC for the two radii of an I/J/K arc, and for the end of an R arc,
# in programmed units; measured on its stand-alone interpreter, for (mm, inch).
SPIRAL_MM, SPIRAL_INCH = 2.0e-2 * math.sqrt(2.0), 2.0e-3 * math.sqrt(2.0)
SPIRAL_RELATIVE = 1.0e-3
SPIRAL_CAP = 100.0
REACH_MM, REACH_INCH = 1.27e-3, 5.0e-5
SAME_POINT = 1.0e-9


class ArcError(Exception):
    """The words define no arc; rule id and message for the reader, which adds the location."""

    def __init__(self, rule: str, message: str) -> None:
        super().__init__(message)
        self.rule = rule
        self.message = message


def centre_of_radius(
    start: tuple[float, float], end: tuple[float, float], radius: float, ccw: bool, inch: bool = False
) -> tuple[float, float]:
    """Centre of the arc of given radius; a negative radius selects the arc longer than a half circle."""
    u, v = end[0] - start[0], end[1] - start[1]
    chord = math.hypot(u, v)
    size = abs(radius)
    if chord <= SAME_POINT:
        raise ArcError("CC112", "an arc given by R ends where it starts, so its centre is not defined")
    if size == 0.0:
        raise ArcError("CC112", "an arc has radius zero")
    excess = chord / 2.0 - size
    if excess > (REACH_INCH if inch else REACH_MM):
        raise ArcError("CC112", f"radius {size:.6g} is too small to reach the end point, {chord:.6g} away")
    height = math.sqrt(max(0.0, (size - chord / 2.0) * (size + chord / 2.0)))
    if chord / 2.0 > size * (1.0 - 1e-12):
        height = 0.0
    side = 1.0 if ccw == (radius > 0.0) else -1.0
    return (
        (start[0] + end[0]) / 2.0 - side * height * v / chord,
        (start[1] + end[1]) / 2.0 + side * height * u / chord,
    )


def check_radii(
    start: tuple[float, float], end: tuple[float, float], centre: tuple[float, float], inch: bool = False
) -> None:
    """Raise ArcError if start and end are not on one circle about the centre within a controller's tolerance."""
    first = math.hypot(start[0] - centre[0], start[1] - centre[1])
    last = math.hypot(end[0] - centre[0], end[1] - centre[1])
    limit = SPIRAL_INCH if inch else SPIRAL_MM
    if min(first, last) < 0.1 * (REACH_INCH if inch else REACH_MM):
        raise ArcError("CC112", "an arc has radius zero")
    off = abs(first - last)
    if off > SPIRAL_CAP * limit or (off > limit and off > SPIRAL_RELATIVE * max(first, last)):
        raise ArcError("CC111", f"radius is {first:.6g} at the start of the arc and {last:.6g} at its end")


def sweep(
    start: tuple[float, float],
    end: tuple[float, float],
    centre: tuple[float, float],
    ccw: bool,
    turns: int = 1,
) -> float:
    """Signed angle in rad from start to end about the centre; equal points mean a full circle."""
    if math.hypot(start[0] - end[0], start[1] - end[1]) <= SAME_POINT:
        angle = 2.0 * math.pi
    else:
        a, b = start[0] - centre[0], start[1] - centre[1]
        c, d = end[0] - centre[0], end[1] - centre[1]
        angle = math.atan2(a * d - b * c, a * c + b * d)
        if not ccw:
            angle = -angle
        if angle <= 0.0:
            angle += 2.0 * math.pi
    angle += 2.0 * math.pi * (turns - 1)
    return angle if ccw else -angle
