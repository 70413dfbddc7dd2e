"""Elastic equilibrium of the whole machine by minimising its potential energy over platform, feet and hinges.

Unknowns are the platform's pose, six deflections of every foot (the drive's spring is in series with it) and the free
hinge angles; the bar's deflection is what is left between the foot and the platform. No chain is reduced to a stiffness
matrix beforehand, and rotations are finite. Shares with the contract: the stiffness of a parallelogram is taken at the
current angle and held fixed when the energy is differentiated. Units: mm, N, rad.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from tests.validation.parallel.machine import Machine, turn

STIFF = 1.0e6  # N/mm, of the direction in which the angle of a parallelogram moves: no load is left there


@njit(cache=True)
def _skew(v):
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


@njit(cache=True)
def _exp(v):
    a2 = v[0] * v[0] + v[1] * v[1] + v[2] * v[2]
    s = _skew(v)
    if a2 < 1e-6:
        return np.eye(3) + (1 - a2 / 6) * s + (0.5 - a2 / 24) * (s @ s)
    a = np.sqrt(a2)
    return np.eye(3) + np.sin(a) / a * s + (1 - np.cos(a)) / a2 * (s @ s)


@njit(cache=True)
def _log(r):
    # Deflections are small: the series of asin is exact to 1e-12 here.
    w = 0.5 * np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
    s2 = w[0] * w[0] + w[1] * w[1] + w[2] * w[2]
    return w * (1 + s2 / 6 + 3 * s2 * s2 / 40)


@njit(cache=True)
def _left(v):
    s = _skew(v)
    return np.eye(3) + 0.5 * s + (s @ s) / 6 + (s @ s @ s) / 24


@njit(cache=True)
def _right_inverse(v):
    s = _skew(v)
    return np.eye(3) + 0.5 * s + (s @ s) / 12


@njit(cache=True)
def _pair(bar, width, q, frame, factor):
    """Two bars side by side (N/mm ...), in the frame of the arm; frame: columns arm, hinge, third."""
    k = np.zeros((6, 6))
    c, s = np.cos(q), np.sin(q)
    d2 = width * width
    k[0, 0] = 2 * bar[0]
    k[1, 1] = 2 * bar[1]
    k[1, 5] = 2 * bar[4]
    k[5, 1] = 2 * bar[4]
    k[3, 3] = 2 * (bar[2] + d2 * c * c * bar[1] / 4)
    k[3, 5] = 2 * d2 * 2 * s * c * bar[1] / 8
    k[5, 3] = k[3, 5]
    k[4, 4] = 2 * d2 * c * c * bar[0] / 4
    k[5, 5] = 2 * (bar[3] + d2 * s * s * bar[1] / 4)
    k *= factor
    k[2, 2] = STIFF
    t = np.zeros((6, 6))
    t[:3, :3] = frame
    t[3:, 3:] = frame
    return t @ k @ t.T


@njit(cache=True)
def _solve(slide, angles, reference, force, weight, tip_at, foot_turn, foot_at, foot_k, near, far, far_dof, far_sign,
           hinges, length, bar, lumped, width, frame, bar_factor, end_turn, end_at, passes):  # fmt: skip
    """Poses of all rows, each from where it would be without load."""
    rows, chains = slide.shape[0], slide.shape[1]
    out_p, out_r = np.empty((rows, 3)), np.empty((rows, 3, 3))
    load, counts = np.empty((rows, chains, 6)), np.empty(rows, np.int64)
    m = 6 + hinges
    foot = np.zeros((chains, 6))
    q = np.zeros((chains, hinges))
    jy, jp = np.zeros((chains, 6, m)), np.zeros((chains, 6, 6))
    back_y = np.zeros((chains, m, 7))
    down = np.array([0.0, 0.0, -weight])
    for n in range(rows):
        p, r = reference[n].copy(), np.eye(3)
        foot[:] = 0.0
        q[:] = angles[n]
        for step in range(passes):
            hpp, gp = np.zeros((6, 6)), np.zeros(6)
            arm = r @ tip_at
            f = force[n]
            gp[:3] -= f + down
            gp[3:] -= np.array([arm[1] * f[2] - arm[2] * f[1], arm[2] * f[0] - arm[0] * f[2],
                                arm[0] * f[1] - arm[1] * f[0]])  # fmt: skip
            for c in range(chains):
                # near side: drive, foot, hinges, bar; every column is (turning, shift of the bar's near end)
                at = foot_at[c] + foot_turn[c] @ (slide[n, c] + foot[c, :3])
                wn, pn = np.zeros((m, 3)), np.zeros((m, 3))
                lefted = foot_turn[c] @ _left(foot[c, 3:])
                rn = foot_turn[c] @ _exp(foot[c, 3:])
                for j in range(3):
                    pn[j] = foot_turn[c, :, j]
                    wn[3 + j] = lefted[:, j]
                for j in range(2):
                    wn[6 + j] = rn @ near[j]
                    rn = rn @ _exp(near[j] * q[c, j])
                reach = rn[:, 0] * length[c]
                for j in range(3, 8):
                    pn[j] = np.array([wn[j, 1] * reach[2] - wn[j, 2] * reach[1],
                                      wn[j, 2] * reach[0] - wn[j, 0] * reach[2],
                                      wn[j, 0] * reach[1] - wn[j, 1] * reach[0]])  # fmt: skip
                end = at + reach
                # far side: platform, end piece, hinges backwards; all far hinges meet in one point
                rf = r @ end_turn[c].T
                pf = p - rf @ end_at[c]
                wf, shift_p = np.zeros((m, 3)), p - pf
                for j in range(1, -1, -1):
                    a = q[c, far_dof[j]] * far_sign[j]
                    rf = rf @ _exp(-far[j] * a)
                    wf[6 + far_dof[j]] -= far_sign[j] * (rf @ far[j])
                gap = pf - end
                rel = _log(rn.T @ rf)
                right = _right_inverse(rel) @ rf.T
                theta = np.empty(6)
                theta[:3] = rn.T @ gap
                theta[3:] = rel
                for j in range(m):
                    w = wn[j]
                    moved = -pn[j] - np.array([w[1] * gap[2] - w[2] * gap[1], w[2] * gap[0] - w[0] * gap[2],
                                               w[0] * gap[1] - w[1] * gap[0]])  # fmt: skip
                    jy[c, :3, j] = rn.T @ moved
                    jy[c, 3:, j] = right @ (wf[j] - w)
                jp[c, :3, :3] = rn.T
                jp[c, :3, 3:] = rn.T @ _skew(shift_p)
                jp[c, 3:, :3] = 0.0
                jp[c, 3:, 3:] = right
                if width > 0:
                    kb = _pair(bar[c], width, q[c, 1], frame, bar_factor[c])
                else:
                    kb = lumped[c] * bar_factor[c]
                ky = jy[c].T @ kb
                hyy = ky @ jy[c]
                hyy[:6, :6] += foot_k[c]
                side = np.empty((m, 7))
                side[:, :6] = ky @ jp[c]
                side[:, 6] = ky @ theta
                side[:6, 6] += foot_k[c] @ foot[c]
                back = np.linalg.solve(hyy, side)
                back_y[c] = back
                mixed = np.ascontiguousarray(side[:, :6]).T
                hpp += jp[c].T @ kb @ jp[c] - mixed @ np.ascontiguousarray(back[:, :6])
                gp += jp[c].T @ (kb @ theta) - mixed @ np.ascontiguousarray(back[:, 6])
            move = -np.linalg.solve(hpp, gp)
            for c in range(chains):
                y = -back_y[c, :, 6] - np.ascontiguousarray(back_y[c, :, :6]) @ move
                foot[c] += y[:6]
                q[c] += y[6:]
            p = p + move[:3]
            r = _exp(move[3:]) @ r
            counts[n] = step + 1
            if np.abs(move[:3]).max() < 1e-5 and np.abs(move[3:]).max() < 1e-7:
                break
        out_p[n], out_r[n] = p, r
        for c in range(chains):
            load[n, c] = foot_k[c] @ foot[c]
    return out_p, out_r, load, counts


@dataclass
class Springs:
    """What differs from the nominal structure: factors on springs, rolls (rad), lengths (mm), a weight (N)."""

    drive: np.ndarray
    foot: np.ndarray
    bar: np.ndarray
    roll: np.ndarray
    longer: np.ndarray
    weight: float = 0.0
    tool: float = 0.0


def nominal(chains: int = 3) -> Springs:
    """The structure that the YAML states."""
    return Springs(np.ones(chains), np.ones(chains), np.ones(chains), np.zeros(chains), np.zeros(chains))


def equilibrium(machine: Machine, tip: np.ndarray, rho: np.ndarray, force: np.ndarray, springs: Springs, side=None,
                passes: int = 40) -> tuple[np.ndarray, np.ndarray, np.ndarray]:  # fmt: skip
    """Tip (n, 3) mm in the program frame, drive force on the carriage (n, c) N, and the passes that each row took.

    tip: where it is meant to be, only to start from; rho: carriages (n, c) mm before any load; force: on the tool at
    the tip (n, 3) N; side: further shift of every carriage (n, c, 3) mm in its own frame.
    """
    _, angles = machine.inverse(tip)
    reference = tip + machine.origin + [0, 0, machine.tool]
    slide = rho[:, :, None] * machine.axis
    if side is not None:
        slide = slide + side
    foot_k, turned = [], []
    for c in range(len(machine.drives)):
        compliance = machine.foot_compliance[c] / springs.foot[c]
        compliance[:3, :3] += np.outer(machine.axis[c], machine.axis[c]) / (
            machine.drive_stiffness[c] * springs.drive[c]
        )
        foot_k.append(np.linalg.inv(compliance))
        turned.append(machine.foot_turn[c] @ turn(machine.axis[c] * springs.roll[c]))
    tip_at = np.array([0.0, 0.0, -machine.tool - springs.tool])
    place, turning, load, counts = _solve(
        np.ascontiguousarray(slide), angles, reference, np.ascontiguousarray(force), springs.weight, tip_at,
        np.array(turned), machine.foot_at, np.array(foot_k), machine.near, machine.far, machine.far_dof,
        machine.far_sign, machine.hinges, machine.length + springs.longer, machine.bar, machine.lumped, machine.width,
        np.ascontiguousarray(machine.frame), springs.bar, machine.end_turn, machine.end_at, passes,
    )  # fmt: skip
    drive = -np.einsum("ncj,cj->nc", load[:, :, :3], machine.axis)
    return place + turning @ tip_at - machine.origin, drive, counts
