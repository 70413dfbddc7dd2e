"""Static truth plant: the loaded pose is the minimum of the total potential energy.

Unknowns are the platform pose and, in every leg, the passive angles and the deflection of the bar.  The foot (in series
with the drive spring) closes the loop: its deflection is whatever gap the rest leaves, so closure holds exactly and there
are no constraints.  The energy is sum of 1/2 xi' K xi minus the work of the dead loads; its gradient is exact with
finite rotations, the iteration matrix is the Gauss-Newton one, and iteration stops when the step is below 1e-10 mm.
A parallelogram's K follows its angle q but is held fixed while the energy is differentiated.

Nothing is linearised and no stiffness matrix of a chain is ever formed, which is what makes this a check on codes that
work with chain stiffnesses and force balances.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tests.validation.plants.legs import Legs
from tests.validation.plants.rotations import Walk, cross, rate, turn, vector


class Settled(NamedTuple):
    """Loaded equilibria of n points: tip and platform reference (n, 3) mm, drive forces (n, 3) N, tilt (n, 3) rad.

    drive: force of each drive on its carriage, positive along the actuator.  gap_mm: size of the last step.
    """

    tip: np.ndarray
    drive: np.ndarray
    tilt: np.ndarray
    reference: np.ndarray
    gap_mm: np.ndarray
    iterations: int


def inverse(legs: Legs, tip: np.ndarray) -> np.ndarray:
    """Actuator coordinates (n, 3) mm of the perfect machine for the tips (n, 3) mm, assembly mode s = -1.

    Slides are the machine's axes.
    """
    p = np.atleast_2d(tip) + [0.0, 0.0, legs.tool]
    square = (p**2).sum(1, keepdims=True) - p**2
    reach = legs.nominal_length**2 - square
    if (reach <= 0).any():
        raise ValueError("a tip is out of reach")
    return p - np.sqrt(reach)


def direct(legs: Legs, rho: np.ndarray) -> np.ndarray:
    """Platform references (n, 3) of the perfect machine for actuator coordinates (n, 3), by Newton on the spheres."""
    p, centres = np.zeros_like(rho), legs.centres(rho)
    for _ in range(60):
        d = p[:, None, :] - centres
        error = (d**2).sum(2) - legs.nominal_length**2
        step = np.linalg.solve(2 * d, error[:, :, None])[:, :, 0]
        p = p - step
        if np.abs(step).max() < 1e-11:
            return p
    raise ValueError("direct kinematics did not converge")


def _parallelogram(bar: np.ndarray, width: float, q: np.ndarray) -> np.ndarray:
    """Stiffness (b, 6, 6) of two bars at distance `width`, turned by q; row 3 is the free direction."""
    k = np.zeros((len(q), 6, 6))
    c2, s2, d2 = np.cos(q) ** 2, np.sin(q) ** 2, width**2
    lateral = bar[:, 1, 1]
    k[:, 0, 0], k[:, 1, 1] = bar[:, 0, 0], lateral
    k[:, 1, 5] = k[:, 5, 1] = bar[:, 1, 5]
    k[:, 3, 3] = bar[:, 3, 3] + d2 * c2 * lateral / 4
    k[:, 3, 5] = k[:, 5, 3] = d2 * np.sin(2 * q) * lateral / 8
    k[:, 4, 4] = d2 * c2 * bar[:, 0, 0] / 4
    k[:, 5, 5] = bar[:, 5, 5] + d2 * s2 * lateral / 4
    return 2 * k


# coordinates of a leg: passive angles first, then the bar's deflection
_LAYOUT = {
    "parallelogram": (3, [3, 4, None, 5, 6, 7], [0, 1, 3, 4, 5]),
    "universal": (4, [4, 5, 6, 7, 8, 9], [0, 1, 2, 3, 4, 5]),
}


def _leg(legs: Legs, length: np.ndarray, end: np.ndarray, z: np.ndarray) -> Walk:
    """From the foot's far side to the platform, in the leg's local axes."""
    passive, slots, rows = _LAYOUT[legs.kind]
    xi = np.zeros((len(z), 6))
    xi[:, rows] = z[:, passive:]
    walk = Walk(len(z), z.shape[1])
    walk.hinge(2, z[:, 0], 0)
    walk.hinge(1, z[:, 1], 1)
    walk.shift(np.stack([length, 0 * length, 0 * length], 1))
    walk.spring(xi, slots)
    if legs.kind == "parallelogram":
        walk.hinge(1, z[:, 1], 1, -1.0)
        walk.hinge(2, z[:, 2], 2)
    else:
        walk.hinge(1, z[:, 2], 2)
        walk.hinge(2, z[:, 3], 3)
    walk.shift(np.array([legs.offset, 0.0, 0.0]))
    walk.shift(end[:, :3])
    walk.rotate(turn(end[:, 3:]))
    return walk


def _start(legs: Legs, rho: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Leg coordinates (n*3, k) of the perfect unloaded machine."""
    d = np.einsum("lji,nlj->nli", legs.axes, p[:, None, :] - legs.centres(rho)).reshape(-1, 3)
    q2, q1 = -np.arcsin(d[:, 2] / np.linalg.norm(d, axis=1)), np.arctan2(d[:, 1], d[:, 0])
    passive, _, rows = _LAYOUT[legs.kind]
    z = np.zeros((len(d), passive + len(rows)))
    z[:, 0], z[:, 1] = q1, q2
    if legs.kind == "parallelogram":
        z[:, 2] = -q1
    else:
        z[:, 2], z[:, 3] = -q2, -q1
    return z


def settle(
    legs: Legs,
    rho: np.ndarray,
    force: np.ndarray,
    *,
    weight: np.ndarray | float = 0.0,
    moment: np.ndarray | None = None,
    tool: np.ndarray | None = None,
    limit: int = 80,
) -> Settled:
    """Loaded equilibrium for motor positions rho (n, 3) mm and dead loads force (n, 3) N at the tool tip.

    weight: N at the platform reference along machine -z.  moment: further dead moment (n, 3) N mm on the platform.
    tool: tip in the platform frame (3,), default (0, 0, -legs.tool).  Raises if the iteration does not settle.
    """
    rho = np.atleast_2d(np.asarray(rho, float))
    n = len(rho)
    force = np.broadcast_to(np.asarray(force, float), (n, 3))
    weight = np.broadcast_to(np.asarray(weight, float), n)
    arm = np.array([0.0, 0.0, -legs.tool]) if tool is None else np.asarray(tool, float)
    p, r = direct(legs, rho), np.broadcast_to(np.eye(3), (n, 3, 3)).copy()
    z = _start(legs, rho, p)
    leg = np.tile(np.arange(3), n)
    passive, _, rows = _LAYOUT[legs.kind]
    length, drive = np.asarray(legs.length)[leg], np.asarray(legs.drive)[leg]
    yielding = np.linalg.inv(np.broadcast_to(legs.foot, (3, 6, 6)))[leg]
    slide = np.array(legs.slide)
    yielding[:, :3, :3] += (
        np.outer(slide, slide) / drive[:, None, None]
    )  # the drive spring and the foot are in series along the actuator
    foot = np.linalg.inv(yielding)
    bars = np.broadcast_to(legs.bar, (3, 6, 6))[leg]
    base, end = legs.base[leg], legs.end[leg]
    axes = legs.axes[leg]
    a = axes @ turn(base[:, 3:])  # carriage axes in the machine frame
    a_t = np.swapaxes(a, 1, 2)
    column = legs.feet - slide * (slide @ legs.feet)  # about this point a base is rolled
    origin = np.einsum("bij,bj->bi", axes, base[:, :3] + column)
    rail = rho.reshape(-1, 1) * slide + (legs.feet - column)
    back = np.swapaxes(axes, 1, 2)  # the leg ends in its local axes, the platform is parallel to the machine
    k = passive + len(rows)
    gap = np.zeros((3 * n, 6))
    step = 0
    while step < limit:
        step += 1
        walk = _leg(legs, length, end, z)
        walk.rotate(back)
        p3, r3 = np.repeat(p, 3, 0), np.repeat(r, 3, 0)
        g = a_t @ r3 @ np.swapaxes(walk.r, 1, 2)
        lever = np.einsum("bij,bj->bi", g, walk.t)
        gap[:, :3] = np.einsum("bij,bj->bi", a_t, p3 - origin) - rail - lever
        gap[:, 3:] = vector(g)
        unrate = np.linalg.inv(rate(gap[:, 3:]))
        jz = np.concatenate([-(g @ walk.m), -(unrate @ g @ walk.w)], 1)
        jp = np.zeros((3 * n, 6, 6))
        jp[:, :3, :3] = a_t
        jp[:, :3, 3:] = cross(lever[:, None, :], np.swapaxes(a_t, 1, 2)).swapaxes(1, 2)
        jp[:, 3:, 3:] = unrate @ a_t
        springs = _parallelogram(bars, legs.width, z[:, 1]) if legs.kind == "parallelogram" else bars
        kz = np.zeros((3 * n, k, k))
        kz[:, passive:, passive:] = springs[:, rows][:, :, rows]
        load = np.einsum("bij,bj->bi", foot, gap)
        gz = np.einsum("bji,bj->bi", jz, load) + np.einsum("bij,bj->bi", kz, z)
        gp = np.einsum("bji,bj->bi", jp, load).reshape(n, 3, 6).sum(1)
        tip_arm = r @ arm
        gp[:, :3] -= force
        gp[:, 2] += weight
        gp[:, 3:] -= cross(tip_arm, force)
        if moment is not None:
            gp[:, 3:] -= moment
        fj = foot @ jz
        hzz, hpz = np.swapaxes(jz, 1, 2) @ fj + kz, np.swapaxes(jp, 1, 2) @ fj
        hpp = (np.swapaxes(jp, 1, 2) @ foot @ jp).reshape(n, 3, 6, 6).sum(1)
        solved = np.linalg.solve(hzz, np.concatenate([np.swapaxes(hpz, 1, 2), gz[:, :, None]], 2))
        reduced = (hpz @ solved).reshape(n, 3, 6, 7).sum(1)
        dx = -np.linalg.solve(hpp - reduced[:, :, :6], (gp - reduced[:, :, 6])[:, :, None])[:, :, 0]
        dz = -solved[:, :, 6] - np.einsum("bij,bj->bi", solved[:, :, :6], np.repeat(dx, 3, 0))
        p = p + dx[:, :3]
        r = turn(dx[:, 3:]) @ r
        z = z + dz
        size = np.maximum(np.abs(dx[:, :3]).max(1), 400 * np.abs(dx[:, 3:]).max(1))
        size = np.maximum(size, 400 * np.abs(dz[:, :passive]).reshape(n, -1).max(1))
        if size.max() < 1e-10:
            break
    else:
        raise ArithmeticError(f"energy did not settle: last step {size.max():.2e} mm")
    return Settled(p + r @ arm, -load.reshape(n, 3, 6)[:, :, :3] @ slide, vector(r), p, size, step)


def compliance(legs: Legs, reference: np.ndarray, load: float = 1.0) -> np.ndarray:
    """Translational compliance (3, 3) mm/N at a platform reference (3,): central differences of the energy minimum."""
    rho = inverse(legs, np.asarray(reference, float) - [0, 0, legs.tool])
    push = np.concatenate([np.eye(3), -np.eye(3)]) * load
    tips = settle(legs, np.repeat(rho, 6, 0), push).tip
    return (tips[:3] - tips[3:]).T / (2 * load)
