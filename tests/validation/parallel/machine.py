"""A parallel machine as numbers: chains of one drive, a foot spring, passive hinges and one bar, read from its YAML.

Shares with the contract the meaning of the YAML keys, nothing else. Units: mm, N, N mm, rad.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import yaml

CONFIG = Path(__file__).resolve().parents[3] / "config"
AXES = {"x": np.eye(3)[0], "y": np.eye(3)[1], "z": np.eye(3)[2]}


def turn(vector) -> np.ndarray:
    """Rotation matrix of a rotation vector (rad)."""
    vector = np.asarray(vector, float)
    angle = np.linalg.norm(vector)
    if angle == 0:
        return np.eye(3)
    x, y, z = vector / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def beam(data: dict) -> tuple[np.ndarray, float]:
    """Tip stiffness of a cantilever along x: EA/L, 12EI/L^3 (y, z), GJ/L, 4EI/L (y, z), -6EI/L^2; square or tube."""
    length, modulus = data["length_mm"], data["E_N_per_mm2"]
    shear = data.get("G_N_per_mm2") or modulus / (2 * (1 + data["nu"]))
    section = data["section"]
    if section["type"] == "square":
        side = section["side_mm"]
        area, inertia, torsion = side**2, side**4 / 12, 0.141 * side**4
    else:
        out, inner = section["outer_diameter_mm"], section["inner_diameter_mm"]
        area, inertia = np.pi * (out**2 - inner**2) / 4, np.pi * (out**4 - inner**4) / 64
        torsion = 2 * inertia
    bend = modulus * inertia
    return np.array([modulus * area / length, 12 * bend / length**3, shear * torsion / length, 4 * bend / length,
                     -6 * bend / length**2]), length  # fmt: skip


@dataclass
class Machine:
    """All chains as arrays; `sign` is the side of the drive on which its carriage stands."""

    name: str
    file: Path
    drives: list[str]
    foot_turn: np.ndarray  # (c, 3, 3) frame of the drive in the machine
    foot_at: np.ndarray  # (c, 3)
    axis: np.ndarray  # (c, 3) of the drive, in that frame
    drive_stiffness: np.ndarray  # (c,) N/mm
    foot_compliance: np.ndarray  # (c, 6, 6) without the drive
    near: np.ndarray  # (2, 3) axes of the hinges before the bar
    far: np.ndarray  # (2, 3) axes behind it
    far_dof: np.ndarray  # (2,) which angle each far hinge takes; a parallelogram repeats one
    far_sign: np.ndarray
    hinges: int  # free angles per chain
    length: np.ndarray  # (c,) of the bar, mm
    bar: np.ndarray  # (c, 5) numbers of one bar of a pair, or zeros
    lumped: np.ndarray  # (c, 6, 6) stiffness of a single bar, or zeros
    width: float  # mm, between the bars of a pair; 0 = single
    frame: np.ndarray  # (3, 3) columns: arm, hinge, arm x hinge, in the bar's frame
    end_turn: np.ndarray  # (c, 3, 3) from behind the far hinges to the platform
    end_at: np.ndarray  # (c, 3)
    sign: np.ndarray  # (c,)
    home: np.ndarray  # (c,) mm
    origin: np.ndarray  # (3,) program origin in the machine
    tool: float  # mm along -z
    force: np.ndarray  # (3,) Fr, Ft, Fz in N
    roll: np.ndarray = field(default_factory=lambda: np.zeros(3))  # (c,) rad, of the chain about its drive's axis

    def inverse(self, tip: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Drives (n, c) mm and hinge angles (n, c, hinges) of the rigid, perfect machine; tip (n, 3) program frame."""
        reference = tip + self.origin + [0, 0, self.tool]
        chains = range(len(self.drives))
        rho, angles = np.empty((len(tip), len(chains))), np.zeros((len(tip), len(chains), self.hinges))
        for c in chains:
            attached = reference - self.end_turn[c].T @ self.end_at[c]
            local = (attached - self.foot_at[c]) @ self.foot_turn[c]
            along = local @ self.axis[c]
            across = local - along[:, None] * self.axis[c]
            reach = np.sqrt(self.length[c] ** 2 - (across**2).sum(1))
            rho[:, c] = along - self.sign[c] * reach
            arm = (across + self.sign[c] * reach[:, None] * self.axis[c]) / self.length[c]
            if self.near[0, 2]:  # hinges z, y
                first, second = np.arctan2(arm[:, 1], arm[:, 0]), -np.arcsin(arm[:, 2])
            else:  # hinges y, z
                first, second = np.arctan2(-arm[:, 2], arm[:, 0]), np.arcsin(arm[:, 1])
            angles[:, c, 0], angles[:, c, 1] = first, second
            angles[:, c, self.hinges - 1] = -first
            if self.hinges == 4:
                angles[:, c, 2] = -second
        return rho, angles


def read(name: str) -> Machine:
    """The machine of config/NAME.yaml."""
    file = CONFIG / f"{name}.yaml"
    data = yaml.safe_load(file.read_text())
    parts: dict[str, list] = {key: [] for key in ("turn", "at", "axis", "k", "foot", "length", "bar", "lumped",
                                                  "end_turn", "end_at", "sign", "home")}  # fmt: skip
    drives = []
    for chain_name, chain in data["robot"]["chains"].items():
        columns = np.array([AXES[letter] for letter in chain.get("frame", "xyz")]).T
        rotation, at = columns.copy(), np.zeros(3)
        end_rotation, end_at = np.eye(3), np.zeros(3)
        near, far, far_dof, far_sign = [], [], [], []
        start: list[float] = []
        stage, width, single, pair, frame = "base", 0.0, np.zeros((6, 6)), np.zeros(5), np.eye(3)
        for element in chain["elements"]:
            kind = element["type"]
            if kind == "transform":
                step = np.array(element["translation_mm"], float)
                spin = turn(np.radians(element.get("rotation_deg", [0, 0, 0])))
                if stage == "base":
                    at, rotation = at + rotation @ step, rotation @ spin
                elif stage == "near":
                    length, stage = step[0], "bar"
                else:
                    end_at, end_rotation = end_at + end_rotation @ step, end_rotation @ spin
            elif kind == "actuator":
                drives.append(element.get("name", chain_name))
                axis, stiffness = AXES[element["axis"]], element["stiffness_N_per_mm"]
                home, stage = element.get("home_mm", 0), "foot"
            elif kind == "link":
                if "compliance_diagonal" in element:
                    flat = element["compliance_diagonal"]
                    matrix = np.diag(flat["translation_mm_per_N"] + flat["rotation_rad_per_Nmm"])
                else:
                    matrix = np.array(element["compliance_mm_N_rad"], float)
                if stage == "foot":
                    foot, stage = matrix, "near"
                else:
                    single, stage = np.linalg.inv(matrix), "far"
            elif kind == "parallelogram":
                pair, _ = beam(element["bar"]["beam"])
                length, width = element["arm_mm"][0], element["width_mm"]
                hinge = AXES[element["hinge"]]
                near.append(hinge)
                start.append(np.radians(element.get("start_deg", 0)))
                far.append(hinge)
                far_dof.append(1)
                far_sign.append(-1.0)
                frame = np.array([AXES["x"], hinge, np.cross(AXES["x"], hinge)]).T
                stage = "far"
            else:
                hinge = AXES[element["axis"]]
                if stage == "near":
                    near.append(hinge)
                    start.append(np.radians(element.get("start_deg", 0)))
                else:
                    far.append(hinge)
                    far_dof.append(2 if width else 1 + len(far))
                    far_sign.append(1.0)
        arm = turn(near[0] * start[0]) @ turn(near[1] * start[1]) @ AXES["x"]
        values = (rotation, at, axis, stiffness, foot, length, pair, single, end_rotation @ columns.T, end_at,
                  np.sign(arm @ axis), home)  # fmt: skip
        for key, value in zip(parts, values, strict=True):
            parts[key].append(value)
    packed = {key: np.array(value, float) for key, value in parts.items()}
    work, force = data["workpiece"], data["process"]["force"]
    return Machine(
        name, file, drives, packed["turn"], packed["at"], packed["axis"], packed["k"], packed["foot"],
        np.array(near), np.array(far), np.array(far_dof), np.array(far_sign), 3 if width else 4,
        packed["length"], packed["bar"], packed["lumped"], float(width), frame, packed["end_turn"], packed["end_at"],
        packed["sign"], packed["home"], np.array(work["origin_mm"], float), float(data["tool"]["length_mm"]),
        np.array([force["Fr_N"], force["Ft_N"], force["Fz_N"]], float), np.zeros(len(drives)),
    )  # fmt: skip
