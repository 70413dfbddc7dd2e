"""Reject poses whose units, columns or rows cannot belong to this arm, and say what they look like."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from camcomp.diagnosis.arm.registration import nuisance_columns, register
from camcomp.diagnosis.fit.outliers import FAR_MM
from camcomp.diagnosis.model.noise import LEAST_VALUES
from camcomp.diagnosis.model.readings import Reading, column_orders, refuse_as_read, row_shifts
from camcomp.ground.datatypes import Floats
from camcomp.ground.errors import ConfigError, Location
from camcomp.model.statics.arm import arm_of, jacobian
from camcomp.model.statics.description import Robot
from camcomp.model.statics.hanging import hang

FAR = 0.02  # of the poses' spread: no arm of the kind is wrong by so much
POSES = 200
_TIPS = {"m": 1e3, "inches": 25.4, "um": 1e-3}


def check_poses(log: str, run: str, robot: Robot, q: Floats, tip: Floats) -> list[str]:
    """Warnings about poses of a log, joints q (n, m) and tips (n, 3) mm, that lie far from those of the arm.

    Raises:
        ConfigError: poses that cannot be the arm's as they are read. CC407: another unit, CC408: columns exchanged or
            reversed, CC412: joints and tips of different rows, CC413: none of these, and no elastic deflection either.
    """
    if len(q) < LEAST_VALUES:
        return []
    rows = np.unique(np.linspace(0, len(q) - 1, POSES).astype(int))
    point, pose = _stand(robot, q[rows])
    spread = float(np.sqrt(((point - point.mean(axis=0)) ** 2).sum(axis=1).mean()))
    off = _misfit(point, pose, tip[rows])
    if off < FAR_MM or spread <= 0.0:
        return []
    refuse_as_read(
        log, off, [(rule, f"run '{run}': {text}", read) for rule, text, read in _readings(robot, q, tip, rows)]
    )
    if off <= FAR * spread:
        return []
    text = (
        f"run '{run}': the tips are {off:.3g} mm from where the arm of the config would have them (median, frames "
        f"fitted; the poses lie {spread:.3g} mm about their centre)"
    )
    for family, columns in _bending(robot, q[rows], point).items():
        if _misfit(point, pose, tip[rows], columns) < 0.5 * off:
            return [f"{log}: {text}; {family} explains most of it"]
    raise ConfigError("CC413", text, at=Location(log, 1, 1))


def _bending(robot: Robot, q: Floats, point: Floats) -> dict[str, Floats]:
    """Columns (n, 3, k) of families of elastic deflection under a unit weight at points (n, 3) of the platform."""
    down = np.array([0.0, 0.0, -1.0])
    moment = np.cross(point, down)  # (n, 3) about the base
    tilts = [np.cross(moment[:, [i]] * np.eye(3)[i], point) for i in range(2)]
    out = {"a base that bends under the arm's weight": np.stack(tilts, axis=2)}
    arm = arm_of(robot)
    if arm is not None:
        rates = np.array([jacobian(arm, row)[:3] for row in q])  # (n, 3, m)
        out["the arm's own bending under weight"] = rates * rates[:, 2:3, :]
    return out


def _readings(robot: Robot, q: Floats, tip: Floats, rows: np.ndarray) -> list[Reading]:
    """Rule, description and misfit of every other way to read the poses."""
    names = [a.name for a in robot.actuators]
    hinges = np.array([a.revolute for a in robot.actuators])

    def joints(changed: Floats) -> Callable[[], float]:
        return lambda: _misfit(*_stand(robot, changed[rows]), tip[rows])

    def tips(changed: Floats) -> Callable[[], float]:
        return lambda: _misfit(*_stand(robot, q[rows]), changed[rows])

    def shifted(by: int) -> Callable[[], float]:
        own = rows[(rows + by >= 0) & (rows + by < len(q))]
        return lambda: _misfit(*_stand(robot, q[own + by]), tip[own])

    out = [("CC407", f"the tip looks as if logged in {unit}", tips(tip * by)) for unit, by in _TIPS.items()]
    out.append(("CC407", "the joints look as if logged in degrees", joints(np.where(hinges, np.radians(q), q))))
    if not hinges.all():
        out.append(("CC407", "the joints that slide look as if logged in m", joints(np.where(hinges, q, 1e3 * q))))
    out += [("CC412", text, shifted(by)) for by, text in row_shifts("the tips look", "their joints")]
    out += [
        ("CC408", f"the joints look right {text}", joints(q[:, order] * sign))
        for order, sign, text in column_orders(names)
    ]
    out.append(("CC408", "the tip looks right when two of its axes are exchanged", tips(tip[:, [1, 0, 2]])))
    return out


def _stand(robot: Robot, q: Floats) -> tuple[Floats, Floats]:
    hung = hang(robot, q)
    return hung.point, hung.rotation


def _misfit(point: Floats, pose: Floats, tip: Floats, columns: Floats | None = None) -> float:
    """Median distance, mm, with the frames that fit best, and with deflections along columns (n, 3, k)."""
    at = register(tip, point, pose, np.zeros(3))
    off = at.to_machine(tip) - at.tips(point, pose)
    if columns is not None:
        A = np.concatenate([columns, nuisance_columns(at.tips(point, pose), pose, point.mean(axis=0))], axis=2)
        A = A.reshape(-1, A.shape[2])
        A = A / (np.linalg.norm(A, axis=0) + 1e-300)
        off = (off.ravel() - A @ np.linalg.lstsq(A, off.ravel(), rcond=1e-9)[0]).reshape(-1, 3)
    return float(np.median(np.linalg.norm(off, axis=1)))
