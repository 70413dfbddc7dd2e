"""The arm of kuka.py on a pedestal that turns about its foot, in MuJoCo: kinematics and weight are MuJoCo's own."""

from __future__ import annotations

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from tests.validation.plants.kuka import ROWS, G

FOOT_M = 0.4  # below the machine's origin


def arm(longer_mm: float = 0.0) -> mujoco.MjModel:
    """The arm in m, kg, s; longer_mm: by which the upper arm is longer."""
    bodies, at, turned = "", np.array([0.0, 0.0, 0.2256]), Rotation.identity()
    for k, (a, alpha, d, theta, _, mass, centre) in enumerate(ROWS):
        step = Rotation.from_euler("z", theta, degrees=True).apply([a, 0.0, d])
        step = step * (1.0 + (longer_mm / np.linalg.norm(step) if k == 1 else 0.0))
        turn = Rotation.from_euler("ZX", [theta, alpha], degrees=True)
        bodies += (
            f'<body pos="{_text(at)}" quat="{_text(np.roll(turned.as_quat(), 1))}"><joint name="A{k + 1}" axis="0 0 1"/>'
            f'<inertial pos="{_text(1e-3 * (step + turn.apply(centre)))}" mass="{mass}" diaginertia="1 1 1"/>'
        )
        at, turned = 1e-3 * step, turn
    tip = at + turned.apply([0.0, 0.0, 0.25])
    foot = "".join(
        f'<joint name="{n}" axis="{axis}" pos="0 0 -{FOOT_M}"/>' for n, axis in (("x", "1 0 0"), ("y", "0 1 0"))
    )
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><compiler angle="radian"/><option gravity="0 0 -{G}"/><worldbody><body>{foot}'
        f'<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>{bodies}<site name="tip" pos="{_text(tip)}"/>'
        f"{'</body>' * (len(ROWS) + 1)}</worldbody></mujoco>"
    )


def settle(model: mujoco.MjModel, q: np.ndarray, rad_per_Nm: float = 0.0) -> np.ndarray:
    """Tip (3,) mm, machine frame, at joint angles q (6,), joints and pedestal deflected by the weight."""
    return 1e3 * settled(model, q, rad_per_Nm).site_xpos[0]


def settled(model: mujoco.MjModel, q: np.ndarray, rad_per_Nm: float = 0.0) -> mujoco.MjData:
    """The arm at rest under its weight."""
    data = mujoco.MjData(model)
    soft = np.array([rad_per_Nm, rad_per_Nm, *(1e3 / row[4] for row in ROWS)])
    told = np.array([0.0, 0.0, *q])
    data.qpos[:] = told
    for _ in range(12):
        mujoco.mj_forward(model, data)
        data.qpos[:] = told - soft * data.qfrc_bias
    mujoco.mj_forward(model, data)
    return data


# What no library lists: how far joints (6,) rad give way further, or the tip (3,) mm of MuJoCo moves further. q, speed (6,) rad, rad/s;
# t s on the common clock; before: what the effect remembers of earlier rows.


def hose(q: np.ndarray) -> np.ndarray:
    """A hose pulls A1 and A4 back to a middle, the harder the further it is bent, up to 400 N m."""
    off = np.tanh((q - np.array([0.1, 0.0, 0.0, 0.0, 0.0, 0.0])) / 0.15) * np.array([1, 0, 0, 1, 0, 0])
    return np.asarray(-400.0 * off * np.abs(off) * 1e3 / np.array([row[4] for row in ROWS]))


def bent_upper_arm(model: mujoco.MjModel, q: np.ndarray) -> np.ndarray:
    """The upper arm bends under the moments at its two ends, as a beam does."""
    data = mujoco.MjData(model)
    data.qpos[2:] = q
    mujoco.mj_forward(model, data)
    shoulder, elbow = data.qfrc_bias[3:5]
    return np.array([0.0, -0.25e-7 * (shoulder + 2.0 * elbow), -0.75e-7 * (shoulder + elbow), 0.0, 0.0, 0.0])


def sloshing(q: np.ndarray, before: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A tank on the forearm turns A1 by how far its liquid, 0.8 s behind, is off; and where that is a row of 0.05 s later."""
    liquid = before + (0.05 / 0.8) * (q - before)
    return np.eye(6)[0] * 4e-3 * (q - liquid)[0], liquid


def growing_spindle(axis: np.ndarray, t: float) -> np.ndarray:
    """The spindle grows along its axis (3,) as it warms up, and with the hall's day."""
    return 0.06 * (1.0 - np.exp(-t / 600.0)) * (0.5 + 0.5 * np.sin(t / 200.0)) * axis


def soft_floor(q: np.ndarray, tip: np.ndarray) -> np.ndarray:
    """The floor sinks on the side to which the arm is turned."""
    return np.cross([0.0, 1.5e-3 * max(np.cos(q[0] - 0.4) - 0.93, 0.0), 0.0], tip)


def wobbling_bearing(q: np.ndarray) -> np.ndarray:
    """The bearing of A3 wobbles along its axis, 17 times per turn."""
    return 0.04 * np.sin(17.0 * q[2] + 0.6) * np.array([-np.sin(q[0]), np.cos(q[0]), 0.0])


def _text(values: np.ndarray) -> str:
    return " ".join(f"{each:.15g}" for each in values)
