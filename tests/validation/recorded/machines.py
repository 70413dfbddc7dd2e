"""Machines under trial: kinematics of the perfect machine, and the loaded one with what is wrong in its structure.

A machine offers: `name`, `config` (the shipped file that describes it to camcomp), `actuators`, `rotary` and `reach` (mm at the
tip per unit of a joint, about: 1 for slides), `origin` (of the program in the machine frame, mm), `home` of its drives, `without`
(effects of the library that it cannot have), `unseen` (effect and target that leave the tip where it is), `triple` (force right of the feed, along it, along the tool, N, by the speed of the
tip), `inverse`, `direct`, `settle` and the stiffness of its drives.  All of it is typed in or solved here or in tests.validation.plants;
camcomp is not asked.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Protocol

import numpy as np

from tests.validation.plants import energy, kuka, legs, milling, serial
from tests.validation.plants.rotations import vector
from tests.validation.recorded.faults import Faults

ROOT = Path(__file__).resolve().parents[3]
GROOVE = np.array([215.0, -10.0, -25.0])


class Machine(Protocol):
    """One of the machines that the head of this file describes."""

    name: str
    config: Path
    actuators: tuple[str, ...]
    rotary: bool
    reach: float
    origin: np.ndarray
    home: float
    without: tuple[str, ...]
    unseen: tuple[tuple[str, str], ...]
    drive_N_per_mm: np.ndarray

    def triple(self, speed: np.ndarray) -> np.ndarray:
        """Forces (n, 3) N at speeds (n,) mm/s of the tip."""

    def inverse(self, tip: np.ndarray) -> np.ndarray:
        """Actuators (n, m) mm or rad of the perfect machine for tips (n, 3) in the machine frame."""

    def direct(self, joints: np.ndarray) -> np.ndarray:
        """Tips (n, 3) of the perfect machine without loads, machine frame."""

    def settle(self, faults: Faults, joints: np.ndarray, force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Loaded tips (n, 3) mm, machine frame, and drive forces (n, m) at joints (n, m) under forces (n, 3)."""


class Parallel:
    """Three legs."""

    name = "orthoglide"
    actuators = ("x", "y", "z")
    rotary, reach = False, 1.0
    origin = np.array([-73.205, -73.205, -173.205])
    home = -300.0
    without: tuple[str, ...] = ()
    unseen: tuple[tuple[str, str], ...] = ()
    force = GROOVE
    built = staticmethod(legs.orthoglide)

    def __init__(self) -> None:
        self.config = ROOT / "config" / f"{self.name}.yaml"
        self._perfect = self.built()
        self.drive_N_per_mm = np.array(self._perfect.drive)

    def triple(self, speed: np.ndarray) -> np.ndarray:
        """The same at every speed."""
        return np.tile(self.force, (len(speed), 1))

    def inverse(self, tip: np.ndarray) -> np.ndarray:
        """By Pythagoras along the axes."""
        return energy.inverse(self._perfect, tip)

    def direct(self, joints: np.ndarray) -> np.ndarray:
        """By Newton on the spheres."""
        return energy.direct(self._perfect, joints) - [0.0, 0.0, self._perfect.tool]

    def structure(self, faults: Faults) -> legs.Legs:
        """The legs as they are."""
        built = self.built(
            roll_deg=tuple(faults.sum("chain_error", "roll_deg", self.actuators)),
            longer=tuple(faults.sum("link_length", "length_mm", self.actuators)),
            drive_factor=tuple(faults.product("drive_stiffness", "factor", self.actuators)),
            link_factor=float(faults.product("link_stiffness", "factor", (None,))[0]),
        )
        return replace(built, tool=built.tool + float(faults.sum("tool_length", "length_mm", (None,))[0]))

    def settle(self, faults: Faults, joints: np.ndarray, force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The least potential energy."""
        weight = float(faults.sum("gravity", "weight_N", (None,))[0])
        found = energy.settle(self.structure(faults), joints, force, weight=weight)
        return found.tip, found.drive


class Puu(Parallel):
    """The Orthoglide's relative with universal joints."""

    name = "puu"
    origin = np.array([-73.65, -73.65, -173.65])
    home = 0.0
    built = staticmethod(legs.ref_puu)


class Delta(Parallel):
    """Three upright drives on a circle."""

    name = "delta"
    actuators = ("a", "b", "c")
    origin = np.array([0.0, 0.0, -60.0])
    home = 300.0
    force = np.array([-40.0, -20.0, -10.0])
    built = staticmethod(legs.delta)
    towers = np.radians([0.0, 120.0, 240.0])

    def inverse(self, tip: np.ndarray) -> np.ndarray:
        """Heights of the carriages: bars of 400 mm, 200 mm between column and platform joint at the centre."""
        outward = 200.0 * np.stack([np.cos(self.towers), np.sin(self.towers)], 1)
        level = outward - tip[:, None, :2]
        return tip[:, 2:] + 60.0 + np.sqrt(400.0**2 - (level**2).sum(2)) - np.sqrt(400.0**2 - 200.0**2)


class Serial:
    """One chain from the base to the tip."""

    rotary, reach = False, 1.0
    home = 0.0
    without: tuple[str, ...] = ("chain_error", "link_length")
    unseen: tuple[tuple[str, str], ...] = ()

    def __init__(self) -> None:
        self.config = ROOT / "config" / f"{self.name}.yaml"
        joints = [each for each in self.elements() if isinstance(each, serial.Joint)]
        self.drive_N_per_mm = np.array([each.stiffness for each in joints])

    name: str
    actuators: tuple[str, ...]
    origin: np.ndarray
    tool: float

    def elements(self) -> list[serial.Element]:
        """From base to platform reference."""
        raise NotImplementedError

    def structure(self, faults: Faults) -> list[serial.Element]:
        """The chain as it is, to the tip."""
        factors = iter(faults.product("drive_stiffness", "factor", self.actuators))
        plays = faults.sum("backlash", "width_rad", self.actuators) if self.rotary else np.zeros(len(self.actuators))
        loose = iter(plays)
        links = float(faults.product("link_stiffness", "factor", (None,))[0])
        out: list[serial.Element] = []
        for each in self.elements():
            if isinstance(each, serial.Joint):
                factor, rigid = next(factors), each.stiffness is None
                each = replace(each, stiffness=None if rigid else each.stiffness * factor, play=next(loose))
            elif isinstance(each, serial.Link):
                each = serial.Link(links * each.stiffness)
            out.append(each)
        weight = float(faults.sum("gravity", "weight_N", (None,))[0])
        longer = float(faults.sum("tool_length", "length_mm", (None,))[0])
        return [*out, serial.Weight(weight), serial.Shift((0.0, 0.0, -self.tool - longer))]

    def settle(self, faults: Faults, joints: np.ndarray, force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The least potential energy."""
        found = serial.settle(self.structure(faults), joints, force)
        return found.tip, found.drive


class Router(Serial):
    """Cartesian, with a gantry that turns under side forces; a cutter of two teeth in a slot."""

    name = "router"
    actuators = ("x", "y", "z")
    origin = np.array([300.0, 200.0, -100.0])
    tool = 40.0
    rpm, depth, teeth = 8000.0, 1.5, 2  # speed by the recorded programs
    edge = staticmethod(milling.linear(631.0, 99.0, 273.0, (13.0, 10.0, 2.8)))

    def __init__(self) -> None:
        super().__init__()
        at = [
            milling.slot(self.edge, feed=feed, speed=self.rpm, sense=1.0, depth=self.depth, teeth=self.teeth)
            for feed in (0.0, 6000.0)
        ]
        self._rubbing, self._per_mm_per_s = at[0], (at[1] - at[0]) / 100.0  # straight in the chip

    def triple(self, speed: np.ndarray) -> np.ndarray:
        """The faster the tip, the thicker the chip."""
        return self._rubbing + speed[:, None] * self._per_mm_per_s

    def inverse(self, tip: np.ndarray) -> np.ndarray:
        """The tool hangs from the reference."""
        return tip + [0.0, 0.0, self.tool]

    def direct(self, joints: np.ndarray) -> np.ndarray:
        """The other way."""
        return joints - [0.0, 0.0, self.tool]

    def elements(self) -> list[serial.Element]:
        """Legs of the gantry, cross beam, ram."""
        upright = legs.beam(250, 70000, 70000 / 2.66, 6000, 1.125e7, 2.0e5, 8.98e7)
        right = np.pi / 2

        def soft(*compliance: float) -> serial.Link:
            return serial.Link(np.diag(1 / np.array(compliance)))

        return [
            serial.Joint("slide", 0, 3e3), serial.Shift((0, 200, 250), (0, -right, 0)), serial.Link(upright),
            serial.Shift((0, 0, 0), (0, right, 0)), soft(5e-5, 1e-5, 1e-4, 2e-8, 1e-7, 2e-8), serial.Weight(90),
            serial.Shift((0, -200, 0)), serial.Joint("slide", 1, 4e3), serial.Joint("slide", 2, 6e3),
            serial.Shift((0, 0, -250)), soft(1e-4, 8e-5, 1e-5, 5e-8, 5e-8, 3e-8), serial.Weight(40, (0, 0, 80)),
        ]  # fmt: skip


class Kuka(Serial):
    """Six-axis arm; the platform keeps its orientation."""

    name = "kuka-kr210"
    actuators = ("A1", "A2", "A3", "A4", "A5", "A6")
    rotary, reach = True, 2000.0
    origin = np.array([1550.0, 0.0, 800.0])
    tool = 250.0
    # of slides, or not of an arm without elastic links
    without = (
        *Serial.without, "link_stiffness", "backlash", "friction", "screw_pitch", "screw_cyclic", "thermal_growth",
    )  # fmt: skip
    # the tool lies in the axis of A6, and A4 stands still
    unseen = (("servo_lag", "A4"), ("servo_lag", "A6"), ("joint_offset", "A6"), ("drive_stiffness", "A6"))
    start = np.radians([0.0, -90.0, 90.0, 0.0, 90.0, 0.0])

    def triple(self, speed: np.ndarray) -> np.ndarray:
        """The same at every speed."""
        return np.tile(GROOVE, (len(speed), 1))

    def elements(self) -> list[serial.Element]:
        """The arm without its tool."""
        return kuka.arm(tool=0.0)

    def direct(self, joints: np.ndarray) -> np.ndarray:
        """Along the rigid chain."""
        return self._walk(joints).t

    def inverse(self, tip: np.ndarray) -> np.ndarray:
        """By Newton on tip and orientation, from the usual pose."""
        q = np.tile(self.start, (len(tip), 1))
        for _ in range(30):
            walk = self._walk(q)
            miss = np.concatenate([tip - walk.t, vector(np.swapaxes(walk.r, 1, 2))], 1)
            moves = walk.m + np.cross(walk.w, walk.t[:, :, None], axisa=1, axisb=1, axisc=1)
            step = np.linalg.solve(np.concatenate([moves, walk.w], 1), miss[:, :, None])[:, :, 0]
            q = q + step
            if np.abs(step).max() < 1e-13:
                break
        return q

    def _walk(self, joints: np.ndarray) -> serial.Walk:
        chain = [*kuka.arm(tool=0.0, weights=False), serial.Shift((0.0, 0.0, -self.tool))]
        return serial._walk(chain, joints, np.zeros_like(joints))[0]


MACHINES: dict[str, Machine] = {each.name: each for each in (Parallel(), Puu(), Delta(), Router(), Kuka())}
