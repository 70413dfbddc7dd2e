"""Serial chains under load, in equilibrium at the displaced pose.

Shared with the contract: the machine files and what their keys mean. Nothing else. A chain is a list of steps from the
bed to the platform; every spring takes the deflection that the loads outboard of it demand where they then are.
Units: mm, N, N mm, rad; rows of poses come first in every array.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import yaml

ROOT = Path(__file__).resolve().parents[3]
GRAVITY = 9.80665


def turn(axis: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Rotation matrices (n, 3, 3) by angle (n,) rad about one unit axis."""
    k = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    angle = np.atleast_1d(angle)[:, None, None]
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * (k @ k)


def turn_vector(vector: np.ndarray) -> np.ndarray:
    """Rotation matrix (3, 3) of a rotation vector in rad."""
    size = np.linalg.norm(vector)
    return np.eye(3) if size == 0 else turn(vector / size, np.array([size]))[0]


def small_turns(vectors: np.ndarray) -> np.ndarray:
    """Rotation matrices (n, 3, 3) of small rotation vectors (n, 3), exact to the third order."""
    k = np.zeros((len(vectors), 3, 3))
    k[:, 2, 1], k[:, 0, 2], k[:, 1, 0] = vectors.T
    k[:, 1, 2], k[:, 2, 0], k[:, 0, 1] = -vectors.T
    return np.eye(3) + k + k @ k / 2


def beam_compliance(beam: dict) -> np.ndarray:
    """6x6 of a cantilever along x, force and moment at its tip, from integrating its bending line."""
    length, young, section = beam["length_mm"], beam["E_N_per_mm2"], beam["section"]
    shear = beam.get("G_N_per_mm2") or young / (2 * (1 + beam["nu"]))
    iy, iz = section["Iy_mm4"], section["Iz_mm4"]
    c = np.diag(
        [
            length / (young * section["area_mm2"]),
            length**3 / (3 * young * iz),
            length**3 / (3 * young * iy),
            length / (shear * section["J_mm4"]),
            length / (young * iy),
            length / (young * iz),
        ]
    )
    c[1, 5] = c[5, 1] = length**2 / (2 * young * iz)  # a force along +y turns the tip about +z
    c[2, 4] = c[4, 2] = -(length**2) / (2 * young * iy)  # a force along +z turns it about -y
    return c


@dataclass
class Springs:
    """How far a machine's statics are off: factors on drives and links, more weight, tool."""

    drive: np.ndarray
    link: float = 1.0
    weight_N: float = 0.0
    tool_mm: float = 0.0
    tool_mm_per_N: float = 0.0


@dataclass
class Machine:
    """A chain as steps, and what else the machine file says."""

    name: str
    path: Path
    steps: list[tuple]
    names: list[str]
    rotary: bool
    stiffness: np.ndarray
    home: np.ndarray
    tool: np.ndarray
    origin: np.ndarray
    force: dict
    process: dict
    teeth: int
    links: bool = field(init=False)

    def __post_init__(self):
        self.links = any(step[0] == "spring" for step in self.steps)

    def inverse(self, tip: np.ndarray) -> np.ndarray:
        """Actuator coordinates (n, a) of programmed tips (n, 3) in the program frame; tool axis along Z."""
        reference = tip + self.origin + self.tool
        return arm_angles(reference) if self.rotary else reference.copy()

    def solve(self, q: np.ndarray, force: np.ndarray, springs: Springs, friction: np.ndarray | float = 0.0, more=0.0):
        """Tip (n, 3) in the machine frame and drive forces (n, a) for carriages q (n, a) and tip forces (n, 3).

        friction: force of the guides on the carriages. more: further spring deflection (n, a) of the drives.
        """
        n = len(q)
        bends = [np.zeros((n, 6)) for _ in self.steps]
        shift = np.zeros(q.shape)
        axis_out = np.array([0.0, 0, 1])
        for _ in range(15):
            r, p = np.broadcast_to(np.eye(3), (n, 3, 3)), np.zeros((n, 3))
            frames, weights, driven = [], [], 0
            for step, bend in zip(self.steps, bends, strict=True):
                if step[0] == "fixed":
                    p = p + r @ step[2]
                    r = r @ step[1]
                elif step[0] == "drive":
                    frames.append((p, r @ step[1]))
                    at = q[:, driven] + shift[:, driven]
                    if step[2]:
                        r = r @ turn(step[1], at)
                    else:
                        p = p + frames[-1][1] * at[:, None]
                    driven += 1
                elif step[0] == "spring":
                    p = p + np.einsum("nij,nj->ni", r, bend[:, :3])
                    frames.append((p, r))
                    r = r @ small_turns(bend[:, 3:])
                elif step[0] == "weight":
                    weights.append((len(frames), p + r @ step[2], step[1]))
            weights.append((len(frames), p, springs.weight_N))
            lateral = force - (r @ axis_out) * np.einsum("ni,nij,j->n", force, r, axis_out)[:, None]
            tip = p - r @ (self.tool + springs.tool_mm * axis_out) + springs.tool_mm_per_N * lateral
            # The loads outboard of each spring, gathered from the tip inwards as a force and a moment about the origin.
            total, moment = force.copy(), np.cross(tip, force)
            load, change, place = np.zeros(q.shape), 0.0, len(frames)
            driven = q.shape[1]
            for number in range(len(self.steps) - 1, -1, -1):
                step = self.steps[number]
                if step[0] in ("fixed", "weight"):
                    continue
                while weights and weights[-1][0] >= place:
                    _, where, size = weights.pop()
                    total = total + [0, 0, -size]
                    moment = moment + size * np.column_stack([-where[:, 1], where[:, 0], np.zeros(n)])
                place -= 1
                p0, r0 = frames[place]
                about = moment - np.cross(p0, total)
                if step[0] == "drive":
                    driven -= 1
                    load[:, driven] = np.einsum("ni,ni->n", r0, about if step[2] else total)
                    stiff = self.stiffness[driven] * springs.drive[driven]
                    extra = more[:, driven] if np.ndim(more) else more
                    rub = friction[:, driven] if np.ndim(friction) else friction
                    new = (load[:, driven] + rub) / stiff + extra
                    change = max(change, np.abs(new - shift[:, driven]).max() * (1e3 if step[2] else 1))
                    shift[:, driven] = new
                else:
                    local = np.concatenate(
                        [np.einsum("nji,nj->ni", r0, total), np.einsum("nji,nj->ni", r0, about)], axis=1
                    )
                    new = local @ (step[1] * (1 / springs.link)).T
                    change = max(change, np.abs(new[:, :3] - bends[number][:, :3]).max())
                    bends[number] = new
            if change < 2e-7:
                break
        return tip, -load - friction


def arm_angles(reference: np.ndarray) -> np.ndarray:
    """A1..A6 of the arm with its flange level at reference points (n, 3), elbow up, from its triangle of links.

    The numbers are those of the machine file, read off the drawing that its table makes; the test checks them by it.
    """
    upper, fore = 1150.0, np.hypot(1200.0, 41.0)
    first = np.arctan2(reference[:, 1], reference[:, 0])
    out = np.hypot(reference[:, 0], reference[:, 1]) - 350.0
    up = reference[:, 2] + 420.0 - (225.6 + 449.4)
    span = np.hypot(out, up)
    alpha = np.arctan2(up, out) + np.arccos((upper**2 + span**2 - fore**2) / (2 * upper * span))
    beta = np.arctan2(up - upper * np.sin(alpha), out - upper * np.cos(alpha))
    pitch = np.arctan2(1200.0, 41.0) - beta
    second = -alpha
    third = pitch - np.pi / 2 - second
    zero = np.zeros(len(first))
    return np.column_stack([first, second, third, zero, np.pi / 2 - (second + third), -first])


def load_machine(name: str) -> Machine:
    """The shipped machine of this name."""
    path = ROOT / "config" / f"{name}.yaml"
    file = yaml.safe_load(path.read_text())
    robot, steps, names, stiffness, home = file["robot"], [], [], [], []
    rotary = robot.get("type") == "serial"

    def fixed(section: dict) -> None:
        vector = np.radians(np.array(section.get("rotation_deg", [0, 0, 0]), float))
        steps.append(("fixed", turn_vector(vector), np.array(section.get("translation_mm", [0, 0, 0]), float)))

    if rotary:
        fixed(robot["base"])
        ex, ez = np.array([1.0, 0, 0]), np.array([0.0, 0, 1])
        for row in robot["joints"]:
            steps.append(("drive", ez, True))
            spin = turn_vector(np.radians(row["theta_deg"]) * ez)
            steps.append(("fixed", spin, np.zeros(3)))
            slope = turn_vector(np.radians(row["alpha_deg"]) * ex)
            steps.append(("fixed", slope, np.array([row["a_mm"], 0, row["d_mm"]], float)))
            steps.append(("weight", row["mass_kg"] * GRAVITY, np.array(row["centre_mm"], float)))
            names.append(row["name"])
            stiffness.append(row["stiffness_Nmm_per_rad"])
            home.append(np.radians(row.get("home_deg", 0)))
        fixed(robot["flange"])
    else:
        (chain,) = robot["chains"].values()
        for item in chain["elements"]:
            if item["type"] == "actuator":
                steps.append(("drive", np.eye(3)["xyz".index(item["axis"])], False))
                names.append(item["name"])
                stiffness.append(item["stiffness_N_per_mm"])
                home.append(item.get("home_mm", 0))
            elif item["type"] == "transform":
                fixed(item)
            elif item["type"] == "weight":
                steps.append(("weight", float(item["force_N"]), np.array(item.get("centre_mm", [0, 0, 0]), float)))
            elif "beam" in item:
                steps.append(("spring", beam_compliance(item["beam"])))
            else:
                c = item["compliance_diagonal"]
                steps.append(("spring", np.diag(c["translation_mm_per_N"] + c["rotation_rad_per_Nmm"])))
    tool = file.get("tool", {})
    return Machine(
        name,
        path,
        steps,
        names,
        rotary,
        np.array(stiffness, float),
        np.array(home, float),
        np.array([0, 0, float(tool["length_mm"])]),
        np.array(file["workpiece"]["origin_mm"], float),
        file["process"]["force"],
        file["process"],
        int(tool.get("teeth", 2)),
    )


def triple(machine: Machine, feed: float, rpm: float) -> np.ndarray:
    """Force on the tool (Fr, Ft, Fz) N in a slot: along e_r, along the feed, along the tool axis.

    The mechanistic model is integrated over the engaged half turn by the rule of the midpoint, with the spindle
    clockwise seen from above (M3).
    """
    force = machine.force
    if force["model"] == "constant":
        return np.array([force["Fr_N"], force["Ft_N"], force["Fz_N"]], float)
    teeth, depth = machine.teeth, machine.process["depth_mm"]
    chip = feed / (teeth * rpm)
    # Angle of a tooth from the right of the feed, against the clock, seen from above; its front half cuts.
    angle = (np.arange(2000) + 0.5) * np.pi / 2000
    place = np.column_stack([np.sin(angle), np.cos(angle)])  # along the feed, to the right of it
    motion = np.column_stack([-np.cos(angle), np.sin(angle)])  # of a tooth that turns with the clock: left to right
    thick = chip * np.sin(angle)
    tangential = force["Ktc_N_per_mm2"] * thick + force["Kte_N_per_mm"]
    radial = force["Krc_N_per_mm2"] * thick + force["Kre_N_per_mm"]
    axial = force["Kac_N_per_mm2"] * thick + force["Kae_N_per_mm"]
    plane = -tangential[:, None] * motion - radial[:, None] * place
    share = teeth * depth / 2  # half a turn of two: the mean over the half, times the half
    along, right = plane.mean(0) * share
    return np.array([right, along, -axial.mean() * share])
