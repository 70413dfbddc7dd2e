"""The six-axis arm of the machine library as a truth plant: its table typed in again, composed by scipy rotations."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from tests.validation.plants.serial import Element, Joint, Shift, Weight

# a mm, alpha deg, d mm, theta deg, N mm/rad, kg, centre mm
ROWS = (
    (350, -90, 449.4, 0, 2.207e9, 259.9, (-175, 0, 0)),
    (1150, 0, 0, 0, 3.377e9, 334.7, (-575, 0, 0)),
    (41, -90, 0, 90, 2.776e9, 217.5, (0, 0, -300)),
    (0, 90, -1200, 0, 2.350e9, 12.2, (0, 100, 0)),
    (0, -90, 0, 0, 2.157e9, 29.5, (0, 0, -100)),
    (0, 180, -420, 180, 4.671e8, 46.5, (0, 0, -80)),
)
G = 9.80665


def arm(tool: float = 250.0, weights: bool = True) -> list[Element]:
    """Elements from base to tool tip."""
    out: list[Element] = [Shift((0.0, 0.0, 225.6))]
    for a, alpha, d, theta, k, kg, centre in ROWS:
        out.append(Joint("turn", 2, k))
        turn = Rotation.from_euler("ZX", [theta, alpha], degrees=True)
        step = Rotation.from_euler("Z", theta, degrees=True).apply([a, 0.0, d])
        out.append(Shift(tuple(step), tuple(turn.as_rotvec())))
        if weights:
            out.append(Weight(kg * G, centre))
    return [*out, Shift((0.0, 0.0, 0.0), (np.pi, 0.0, 0.0)), Shift((0.0, 0.0, -tool))]
