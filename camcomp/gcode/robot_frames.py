"""Frames of a robot program: bases, tools, and what the machine file says of the arm's flange. mm, machine frame.

A pose of a program is that of the tool frame T in the base B. With the flange S in the platform's axes the platform is turned
to B R T^-1 S^-1; with F of the program frame and H of the platform without words, D = F^-1 (B R T^-1 S^-1) H^-1 F is the
orientation in the words of `ground.orientation`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from camcomp.ground.datatypes import Floats
from camcomp.ground.orientation import RPY, rotations_of
from camcomp.ground.records import dataclass, field

SAME_TIP_MM = 0.1  # between the tool of a program and that of the machine file


@dataclass(frozen=True, eq=False)
class CoordinateFrame:
    """A frame seen from another: outer = origin + rotation @ inner."""

    rotation: Floats  # (3, 3)
    origin: Floats  # (3,) mm

    @classmethod
    def of(cls, origin: Sequence[float], zyx_deg: Sequence[float]) -> CoordinateFrame:
        """From an origin (3,) mm and angles (3,) deg: R = Rz(first) Ry(second) Rx(third)."""
        return cls(zyx_rotations(np.array([zyx_deg], float))[0], np.asarray(origin, float))


IDENTITY = CoordinateFrame(np.eye(3), np.zeros(3))


def zyx_rotations(angles: Floats) -> Floats:
    """Rotations (n, 3, 3) of angles (n, 3) deg about z, y, x: A, B, C of KUKA."""
    return rotations_of(RPY, angles[:, ::-1])


@dataclass(frozen=True, eq=False)
class JointPose:
    """Where joint angles put the tool; why: it cannot be followed from there, or empty."""

    tip: Floats  # (3,) mm machine frame
    rotation: Floats  # (3, 3) of the platform
    why: str = ""


@dataclass(frozen=True, eq=False, kw_only=True)
class RobotFrames:
    """Statements of a machine file about an arm; by default the base stands in the program frame and the flange is the platform."""

    program: CoordinateFrame = IDENTITY  # G54 of the machine file in the machine frame
    held: Floats = field(default_factory=lambda: np.eye(3))  # of the platform without words
    flange: Floats = field(default_factory=lambda: np.eye(3))  # axes of the control's flange in those of the platform
    tip: Floats | None = None  # (3,) mm of the tool in the flange frame; None: not known
    bases: Mapping[int, CoordinateFrame] = field(default_factory=dict)
    tools: Mapping[int, CoordinateFrame] = field(default_factory=dict)
    pose_of_joints: Callable[[Sequence[float]], JointPose] | None = None  # of angles in deg

    def to_program(
        self, points: Floats, rotations: Floats, base: CoordinateFrame, tool: CoordinateFrame
    ) -> tuple[Floats, Floats]:
        """Tips (n, 3) mm in the program frame, and orientations D (n, 3, 3), of poses in a base."""
        F, origin = self.program.rotation, self.program.origin
        tips = (base.origin + points @ base.rotation.T - origin) @ F
        platform = base.rotation @ rotations @ (self.flange @ tool.rotation).T
        return tips, self.turned(platform)

    def turned(self, platform: Floats) -> Floats:
        """Orientations D (n, 3, 3) of platforms (n, 3, 3)."""
        F = self.program.rotation
        out: Floats = F.T @ platform @ self.held.T @ F
        return out

    def from_program(
        self, tips: Floats, D: Floats, base: CoordinateFrame, tool: CoordinateFrame
    ) -> tuple[Floats, Floats]:
        """Points (n, 3) and rotations (n, 3, 3) of the tool frame in a base: the inverse of `to_program`."""
        F, origin = self.program.rotation, self.program.origin
        points = (origin + tips @ F.T - base.origin) @ base.rotation
        rotations = base.rotation.T @ (F @ D @ F.T @ self.held) @ (self.flange @ tool.rotation)
        return points, rotations

    def tool_of_machine(self) -> CoordinateFrame:
        """The tool of the machine file, with the axes of the flange."""
        return IDENTITY if self.tip is None else CoordinateFrame(np.eye(3), self.tip)

    def off_tip(self, tool: CoordinateFrame) -> float:
        """Distance of a tool's tip from that of the machine file, mm."""
        return 0.0 if self.tip is None else float(np.linalg.norm(tool.origin - self.tip))
