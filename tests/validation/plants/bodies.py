"""What masses, warmth and a soft foundation do to an arm: truth plants for poses and motions of the KUKA of kuka.py.

Inertia by Lagrange's equation from the kinetic energy of the links' centres of mass; a foundation by the balance of moments
about its foot at the turned pose; a longer link by walking the table again.  Angles in rad, mm, N, kg, s.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from tests.validation.plants.kuka import ROWS, G

BASE = np.array([0.0, 0.0, 225.6])


def walk(q: np.ndarray, longer: dict[int, float] | None = None, tool: float = 250.0) -> tuple[np.ndarray, np.ndarray]:
    """Tip (3,) and centres of mass (6, 3) at joint angles q (6,); longer: mm by which the step of a row is longer."""
    at, turned, centres = BASE, Rotation.identity(), []
    for k, (a, alpha, d, theta, _, _, centre) in enumerate(ROWS):
        turned = turned * Rotation.from_euler("z", q[k] + np.radians(theta))
        step = np.array([a, 0.0, d])
        step = step * (1.0 + (longer or {}).get(k, 0.0) / max(np.linalg.norm(step), 1e-9))
        at = at + turned.apply(step)
        turned = turned * Rotation.from_euler("x", alpha, degrees=True)
        centres.append(at + turned.apply(centre))
    return at + turned.apply([0.0, 0.0, tool]), np.array(centres)


def mass_matrix(q: np.ndarray, h: float = 1e-5) -> np.ndarray:
    """Kinetic energy of joint rates v is v M v / 2, N mm s2: (6, 6)."""
    slopes = np.stack([(walk(q + e)[1] - walk(q - e)[1]) / (2 * h) for e in h * np.eye(6)], axis=2)
    kilograms = np.array([row[5] for row in ROWS])
    return 1e-3 * np.einsum("k,kij,kil->jl", kilograms, slopes, slopes)


def inertia_torques(motion, t: float, h: float = 1e-3) -> np.ndarray:
    """Torque (6,) N mm that accelerates the links; motion: t -> joint angles (6,)."""

    def rate(at: float) -> np.ndarray:
        return (motion(at + h) - motion(at - h)) / (2 * h)

    def momentum(at: float) -> np.ndarray:
        return mass_matrix(motion(at)) @ rate(at)

    q, v, step = motion(t), rate(t), 1e-4
    by_place = [v @ (mass_matrix(q + e) - mass_matrix(q - e)) @ v / (4 * step) for e in step * np.eye(6)]
    return (momentum(t + h) - momentum(t - h)) / (2 * h) - np.array(by_place)


def on_pedestal(q: np.ndarray, force: np.ndarray, soft: np.ndarray, depth: float) -> np.ndarray:
    """Tip (3,) of a rigid arm whose base turns on springs about a point `depth` below the origin of the machine.

    soft (3, 3): rad per N mm.
    """
    tip, centres = walk(q)
    foot = np.array([0.0, 0.0, -depth])
    pulls = np.vstack([[[0.0, 0.0, -G * row[5]] for row in ROWS], force])

    turn = np.zeros(3)
    for _ in range(30):
        points = foot + Rotation.from_rotvec(turn).apply(np.vstack([centres, tip]) - foot)
        turn = soft @ np.cross(points - foot, pulls).sum(axis=0)
    return points[-1]


def slow_follower(setpoint, speed: float, until: float, step: float = 1e-4) -> tuple[np.ndarray, np.ndarray]:
    """Times and positions of a drive that goes no faster than `speed` towards a set-point t -> x, by small steps from rest."""
    time = np.arange(0.0, until, step)
    at, out = setpoint(0.0), []
    for t in time:
        way = setpoint(t) - at
        at += np.sign(way) * min(abs(way), speed * step)
        out.append(at)
    return time, np.array(out)
