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


def settle(model: mujoco.MjModel, q: np.ndarray, rad_per_Nm: float) -> np.ndarray:
    """Tip (3,) mm, machine frame, at joint angles q (6,), joints and pedestal deflected by the weight."""
    data = mujoco.MjData(model)
    soft = np.array([rad_per_Nm, rad_per_Nm, *(1e3 / row[4] for row in ROWS)])
    told = np.array([0.0, 0.0, *q])
    data.qpos[:] = told
    for _ in range(12):
        mujoco.mj_forward(model, data)
        data.qpos[:] = told - soft * data.qfrc_bias
    mujoco.mj_forward(model, data)
    return 1e3 * data.site_xpos[0]


def _text(values: np.ndarray) -> str:
    return " ".join(f"{each:.15g}" for each in values)
