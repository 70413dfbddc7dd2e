"""Alignment of log rows with the program: position on the path of every row, from the tip and the line numbers.

Controllers blend corners, merge lines and report line numbers early or late. The alignment therefore follows the tip
along the path for all rows jointly, by dynamic programming, which copes with repeated passes and beam breaks. The column
`line` is a weak prior; its lead or lag in rows is estimated from the rows at which it changes.
"""

from __future__ import annotations

from functools import partial

import numpy as np
from scipy.optimize import isotonic_regression

from camcomp.ground import path_geometry
from camcomp.ground.compiled import inner, kept
from camcomp.ground.datatypes import ARC, Floats, Ints, Path
from camcomp.ground.records import dataclass

_CHORD_RAD = 0.05  # chord of an arc
_LINE_MM2 = 0.01  # mm²: cost of a wrong line number, plus _LINE_TIMES times the squared distance
_LINE_TIMES = 4.0
_SLACK_MM = 0.5  # tolerance of the path length between two rows
LOST_MM = 2.0  # distance from the path beyond which a row has no position on it
_JUMP_MM2 = 10.0  # mm²: cost of a position that the row before does not lead to (missing rows, or a restarted log)
_BACK_MM2 = 10.0  # mm² per mm of motion back along the path
_PLACES = 16  # most candidate positions per row
_BOX = 32  # chords per bounding box
_MOST_LAG = 250  # rows: a quarter of a second for a log at 1 kHz
_GAINED = 0.35  # of the shift, in rows per change of line: least gain in agreement, which short lines reduce


@dataclass(frozen=True, eq=False)
class Aligned:
    """Positions of n rows on a path.

    motion (n,): index into the path; share (n,) of its length; distance (n,) mm from it; lag: delay of the column `line` in
    rows (negative: early); line (n,): executed source line, corrected by it.
    """

    motion: Ints
    share: Floats
    distance: Floats
    lag: int
    line: Floats


def align(path: Path, tip: Floats, line: Floats, lost_mm: float = LOST_MM) -> Aligned:
    """Align rows of tips (n, 3) mm, program frame, in the order of time; line (n,): as logged, NaN where unknown.

    lost_mm: distance from the path beyond which a row is a beam break; larger for machines with large deflections.
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
    """Monotone path length (n,) mm nearest to `way` by least squares, which removes backward steps of noise.

    A step back by more than _SLACK_MM restarts it. Source: pool adjacent violators (Barlow et al. 1972).
    """
    parts = np.split(way, np.flatnonzero(np.diff(way) < -_SLACK_MM) + 1)
    return np.concatenate([isotonic_regression(each).x for each in parts])


def _boxes(begin: Floats, end: Floats) -> tuple[Floats, Floats]:
    """Bounding boxes (lowest, highest corner (b, 3)) of _BOX chords each."""
    first = np.arange(0, len(begin), _BOX)
    low = np.minimum.reduceat(np.minimum(begin, end), first)
    return low, np.maximum.reduceat(np.maximum(begin, end), first)


def _chords(path: Path) -> tuple[Ints, Floats, Floats]:
    """Straight chords of every motion with a length: motion (k,), start and end (k,) as shares of it."""
    moves = np.flatnonzero(path_geometry.lengths(path) > 0.0)
    angle = np.where(path.kind[moves] == ARC, np.abs(np.nan_to_num(path.angle[moves])), 0.0)
    count = np.maximum(np.ceil(angle / _CHORD_RAD), 1.0).astype(np.int64)
    motion = np.repeat(moves, count)
    within = np.arange(len(motion)) - np.repeat(np.cumsum(count) - count, count)
    of = np.repeat(count, count)
    return motion, within / of, (within + 1) / of


allocating = partial(inner, allocates=True)


@inner
def _put(place, weight, found, at, weighs):  # type: ignore[no-untyped-def]  # pragma: no cover
    """Add a candidate, in place of the worst one if there are _PLACES, and return their number."""
    k = found
    if found == _PLACES:
        k = int(np.argmax(weight))
        if weight[k] <= weighs:
            return found
    place[k], weight[k] = at, weighs
    return min(found + 1, _PLACES)


@allocating
def _places(begin, way, length, at, line, low, high, tip, hint, lost):  # type: ignore[no-untyped-def]  # pragma: no cover
    """Candidates for a tip (3,): path lengths (mm) of local minima of the distance, and their costs (mm²)."""
    place, weight = np.empty(_PLACES), np.empty(_PLACES)
    found, previous = 0, -2
    ended = False  # the distance falls up to the end of the chord before
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
            # the logged line gets a candidate of its own
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
    """Path length (n,) mm of the cheapest consistent sequence of candidates.

    Dynamic programming over at most _PLACES candidates per row, each with its last row; a row without a position (a beam
    break) costs as much as `lost` mm of distance.
    """
    n = tip.shape[0]
    where, cost = np.zeros((n, _PLACES)), np.full((n, _PLACES), np.inf)
    before, seen = np.full((n, _PLACES), -1), np.full((n, _PLACES), -1)
    held = 0  # candidates of the row before
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
                value = cost[i - 1, j] + jump + 1e-9 * max(ahead, 0.0)  # of two equal costs the nearer along the path
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
        if before[i, j] < 0:  # rows before the first candidate take its position
            out[:i] = out[i]
            break
        j = before[i, j]
    return out


def _nearest(path: Path, motion: Ints, share: Floats, tip: Floats) -> Floats:
    """Shares (n,) of the nearest points on the motions, refined from those on the chords."""
    arc = np.flatnonzero(path.kind[motion] == ARC)
    length = np.maximum(path_geometry.lengths(path)[motion[arc]], 1e-12)
    out = share.copy()
    for _ in range(2):
        off = tip[arc] - path_geometry.points(path, motion[arc], out[arc])
        ahead = np.sum(off * path_geometry.tangents(path, motion[arc], out[arc]), axis=1)
        out[arc] = np.clip(out[arc] + ahead / length, 0.0, 1.0)
    return out


def _lag(geometric: Ints, hint: Ints) -> int:
    """Lag of the line numbers in rows against the lines at the tip's positions; 0 without clear evidence.

    At standstill on the end of a line both numbers are possible, so that only the gain in agreement by a shift counts.
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
    """Path length (n,) mm from the position of a row to its logged line; NaN for numbers outside the program."""
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
    """Line numbers (n,) shifted to earlier rows by `lag`, constant at the ends."""
    index = np.clip(np.arange(len(line)) + lag, 0, len(line) - 1)
    return line[index]
