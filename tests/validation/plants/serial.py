"""Static truth plant for serial arms: minimum of the elastic energy minus the work of the loads and weights.

An arm is a list of elements from the base to the tip, built with the small functions below.  Every joint and every
elastic link contributes its deflections as unknowns; the tip and the centres of the weights follow from them exactly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from tests.validation.plants.rotations import Walk, cross, turn, vector


@dataclass(frozen=True)
class Shift:
    """Fixed translation (3,) mm, then a fixed rotation vector (3,) rad."""

    by: tuple[float, float, float]
    turned: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Joint:
    """Actuated joint about ("turn") or along ("slide") a coordinate axis 0, 1, 2; stiffness None is rigid.

    play: full width of a dead zone in its spring, which has no energy there.
    """

    motion: str
    axis: int
    stiffness: float | None
    sign: float = 1.0
    play: float = 0.0


@dataclass(frozen=True)
class Link:
    """Elastic link: stiffness (6, 6), translation first."""

    stiffness: np.ndarray


@dataclass(frozen=True)
class Weight:
    """A weight (N) along machine -z at a point fixed in the frame reached so far."""

    newton: float
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)


Element = Shift | Joint | Link | Weight


@dataclass(frozen=True)
class ArmSettled:
    """tip (n, 3) mm; drive (n, m) N or N mm, what each drive exerts, positive along its joint; tilt (n, 3) rad."""

    tip: np.ndarray
    drive: np.ndarray
    tilt: np.ndarray
    orientation: np.ndarray
    iterations: int


def _columns(arm: list[Element]) -> int:
    return sum(1 if isinstance(e, Joint) else 6 if isinstance(e, Link) else 0 for e in arm)


def _walk(arm: list[Element], q: np.ndarray, z: np.ndarray) -> tuple[Walk, list[tuple[float, np.ndarray, int]]]:
    """Chain pose with twists, and (weight, centre (n, 3), number of coordinates before it) of every weight."""
    walk, weights, at, joint = Walk(len(q), z.shape[1]), [], 0, 0
    for e in arm:
        if isinstance(e, Shift):
            walk.shift(np.array(e.by))
            walk.rotate(turn(np.array(e.turned)))
        elif isinstance(e, Joint):
            value = q[:, joint] + z[:, at]
            if e.motion == "turn":
                walk.hinge(e.axis, value, at, e.sign)
            else:
                before = walk.m.copy()
                walk.slide(e.axis, e.sign * value, at)
                walk.m = before + e.sign * (walk.m - before)
            at, joint = at + 1, joint + 1
        elif isinstance(e, Link):
            walk.spring(z[:, at : at + 6], list(range(at, at + 6)))
            at += 6
        else:
            weights.append((e.newton, walk.t + walk.r @ np.array(e.centre), at))
    return walk, weights


def settle(arm: list[Element], q: np.ndarray, force: np.ndarray, limit: int = 200) -> ArmSettled:
    """Loaded equilibrium at joint commands q (n, m) mm or rad under dead tip loads force (n, 3) N."""
    q = np.atleast_2d(np.asarray(q, float))
    n, k = len(q), _columns(arm)
    force = np.broadcast_to(np.asarray(force, float), (n, 3))
    stiffness, joints, free, at = np.zeros((k, k)), [], np.ones(k, bool), 0
    loose = np.zeros(k)
    for e in arm:
        if isinstance(e, Joint):
            joints.append(at)
            stiffness[at, at], free[at] = (1.0, False) if e.stiffness is None else (e.stiffness, True)
            loose[at] = 0.5 * e.play
            at += 1
        elif isinstance(e, Link):
            stiffness[at : at + 6, at : at + 6] = e.stiffness
            at += 6
    z = np.zeros((n, k))
    straight = _walk(arm, q, z)[0].r
    step = 0
    while step < limit:
        step += 1
        walk, weights = _walk(arm, q, z)
        pull = np.einsum("nik,ni->nk", walk.m, force)
        pull += np.einsum("nik,ni->nk", walk.w, cross(walk.t, force))
        for newton, centre, before in weights:
            w = np.array([0.0, 0.0, -newton])
            pull[:, :before] += np.einsum("nik,i->nk", walk.m[:, :, :before], w)
            pull[:, :before] += np.einsum("nik,ni->nk", walk.w[:, :, :before], cross(centre, w))
        new = np.linalg.solve(stiffness, pull.T).T * free + loose * np.sign(pull)
        move, z = np.abs(new - z).max(), new
        if move < 1e-14 * max(1.0, np.abs(z).max()) + 1e-13:
            break
    else:
        raise ArithmeticError(f"energy did not settle: last step {move:.2e}")
    walk, _ = _walk(arm, q, z)
    tilt = vector(walk.r @ np.swapaxes(straight, 1, 2))
    return ArmSettled(walk.t, -pull[:, joints], tilt, walk.r, step)


def cartesian(stiffness: tuple[float, float, float]) -> list[Element]:
    """Three slides x, y, z in series with one spring each, N/mm."""
    return [Joint("slide", axis, k) for axis, k in enumerate(stiffness)]


def energy(arm: list[Element], q: np.ndarray, z: np.ndarray, force: np.ndarray) -> float:
    """Total potential energy of one configuration, N mm: q (m,), deflections z (k,), force (3,)."""
    walk, weights = _walk(arm, q[None], z[None])
    total, at = -float(walk.t[0] @ force), 0
    for e in arm:
        if isinstance(e, Joint):
            total += 0.0 if e.stiffness is None else 0.5 * e.stiffness * max(abs(z[at]) - 0.5 * e.play, 0.0) ** 2
            at += 1
        elif isinstance(e, Link):
            total += 0.5 * z[at : at + 6] @ e.stiffness @ z[at : at + 6]
            at += 6
    return total + sum(newton * float(centre[0, 2]) for newton, centre, _ in weights)


def buckle(load: float, length: float, stiffness: float, start: float = 0.1) -> tuple[float, float]:
    """Pinned column of two rigid links with a torsion spring in the middle: (tilt of the links, shortening).

    Minimises 1/2 K (2a)^2 - P 2 l (1 - cos a) over the tilt a > 0, starting from an imperfect column.
    """

    def total(a: np.ndarray) -> float:
        return 2 * stiffness * a[0] ** 2 - 2 * load * length * (1 - np.cos(a[0]))

    def slope(a: np.ndarray) -> np.ndarray:
        return np.array([4 * stiffness * a[0] - 2 * load * length * np.sin(a[0])])

    found = minimize(total, [start], jac=slope, method="L-BFGS-B", bounds=[(0, 3)], options={"ftol": 1e-15})
    a = float(found.x[0])
    for _ in range(20):  # polish: the line search stops at rounding level of the energy, not of the angle
        curvature = 4 * stiffness - 2 * load * length * np.cos(a)
        a -= slope(np.array([a]))[0] / curvature if curvature > 0 and a > 1e-9 else 0.0
    return a, 2 * length * (1 - np.cos(a))
