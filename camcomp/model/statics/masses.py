"""Forces of the masses that a machine's drives move: weight and inertia of the bodies, along a motion, in numpy.

Body k of mass m_k at c_k(t) loads the machine with m_k (g - c_k''). The drive of joint j balances the inertia of all bodies
behind it: for a hinge about axis a through p, a . ((c_k - p) x m_k c_k''); for a slide along a, a . m_k c_k''. The base
carries the weights, without their inertia, because a program does not state decelerations. Bodies are point masses; those
behind a passive joint do not count.

Source: Newton-Euler equations of a serial chain of point masses (Siciliano et al., Robotics, 7.3).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Self

import numpy as np

from camcomp.ground.datatypes import STANDARD_GRAVITY, Floats
from camcomp.ground.records import dataclass, replace
from camcomp.model.statics.description import (
    Actuator,
    Chain,
    Parallelogram,
    Passive,
    Robot,
    Transform,
    Weight,
)
from camcomp.model.statics.rotation import rotations_of

ACCELERATION_STEP_S = 0.01  # half width of a second difference: above it structures of 10 to 30 Hz do not follow
_N_PER_KG_MM_S2 = 1e-3
_UP = np.array([0.0, 0.0, 1e3 * STANDARD_GRAVITY])  # mm/s2
_STEP_S = 1e-3  # half width of the second difference of places


@dataclass(frozen=True, eq=False)
class MassLoads:
    """Loads of the masses of a machine in n instants: on m drives and on the base.

    drive (n, m): force of the drives that accelerates the masses, N or N mm; base (n, 6): force and moment of the weights
    about the machine's origin, N and N mm.
    """

    drive: Floats
    base: Floats

    def at(self, rows: Callable[[Floats], Floats]) -> Self:
        """Loads at other instants; rows: values (n, c) -> (k, c)."""
        return replace(self, drive=rows(self.drive), base=rows(self.base))


@dataclass(frozen=True, eq=False)
class _Joint:
    """Joint in front of a body: index of its actuator, axis (n, 3), point on it (n, 3), whether it is a hinge."""

    index: int
    axis: Floats
    point: Floats
    revolute: bool


@dataclass(frozen=True, eq=False)
class _Body:
    """Weight (3,) N of a body, its centre of mass (n, 3) mm, the joints that move it."""

    weight: Floats
    centre: Floats
    joints: tuple[_Joint, ...]

    @property
    def mass_kg(self) -> float:
        return float(np.linalg.norm(self.weight)) / STANDARD_GRAVITY

    def drive(self, joint: _Joint, speeding: Floats) -> Floats:
        """Force or torque (n,) of the drive of a joint that accelerates the body by `speeding` (n, 3) mm/s2, N or N mm."""
        inertia = _N_PER_KG_MM_S2 * self.mass_kg * speeding
        along = np.cross(self.centre - joint.point, inertia) if joint.revolute else inertia
        return np.asarray(np.einsum("ni,ni->n", joint.axis, along))


def has_moved_mass(robot: Robot, actuator: str | None = None) -> bool:
    """Whether the machine file states a mass that this actuator (None: any) moves, in front of a passive joint."""
    for chain in robot.chains:
        names: list[str] = []
        for e in chain.elements:
            if isinstance(e, Passive | Parallelogram):
                break
            if isinstance(e, Actuator):
                names.append(e.name)
            elif isinstance(e, Weight) and names and actuator in (None, *names):
                return True
    return False


def mass_loads(robot: Robot, q: Floats, time: Floats | None = None) -> MassLoads:
    """Loads of all stated masses on drives and base.

    Args:
        robot: the machine.
        q: (n, m) actuator coordinates, mm or rad.
        time: (n,) s, not decreasing; None for poses at rest.
    """
    bodies = list(_all_bodies(robot, q))
    speeding = [np.zeros_like(each.centre) if time is None else acceleration(time, each.centre) for each in bodies]
    return _loads(bodies, speeding, q.shape)


def mass_loads_around(robot: Robot, q: Floats, around: Sequence[Floats], step_s: float) -> MassLoads:
    """Loads of all stated masses at coordinates q (n, m), accelerated as at an instant near by.

    around: coordinates (n, m) step_s before, at and step_s after that instant.
    """
    before, here, after = (list(_all_bodies(robot, each)) for each in around)
    speeding = [(c.centre - 2.0 * b.centre + a.centre) / step_s**2 for a, b, c in zip(before, here, after, strict=True)]
    return _loads(list(_all_bodies(robot, q)), speeding, q.shape)


def _loads(bodies: Sequence[_Body], speeding: Sequence[Floats], shape: tuple[int, ...]) -> MassLoads:
    """Loads of bodies whose centres accelerate by `speeding` (n, 3) mm/s2; shape: rows and actuators."""
    drive, base = np.zeros(shape), np.zeros((shape[0], 6))
    for body, change in zip(bodies, speeding, strict=True):
        for joint in body.joints:
            drive[:, joint.index] += body.drive(joint, change)
        base += np.hstack([np.broadcast_to(body.weight, change.shape), np.cross(body.centre, body.weight)])
    return MassLoads(drive, base)


def weight_and_inertia(robot: Robot, q: Floats, speed: Floats, acceleration: Floats) -> tuple[Floats, Floats]:
    """Forces (n, m) N, torques N mm, of rigid drives against the weight of all stated masses, and for their acceleration.

    q, speed, acceleration (n, m): of all actuators, mm or rad, per s, per s^2.
    """
    weight, inertia, start = np.zeros(q.shape), np.zeros(q.shape), 0
    for chain in robot.chains:
        for body, speeding in moving_bodies(chain, q, speed, acceleration, start):
            for joint in body.joints:
                weight[:, joint.index] += body.drive(joint, np.broadcast_to(_UP, speeding.shape))
                inertia[:, joint.index] += body.drive(joint, speeding)
        start += sum(isinstance(e, Actuator) for e in chain.elements)
    return weight, inertia


def moving_bodies(
    chain: Chain, q: Floats, speed: Floats, acceleration: Floats, start: int = 0
) -> Iterator[tuple[_Body, Floats]]:
    """Bodies of a chain in motion, each with the acceleration (n, 3) mm/s2 of its centre.

    q, speed, acceleration (n, m): of all actuators. start: index of the chain's first actuator.
    """
    around = (q + s * _STEP_S * speed + 0.5 * _STEP_S**2 * acceleration for s in (-1.0, 1.0))
    places = (bodies_of(chain, each, start) for each in (q, *around))
    for here, before, after in zip(*places, strict=True):
        yield here, (before.centre - 2.0 * here.centre + after.centre) / _STEP_S**2


def acceleration(time: Floats, values: Floats) -> Floats:
    """Second derivative (n, c), per s2, of values (n, c) at times (n,) s; at both ends that of the nearest inner instant.

    Divided differences of each instant with the next ones at least ACCELERATION_STEP_S before and after it: exact for
    constant acceleration.
    """
    out = np.zeros_like(values)
    before = np.searchsorted(time, time - ACCELERATION_STEP_S, side="right") - 1
    after = np.searchsorted(time, time + ACCELERATION_STEP_S, side="left")
    inner = np.flatnonzero((before >= 0) & (after < len(time)))
    if not len(inner):
        return out
    low, high = before[inner], after[inner]
    back, ahead = (time[inner] - time[low])[:, None], (time[high] - time[inner])[:, None]
    bend = (values[high] - values[inner]) / ahead - (values[inner] - values[low]) / back
    out[inner] = 2.0 * bend / (ahead + back)
    out[: inner[0]], out[inner[-1] + 1 :] = out[inner[0]], out[inner[-1]]
    return out


def _all_bodies(robot: Robot, q: Floats) -> Iterator[_Body]:
    """Bodies of all chains along actuator coordinates q (n, m)."""
    start = 0
    for chain in robot.chains:
        yield from bodies_of(chain, q, start)
        start += sum(isinstance(e, Actuator) for e in chain.elements)


def bodies_of(chain: Chain, q: Floats, start: int = 0) -> Iterator[_Body]:
    """Bodies of a chain, along actuator coordinates q (n, m); start: index of the chain's first actuator."""
    n = len(q)
    rotation, point = np.broadcast_to(chain.frame, (n, 3, 3)), np.zeros((n, 3))
    joints: list[_Joint] = []
    for e in chain.elements:
        if isinstance(e, Transform):
            point, rotation = point + rotation @ e.translation, rotation @ e.rotation
        elif isinstance(e, Actuator):
            value, axis = q[:, start + len(joints)], rotation @ e.axis
            joints.append(_Joint(start + len(joints), axis, point, e.revolute))
            if e.revolute:
                rotation = rotation @ rotations_of(value[:, None] * e.axis)
            else:
                point = point + value[:, None] * axis
        elif isinstance(e, Weight):
            yield _Body(np.asarray(e.force, float), point + rotation @ e.centre, tuple(joints))
        elif isinstance(e, Passive | Parallelogram):
            return
