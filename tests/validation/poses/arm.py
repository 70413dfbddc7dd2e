"""An arm from its machine file: forward kinematics of rows of poses, and how its joints give way under its weight.

Shared with the contract: the machine files and what their keys mean. Nothing else.
Units: mm, N, N mm, rad; rows of poses come first in every array.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from pathlib import Path

import numpy as np
import yaml

ROOT = Path(__file__).resolve().parents[3]
GRAVITY = 9.80665
HARMONICS = 4


def turn_x(angle: np.ndarray | float) -> np.ndarray:
    """Rotations (n, 3, 3) about x."""
    c, s = np.cos(np.atleast_1d(angle)), np.sin(np.atleast_1d(angle))
    out = np.zeros((len(c), 3, 3))
    out[:, 0, 0], out[:, 1, 1], out[:, 2, 2], out[:, 2, 1], out[:, 1, 2] = 1, c, c, s, -s
    return out


def turn_y(angle: np.ndarray | float) -> np.ndarray:
    """Rotations (n, 3, 3) about y."""
    c, s = np.cos(np.atleast_1d(angle)), np.sin(np.atleast_1d(angle))
    out = np.zeros((len(c), 3, 3))
    out[:, 1, 1], out[:, 0, 0], out[:, 2, 2], out[:, 0, 2], out[:, 2, 0] = 1, c, c, s, -s
    return out


def turn_z(angle: np.ndarray | float) -> np.ndarray:
    """Rotations (n, 3, 3) about z."""
    c, s = np.cos(np.atleast_1d(angle)), np.sin(np.atleast_1d(angle))
    out = np.zeros((len(c), 3, 3))
    out[:, 2, 2], out[:, 0, 0], out[:, 1, 1], out[:, 1, 0], out[:, 0, 1] = 1, c, c, s, -s
    return out


def turn_vector(vectors: np.ndarray) -> np.ndarray:
    """Rotations (n, 3, 3) of rotation vectors (n, 3)."""
    vectors = np.atleast_2d(vectors)
    size = np.linalg.norm(vectors, axis=1)
    way = vectors / np.where(size > 0, size, 1)[:, None]
    k = np.zeros((len(vectors), 3, 3))
    k[:, 2, 1], k[:, 0, 2], k[:, 1, 0] = way.T
    k -= k.transpose(0, 2, 1)
    return np.eye(3) + np.sin(size)[:, None, None] * k + (1 - np.cos(size))[:, None, None] * (k @ k)


@dataclass
class Off:
    """Errors of an arm, in the contract's parameters. Arrays go by joint; zero or, for factors, one: nothing."""

    offset: np.ndarray
    pitch: np.ndarray  # share
    coupling: np.ndarray
    hysteresis: np.ndarray
    growth: np.ndarray  # rad per K
    stiffness: np.ndarray  # factor
    compliance: np.ndarray  # rad per N mm
    length: np.ndarray  # mm
    geometry: np.ndarray  # (a, 5): x, y, z mm, tilt_x, tilt_y rad, in the frame of the next joint
    curve: np.ndarray  # (a, 2 HARMONICS): sine, cosine of each harmonic, rad
    weight: float = 0.0
    tool: float = 0.0
    disturbance: list[tuple[int, float, float, float]] = field(default_factory=list)  # joint, shift, from, to

    @staticmethod
    def nothing(joints: int = 6) -> Off:
        """An arm as its table says."""
        out = Off(*[np.zeros(joints) for _ in range(8)], np.zeros((joints, 5)), np.zeros((joints, 2 * HARMONICS)))
        out.stiffness += 1
        return out

    def copy(self) -> Off:
        """To be changed on its own."""
        return Off(**{f.name: (v.copy() if hasattr(v := getattr(self, f.name), "copy") else v) for f in fields(self)})


@dataclass
class Stand:
    """How an arm stands in rows of poses: frames of the joints, of what follows them, and of the platform."""

    point: np.ndarray  # (n, 3) of the platform
    turn: np.ndarray  # (n, 3, 3) of the platform
    joint_point: np.ndarray  # (a, n, 3)
    axis: np.ndarray  # (a, n, 3) of the joints
    behind_point: np.ndarray  # (a, n, 3), where link_geometry acts
    behind_turn: np.ndarray  # (a, n, 3, 3)
    along: np.ndarray  # (a, n, 3) direction of the link
    load: np.ndarray  # (n, a) moment of the weight about the joints


@dataclass
class Arm:
    """Table of an arm."""

    name: str
    path: Path
    names: list[str]
    a: np.ndarray
    d: np.ndarray
    alpha: np.ndarray
    theta: np.ndarray
    limits: np.ndarray
    home: np.ndarray
    start: np.ndarray
    stiffness: np.ndarray  # infinite where the file states none
    mass: np.ndarray
    centre: np.ndarray
    base_turn: np.ndarray
    base_point: np.ndarray
    flange_turn: np.ndarray
    flange_point: np.ndarray
    tool_mm: float
    origin: np.ndarray

    def stand(
        self,
        q: np.ndarray,
        off: Off | None = None,
        geometry: np.ndarray | float = 0.0,
        base: np.ndarray | None = None,
        push: float = 0.0,
    ) -> Stand:
        """Frames at joints (n, a) that are the carriages'. geometry: more of it by rows (n, a, 5); base: its tilt."""
        off = off or Off.nothing(len(self.names))
        give = 1 / (self.stiffness * off.stiffness) + off.compliance
        out = self._rigid(q, off, geometry, base, off.weight + push)
        for _ in range(5 if give.any() else 0):
            before, out = out, self._rigid(q + out.load * give, off, geometry, base, off.weight + push)
            if np.abs((out.load - before.load) * give).max() < 1e-9:
                break
        return out

    def _rigid(self, q: np.ndarray, off: Off, geometry: np.ndarray | float, base: np.ndarray | None, weight: float):
        n, joints = q.shape
        whole = off.geometry + np.zeros((1, 1, 5)) + geometry
        r = np.broadcast_to(self.base_turn, (n, 3, 3))
        p = np.broadcast_to(self.base_point, (n, 3))
        if base is not None:
            lean = turn_vector(base)
            r, p = lean @ r, np.einsum("nij,nj->ni", lean, p)
        place, axis, behind, turned, along, masses = [], [], [], [], [], []
        for j in range(joints):
            place.append(p)
            axis.append(r[:, :, 2])
            r = r @ turn_z(q[:, j] + self.theta[j])
            step = np.array([self.a[j], 0, self.d[j]])
            size = np.linalg.norm(step)
            way = step / size if size else step
            along.append(r @ way)
            p = p + r @ (step + off.length[j] * way)
            r = r @ turn_x(self.alpha[j])
            masses.append(p + r @ self.centre[j])
            if j == joints - 1:
                p, r = p + r @ self.flange_point, r @ self.flange_turn
            behind.append(p)
            turned.append(r)
            if whole[:, j].any():
                p = p + (r @ whole[:, j, :3, None])[:, :, 0]
                r = r @ turn_x(whole[:, j, 3]) @ turn_y(whole[:, j, 4])
        load = np.zeros((n, joints))
        total, first = np.full(n, weight), weight * p
        for j in reversed(range(joints)):
            size = self.mass[j] * GRAVITY
            total, first = total + size, first + size * masses[j]
            arm = first - total[:, None] * place[j]  # of the weight, which pulls along -z
            load[:, j] = -axis[j][:, 0] * arm[:, 1] + axis[j][:, 1] * arm[:, 0]
        return Stand(p, r, *(np.array(each) for each in (place, axis, behind, turned, along)), load)

    def inverse(self, point: np.ndarray, turn: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Joints (n, a) of platforms at points (n, 3), turned (n, 3, 3), by damped steps from q; and which came there."""
        for _ in range(40):
            now = self.stand(q)
            r = np.einsum("nij,nkj->nik", turn, now.turn)
            spin = 0.5 * np.column_stack([r[:, 2, 1] - r[:, 1, 2], r[:, 0, 2] - r[:, 2, 0], r[:, 1, 0] - r[:, 0, 1]])
            miss = np.concatenate([(point - now.point) / 500, spin], axis=1)
            jacobian = np.concatenate(
                [np.cross(now.axis, now.point - now.joint_point).transpose(1, 2, 0) / 500, now.axis.transpose(1, 2, 0)],
                axis=1,
            )
            square = jacobian @ jacobian.transpose(0, 2, 1) + 1e-4 * np.eye(6)
            step = np.einsum("nji,nj->ni", jacobian, np.linalg.solve(square, miss[:, :, None])[:, :, 0])
            q = q + np.clip(step, -0.4, 0.4)
        near = (np.linalg.norm(now.point - point, axis=1) < 5) & (np.linalg.norm(spin, axis=1) < 0.02)
        return q, near & self.inside(q)

    def inside(self, q: np.ndarray) -> np.ndarray:
        """Whether joints (n, a) keep their limits."""
        return ((q > self.limits[:, 0]) & (q < self.limits[:, 1])).all(1)


def load_arm(name: str) -> Arm:
    """The shipped arm of this name."""
    path = ROOT / "config" / f"{name}.yaml"
    file = yaml.safe_load(path.read_text())
    robot, rows = file["robot"], file["robot"]["joints"]

    def frame(section: dict) -> tuple[np.ndarray, np.ndarray]:
        turn = turn_vector(np.radians(np.array(section.get("rotation_deg", [0, 0, 0]), float)))[0]
        return turn, np.array(section.get("translation_mm", [0, 0, 0]), float)

    def column(key: str, other: float, scale: float = 1.0) -> np.ndarray:
        return np.array([float(row.get(key, other)) for row in rows]) * scale

    deg = np.pi / 180
    return Arm(
        name,
        path,
        [row["name"] for row in rows],
        column("a_mm", 0),
        column("d_mm", 0),
        column("alpha_deg", 0, deg),
        column("theta_deg", 0, deg),
        np.array([row["limits_deg"] for row in rows], float) * deg,
        column("home_deg", 0, deg),
        column("start_deg", 0, deg),
        column("stiffness_Nmm_per_rad", np.inf),
        column("mass_kg", 0),
        np.array([row.get("centre_mm", [0, 0, 0]) for row in rows], float),
        *frame(robot.get("base", {})),
        *frame(robot.get("flange", {})),
        float(file.get("tool", {}).get("length_mm", 0)),
        np.array(file["workpiece"]["origin_mm"], float),
    )
