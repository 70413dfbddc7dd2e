"""Milling forces on the tool, averaged over a revolution.

Frame of this module (Altintas, Manufacturing Automation, section 2.7): x along the feed of the tool relative to the
work, y left of it, z up the tool; spindle clockwise seen from above. A tooth at immersion phi sits at
(sin phi, cos phi), moves along (cos phi, -sin phi), and takes a chip of thickness h = c sin phi. The work pushes it
back against its motion (tangential force) and towards the tool centre (radial force):

    dFx = -dFt cos phi - dFr sin phi        dFy = dFt sin phi - dFr cos phi        dFz = -dFa

dFa > 0 pulls the tool towards the work, as a right-hand helix on a right-hand cutter does. In a slot the front teeth
run to the right, so the tool is pushed to the LEFT of its feed, and held back.

The mean does not depend on the helix angle: a helix delays each slice of an edge, it does not change its turn.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import beta, betainc

from camcomp.ground.datatypes import Bools, Floats, Ints


def linear_edge(
    chip: ArrayLike,
    depth: ArrayLike,
    teeth: int,
    start: ArrayLike,
    stop: ArrayLike,
    *,
    cutting: ArrayLike,
    edge: ArrayLike,
) -> Floats:
    """Mean (Fx, Fy, Fz) (n, 3) in N of the linear-edge model dF = (Kc h + Ke) dz (Altintas, section 2.7.1).

    chip (n,) mm per tooth, depth (n,) mm, start and stop (n,) rad; cutting (Ktc, Krc, Kac) in N/mm2, edge
    (Kte, Kre, Kae) in N/mm; each may be (n,).
    """
    c, a = np.asarray(chip, float), np.asarray(depth, float)
    ktc, krc, kac = np.asarray(cutting, float)
    kte, kre, kae = np.asarray(edge, float)
    cos1, sin1 = _span(np.cos, start, stop), _span(np.sin, start, stop)
    cos2 = _span(lambda phi: np.cos(2 * phi), start, stop)
    twice = _span(lambda phi: 2 * phi - np.sin(2 * phi), start, stop)
    turn = _span(lambda phi: phi, start, stop)
    x = c / 4 * (ktc * cos2 - krc * twice) - kte * sin1 + kre * cos1
    y = c / 4 * (ktc * twice + krc * cos2) - kte * cos1 - kre * sin1
    z = kac * c * cos1 - kae * turn
    out: Floats = (teeth * a / (2 * np.pi))[..., None] * np.stack([x, y, z], axis=-1)
    return out


def power_law(
    chip: ArrayLike,
    depth: ArrayLike,
    teeth: int,
    start: ArrayLike,
    stop: ArrayLike,
    *,
    kc11: ArrayLike,
    mc: float,
    ratios: ArrayLike,
) -> Floats:
    """Mean (Fx, Fy, Fz) (n, 3) in N of Kienzle's law dFt = kc11 h^(1-mc) dz, h in mm, kc11 in N/mm2.

    ratios: radial and axial force over tangential force, which Kienzle's law does not state; they and kc11 may be (n,).
    """
    c, a, kc11 = np.asarray(chip, float), np.asarray(depth, float), np.asarray(kc11, float)
    radial, axial = np.asarray(ratios, float)
    # Integrals over the engagement of sin^(2-mc), sin^(1-mc) cos and sin^(1-mc).
    square = sine_power(2 - mc, start, stop)
    mixed = _span(lambda phi: np.abs(np.sin(phi)) ** (2 - mc), start, stop) / (2 - mc)
    single = sine_power(1 - mc, start, stop)
    law = np.stack([-mixed - radial * square, square - radial * mixed, -axial * single], axis=-1)
    out: Floats = (teeth * a * kc11 * c ** (1 - mc) / (2 * np.pi))[..., None] * law
    return out


def slanted(radial: ArrayLike, axial: ArrayLike, rise: Floats, run: Floats) -> tuple[Floats, Floats]:
    """Radial and axial parts (n,), about the tool's axis, of forces normal to a slanted surface and along its edge.

    rise, run (n,): of the surface per length of its edge; (1, 0) at the side of a cylinder, (0, 1) under a tool's tip.
    """
    normal, along = np.asarray(radial, float), np.asarray(axial, float)
    return normal * rise + along * run, along * rise - normal * run


def summed(force: Floats, place: Ints, places: int) -> Floats:
    """Forces (b, 3) of parts of the tool's edges added up at their places (places, 3)."""
    return np.column_stack([np.bincount(place, each, places) for each in force.T])


def sine_power(power: float, start: ArrayLike, stop: ArrayLike) -> Floats:
    """Integral of sin(phi)^power from start to stop (n,), 0 <= phi <= pi, by the incomplete beta function.

    Counted from the crest at pi/2, where a substitution of cos^2 makes it half a beta function on each side; exact
    for broken powers too, where a quadrature would suffer from the steep ends.
    """
    half = (power + 1) / 2

    def from_crest(phi: Floats) -> Floats:
        out: Floats = (
            np.sign(phi - np.pi / 2) * beta(0.5, half) / 2 * betainc(0.5, half, np.minimum(np.cos(phi) ** 2, 1.0))
        )
        return out

    return _span(from_crest, start, stop)


def to_path(force: Floats, clockwise: bool | Bools) -> Floats:
    """(Fx, Fy, Fz) (n, 3) of this module as (Fr, Ft, Fz) on the tool; e_r is right of the feed, hence Fr = -Fy.

    clockwise: the sense of the spindle, of all rows or of each (n,).

    A counter-clockwise spindle with a left-hand cutter is the mirror image in the plane of feed and tool axis.
    """
    right = np.where(clockwise, -force[..., 1], force[..., 1])
    return np.stack([right, force[..., 0], force[..., 2]], axis=-1)


def _span(f: Callable[[Floats], Floats], start: ArrayLike, stop: ArrayLike) -> Floats:
    return f(np.asarray(stop, float)) - f(np.asarray(start, float))
