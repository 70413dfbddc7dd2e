"""Elements with memory: lags, rate limit, play, presliding friction and direction of travel, over ordered instants."""

from itertools import pairwise

import numpy as np

from camcomp.ground.compiled import inner, kept
from camcomp.ground.datatypes import Floats
from camcomp.model.seams import Seams

AT_ONCE = 1e-6  # of a time constant: shorter time steps move a lag by less than the round-off of its set-points
REST_S = 60.0  # time step across a stop
SHORT, SOON, DENSE = 0.01, 0.5, 2.0  # time constants
BELOW, ABOVE = 5, 2  # diagonals of the equations of a second-order loop
SAME = 1e-9  # relative difference below which two time steps are equal
STILL = 1e-9  # mm or rad, round-off of two solutions of the same point
PRESLIDING_MM = 0.005  # rolling guides reverse their friction within 1 to 20 um (Armstrong-Helouvry 1994)
PRESLIDING_RAD = 1e-5


@kept
def _first_order(x, t, tau, at, unseen, speed):  # type: ignore[no-untyped-def]  # pragma: no cover
    y = np.empty_like(x)
    y[0] = x[0]
    seam = 0
    for i in range(x.shape[0]):
        if seam < len(at) and at[seam] == i:
            kept_share = np.exp(-unseen[seam] / tau)
            for j in range(x.shape[1]):
                before = y[i - 1, j] - x[i - 1, j] if i > 0 else 0.0
                y[i, j] = x[i, j] + kept_share * before - (1.0 - kept_share) * tau * speed[seam, j]
            seam += 1
            continue
        if i == 0:
            continue
        dt = t[i] - t[i - 1]
        decay = np.exp(-dt / tau)
        hold = tau * (1.0 - decay) / dt if dt > 0.0 else 1.0
        for j in range(x.shape[1]):
            # exact for a set-point that moves linearly between two instants
            y[i, j] = decay * y[i - 1, j] + (hold - decay) * x[i - 1, j] + (1.0 - hold) * x[i, j]
    return y


def first_order(x: Floats, time: Floats, tau: float, seams: Seams | None = None) -> Floats:
    """First-order lag of x (n, m) with time constant tau s; time (n,) s, not decreasing.

    At rest and settled at the start; at seams settled at the speed with which the recording continues.
    """
    if seams is None:
        seams = Seams(np.zeros(0, np.int64), np.zeros(0), np.zeros((0, x.shape[1])))
    out: Floats = _first_order(
        *(np.ascontiguousarray(each) for each in (x, time)),
        tau,
        seams.at,
        seams.unseen,
        np.ascontiguousarray(seams.speed),
    )
    return out


@inner
def _lag_shares(dt, tau):  # type: ignore[no-untyped-def]  # pragma: no cover
    """Shares of the position before, of the set-point before and of the set-point in the position after dt."""
    decay = np.exp(-dt / tau)
    hold = -np.expm1(-dt / tau) * tau / dt
    return decay, hold - decay, 1.0 - hold


@inner
def _takes_up_play(y, t, k, tau):  # type: ignore[no-untyped-def]  # pragma: no cover
    """Whether y turns round at instant k at a speed that it does not keep to: an encoder that goes through the play of its drive."""
    if not 0 < k < t.shape[0] - 2:
        return False
    step, dt, after = y[k + 1] - y[k], t[k + 1] - t[k], t[k + 2] - t[k + 1]
    turns = AT_ONCE * tau < dt and max(dt, after) < REST_S and step * (y[k] - y[k - 1]) < 0.0
    return turns and abs(step) * after > 2.0 * abs(y[k + 2] - y[k + 1]) * dt


@inner
def _speed(y, t, k, tau):  # type: ignore[no-untyped-def]  # pragma: no cover
    """Speed at instant k by a parabola through its neighbours, or from the one before if the motion ends."""
    dt = t[k] - t[k - 1]
    before = (y[k] - y[k - 1]) / dt if dt > 0.0 else 0.0
    after = t[k + 1] - t[k] if k + 1 < t.shape[0] else 0.0
    if not 0.0 < after < REST_S or _takes_up_play(y, t, k, tau):
        return before
    return before + ((y[k + 1] - y[k]) / after - before) * dt / (dt + after)


@inner
def _later(y, t, i, tau):  # type: ignore[no-untyped-def]  # pragma: no cover
    """The instant to whose position a lag is led from instant i, and the time (s) within which it gets there.

    Instant i itself if it is late enough; else the next but within SOON tau, not in front of a very short step, and none beyond an
    instant at which play is taken up; behind that the next one, because an encoder that goes too far takes the carriage along.
    """
    behind_play = _takes_up_play(y, t, i - 1, tau)
    if t[i] - t[i - 1] >= DENSE * tau and not behind_play:
        return i, 0.0
    k = i
    while k + 1 < t.shape[0] and t[k + 1] - t[k] < REST_S and not _takes_up_play(y, t, k, tau):
        since = t[k] - t[i - 1]
        short = t[k + 1] - t[k] < SHORT * tau and since < 2.0 * SOON * tau
        if k > i and (behind_play or since >= SOON * tau) and not short:
            break
        k += 1
    return k, t[k] - t[i] if behind_play else min(t[k] - t[i], DENSE * tau)


@kept
def _inverse_first_order(y, t, tau):  # type: ignore[no-untyped-def]  # pragma: no cover
    n = y.shape[0]
    x = np.empty_like(y)
    x[0] = y[0]
    reached = y[0].copy()
    for i in range(1, n):
        dt = t[i] - t[i - 1]
        if dt <= AT_ONCE * tau:
            x[i] = x[i - 1] + y[i] - y[i - 1]
            continue
        decay, old, new = _lag_shares(dt, tau)
        for j in range(y.shape[1]):
            k, ahead = _later(y[:, j], t, i, tau)
            coming = decay * reached[j] + old * x[i - 1, j]
            if ahead > AT_ONCE * tau:
                decay_ahead, old_ahead, new_ahead = _lag_shares(ahead, tau)
                share = ahead / (t[k] - t[i])
                goal = y[i, j] + share * (y[k, j] - y[i, j])
                then = share * (y[k, j] + tau * _speed(y[:, j], t, k, tau))
                by = decay_ahead * new + old_ahead + new_ahead * (1.0 - share)
                x[i, j] = (goal - new_ahead * then - decay_ahead * coming) / by
            else:
                x[i, j] = (y[i, j] - coming) / new
            reached[j] = coming + new * x[i, j]
    return x


def inverse_first_order(y: Floats, time: Floats, tau: float) -> Floats:
    """Set-points x (n, m) with which a first-order lag of time constant tau s is at y (n, m); time (n,) s, not decreasing.

    At rest at the start. Where instants are at least DENSE tau apart, and where a motion ends, the lag is at y at every one. Led to
    all of dense ones, set-points would alternate behind each jump of y or its speed: there they lead to y at a later instant, the next
    one or the first behind SOON tau, from which x = y + tau dy/dt goes on (dead-beat control in two steps).
    """
    out: Floats = _inverse_first_order(np.ascontiguousarray(y), np.ascontiguousarray(time), tau)
    return out


@inner
def _free_swing(w, damping, dt):  # type: ignore[no-untyped-def]  # pragma: no cover
    """Free response of a second-order loop over dt: its state transition matrix (error, rate), four elements."""
    fade, square = damping * w, (damping * damping - 1.0) * w * w
    if square < 0.0:
        q = np.sqrt(-square)
        even, odd = np.exp(-fade * dt) * np.cos(q * dt), np.exp(-fade * dt) * np.sin(q * dt) / q
    else:
        q = np.sqrt(square)
        slow, ratio = np.exp(-(fade - q) * dt), np.exp(-2.0 * q * dt)
        even = 0.5 * slow * (1.0 + ratio)
        odd = slow * dt if q == 0.0 else -0.5 * slow * np.expm1(-2.0 * q * dt) / q
    return even + fade * odd, odd, -w * w * odd, even - fade * odd


@inner
def _swing(error, rate, push, bend, free, w, damping, dt):  # type: ignore[no-untyped-def]  # pragma: no cover
    """Error and rate after dt, during which the set-point's acceleration goes straight from `push` to `bend`."""
    ee, er, re, rr = free
    # particular solution for a linear acceleration, and the free response about it
    slope = (bend - push) / dt
    run = -slope / (w * w)
    late = 2.0 * damping * slope / w
    about = error + (push - late) / (w * w)
    drift = rate - run
    return ee * about + er * drift - (bend - late) / (w * w), re * about + rr * drift + run


@kept
def _second_order(x, t, period, damping):  # type: ignore[no-untyped-def]  # pragma: no cover
    n = x.shape[0]
    y = np.zeros_like(x)
    w = 2.0 * np.pi / period
    push = np.zeros(x.shape[1])
    rate = np.zeros(x.shape[1])
    known = 0.0  # the time step to which `free` belongs
    free = 1.0, 0.0, 0.0, 1.0
    for i in range(1, n):
        dt = t[i] - t[i - 1]
        if dt <= 0.0:
            y[i] = y[i - 1]
            push[:] = 0.0
            continue
        after = t[i + 1] - t[i] if i + 1 < n else 0.0
        if abs(dt - known) > SAME * dt:
            free = _free_swing(w, damping, dt)
            known = dt
        for j in range(x.shape[1]):
            bend = 0.0
            if after > 0.0:
                bend = 2.0 * ((x[i + 1, j] - x[i, j]) / after - (x[i, j] - x[i - 1, j]) / dt) / (dt + after)
            y[i, j], rate[j] = _swing(y[i - 1, j], rate[j], push[j], bend, free, w, damping, dt)
            push[j] = bend
    return y


def second_order(x: Floats, time: Floats, period: float, damping: float) -> Floats:
    """Position minus set-point x (n, m) of a second-order loop with velocity feed-forward; period s, time (n,) s, not decreasing.

    e'' + 2 d w e' + w^2 e = -x'', the set-point's acceleration x'' being straight between two instants. Settled at the start.
    Exact, whatever the period.
    """
    out: Floats = _second_order(np.ascontiguousarray(x), np.ascontiguousarray(time), period, damping)
    return out


@inner
def _add(bands, row, column, value):  # type: ignore[no-untyped-def]  # pragma: no cover
    if value != 0.0:
        bands[ABOVE + row - column, column] += value


@kept
def _inverse_bands(t, period, damping):  # type: ignore[no-untyped-def]  # pragma: no cover
    """Equations of `_second_order` for set-point and rate at n instants: bands (BELOW + ABOVE + 1, 2 n), and the factor (2 n,) of the
    position before in each of them.
    """
    n = t.shape[0]
    w = 2.0 * np.pi / period
    bands = np.zeros((BELOW + ABOVE + 1, 2 * n))
    bands[ABOVE] = 1.0
    factor = np.zeros(2 * n)
    pushed = np.zeros(3)  # factors of the set-points around the instant before in its acceleration
    for i in range(1, n):
        dt = t[i] - t[i - 1]
        after = t[i + 1] - t[i] if i + 1 < n else 0.0
        bent = np.zeros(3)
        by_error, by_rate, by_push, by_bend = (1.0, 0.0), (0.0, 1.0), (0.0, 0.0), (0.0, 0.0)
        if dt > 0.0:
            if after > 0.0:
                bent[0] = 2.0 / (dt * (dt + after))
                bent[2] = 2.0 / (after * (dt + after))
                bent[1] = -bent[0] - bent[2]
            free = _free_swing(w, damping, dt)
            by_error = _swing(1.0, 0.0, 0.0, 0.0, free, w, damping, dt)
            by_rate = _swing(0.0, 1.0, 0.0, 0.0, free, w, damping, dt)
            by_push = _swing(0.0, 0.0, 1.0, 0.0, free, w, damping, dt)
            by_bend = _swing(0.0, 0.0, 0.0, 1.0, free, w, damping, dt)
        for k in range(2):  # the error is position minus set-point, so that its equation has the other sign
            row, sign = 2 * i + k, 1.0 - 2.0 * k
            factor[row] = -sign * by_error[k]
            _add(bands, row, 2 * i - 2, -sign * by_error[k])
            _add(bands, row, 2 * i - 1, sign * by_rate[k])
            for j in range(3):
                _add(bands, row, 2 * (i - 2 + j), sign * by_push[k] * pushed[j])
                _add(bands, row, 2 * (i - 1 + j), sign * by_bend[k] * bent[j])
        pushed = bent
    return bands, factor


def inverse_second_order(y: Floats, time: Floats, period: float, damping: float) -> Floats:
    """Set-points x (n, m) that a second-order loop makes positions y (n, m): x + second_order(x) = y.

    Its acceleration at an instant looks ahead to the next one, so that all instants are solved together.
    """
    from scipy.linalg import solve_banded  # only programs on such a loop wait for it

    bands, factor = _inverse_bands(np.ascontiguousarray(time), period, damping)
    right = factor[:, None] * np.repeat(np.concatenate((y[:1], y[:-1])), 2, axis=0)
    right[::2] += y
    found = solve_banded((BELOW, ABOVE), bands, right, overwrite_ab=True, overwrite_b=True, check_finite=False)
    return np.asarray(found[::2])


@kept
def _rate_limited(x, t, speed):  # type: ignore[no-untyped-def]  # pragma: no cover
    y = np.empty_like(x)
    y[0] = x[0]
    for i in range(1, x.shape[0]):
        most = speed * (t[i] - t[i - 1])
        for j in range(x.shape[1]):
            y[i, j] = y[i - 1, j] + min(max(x[i, j] - y[i - 1, j], -most), most)
    return y


def rate_limited(x: Floats, time: Floats, speed: float) -> Floats:
    """Positions (n, m) that follow set-points x (n, m) at `speed` per s at most; time (n,) s, not decreasing.

    On its set-point at the start. Exact for a set-point that moves linearly between two instants, except for the instant
    at which it is reached again.
    """
    out: Floats = _rate_limited(np.ascontiguousarray(x), np.ascontiguousarray(time), speed)
    return out


@kept
def _play(x, width, pushed):  # type: ignore[no-untyped-def]  # pragma: no cover
    y = np.empty_like(x)
    for j in range(x.shape[1]):
        state = x[0, j]
        for i in range(x.shape[0]):
            if pushed[i, j] != 0.0:
                state = x[i, j] + 0.5 * width * pushed[i, j]
            state = min(max(state, x[i, j] - 0.5 * width), x[i, j] + 0.5 * width)
            y[i, j] = state - x[i, j]
    return y


def play(x: Floats, width: float, pushed: Floats | None = None) -> Floats:
    """Carriage minus encoder (n, m) of a play of full `width` mm driven by x (n, m), centred at the start.

    pushed (n, m): flank on which a load holds the carriage, 1 or -1; 0, and None: it stays on that of the last motion.
    """
    pushed = np.zeros_like(x) if pushed is None else pushed
    out: Floats = _play(np.ascontiguousarray(x), width, np.ascontiguousarray(pushed))
    return out


@kept
def _play_between(x, low, high):  # type: ignore[no-untyped-def]  # pragma: no cover
    y = np.empty_like(x)
    state = x[0] + 0.5 * (low[0] + high[0])
    for i in range(x.shape[0]):
        state = min(max(state, x[i] + low[i]), x[i] + high[i])
        y[i] = state - x[i]
    return y


def play_between(x: Floats, low: Floats, high: Floats) -> Floats:
    """Carriage minus encoder (n,) of one drive at x (n,) mm whose play reaches from low to high (n,), centred at the start."""
    out: Floats = _play_between(*(np.ascontiguousarray(each) for each in (x, low, high)))
    return out


@kept
def _direction(x, distance, y):  # type: ignore[no-untyped-def]  # pragma: no cover
    for j in range(x.shape[1]):
        state = 0.0
        for i in range(1, x.shape[0]):
            step = x[i, j] - x[i - 1, j]
            sign = 1.0 if step > 0.0 else -1.0
            if step != 0.0:
                state = sign + (state - sign) * np.exp(-abs(step) / distance)
            y[i, j] = state


def direction(x: Floats, distance: float = PRESLIDING_MM) -> Floats:
    """Sign of travel with memory (n, m): Dahl's law reverses it over `distance`; 0 before the first move.

    Source: Dahl 1968 with exponent 1. Holds while: rate-independent friction.
    """
    out: Floats = np.zeros(x.shape)
    _direction(np.ascontiguousarray(x), distance, out)
    return out


@kept
def _held(x, stiffness, force, distance):  # type: ignore[no-untyped-def]  # pragma: no cover
    out = np.zeros_like(x)
    for j in range(x.shape[1]):
        k = stiffness[j]
        carriage = x[0, j]
        state = 0.0
        for i in range(1, x.shape[0]):
            pull = k * (x[i, j] - carriage) - force * state if np.isfinite(k) else x[i, j] - carriage
            if pull != 0.0:
                sense = 1.0 if pull > 0.0 else -1.0
                way = abs(pull)
                turned = sense * state - 1.0
                if np.isfinite(k):  # Newton from the left on a convex, falling function
                    way = 0.0
                    for _ in range(50):
                        fade = turned * np.exp(-way / distance)
                        left = sense * k * (x[i, j] - carriage) - k * way - force * (1.0 + fade)
                        step = left / (k - force * fade / distance)
                        way += step
                        if step < 1e-9:
                            break
                state = sense * (1.0 + turned * np.exp(-way / distance))
                carriage += sense * way
            out[i, j] = state
    return out


def held_back(x: Floats, stiffness: Floats, force: float, distance: float = PRESLIDING_MM) -> Floats:
    """Friction over its Coulomb force (n, m), -1 to 1, of carriages that encoders x (n, m) pull through springs (m,).

    Dahl's law over the travel of the carriage, not of the encoder: the carriage hardly moves until the spring has reversed
    by 2 force/stiffness. distance mm; force N; stiffness inf = rigid. 0 before the first move.
    """
    out: Floats = _held(np.ascontiguousarray(x), np.ascontiguousarray(stiffness, dtype=float), force, distance)
    return out


def ways(x: Floats, least: float) -> Floats:
    """Direction of travel (n, m) in which x (n, m) arrives: +1, -1, 0 before the first move.

    A reversal counts from the extremum on, and only if a travel of at least `least` follows it.
    """
    out = np.zeros_like(x)
    for j in range(x.shape[1]):
        turns, first = turning_points(x[:, j], least)
        sense = first
        for a, b in pairwise([*turns, len(x) - 1]):
            out[a + 1 : b + 1, j] = sense
            sense = -sense
    return out


def turning_points(x: Floats, least: float) -> tuple[list[int], float]:
    """Indices where x (n,) begins a travel of at least `least`, and the sign of the first one; ([], 0) without any."""
    steps = np.diff(x)
    moving = np.flatnonzero(np.abs(steps) > STILL)
    if not len(moving):
        return [], 0.0
    inner = moving[1:][steps[moving[1:]] * steps[moving[:-1]] < 0.0]  # local extrema, in order
    low = high = 0
    sense, turns, first = 0.0, [], 0.0
    for i in [*inner.tolist(), len(x) - 1]:
        if x[i] > x[high]:
            high = i
        if x[i] < x[low]:
            low = i
        if sense <= 0.0 and x[i] - x[low] >= least:
            turns.append(low)
            sense, high = 1.0, i
        elif sense >= 0.0 and x[high] - x[i] >= least:
            turns.append(high)
            sense, low = -1.0, i
        else:
            continue
        first = first or sense
    return turns, first
