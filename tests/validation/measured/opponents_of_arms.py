"""A textbook calibration of an arm: ridge regression of link geometry and compliance, Gauss-Newton.

    minimise  |tip - frame(p, q)|^2 / NOISE^2 + |p / PRIOR|^2

with five parameters per joint (offset, d, a, alpha, beta: the last for parallel axes) and, where asked, one compliance per
joint under the arm's weight and two harmonics per joint.  Nine numbers of the frames (tracker to base, flange to target) are free.
Source: Hayati, Mirmirani, J. Robotic Systems 2 (1985); Mooring, Roth, Driels, Fundamentals of Manipulator Calibration (1991).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import yaml
from scipy.spatial.transform import Rotation

NOISE_MM = 0.1
PRIOR_LINK = (1e-3, 1.0, 1.0, 1e-3, 1e-3)  # rad, mm, mm, rad, rad
PRIOR_COMPLIANCE = 1e-8  # rad per N mm
PRIOR_HARMONIC = 1e-3  # rad
HARMONICS = (1, 2)
GRAVITY = 9.81
STEPS = np.r_[np.full(3, 1e-6), np.full(6, 1e-3)]  # of the frame's derivatives: rad, mm


@dataclass(frozen=True)
class Poses:
    """Joint angles (n, k) rad and tips (n, 3) mm of one campaign."""

    q: np.ndarray
    tip: np.ndarray


class Arm:
    """A serial arm by its DH table, masses and centres, read from the robot section of a machine file."""

    def __init__(self, file: Path) -> None:
        joints = yaml.safe_load(file.read_text())["robot"]["joints"]
        self.names = [each["name"] for each in joints]
        self.links = np.array(
            [
                [np.radians(j.get("theta_deg", 0)), j.get("d_mm", 0), j.get("a_mm", 0), np.radians(j.get("alpha_deg", 0)), 0]
                for j in joints
            ],
            float,
        )  # fmt: skip
        self.mass = np.array([j.get("mass_kg", 0.0) for j in joints])
        self.centre = np.array([j.get("centre_mm", [0, 0, 0]) for j in joints], float)

    def chain(self, q: np.ndarray, change: np.ndarray) -> list[np.ndarray]:
        """Frames (n, 4, 4) behind every joint; change (k, 5) of the links."""
        frames, at = [], np.tile(np.eye(4), (len(q), 1, 1))
        for angle, (theta, d, a, alpha, beta) in zip(q.T, self.links + change, strict=True):
            turn = np.tile(np.eye(4), (len(q), 1, 1))
            turn[:, 0, 0] = turn[:, 1, 1] = np.cos(angle + theta)
            turn[:, 1, 0] = np.sin(angle + theta)
            turn[:, 0, 1] = -turn[:, 1, 0]
            turn[:, 2, 3] = d
            link = np.eye(4)
            link[:3, :3] = Rotation.from_euler("XY", [alpha, beta]).as_matrix()
            link[0, 3] = a
            at = at @ turn @ link
            frames.append(at)
        return frames

    def weight_torques(self, q: np.ndarray) -> np.ndarray:
        """Torque (n, k) N mm that the weight of all that a joint carries exerts about its axis."""
        frames = [np.tile(np.eye(4), (len(q), 1, 1)), *self.chain(q, np.zeros_like(self.links))]
        centres = [(frames[i + 1] @ np.r_[c, 1.0])[:, :3] for i, c in enumerate(self.centre)]
        out = np.zeros_like(q)
        for j in range(q.shape[1]):
            axis, origin = frames[j][:, :3, 2], frames[j][:, :3, 3]
            for i in range(j, q.shape[1]):
                force = np.array([0.0, 0.0, -GRAVITY * self.mass[i]])
                out[:, j] += np.einsum("ij,ij->i", axis, np.cross(centres[i] - origin, force))
        return out


_kept: dict[tuple[int, int], tuple[object, ...]] = {}


def _torques(arm: Arm, q: np.ndarray) -> np.ndarray:
    """Weight torques, computed once per arm and set of angles."""
    key = (id(arm), id(q))
    if key not in _kept or _kept[key][1] is not q:
        _kept[key] = (arm, q, arm.weight_torques(q))
    return np.asarray(_kept[key][2])


@dataclass(frozen=True)
class Calibration:
    """Fitted parameters: links, compliances and harmonics of an arm, and the frames of the campaign that was fitted."""

    arm: Arm
    compliance: bool = False
    harmonics: bool = False
    priors: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        """Collect the prior deviation of every parameter."""
        k = len(self.arm.names)
        priors = np.r_[
            np.tile(PRIOR_LINK, k),
            np.full(k * self.compliance, PRIOR_COMPLIANCE),
            np.full(2 * len(HARMONICS) * k * self.harmonics, PRIOR_HARMONIC),
        ]
        object.__setattr__(self, "priors", priors)

    def flange(self, q: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Frames (n, 4, 4) of the flange with parameters p."""
        k = len(self.arm.names)
        links, more, angle = p[: 5 * k].reshape(k, 5), p[5 * k :], q
        if self.compliance:
            angle, more = angle + more[:k] * _torques(self.arm, q), more[k:]
        if self.harmonics:
            waves = [wave(h * q) for h in HARMONICS for wave in (np.sin, np.cos)]
            angle = angle + sum(c * w for c, w in zip(more.reshape(-1, k), waves, strict=True))
        return self.arm.chain(angle, links)[-1]

    def fit(self, poses: Poses, rounds: int = 4) -> tuple[np.ndarray, np.ndarray]:
        """Parameters and frame of the least ridge sum of squares."""
        p = np.zeros(len(self.priors))
        frame = fit_frame(self.flange(poses.q, p), poses.tip)
        for _ in range(rounds):
            base = self.flange(poses.q, p)
            r = (poses.tip - placed(base, frame)).ravel() / NOISE_MM
            moved = []
            for i, size in enumerate(1e-3 * self.priors):
                other = p.copy()
                other[i] += size
                moved.append((placed(self.flange(poses.q, other), frame) - placed(base, frame)).ravel() / size)
            J = np.stack([*(m * s for m, s in zip(moved, self.priors, strict=True)), *_frame_columns(base, frame).T], 1)
            J = J / NOISE_MM
            prior = np.r_[np.ones(len(p)), np.zeros(9)]
            size = np.sqrt((J**2).sum(0) + prior)
            pull = J.T @ r - np.r_[p / self.priors, np.zeros(9)]
            step = (
                np.linalg.lstsq((J.T @ J + np.diag(prior)) / np.outer(size, size), pull / size, rcond=1e-13)[0] / size
            )
            p, frame = p + step[: len(p)] * self.priors, frame + step[len(p) :]
        return p, frame


def placed(flange: np.ndarray, frame: np.ndarray) -> np.ndarray:
    """Tips (n, 3) as the tracker sees them; frame: rotation vector, shift and target on the flange, three numbers each."""
    target = (flange @ np.r_[frame[6:], 1.0])[:, :3]
    return target @ Rotation.from_rotvec(frame[:3]).as_matrix().T + frame[3:6]


def _frame_columns(flange: np.ndarray, frame: np.ndarray) -> np.ndarray:
    at = placed(flange, frame)
    return np.stack(
        [(placed(flange, frame + h * e) - at).ravel() / h for h, e in zip(STEPS, np.eye(9), strict=True)], 1
    )


def fit_frame(flange: np.ndarray, tip: np.ndarray) -> np.ndarray:
    """Nine numbers of the frame that bring the flange nearest to the tips."""
    frame, origin = np.zeros(9), flange[:, :3, 3]
    a, b = origin - origin.mean(0), tip - tip.mean(0)
    u, _, vt = np.linalg.svd(b.T @ a)
    turn = u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))]) @ vt
    frame[:3] = Rotation.from_matrix(turn).as_rotvec()
    frame[3:6] = tip.mean(0) - turn @ origin.mean(0)
    for _ in range(20):
        J = _frame_columns(flange, frame)
        size = np.linalg.norm(J, axis=0)
        step = np.linalg.lstsq(J / size, (tip - placed(flange, frame)).ravel(), rcond=1e-8)[0] / size
        frame = frame + step
    return frame


def residual(
    calibration: Calibration, fit: Poses, judge: Poses, *, refit_frame: bool, nominal: bool = False
) -> np.ndarray:
    """Residual (n, 3) mm on judged poses, with the frame of the fitted ones or fitted again; nominal: nothing but frames is fitted."""
    if nominal:
        p = np.zeros(len(calibration.priors))
        frame = fit_frame(calibration.flange(fit.q, p), fit.tip)
    else:
        p, frame = calibration.fit(fit)
    flange = calibration.flange(judge.q, p)
    return judge.tip - placed(flange, fit_frame(flange, judge.tip) if refit_frame else frame)
