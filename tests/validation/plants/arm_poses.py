"""Poses of a UR10 that a tracker measured: the energy plant's arm, with faults in it, in a frame that nobody knows."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from tests.validation.plants import serial

JOINTS = ((0, 90, 127.3), (-612, 0, 0), (-572.3, 0, 0), (0, 90, 163.941), (0, -90, 115.7), (0, 0, 92.2))
MASS = (
    (7.1, (21, 0, 27)),
    (12.7, (380, 0, 158)),
    (4.27, (240, 0, 68)),
    (2.0, (0, 7, 18)),
    (2.0, (0, 7, 18)),
    (0.365, (0, 0, -26)),
)
TOOL = (3.0, -4.0, 90.0)


def platform(q):
    """Where the flange of the rigid arm stands (n, 3), base frame."""
    arm = []
    for a, alpha, d in JOINTS:
        arm += [serial.Joint("turn", 2, None), serial.Shift((a, 0.0, d), (np.radians(alpha), 0.0, 0.0))]
    return serial.settle(arm, q, np.zeros(3)).tip


def measured(q, seed, *, longer=0.0, soft=0.0, offset=0.0, noise=0.02, error=0.0):
    """Tracker points (n, 3) at joints q (n, 6): elbow link longer, shoulder lift soft (rad/Nmm), elbow off by an angle.

    error (n, 6) rad: what the joints stand off their encoders besides.
    """
    arm = []
    for i, ((a, alpha, d), (kg, centre)) in enumerate(zip(JOINTS, MASS, strict=True)):
        arm.append(serial.Joint("turn", 2, 1.0 / soft if i == 1 and soft else None))
        turn = Rotation.from_euler("X", alpha, degrees=True).as_rotvec()
        arm += [serial.Shift((a - longer if i == 2 else a, 0.0, d), tuple(turn)), serial.Weight(kg * 9.80665, centre)]
    arm.append(serial.Shift(TOOL))
    rng = np.random.default_rng(seed)
    tip = serial.settle(arm, q + error + offset * np.eye(6)[2], np.zeros(3)).tip
    frame = Rotation.from_euler("XYZ", rng.uniform(-0.3, 0.3, 3))
    return frame.apply(tip) + rng.uniform(-3000, 3000, 3) + noise * rng.standard_normal(tip.shape)
