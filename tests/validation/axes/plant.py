"""One axis in its control loop, step by step in time: motor, load, friction, cascade of position and speed.

Force in N, way in mm, time in s, so a mass is in N s2/mm (a thousandth of its kg).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numba import njit
from scipy.interpolate import CubicSpline

from tests.validation.axes.motion import STEP_S

Array = np.ndarray
FINE = 5  # steps of the simulation per millisecond


@dataclass(frozen=True)
class Axis:
    """Loop, masses and friction of an axis. Without more: a healthy one."""

    mass: float = 0.05  # N s2/mm, rotor and screw included
    kp: float = 250.0  # 1/s, position loop
    kp_back: float = 0.0  # the same while the axis travels backwards; 0: as forwards
    wv: float = 800.0  # 1/s, gain of the speed loop over the mass
    reset_s: float = 0.02  # of the speed loop; inf: no integral part
    vff: float = 1.0  # share of the set-point's speed that is fed forward
    aff: float = 1.0  # share of the speed command's change that is fed forward as a force
    coulomb: float = 0.0  # N
    viscous: float = 0.0  # N s/mm
    asymmetry: float = 0.0  # N s/mm, viscous forwards minus the mean of both ways
    presliding: float = 0.005  # mm, of the bristles
    spring: float = 2e4  # N/mm, between the encoder and the guide
    friction_ff: float = 1.0  # share of the friction that the drive feeds forward
    weight: float = 0.0  # N that the drive carries, along plus
    most: float = np.inf  # N, the motor's own limit
    ratio: float = 0.0  # load's share of the mass behind a soft belt; 0: one mass
    belt_hertz: float = 20.0
    belt_damping: float = 0.03
    play: float = 0.0  # mm, inside the loop: the load's encoder closes it
    stribeck: float = 0.0  # of the Coulomb force, more at standstill
    stribeck_speed: float = 2.0  # mm/s
    notes: dict = field(default_factory=dict)

    def but(self, **changes: float) -> Axis:
        """The same axis with something changed."""
        return replace(self, **changes)


@dataclass(frozen=True)
class Around:
    """Forces and faults on an axis in a run over time; arrays per millisecond, or None."""

    load: Array | None = None  # N, pushes the carriage along plus
    rub: Array | None = None  # factor on the friction
    seen: Array | None = None  # set-points as they reach the loop
    more_ff: Array | None = None  # N, fed forward in error


@dataclass(frozen=True)
class Moved:
    """Motion of an axis, per millisecond."""

    motor: Array
    force: Array  # of the motor, along plus


@njit(cache=True)
def _turned(z, step, reach, stiff, level):
    """State of the bristles after a step of the way."""
    if step == 0.0:
        return z
    end = level if step > 0 else -level
    slope = max(0.0, 1 - z / end) / reach
    return end + (z - end) * np.exp(-abs(step) / (reach * level * (1 + slope / stiff)))


@njit(cache=True)
def bristles(way: Array, reach: float, stiff: float) -> Array:
    """Friction over its Coulomb force along a way: turns round exponentially, behind a spring of stiff = k / force."""
    out = np.zeros(len(way))
    for k in range(1, len(way)):
        step, z = way[k] - way[k - 1], out[k - 1]
        out[k] = _turned(z, step, reach, stiff, 1.0)
    return out


@njit(cache=True)
def _rates(y, z, k, c, cd, cdd, ff, load, rub, p, out):
    (kp, back, wv, inv_reset, vff, aff, mass, coulomb, viscous, asymmetry, most, share, belt, damp, play) = p  # fmt: skip
    x, v, xl, vl, summed = y[0], y[1], y[2], y[3], y[4]
    seen = xl if play > 0 else x
    gain = back if v < 0 else kp
    want = gain * (c[k] - seen) + vff * cd[k]
    late = want - v
    force = mass * (wv * (late + inv_reset * summed) + aff * (gain * (cd[k] - v) + vff * cdd[k])) + ff[k]
    held = False
    if force > most:
        force, held = most, late > 0
    elif force < -most:
        force, held = -most, late < 0
    at = vl if share > 0 else v
    sense = 1.0 if at > 0 else -1.0
    rubbed = rub[k] * (coulomb * z + (viscous + asymmetry * sense) * at)
    out[0] = v
    out[4] = 0.0 if held else late
    if share > 0:
        heavy = mass * share
        pull = heavy * (belt * belt * (x - xl) + 2 * damp * belt * (v - vl))
        out[1] = (force - pull) / (mass * (1 - share))
        out[2] = vl
        out[3] = (pull - rubbed + load[k]) / heavy
    else:
        out[1] = (force - rubbed + load[k]) / mass
        out[2] = 0.0
        out[3] = 0.0
    return force


@njit(cache=True)
def _loop(c, cd, cdd, ff, load, rub, p, rubs, fine):
    steps = (len(c) - 1) // 2
    h = 1e-3 / fine
    motor, force = np.zeros(steps // fine + 1), np.zeros(steps // fine + 1)
    reach, stiff, more, slow = rubs
    y, z = np.zeros(5), 0.0
    y[0], y[1], y[2], y[3] = c[0], cd[0], c[0], cd[0]
    a, b, d, e, w = np.zeros(5), np.zeros(5), np.zeros(5), np.zeros(5), np.zeros(5)
    soft, play = p[11] > 0, p[14]
    for k in range(steps + 1):
        speed = y[3] if soft else y[1]
        level = 1 + more * np.exp(-((speed / slow) ** 2)) if more > 0 else 1.0
        mid = _turned(z, speed * h / 2, reach, stiff, level)
        now = _rates(y, mid, 2 * k, c, cd, cdd, ff, load, rub, p, a)
        if k % fine == 0:
            motor[k // fine], force[k // fine] = y[0], now
        if k == steps:
            break
        for i in range(5):
            w[i] = y[i] + 0.5 * h * a[i]
        _rates(w, mid, 2 * k + 1, c, cd, cdd, ff, load, rub, p, b)
        for i in range(5):
            w[i] = y[i] + 0.5 * h * b[i]
        _rates(w, mid, 2 * k + 1, c, cd, cdd, ff, load, rub, p, d)
        for i in range(5):
            w[i] = y[i] + h * d[i]
        _rates(w, mid, 2 * k + 2, c, cd, cdd, ff, load, rub, p, e)
        before = y[2] if soft else y[0]
        for i in range(5):
            y[i] += h / 6 * (a[i] + 2 * b[i] + 2 * d[i] + e[i])
        if play > 0:
            y[2] = min(max(y[2], y[0] - play / 2), y[0] + play / 2)
        z = _turned(z, (y[2] if soft else y[0]) - before, reach, stiff, level)
    return motor, force


def _finer(values: Array | None, n: int, other: float) -> Array:
    """At half steps of the simulation."""
    per = 2 * FINE
    if values is None:
        return np.full((n - 1) * per + 1, other)
    return np.interp(np.arange((n - 1) * per + 1) / per, np.arange(n), values)


def simulate(axis: Axis, command: Array, around: Around | None = None) -> Moved:
    """An axis driven by set-points (n,), a value per millisecond."""
    around = around or Around()
    n = len(command)
    t = np.arange((n - 1) * 2 * FINE + 1) * STEP_S / (2 * FINE)
    spline = CubicSpline(np.arange(n) * STEP_S, command if around.seen is None else around.seen)
    c, cd, cdd = spline(t), spline(t, 1), spline(t, 2)
    rub = _finer(around.rub, n, 1.0)
    stiff = axis.spring / max(axis.coulomb, 1e-9)
    ff = np.full(len(t), 0.0)
    if axis.friction_ff and (axis.coulomb or axis.viscous or axis.asymmetry):
        slide = bristles(command, axis.presliding, stiff)
        speed = np.gradient(command, STEP_S)
        drag = axis.coulomb * slide + (axis.viscous + axis.asymmetry * np.sign(speed)) * speed
        ff += axis.friction_ff * _finer(drag, n, 0.0)
    if around.more_ff is not None:
        ff += _finer(around.more_ff, n, 0.0)
    turn = 2 * np.pi * axis.belt_hertz
    parameters = (
        axis.kp, axis.kp_back or axis.kp, axis.wv, 1 / axis.reset_s, axis.vff, axis.aff, axis.mass, axis.coulomb,
        axis.viscous, axis.asymmetry, axis.most, axis.ratio, turn, axis.belt_damping, axis.play,
    )  # fmt: skip
    p = tuple(float(value) for value in parameters)
    rubs = (axis.presliding, stiff, axis.stribeck, axis.stribeck_speed)
    motor, force = _loop(c, cd, cdd, ff, _finer(around.load, n, 0.0), rub, p, rubs, FINE)
    return Moved(motor, force + axis.weight)
