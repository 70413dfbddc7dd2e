"""Where along its program a machine was, row by row: geometry says it, line numbers settle what geometry leaves open.

Real controls blend corners, merge lines and report line numbers early or late. So rows are led along the path by the
place of the tip, all of them together, so that passes over the same place and beam breaks mislead nobody. The column `line`
counts as a hint; by how many rows it leads or lags is found from the rows at which it changes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import isotonic_regression

from camcomp.ground import path_geometry
from camcomp.ground.datatypes import ARC, Floats, Ints, Path
from camcomp.ground.machine_code import kept

_CHORD_RAD = 0.05  # of an arc
_LINE_MM2 = 0.01  # squared distance that a wrong line number weighs as much as, and by how many times it adds to it
_LINE_TIMES = 4.0
_SLACK_MM = 0.5  # by which a row may be further along than the way between two rows says
LOST_MM = 2.0  # from the path: a row that is further off says nothing about where the machine was
_JUMP_MM2 = 10.0  # what a place weighs that the row before does not lead to: rows are missing, or the log begins again
_BACK_MM2 = 10.0  # and every mm back along the path
_PLACES = 16  # that are followed at a time
_BOX = 32  # chords that are looked at together
_MOST_LAG = 250  # rows: a quarter of a second where a control logs every millisecond
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


def align(path: Path, tip: Floats, line: Floats, lost_mm: float = LOST_MM) -> Aligned:
    """Rows of tips (n, 3) mm, program frame, in the order of time; line (n,): as logged, NaN where it is not known.

    lost_mm: from the path, beyond which a row is a beam break; more where the tip bends by as much.
    """
    tip = np.ascontiguousarray(tip)  # one layout, compiled once
    motion, u0, u1 = _chords(path)
    begin, end = path_geometry.points(path, motion, u0), path_geometry.points(path, motion, u1)
    length = np.linalg.norm(end - begin, axis=1)
    at = np.concatenate([[0.0], np.cumsum(length)])
    hint = np.where(np.isfinite(line) & (line > 0), line, -1.0).astype(np.int64)
    hint[~np.isin(hint, path.line)] = -1  # comments, dwells, the end of the program
    way = _onward(_follow(begin, end - begin, length, at, path.line[motion], *_boxes(begin, end), tip, hint, lost_mm))
    chord = np.clip(np.searchsorted(at, way, side="right") - 1, 0, len(motion) - 1)
    share = u0[chord] + (way - at[chord]) / length[chord] * (u1[chord] - u0[chord])
    found = motion[chord]
    share = _nearest(path, found, np.clip(share, 0.0, 1.0), tip)
    distance = np.linalg.norm(path_geometry.points(path, found, share) - tip, axis=1)
    lag = _lag(path.line[found], hint)
    corrected = line if lag == 0 else _shifted(line, lag)
    return Aligned(found, share, distance, lag, corrected)


def _onward(way: Floats) -> Floats:
    """The way along the path (n,) mm without going back, the nearest such one by squares: noise moves nobody backward.

    Where it goes back by more than _SLACK_MM the log begins again. Source: pool adjacent violators (Barlow et al. 1972).
    """
    parts = np.split(way, np.flatnonzero(np.diff(way) < -_SLACK_MM) + 1)
    return np.concatenate([isotonic_regression(each).x for each in parts])


def _boxes(begin: Floats, end: Floats) -> tuple[Floats, Floats]:
    """Lowest and highest corners (b, 3) of the chords, _BOX of them at a time."""
    first = np.arange(0, len(begin), _BOX)
    low = np.minimum.reduceat(np.minimum(begin, end), first)
    return low, np.maximum.reduceat(np.maximum(begin, end), first)


def _chords(path: Path) -> tuple[Ints, Floats, Floats]:
    """Every motion with a length as straight chords: motion (k,), begin and end (k,) as shares of it."""
    moves = np.flatnonzero(path_geometry.lengths(path) > 0.0)
    angle = np.where(path.kind[moves] == ARC, np.abs(np.nan_to_num(path.angle[moves])), 0.0)
    count = np.maximum(np.ceil(angle / _CHORD_RAD), 1.0).astype(np.int64)
    motion = np.repeat(moves, count)
    within = np.arange(len(motion)) - np.repeat(np.cumsum(count) - count, count)
    of = np.repeat(count, count)
    return motion, within / of, (within + 1) / of


@kept
def _put(place, weight, found, at, weighs):  # type: ignore[no-untyped-def]  # pragma: no cover
    """One more place, in the stead of the worst one when there are too many; their number."""
    k = found
    if found == _PLACES:
        k = int(np.argmax(weight))
        if weight[k] <= weighs:
            return found
    place[k], weight[k] = at, weighs
    return min(found + 1, _PLACES)


@kept
def _places(begin, way, length, at, line, low, high, tip, hint, lost):  # type: ignore[no-untyped-def]  # pragma: no cover
    """Where along the path it comes nearest to a tip (3,) and leaves again, mm, and what these places weigh."""
    place, weight = np.empty(_PLACES), np.empty(_PLACES)
    found, previous = 0, -2
    ended = False  # the nearest place on the chord before is its end: the way goes on to fall, or it is the nearest one
    last_at, last_weight = 0.0, 0.0
    for box in range(low.shape[0]):
        gap = 0.0
        for j in range(3):
            gap += max(low[box, j] - tip[j], tip[j] - high[box, j], 0.0) ** 2
        if gap > lost**2:
            continue
        for c in range(box * _BOX, min(box * _BOX + _BOX, len(length))):
            x = 0.0
            for j in range(3):
                x += (tip[j] - begin[c, j]) * way[c, j]
            x = min(max(x / length[c], 0.0), length[c])
            gap = 0.0
            for j in range(3):
                gap += (begin[c, j] + x / length[c] * way[c, j] - tip[j]) ** 2
            if gap > lost**2:
                continue
            # the line that is said to be executed has a nearest place of its own
            on = c == previous + 1 and (hint < 0 or (line[c] == hint) == (line[previous] == hint))
            if ended and (not on or x == 0.0):
                found = _put(place, weight, found, last_at, last_weight)
            ended, previous, last_at = x == length[c], c, at[c] + x
            last_weight = gap if hint < 0 or line[c] == hint else _LINE_TIMES * gap + _LINE_MM2
            if 0.0 < x < length[c] or (x == 0.0 and not on):
                found = _put(place, weight, found, last_at, last_weight)
    if ended:
        found = _put(place, weight, found, last_at, last_weight)
    return place[:found], weight[:found]


@kept
def _follow(begin, way, length, at, line, low, high, tip, hint, lost):  # type: ignore[no-untyped-def]  # pragma: no cover
    """Way along the path (n,) mm: of all sequences of places near the rows the one that fits best and leads from row to row.

    Dynamic programming over the nearest places of every row, at most _PLACES of them, each with the row it was last seen at:
    a row may be no place at all (a beam break), for which it counts as `lost` mm off.
    """
    n = tip.shape[0]
    where, cost = np.zeros((n, _PLACES)), np.full((n, _PLACES), np.inf)
    before, seen = np.full((n, _PLACES), -1), np.full((n, _PLACES), -1)
    held = 0  # places of the row before
    for i in range(n):
        near, off = _places(begin, way, length, at, line, low, high, tip[i], hint[i], lost)
        count = len(near) + held
        s, c = np.empty(count), np.empty(count)
        b, last = np.full(count, -1), np.full(count, i)
        for k in range(len(near)):
            s[k], c[k] = near[k], np.inf
            for j in range(held):
                step = 0.0
                for a in range(3):
                    step += (tip[i, a] - tip[seen[i - 1, j], a]) ** 2
                ahead = near[k] - where[i - 1, j]
                jump = 0.0
                if ahead < 0.0:
                    jump = min(-_BACK_MM2 * ahead, _JUMP_MM2)
                elif ahead > 2.0 * np.sqrt(step) + _SLACK_MM:
                    jump = _JUMP_MM2
                value = (
                    cost[i - 1, j] + jump + 1e-9 * max(ahead, 0.0)
                )  # of two that fit alike the nearer along the path
                if value < c[k]:
                    c[k], b[k] = value, j
            if held == 0:
                c[k] = 1e-9 * near[k]
            c[k] += off[k]
        for j in range(held):
            k = len(near) + j
            s[k], c[k], b[k], last[k] = where[i - 1, j], cost[i - 1, j] + lost**2, j, seen[i - 1, j]
        held = min(count, _PLACES)
        best = np.argsort(c, kind="mergesort")[:held]
        for j in range(held):
            k = best[j]
            where[i, j], cost[i, j], before[i, j], seen[i, j] = s[k], c[k], b[k], last[k]
    out = np.zeros(n)
    j = 0
    for i in range(n - 1, -1, -1):
        out[i] = where[i, j]
        if before[i, j] < 0:  # rows before the first place: they lie wherever that is
            out[:i] = out[i]
            break
        j = before[i, j]
    return out


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
    most = min(_MOST_LAG, n // 4)
    for lag in range(-most, most + 1):
        a, b = max(-lag, 0), n - max(lag, 0)
        if b - a < n // 2:
            continue
        both = known[a + lag : b + lag]
        score[lag] = float(np.mean((geometric[a:b] == hint[a + lag : b + lag])[both])) if both.any() else 0.0
    best = max(score, key=lambda lag: (score[lag], -abs(lag)))
    gained = (score[best] - score[0]) * n / len(change)  # rows per change of line
    return best if gained > _GAINED * abs(best) and abs(best) > 1 else 0


def way_from_lines(path: Path, aligned: Aligned) -> Floats:
    """Way along the path (n,) mm from where a row lies to the line that it names; NaN where it names none of the program."""
    length = path_geometry.lengths(path)
    at = np.concatenate([[0.0], np.cumsum(length)])
    own = at[aligned.motion] + aligned.share * length[aligned.motion]
    out = np.full(len(own), np.nan)
    for line in np.unique(aligned.line[np.isfinite(aligned.line)]):
        rows, motions = np.flatnonzero(aligned.line == line), np.flatnonzero((path.line == line) & (length > 0.0))
        if len(motions):
            before = at[motions] - own[rows, None]
            out[rows] = np.maximum(np.maximum(before, -before - length[motions]), 0.0).min(axis=1)
    return out


def _shifted(line: Floats, lag: int) -> Floats:
    """Line numbers (n,) moved to earlier rows by `lag`; the ends keep what they have."""
    index = np.clip(np.arange(len(line)) + lag, 0, len(line) - 1)
    return line[index]
