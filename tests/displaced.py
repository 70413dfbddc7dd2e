"""Random outputs for a path: what a compensation might ask the writer for."""

from random import Random

import numpy as np

from camcomp.gcode.output import Output
from camcomp.ground.datatypes import ARC, LINE, RAPID, Path


def shifted(path: Path, random: Random, size: float = 0.3) -> Output:
    """Every motion moved by one common vector."""
    shift = np.array([random.uniform(-size, size) for _ in range(3)])
    same = Output.same(path)
    return Output(
        motion=same.motion,
        kind=same.kind,
        end=same.end + shift,
        centre=same.centre + shift,
        angle=same.angle,
        feed=same.feed,
        joining=same.joining,
    )


def divided(path: Path, random: Random, size: float = 0.3) -> Output:
    """Cuts divided into straight pieces, every point moved by its own vector, feeds changed, joining lines added."""
    rows: list[tuple[int, int, np.ndarray, float, bool]] = []
    for k in range(len(path)):
        if path.machine[k] or not path.known[k]:
            rows.append((k, int(path.kind[k]), path.end[k], np.nan, False))
            continue
        if path.kind[k] == RAPID:
            rows.append((k, RAPID, path.end[k] + _vector(random, size), np.nan, False))
            continue
        feed = path.feed[k]
        if random.random() < 0.2:
            rows.append((k, LINE, path.start[k] + _vector(random, size), feed, True))
        pieces = random.choice([1, 1, 2, 3]) if path.kind[k] == LINE else random.choice([3, 5])
        for piece in range(1, pieces + 1):
            point = path.start[k] + (path.end[k] - path.start[k]) * piece / pieces + _vector(random, size)
            factor = random.choice([1.0, 1.0, 1.0005, 1.2, 0.8])
            rows.append((k, LINE, point, feed * factor if factor != 1.0 else np.nan, False))
        if random.random() < 0.1:
            rows.append((k, LINE, path.end[k] + _vector(random, size), np.nan, True))
    n = len(rows)
    return Output(
        motion=np.array([each[0] for each in rows]),
        kind=np.array([each[1] for each in rows], np.int8),
        end=np.array([each[2] for each in rows]),
        centre=np.full((n, 3), np.nan),
        angle=np.zeros(n),
        feed=np.array([each[3] for each in rows]),
        joining=np.array([each[4] for each in rows]),
    )


def _vector(random: Random, size: float) -> np.ndarray:
    return np.array([random.uniform(-size, size) for _ in range(3)])


def arcs_bent(path: Path, random: Random, size: float = 0.3) -> Output:
    """Every end moved by its own vector; arcs stay arcs, about the centre that the moved ends allow."""
    same = Output.same(path)
    end, centre, angle = path.end.copy(), path.centre.copy(), path.angle.copy()
    last = path.start[0].copy()
    for k in range(len(path)):
        if path.known[k] and not path.machine[k]:
            end[k] += _vector(random, size)
        if path.kind[k] == ARC and path.known[k]:
            normal = path.axis[k]
            full = abs(angle[k]) % (2 * np.pi) < 1e-6 or abs(angle[k]) % (2 * np.pi) > 2 * np.pi - 1e-6
            if full:
                end[k] = last + normal * (end[k] - last)
                centre[k] += (1 - normal) * (last - path.start[k])
            else:
                # Centre on the bisector of the moved chord, at the distance that keeps the angle.
                chord = (end[k] - last) * (1 - normal)
                half = np.linalg.norm(chord) / 2.0
                turn = angle[k] % (2 * np.pi) if angle[k] > 0 else -((-angle[k]) % (2 * np.pi))
                height = half / np.tan(turn / 2.0)
                centre[k] = last + chord / 2.0 + height * np.cross(normal, chord / (2.0 * half))
        last = end[k]
    return Output(
        motion=same.motion, kind=same.kind, end=end, centre=centre, angle=angle, feed=same.feed, joining=same.joining
    )
