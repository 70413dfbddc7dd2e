"""The arm of kuka.py in motion, in MuJoCo: rigid bodies, friction and weight are MuJoCo's own; a loop for the position drives every joint,
with one for the speed in it, both proportional, on a torque that makes up for the weight.
"""

from __future__ import annotations

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from tests.validation.plants.kuka import ROWS, G

STEP_S, ROW_S = 5e-4, 0.01
ROTORS = (30.0, 40.0, 30.0, 8.0, 6.0, 4.0)  # kg m2 at the joint
COULOMB = (300.0, 400.0, 250.0, 40.0, 35.0, 25.0)  # N m
VISCOUS = (200.0, 250.0, 150.0, 30.0, 25.0, 20.0)  # N m s
GAIN = (12.0, 12.0, 12.0, 15.0, 15.0, 18.0)  # 1/s
MIDDLE, SPAN = np.deg2rad([[0, -80, 80, 10, 60, 0], [30, 20, 20, 60, 40, 90]])
FASTEST, HARDEST = np.array([[0.8, 0.6, 0.7, 1.2, 1.2, 1.8], [1.5, 1.2, 1.5, 4.0, 4.0, 8.0]])  # rad/s, rad/s2
COUNT_RAD, NOISE = 1e-5, 0.002  # of encoders; of a torque over its largest


def arm() -> mujoco.MjModel:
    """The arm in m, kg, s."""
    bodies, at, turned = "", np.array([0.0, 0.0, 0.2256]), Rotation.identity()
    for k, (a, alpha, d, theta, _, mass, centre) in enumerate(ROWS):
        step = 1e-3 * Rotation.from_euler("z", theta, degrees=True).apply([a, 0.0, d])
        turn = Rotation.from_euler("ZX", [theta, alpha], degrees=True)
        own = 0.05 * mass * max(0.05, float(step @ step) + 0.02)
        bodies += (
            f'<body pos="{_text(at)}" quat="{_text(np.roll(turned.as_quat(), 1))}"><joint axis="0 0 1" armature="{ROTORS[k]}" '
            f'frictionloss="{COULOMB[k]}" damping="{VISCOUS[k]}"/><inertial pos="{_text(step + 1e-3 * turn.apply(centre))}" '
            f'mass="{mass}" diaginertia="{_text(np.full(3, own))}"/>'
        )
        at, turned = step, turn
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><option gravity="0 0 -{G}" timestep="{STEP_S}" integrator="implicitfast"/>'
        f"<worldbody>{bodies}{'</body>' * len(ROWS)}</worldbody></mujoco>"
    )


def asked(rng: np.random.Generator, seconds: float) -> np.ndarray:
    """Set-points (n, 6) rad every STEP_S: moves of least jerk, with rests between some of them."""
    t = np.arange(0.0, seconds, STEP_S)
    out = np.tile(MIDDLE, (len(t), 1))
    for j in range(6):
        here, now = MIDDLE[j], 0.5
        while now < seconds:
            there = MIDDLE[j] + SPAN[j] * rng.uniform(-1.0, 1.0)
            way = abs(there - here)
            lasts = max(0.15, 1.875 * way / FASTEST[j], np.sqrt(5.7735 * way / HARDEST[j]))
            u = np.clip((t - now) / lasts, 0.0, 1.0)
            out[:, j] += (there - here) * (10.0 * u**3 - 15.0 * u**4 + 6.0 * u**5)
            here, now = there, now + lasts + rng.choice([0.0, 0.3, 0.8])
    return out


def speed_gain(model: mujoco.MjModel) -> np.ndarray:
    """Torque (6,) per speed, N m s: twice the gain of the position times the inertia in the middle."""
    data, inertia = mujoco.MjData(model), np.zeros((6, 6))
    data.qpos[:] = MIDDLE
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, inertia, data.qM)
    return 2.0 * np.array(GAIN) * np.diag(inertia)


def lags_ms() -> np.ndarray:
    """Lags (6,) at steady speeds: viscous friction makes a loop that much later."""
    return 1e3 / np.array(GAIN) * (1.0 + np.array(VISCOUS) / speed_gain(arm()))


def log(seed: int, seconds: float, *, held: bool = True, rubs: bool = True) -> dict[str, np.ndarray]:
    """Columns of a log: set-points and encoders rad, torques N mm, every ROW_S.

    held: the torque makes up for the weight. rubs: joints have friction.
    """
    rng = np.random.default_rng(seed)
    wanted, model = asked(rng, seconds), arm()
    model.dof_frictionloss[:] *= rubs
    model.dof_damping[:] *= rubs
    data, stiff = mujoco.MjData(model), speed_gain(model)
    data.qpos[:] = wanted[0]
    mujoco.mj_forward(model, data)
    angle, torque = np.zeros_like(wanted), np.zeros_like(wanted)
    for i, there in enumerate(wanted):
        torque[i] = stiff * (np.array(GAIN) * (there - data.qpos) - data.qvel) + held * data.qfrc_bias
        data.qfrc_applied[:] = torque[i]
        mujoco.mj_step(model, data)
        angle[i] = data.qpos
    on = slice(0, None, round(ROW_S / STEP_S))
    torque += NOISE * np.abs(torque).max(axis=0) * rng.standard_normal(torque.shape)
    angle += 5e-6 * rng.standard_normal(angle.shape)
    out = {"t_s": STEP_S * np.arange(len(wanted))[on]}
    for name, columns in (
        ("cmd_A{}_rad", wanted),
        ("act_A{}_rad", COUNT_RAD * np.round(angle / COUNT_RAD)),
        ("act_A{}_Nmm", 1e3 * torque),
    ):
        out |= {name.format(j + 1): columns[on, j] for j in range(6)}
    return out


def _text(values: np.ndarray) -> str:
    return " ".join(f"{value:.9g}" for value in values)
