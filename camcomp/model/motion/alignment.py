"""Where along its program a machine was, row by row: geometry says it, line numbers settle what geometry leaves open.

Real controls blend corners, merge lines and report line numbers early or late. So rows are led along the path by the
place of the tip, never back, and the column `line` counts as a hint; by how many rows it leads or lags is found from the
rows at which it changes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from camcomp.ground import path_geometry
from camcomp.ground.datatypes import ARC, Floats, Ints, Path

_CHORD_RAD = 0.05  # of an arc
_LINE_MM2 = 0.01  # squared distance that a wrong line number weighs as much as, and by how many times it adds to it
_LINE_TIMES = 4.0
_SLACK_MM = 0.5  # by which a row may be further along than the way between two rows says
_LOST_MM = 2.0  # from the path where the search begins anew
_MOST_LAG = 25  # rows
_GAINED = 0.35  # of the shift, in rows per change of line: short lines hide a part of it


@dataclass(frozen=True, eq=False)
class Aligned:
    """n rows on a path. motion (n,): index into the path; share (n,) of its length; distance (n,) mm from it; lag: rows by
    which the column `line` is late (early where negative); line (n,): source line being executed, corrected by it.
    """

    motion: Ints
    share: Floats
    distance: Floats
    lag: int
    line: Floats


def align(path: Path, tip: Floats, line: Floats) -> Aligned:
    """Rows of tips (n, 3) mm, program frame, in the order of time; line (n,): as logged, NaN where it is not known."""
    motion, u0, u1 = _chords(path)
    begin, end = path_geometry.points(path, motion, u0), path_geometry.points(path, motion, u1)
    length = np.linalg.norm(end - begin, axis=1)
    at = np.concatenate([[0.0], np.cumsum(length)])
    step = np.linalg.norm(np.diff(tip, axis=0, prepend=tip[:1]), axis=1)
    hint = np.where(np.isfinite(line) & (line > 0), line, -1.0).astype(np.int64)
    hint[~np.isin(hint, path.line)] = -1  # comments, dwells, the end of the program
    chord, along = _follow(begin, end - begin, length, at, path.line[motion], tip, step, hint)
    share = np.clip(u0[chord] + along * (u1[chord] - u0[chord]), 0.0, 1.0)
    found = motion[chord]
    share = _nearest(path, found, share, tip)
    distance = np.linalg.norm(path_geometry.points(path, found, share) - tip, axis=1)
    lag = _lag(path.line[found], hint)
    corrected = line if lag == 0 else _shifted(line, lag)
    return Aligned(found, share, distance, lag, corrected)


def _chords(path: Path) -> tuple[Ints, Floats, Floats]:
    """Every motion with a length as straight chords: motion (k,), begin and end (k,) as shares of it."""
    moves = np.flatnonzero(path_geometry.lengths(path) > 0.0)
    angle = np.where(path.kind[moves] == ARC, np.abs(np.nan_to_num(path.angle[moves])), 0.0)
    count = np.maximum(np.ceil(angle / _CHORD_RAD), 1.0).astype(np.int64)
    motion = np.repeat(moves, count)
    within = np.arange(len(motion)) - np.repeat(np.cumsum(count) - count, count)
    of = np.repeat(count, count)
    return motion, within / of, (within + 1) / of


@njit(cache=True)
def _follow(begin, way, length, at, line, tip, step, hint):  # type: ignore[no-untyped-def]  # pragma: no cover
    n, k = tip.shape[0], begin.shape[0]
    chord, along = np.zeros(n, np.int64), np.zeros(n)
    here, done = 0, 0.0  # chord, and mm along it
    lost = True
    for i in range(n):
        best = np.inf
        found, place = here, done
        # near by at first; rows are missing: anywhere ahead; the log begins again: anywhere
        for attempt in range(2 if lost else 0, 3):
            if best <= _LOST_MM**2:
                break
            first = 0 if attempt == 2 else here
            reach = 2.0 * step[i] + _SLACK_MM if attempt == 0 else np.inf
            for c in range(first, k):
                if at[c] - at[here] - done > reach:
                    break
                low = done if c == here and attempt < 2 else 0.0
                x = 0.0
                for j in range(3):
                    x += (tip[i, j] - begin[c, j]) * way[c, j]
                x = min(max(x / length[c], low), length[c])
                gap = 0.0
                for j in range(3):
                    gap += (begin[c, j] + x / length[c] * way[c, j] - tip[i, j]) ** 2
                if hint[i] >= 0 and line[c] != hint[i]:
                    gap = _LINE_TIMES * gap + _LINE_MM2
                gap += 1e-9 * max(at[c] + x - at[here] - done, 0.0)  # of two that fit alike the nearer along the path
                if gap < best - 1e-12:
                    best, found, place = gap, c, x
        lost = False
        here, done = found, place
        chord[i], along[i] = found, place / length[found]
    return chord, along


def _nearest(path: Path, motion: Ints, share: Floats, tip: Floats) -> Floats:
    """Shares (n,) of the points of the motions that are nearest to the tips, from those on the chords."""
    arc = np.flatnonzero(path.kind[motion] == ARC)
    length = np.maximum(path_geometry.lengths(path)[motion[arc]], 1e-12)
    out = share.copy()
    for _ in range(2):
        off = tip[arc] - path_geometry.points(path, motion[arc], out[arc])
        ahead = np.sum(off * path_geometry.tangents(path, motion[arc], out[arc]), axis=1)
        out[arc] = np.clip(out[arc] + ahead / length, 0.0, 1.0)
    return out


def _lag(geometric: Ints, hint: Ints) -> int:
    """Rows by which the line numbers are late, from what the place of the tip says; 0 where that is not plain to see.

    Standing at the end of a line either number may be shown, so only agreement counts that a shift gains.
    """
    known = hint >= 0
    change = np.flatnonzero(np.diff(geometric) != 0)
    if known.mean() < 0.5 or len(change) < 2:
        return 0
    n = len(hint)
    score = {}
    for lag in range(-_MOST_LAG, _MOST_LAG + 1):
        a, b = max(-lag, 0), n - max(lag, 0)
        if b - a < n // 2:
            continue
        both = known[a + lag : b + lag]
        score[lag] = float(np.mean((geometric[a:b] == hint[a + lag : b + lag])[both])) if both.any() else 0.0
    best = max(score, key=lambda lag: (score[lag], -abs(lag)))
    gained = (score[best] - score[0]) * n / len(change)  # rows per change of line
    return best if gained > _GAINED * abs(best) and abs(best) > 1 else 0


def _shifted(line: Floats, lag: int) -> Floats:
    """Line numbers (n,) moved to earlier rows by `lag`; the ends keep what they have."""
    index = np.clip(np.arange(len(line)) + lag, 0, len(line) - 1)
    return line[index]
