"""Rotation vectors, compiled: exponential, logarithm, left Jacobian and its derivative.

All functions take and return small float64 arrays (3,) or (3, 3); angles in rad. The left Jacobian J_l(w)
maps the rate of a rotation vector w to the angular velocity in the fixed frame, omega = J_l(w) dw/dt.
Source: Sola, Deray, Atchuthan, "A micro Lie theory for state estimation in robotics", eqs. (132)-(145).
"""

import math

import numpy as np
from numba import njit

SMALL_ANGLE = 0.2  # below it the closed forms lose digits and the series are exact to round-off


@njit(cache=True, nogil=True, error_model="numpy")
def _coefficients(angle_sq):
    """Factors a = sin t / t, b = (1 - cos t)/t^2, c = (t - sin t)/t^3, and b'/t, c'/t for the angle t."""
    if angle_sq < SMALL_ANGLE * SMALL_ANGLE:
        t2 = angle_sq
        a = 1.0 - t2 / 6.0 * (1.0 - t2 / 20.0 * (1.0 - t2 / 42.0 * (1.0 - t2 / 72.0)))
        b = 0.5 * (1.0 - t2 / 12.0 * (1.0 - t2 / 30.0 * (1.0 - t2 / 56.0 * (1.0 - t2 / 90.0))))
        c = (1.0 - t2 / 20.0 * (1.0 - t2 / 42.0 * (1.0 - t2 / 72.0 * (1.0 - t2 / 110.0)))) / 6.0
        db = -1.0 / 12.0 + t2 * (1.0 / 180.0 - t2 * (1.0 / 6720.0 - t2 / 453600.0))
        dc = -1.0 / 60.0 + t2 * (1.0 / 1260.0 - t2 * (1.0 / 60480.0 - t2 / 4989600.0))
        return a, b, c, db, dc
    t = math.sqrt(angle_sq)
    s = math.sin(t)
    co = math.cos(t)
    a = s / t
    b = (1.0 - co) / angle_sq
    c = (t - s) / (angle_sq * t)
    db = (a - 2.0 * b) / angle_sq
    dc = (b - 3.0 * c) / angle_sq
    return a, b, c, db, dc


@njit(cache=True, nogil=True, error_model="numpy")
def cross_matrix(w):
    """(3, 3) matrix [w] with [w] v = w x v."""
    m = np.zeros((3, 3))
    m[0, 1] = -w[2]
    m[0, 2] = w[1]
    m[1, 0] = w[2]
    m[1, 2] = -w[0]
    m[2, 0] = -w[1]
    m[2, 1] = w[0]
    return m


@njit(cache=True, nogil=True, error_model="numpy")
def exp_rotation(w):
    """(3, 3) rotation matrix of the rotation vector w (3,) rad."""
    a, b, _, _, _ = _coefficients(w[0] * w[0] + w[1] * w[1] + w[2] * w[2])
    m = np.empty((3, 3))
    m[0, 0] = 1.0 - b * (w[1] * w[1] + w[2] * w[2])
    m[1, 1] = 1.0 - b * (w[0] * w[0] + w[2] * w[2])
    m[2, 2] = 1.0 - b * (w[0] * w[0] + w[1] * w[1])
    m[0, 1] = b * w[0] * w[1] - a * w[2]
    m[1, 0] = b * w[0] * w[1] + a * w[2]
    m[0, 2] = b * w[0] * w[2] + a * w[1]
    m[2, 0] = b * w[0] * w[2] - a * w[1]
    m[1, 2] = b * w[1] * w[2] - a * w[0]
    m[2, 1] = b * w[1] * w[2] + a * w[0]
    return m


@njit(cache=True, nogil=True, error_model="numpy")
def log_rotation(r):
    """Rotation vector (3,) rad of a rotation matrix (3, 3); angles up to just below pi."""
    w = np.empty(3)
    w[0] = 0.5 * (r[2, 1] - r[1, 2])
    w[1] = 0.5 * (r[0, 2] - r[2, 0])
    w[2] = 0.5 * (r[1, 0] - r[0, 1])
    s = math.sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2])
    c = 0.5 * (r[0, 0] + r[1, 1] + r[2, 2] - 1.0)
    if s > 1e-300:
        angle = math.atan2(s, c)
        scale = angle / s if s > 1e-8 or c < 0.0 else 1.0 + s * s / 6.0
        w[0] *= scale
        w[1] *= scale
        w[2] *= scale
    return w


@njit(cache=True, nogil=True, error_model="numpy")
def left_jacobian(w):
    """(3, 3) left Jacobian J_l(w)."""
    _, b, c, _, _ = _coefficients(w[0] * w[0] + w[1] * w[1] + w[2] * w[2])
    x = cross_matrix(w)
    return np.eye(3) + b * x + c * (x @ x)


@njit(cache=True, nogil=True, error_model="numpy")
def left_jacobian_derivative(w):
    """(3, 3, 3) array D with D[j] = d J_l(w) / d w_j."""
    _, b, c, db, dc = _coefficients(w[0] * w[0] + w[1] * w[1] + w[2] * w[2])
    x = cross_matrix(w)
    xx = x @ x
    out = np.empty((3, 3, 3))
    e = np.zeros(3)
    for j in range(3):
        e[:] = 0.0
        e[j] = 1.0
        ej = cross_matrix(e)
        out[j] = w[j] * (db * x + dc * xx) + b * ej + c * (ej @ x + x @ ej)
    return out
