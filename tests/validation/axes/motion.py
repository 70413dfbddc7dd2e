"""Set-points of one axis, a value per millisecond, about zero: strokes, sines, chirps, ladders, recordings."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tests.validation.recordings import recording

STEP_S = 1e-3
KINDS = ("s_curve", "trapezoid", "sine", "chirp", "ladder", "multisine", "recording")
Array = np.ndarray


def boxed(values: Array, seconds: float) -> Array:
    """Running mean over some seconds, held at both ends; makes jerk and corners finite."""
    n = max(1, round(seconds / STEP_S))
    padded = np.concatenate([np.full(n, values[0]), values, np.full(n, values[-1])])
    total = np.cumsum(np.concatenate([[0.0], padded - values[0]]))
    mean = (total[n:] - total[:-n]) / n + values[0]
    return mean[: len(values) + n]


def smooth(values: Array, seconds: float) -> Array:
    """Running mean about each value, over an odd number of them: over an even one it would come half a value late."""
    n = max(1, round(seconds / STEP_S)) // 2 * 2 + 1
    return boxed(values, seconds)[(n + 1) // 2 :][: len(values)]


def stroke(start: float, end: float, speed: float, acceleration: float) -> Array:
    """One move with a trapezoid of speed, without its first point."""
    way = abs(end - start)
    ramp = min(speed / acceleration, np.sqrt(way / acceleration))
    top = acceleration * ramp
    whole = way / top + ramp
    t = np.arange(1, int(np.ceil(whole / STEP_S)) + 1) * STEP_S
    up = 0.5 * acceleration * np.minimum(t, ramp) ** 2
    flat = top * np.clip(t - ramp, 0, whole - 2 * ramp)
    late = np.clip(t - (whole - ramp), 0, ramp)
    return start + np.sign(end - start) * (up + flat + top * late - 0.5 * acceleration * late**2)


def strokes(
    places: Sequence[float], speed: float, acceleration: float, round_s: float, dwell_s: Sequence[float]
) -> Array:
    """Moves from place to place with a stop at each."""
    parts = [np.full(round(0.2 / STEP_S), places[0])]
    for start, end, wait in zip(places[:-1], places[1:], dwell_s, strict=True):
        parts += [stroke(start, end, speed, acceleration), np.full(round(wait / STEP_S), end)]
    return boxed(np.concatenate(parts), round_s)


def faded(values: Array, seconds: float) -> Array:
    """Starts and ends at rest."""
    t = np.arange(len(values)) * STEP_S
    shape = np.clip(np.minimum(t, t[-1] - t) / seconds, 0, 1)
    return values * (shape**3 * (10 - 15 * shape + 6 * shape**2))


def recorded(name: str, axis: int, seconds: float, rng: np.random.Generator) -> Array:
    """A piece of what LinuxCNC commanded, through the set-point filter of a drive."""
    tip = recording.load(name).tip[:, axis]
    n = round(seconds / STEP_S)
    begin = int(rng.integers(0, max(1, len(tip) - n)))
    piece = np.concatenate(
        [np.full(100, tip[begin]), tip[begin : begin + n], np.full(100, tip[min(begin + n, len(tip)) - 1])]
    )
    piece = boxed(boxed(piece, 0.012), 0.008)
    return piece - piece[0]


def lengthened(values: Array, n: int) -> Array:
    """Comes to a stop within 0.15 s and stands until there are n values."""
    late = np.arange(1, n - len(values) + 1) * STEP_S / 0.15
    speed = (values[-1] - values[-2]) * np.where(late < 1, 0.5 + 0.5 * np.cos(np.pi * np.minimum(late, 1)), 0.0)
    return np.concatenate([values, values[-1] + np.cumsum(speed)])


def contour(axes: int, reach: float, seconds: float, rng: np.random.Generator) -> list[Array]:
    """Axes that move together: a circle, or a piece of a recording."""
    if rng.random() < 0.5:
        radius = reach * float(rng.uniform(0.2, 0.9))
        hertz = float(np.exp(rng.uniform(np.log(0.15), np.log(1.0)))) * float(rng.choice([-1, 1]))
        turn = 2 * np.pi * hertz * np.clip(np.arange(round(seconds / STEP_S)) * STEP_S - 0.3, 0, seconds - 0.6)
        turn = smooth(smooth(turn, 0.15), 0.1)
        parts = [radius * (np.cos(turn) - 1), radius * np.sin(turn), 0.2 * radius * np.sin(0.5 * turn)]
        return parts[:axes]
    tip = recording.load(str(rng.choice(recording.names()))).tip
    n = round(seconds / STEP_S)
    begin = int(rng.integers(0, max(1, len(tip) - n)))
    piece = np.vstack(
        [np.tile(tip[begin], (100, 1)), tip[begin : begin + n], np.tile(tip[min(begin + n, len(tip)) - 1], (100, 1))]
    )
    scale = min(1.0, reach / max(np.abs(piece - piece[0]).max(), 1e-9))
    return [boxed(boxed(scale * (piece[:, k] - piece[0, k]), 0.012), 0.008) for k in range(axes)]


def draw(kind: str, reach: float, seconds: float, sharp: bool, rng: np.random.Generator) -> Array:
    """A motion of about so many seconds that stays within +-reach."""
    speed = float(np.exp(rng.uniform(np.log(15), np.log(250))))
    acceleration = float(np.exp(rng.uniform(np.log(300), np.log(4000))))
    if kind in ("s_curve", "trapezoid"):
        round_s = float(rng.uniform(0.003, 0.006)) if kind == "trapezoid" and sharp else float(rng.uniform(0.03, 0.08))
        places, waits, length = [0.0], [], 0.0
        while length < seconds and len(places) < 60:
            side = -np.sign(places[-1]) if places[-1] else rng.choice([-1, 1])
            places.append(float(side * reach * rng.uniform(0.15, 1)))
            waits.append(float(rng.choice([0.02, rng.uniform(0.05, 0.5)])))
            length += abs(places[-1] - places[-2]) / speed + speed / acceleration + waits[-1]
        return strokes(places, speed, acceleration, round_s, waits)[: round(1.3 * seconds / STEP_S)]
    t = np.arange(round(seconds / STEP_S)) * STEP_S
    if kind == "sine":
        hertz = float(np.exp(rng.uniform(np.log(0.2), np.log(2.5))))
        size = min(reach, speed / (2 * np.pi * hertz), acceleration / (2 * np.pi * hertz) ** 2)
        return faded(size * np.sin(2 * np.pi * hertz * t), min(1.0, seconds / 5))
    if kind == "chirp":
        low, high = float(rng.uniform(0.15, 0.5)), float(rng.uniform(2, 9))
        phase = 2 * np.pi * low * seconds / np.log(high / low) * ((high / low) ** (t / seconds) - 1)
        hertz = low * (high / low) ** (t / seconds)
        size = np.minimum(min(reach, speed / (2 * np.pi * low)), acceleration / (2 * np.pi * hertz) ** 2)
        return faded(boxed(size, 0.2)[: len(t)] * np.sin(phase), 0.6)
    if kind == "multisine":
        out = np.zeros(len(t))
        for hertz in rng.uniform(0.2, 4, 6):
            out += np.sin(2 * np.pi * hertz * t + rng.uniform(0, 6.28)) / hertz
        return faded(out * min(reach / np.abs(out).max(), speed / np.abs(np.gradient(out, STEP_S)).max()), 0.8)
    if kind == "ladder":
        steps = int(rng.integers(4, 9))
        up = list(np.linspace(-0.8 * reach, 0.8 * reach, steps))
        way = [*up, up[-1] + 0.1 * reach, *up[::-1], up[0] - 0.1 * reach, up[0]]
        places = [x - way[0] for x in way]
        pause = float(rng.uniform(0.15, 0.4))
        whole = strokes(
            places, max(speed, 60), max(acceleration, 800), float(rng.uniform(0.02, 0.06)), [pause] * (len(places) - 1)
        )
        return (whole + way[0])[: round(1.6 * seconds / STEP_S)]
    piece = recorded(str(rng.choice(recording.names())), int(rng.integers(2)), seconds, rng)
    most = np.abs(piece).max()
    return piece * min(1.0, reach / most) if most > 0 else piece
