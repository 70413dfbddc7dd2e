"""The modified target as one would write it for a paper: residuals in numpy, one point at a time, a library's root finder.

The model is that of the truth plant (tests/validation/plants/energy.py): the gradient of the potential energy by platform pose,
passive angles and bar deflections vanishes, and the loaded tip is where it is wanted. The last three unknowns are the
tip to be commanded.
"""

import numpy as np

from tests.validation.plants import energy
from tests.validation.plants.legs import orthoglide
from tests.validation.plants.rotations import rate, turn, vector

LEG = np.arange(3)


class Researcher:
    """The Orthoglide with every leg rolled by 1 degree."""

    def __init__(self):
        self.legs = orthoglide(roll_deg=1.0)
        legs = self.legs
        self.arm = np.array([0.0, 0.0, -legs.tool])
        self.passive, _, self.rows = energy._LAYOUT[legs.kind]
        yielding = np.linalg.inv(np.broadcast_to(legs.foot, (3, 6, 6))).copy()
        yielding[:, 0, 0] += 1.0 / np.asarray(legs.drive)
        self.foot = np.linalg.inv(yielding)
        self.bars = np.broadcast_to(legs.bar, (3, 6, 6))
        self.carriage = legs.axes @ turn(legs.base[:, 3:])
        self.origin = np.einsum("bij,bj->bi", legs.axes, legs.base[:, :3])
        self.back = np.swapaxes(legs.axes, 1, 2)

    def residual(self, u, tip, force):
        """Gradient of the energy and miss of the tip, for u = platform (6), legs (3 k), commanded tip (3)."""
        legs, (p, turned) = self.legs, u[:6].reshape(2, 3)
        r, z = turn(turned[None])[0], u[6:-3].reshape(3, -1)
        walk = energy._leg(legs, np.asarray(legs.length), legs.end, z)
        walk.rotate(self.back)
        a_t = np.swapaxes(self.carriage, 1, 2)
        g = a_t @ r @ np.swapaxes(walk.r, 1, 2)
        lever = np.einsum("bij,bj->bi", g, walk.t)
        rail = np.zeros((3, 3))
        rail[:, 0] = energy.inverse(legs, u[-3:])[0] - legs.offset
        gap = np.empty((3, 6))
        gap[:, :3] = np.einsum("bij,bj->bi", a_t, p - self.origin) - rail - lever
        gap[:, 3:] = vector(g)
        unrate = np.linalg.inv(rate(gap[:, 3:]))
        by_z = np.concatenate([-(g @ walk.m), -(unrate @ g @ walk.w)], axis=1)
        by_pose = np.zeros((3, 6, 6))
        by_pose[:, :3, :3] = a_t
        by_pose[:, :3, 3:] = np.cross(lever[:, None, :], np.swapaxes(a_t, 1, 2)).swapaxes(1, 2)
        by_pose[:, 3:, 3:] = unrate @ a_t
        springs = energy._parallelogram(self.bars, legs.width, z[:, 1]) if legs.kind == "parallelogram" else self.bars
        wrench = np.einsum("bij,bj->bi", self.foot, gap)
        of_legs = np.einsum("bji,bj->bi", by_z, wrench)
        of_legs[:, self.passive :] += np.einsum(
            "bij,bj->bi", springs[:, self.rows][:, :, self.rows], z[:, self.passive :]
        )
        of_pose = np.einsum("bji,bj->i", by_pose, wrench)
        of_pose[:3] -= force
        of_pose[3:] -= np.cross(r @ self.arm, force)
        return np.concatenate((of_pose, of_legs.ravel(), 1e4 * (p + r @ self.arm - tip)))

    def commanded(self, tip, force, start, root):
        """Unknowns (for the next point) and the tip to be commanded (3,), by `root` from a start or from the perfect machine."""
        if start is None:
            rho = energy.inverse(self.legs, tip)
            legs = energy._start(self.legs, rho, energy.direct(self.legs, rho))
            start = np.concatenate((tip - self.arm, np.zeros(3), legs.ravel(), tip))
        found = root(self.residual, start, args=(tip, force), tol=1e-12)
        return found.x, found.x[-3:]
