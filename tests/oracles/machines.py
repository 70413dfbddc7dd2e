"""Shipped machines as plants independent of the model: those of the recorded programs, and three more."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from tests.validation.plants import serial
from tests.validation.plants.kuka import G
from tests.validation.plants.rotations import cross, turn, vector
from tests.validation.recorded import machines
from tests.validation.recorded.faults import Faults
from tests.validation.recorded.machines import GROOVE

INCH = 25.4


class Cartesian(machines.Serial):
    """Three slides in a row."""

    name = "cartesian"
    actuators = ("x", "y", "z")
    origin = np.zeros(3)
    tool = 0.0
    without = (*machines.Serial.without, "link_stiffness")

    def elements(self) -> list[serial.Element]:
        """Springs of the drives, N/mm."""
        return serial.cartesian((2e4, 2e4, 4e4))


class Ur10(machines.Kuka):
    """Six rigid joints that carry weights; the flange is the tip, without a cutting force."""

    name = "ur10"
    actuators = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
    origin = np.array([-688.0, -164.0, 500.0])
    tool = 0.0
    without = (*machines.Serial.without, "link_stiffness", "drive_stiffness", "cutting_force", "gravity")
    # a, alpha, d, kg, centre: manufacturer's table, typed in again
    rows = (
        (0, 90, 127.3, 7.1, (21, 0, 27)), (-612, 0, 0, 12.7, (380, 0, 158)), (-572.3, 0, 0, 4.27, (240, 0, 68)),
        (0, 90, 163.941, 2.0, (0, 7, 18)), (0, -90, 115.7, 2.0, (0, 7, 18)), (0, 0, 92.2, 0.365, (0, 0, -26)),
    )  # fmt: skip

    def elements(self) -> list[serial.Element]:
        """Base to flange, whose z axis points away from the workpiece."""
        out: list[serial.Element] = []
        for a, alpha, d, kg, centre in self.rows:
            bend = Rotation.from_euler("X", alpha, degrees=True).as_rotvec()
            out += [
                serial.Joint("turn", 2, None),
                serial.Shift((a, 0.0, d), tuple(bend)),
                serial.Weight(kg * G, centre),
            ]
        return [*out, serial.Shift((0.0, 0.0, 0.0), (np.pi, 0.0, 0.0))]


class Hexapod:
    """Six springs along the lines between base and platform joints; a wrench of six numbers holds them in balance."""

    name = "hexapod"
    actuators = tuple(f"leg{k}" for k in range(1, 7))
    rotary = False
    origin = np.array([0.0, 0.0, -800.0])
    home = 880.0
    tool = 100.0
    without = ("chain_error",)
    config = machines.ROOT / "config" / "hexapod.yaml"
    # LinuxCNC, src/emc/kinematics/genhexkins.h
    base = INCH * np.array([
        [-22.95, 13.25, 0], [22.95, 13.25, 0], [22.95, 13.25, 0], [0, -26.5, 0], [0, -26.5, 0], [-22.95, 13.25, 0],
    ])  # fmt: skip
    platform = INCH * np.array([
        [-1, 11.5, 0], [1, 11.5, 0], [10.459, -4.884, 0], [9.459, -6.616, 0], [-9.459, -6.616, 0], [-10.459, -4.884, 0],
    ])  # fmt: skip

    def settle(self, faults: Faults, joints: np.ndarray, force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Loaded tips (n, 3) and drive forces (n, 6)."""
        return self.posed(faults, joints, force)[:2]

    def posed(self, faults: Faults, joints: np.ndarray, force: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The same, and the rotation vector (n, 3) of the platform."""
        factor = faults.product("drive_stiffness", "factor", self.actuators)
        soft = 1.5e-5 / faults.product("link_stiffness", "factor", (None,))[0]
        k = 1.0 / (1.0 / (5e4 * factor) + soft)
        longer = faults.sum("link_length", "length_mm", self.actuators)  # the rigid step behind a drive: the platform's
        platform = self.platform * (1.0 + longer / np.linalg.norm(self.platform, axis=1))[:, None]
        arm = np.array([0.0, 0.0, -self.tool - faults.sum("tool_length", "length_mm", (None,))[0]])
        weight = np.array([0.0, 0.0, -faults.sum("gravity", "weight_N", (None,))[0]])
        at = np.tile(self.origin + [0.0, 0.0, self.tool], (len(joints), 1))
        r = np.tile(np.eye(3), (len(joints), 1, 1))
        for _ in range(200):
            lever = platform @ np.swapaxes(r, 1, 2)
            leg = at[:, None] + lever - self.base
            size = np.linalg.norm(leg, axis=2)
            along = leg / size[:, :, None]
            drive = -k * (size - joints)
            rates = np.concatenate([along, cross(lever, along)], 2)
            load = np.concatenate([force + weight, cross(r @ arm, force)], 1)
            left = load + np.einsum("nki,nk->ni", rates, drive)
            step = np.linalg.solve(np.einsum("nki,k,nkj->nij", rates, k, rates), left[:, :, None])[:, :, 0]
            at, r = at + step[:, :3], turn(step[:, 3:]) @ r
            if np.abs(step).max() < 1e-13 * 1e3:
                break
        return at + r @ arm, drive, vector(r)

    def triple(self, speed: np.ndarray) -> np.ndarray:
        """The same at every speed."""
        return np.tile(GROOVE, (len(speed), 1))


MACHINES = {**machines.MACHINES, **{each.name: each for each in (Cartesian(), Ur10(), Hexapod())}}


def tilt(machine, faults: Faults, joints: np.ndarray, force: np.ndarray, nominal: np.ndarray) -> np.ndarray:
    """Rotation vector (n, 3) of the loaded platform of six actuators against that at the nominal joints (n, 6)."""
    if isinstance(machine, Hexapod):
        return machine.posed(faults, joints, force)[2]
    arm = machine.structure(faults)
    straight = serial._walk(arm, nominal, np.zeros((len(nominal), serial._columns(arm))))[0].r
    turned = serial.settle(arm, joints, force).orientation
    return vector(turned @ np.swapaxes(straight, 1, 2))
