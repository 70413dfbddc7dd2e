"""Torques of a joint by the bodies behind it, against the virtual work of point masses along a motion."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from camcomp.diagnosis.axis.rigid_bodies import PLACES, torque_columns
from camcomp.ground.datatypes import STANDARD_GRAVITY
from camcomp.model.statics.arm import ARM_LENGTH
from camcomp.model.statics.description import Actuator, Chain, Transform

STEPS = [([0.0, 0.0, 300.0], [90.0, 0.0, 0.0]), ([-400.0, 0.0, 50.0], [0.0, 30.0, 0.0]), ([120.0, 80.0, 0.0], [0.0, 0.0, 45.0])]  # fmt: skip
MASSES = [(0, 9.0, [10.0, -40.0, 30.0]), (1, 5.0, [-150.0, 20.0, 60.0]), (1, 2.0, [40.0, 0.0, -70.0]), (2, 3.0, [60.0, 90.0, 20.0])]  # fmt: skip
Z, T = np.array([0.0, 0.0, 1.0]), np.linspace(0.0, 2.0, 9)


def chain(hinges):
    """Steps (mm, degrees) with a joint about, or along, z in front of each."""
    elements = []
    for k, (way, turn) in enumerate(STEPS):
        elements.append(Actuator(name=f"J{k}", revolute=hinges[k], axis=Z, stiffness=None))
        elements.append(Transform(np.array(way), Rotation.from_euler("xyz", turn, degrees=True).as_matrix()))
    return Chain(name="arm", elements=tuple(elements))


def motion(t, hinges):
    sizes = np.where(hinges, 1.0, 100.0)
    return sizes * np.stack([0.6 * np.sin(1.3 * t), 0.5 * np.cos(2.1 * t), 0.7 * np.sin(1.7 * t + 1.0)], axis=-1)


def place(q, link, centre, hinges):
    """A point of a link (3,) mm."""
    at, turned = np.zeros(3), Rotation.identity()
    for k, (way, turn) in enumerate(STEPS[: link + 1]):
        if hinges[k]:
            turned = turned * Rotation.from_rotvec(q[k] * Z)
        else:
            at = at + turned.apply(q[k] * Z)
        if k == link:
            return at + turned.apply(centre)
        at, turned = at + turned.apply(way), turned * Rotation.from_euler("xyz", turn, degrees=True)


def moments(centre):
    """Mass, first moments and moments of inertia (10,) of a unit mass at a point, in multiples of ARM_LENGTH."""
    c = np.array(centre) / ARM_LENGTH
    inertia = np.dot(c, c) * np.eye(3) - np.outer(c, c)
    return np.array([1.0, *c, *inertia[np.triu_indices(3)]])


def parameters(link, mass, centre):
    """Masses, t, at the places of a link among three that move like a point mass of it."""
    out = np.zeros((3, 10))
    out[link] = 1e-3 * mass * np.linalg.solve(np.transpose([moments(each) for each in PLACES]), moments(centre))
    return out


@pytest.mark.parametrize("hinges", [(True, True, True), (True, False, True)])
@pytest.mark.parametrize("joint", [0, 1, 2])
def test_they_do_the_virtual_work_of_point_masses(joint, hinges):
    h = 1e-4
    q, before, after = (motion(T + s, hinges) for s in (0.0, -h, h))
    columns = torque_columns(chain(hinges), joint, q, (after - before) / (2 * h), (after - 2 * q + before) / h**2)
    own = sum(parameters(*each) for each in MASSES)[joint:].ravel()
    due = np.zeros(len(T))
    for link, mass, centre in MASSES:
        for i in range(len(T)):
            x, y, z = (place(each[i], link, centre, hinges) for each in (before, q, after))
            pull = (x - 2 * y + z) / h**2 + 1e3 * STANDARD_GRAVITY * Z
            e = 1e-5 * np.eye(3)[joint]
            rate = (place(q[i] + e, link, centre, hinges) - place(q[i] - e, link, centre, hinges)) / 2e-5
            due[i] += 1e-3 * mass * rate @ pull
    assert columns @ own == pytest.approx(due, rel=1e-5, abs=1e-5 * np.abs(due).max())
