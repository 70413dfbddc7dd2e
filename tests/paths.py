"""Paths built by hand, for tests that need no program text."""

import numpy as np

from camcomp.ground.datatypes import ARC, LINE, RAPID, Path


def path_of(*moves, start=(0.0, 0.0, 0.0), feed=300.0, speed=8000.0, turn=1.0):
    """A path from ("rapid" | "line", end) and ("arc", end, centre, angle about +z) tuples; lines count from 1."""
    rows = []
    at = np.asarray(start, float)
    for number, (what, end, *rest) in enumerate(moves, start=1):
        kind = {"rapid": RAPID, "line": LINE, "arc": ARC}[what]
        centre, angle = (np.asarray(rest[0], float), rest[1]) if kind == ARC else (np.full(3, np.nan), 0.0)
        axis = [0.0, 0.0, 1.0] if kind == ARC else [0.0, 0.0, 0.0]
        rows.append((number, kind, at, np.asarray(end, float), centre, axis, angle))
        at = np.asarray(end, float)
    line, kind, begin, end, centre, axis, angle = zip(*rows, strict=True)
    n = len(rows)
    return Path(
        line=np.array(line),
        kind=np.array(kind),
        start=np.array(begin),
        end=np.array(end),
        centre=np.array(centre),
        axis=np.array(axis),
        angle=np.array(angle),
        feed=np.where(np.array(kind) == RAPID, np.nan, feed),
        speed=np.full(n, speed),
        turn=np.full(n, turn),
        tool=np.zeros(n, int),
        known=np.ones(n, bool),
        machine=np.zeros(n, bool),
    )
