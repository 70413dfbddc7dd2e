"""Run path of a logged run: motion from the log, cutting force from the program.

The set-points (or encoders) of a log define the motion, interpolated smoothly between rows. The cutting force acts along
the path of the tip while the executed line cuts. Rows with an uncertain force (the side of a corner, the instant at which
a cut begins) carry a bound of its error.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from scipy.interpolate import Akima1DInterpolator, PchipInterpolator
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from camcomp.ground import path_geometry
from camcomp.ground.datatypes import Bools, Floats, Ints
from camcomp.ground.orientation import rotation_vectors, rotations_about
from camcomp.ground.records import dataclass
from camcomp.model.cutting.track import Track
from camcomp.model.motion.alignment import Aligned
from camcomp.model.motion.driven_pieces import DrivenPieces, near_largest_change, node_loads
from camcomp.model.motion.run_path import MOST_STEPS, STEP_S, Driven, RunPath, moving
from camcomp.model.seams import Seams, missing_rows

if TYPE_CHECKING:
    from camcomp.model.motion.control_kinematics import ControlKinematics

CLOCK_S = 0.010  # largest offset between the clocks of tip measurement and controller
_JUMP_SHARE = 0.1  # of the largest force: a change from row to row above it is a jump, not the turn of an arc
_USUAL = 4.0  # times the median change from row to row
_AGREE = np.cos(np.radians(2.0))  # cosine of the angle by which digits of set-points turn the driven direction
_STILL_MM_PER_S = 0.05
MAX_CUT_DISTANCE_MM = 0.6  # distance from the path beyond which a row does not cut: blended corners deviate less
_SURE_N = 20.0  # largest error of a force that determines the nodes between rows
_REST_S = 0.1  # time in which a tip at standstill moves by less than _CHORD_MM
_CREEPS = 0.05  # of the cutting speed: a slower mean speed over missing rows means a standstill
_SAME_FEED = 0.03  # relative tolerance of driven against programmed feed
LEAST_FEED = 1e-3  # mm/min, in place of zero
_RESTS = 1e-3  # of the longest step between two rows: two shorter steps in succession are a standstill
_CHORD_MM = 0.02  # length over which a direction is taken: large against digits and noise of set-points


@dataclass(frozen=True, eq=False)
class Forces:
    """Cutting force (n, 3) N at n rows, program frame, with half the width of its error interval (`doubt`).

    apart (n - 1,): between a row and the next the machine moved without cutting, or waited, and no row was logged.
    """

    force: Floats
    doubt: Floats
    cutting: Bools
    apart: Bools

    @classmethod
    def none(cls, n: int) -> Forces:
        """Zero forces of a run without a known cut."""
        return cls(np.zeros((n, 3)), np.zeros((n, 3)), np.zeros(n, bool), np.zeros(max(n - 1, 0), bool))

    def cut_at(self, time: Floats, at: Floats) -> Floats:
        """1 where the tool cuts at times (k,) s, rows at times (n,), else 0."""
        if len(time) < 2:
            return np.full(len(at), float(self.cutting.any()))
        right = np.clip(np.searchsorted(time, at), 1, len(time) - 1)
        late = at - time[right - 1] > time[right] - at
        within = (at > time[right - 1]) & (at < time[right])
        return np.asarray(self.cutting[right - ~late] & ~(self.apart[right - 1] & within), float)


def driven_path(
    machine: ControlKinematics,
    name: str,
    *,
    time: Floats,
    rho: Floats,
    tip: Floats,
    forces: Forces,
    started: float,
    temperature: Floats | None = None,
    rotation: Floats | None = None,
) -> RunPath:
    """Run path of logged actuators rho (n, m) at times (n,) s with their nominal tips (n, 3) mm, program frame.

    rotation (n, 3, 3): of the platform at the rows, machine frame; None: the one that the machine holds.
    """
    row_tip, row_force = machine.to_machine(tip), machine.vectors(forces.force)
    span = float(time[-1] - time[0])
    grid = np.linspace(time[0], time[-1], max(int(min(np.ceil(span / STEP_S) + 1, MOST_STEPS)), 2))
    lead, lead_tip = _smooth(time, rho), _smooth(time, row_tip)
    grid_rho, grid_tip = lead(grid), lead_tip(grid)
    jump = _jumps(row_force, forces.cutting)
    sure = np.linalg.norm(forces.doubt, axis=1) <= _SURE_N
    pieces = DrivenPieces.along(time, grid, grid_tip, jump)
    pieces = pieces.around(time, near_largest_change(time, row_force, sure, jump, pieces))
    node_time = pieces.node_times()
    # the tip is interpolated, and the drives follow from it: an arm keeps its tool upright between rows
    node_tip = lead_tip(node_time)
    turned = None if rotation is None else _turns(time, rotation, node_time)
    node_rho = machine.inverse(node_tip, turned)
    node_force = node_loads(time=time, force=row_force, sure=sure, jump=jump, at=node_time, pieces=pieces)
    return RunPath(
        name=name,
        time=time,
        started=started,
        ordered=True,
        node_tip=node_tip,
        node_force=node_force,
        node_rho=node_rho,
        node_time=node_time,
        grid=grid,
        grid_rho=grid_rho,
        grid_cut=forces.cut_at(time, grid) * moving(grid, grid_tip),
        grid_piece=pieces.of(grid),
        pieces=len(pieces.begin),
        place=pieces.at,
        row_rho=rho,
        temperature=temperature,
        node_rotation=turned,
        driven=Driven(row_tip, row_force, np.abs(machine.vectors(forces.doubt)), lead_tip, _seams(time, grid, lead)),
    )


def _turns(time: Floats, rotation: Floats, at: Floats) -> Floats:
    """Rotations (k, 3, 3) at times (k,) between those of rows (n, 3, 3): smooth vectors of the turn from the first row."""
    vectors = rotation_vectors(rotation @ rotation[0].T)
    return np.asarray(rotations_about(_smooth(time, vectors)(at)) @ rotation[0])


def _seams(time: Floats, grid: Floats, lead: Callable[[Floats], Floats]) -> Seams:
    """Seams of rows at times (n,) s: their start, and the instants on either side of missing rows."""
    rows = np.repeat(np.flatnonzero(np.append(True, missing_rows(time))), 2)
    before = np.searchsorted(grid, time[rows], side="right") - 1
    instants = np.minimum(before + np.arange(len(rows)) % 2, len(grid) - 1)
    at, last = np.unique(instants[::-1], return_index=True)  # the last one in each step of the grid
    rows = rows[::-1][last]
    unseen = np.where(rows > 0, time[rows] - time[rows - 1], np.inf)
    speed = (lead(time[rows] + STEP_S) - lead(time[rows])) / STEP_S
    return Seams(at, unseen, speed)


def cutting_forces(
    track: Track,
    aligned: Aligned,
    tip: Floats,
    time: Floats,
    rests: Bools,
    *,
    logged_line: bool,
    max_distance_mm: float = MAX_CUT_DISTANCE_MM,
) -> Forces:
    """Modelled cutting force along the driven path of the tip (n, 3) mm, program frame, at times (n,) s.

    rests (m,): motions of the path with a stop at their end. max_distance_mm: distance from the path beyond which rows without line
    numbers do not cut.
    """
    motion, share, on = _executed(track, aligned, tip, time, logged_line)
    piece = _piece_of(track, motion, share)
    w = np.clip((share - track.u0[piece]) / np.maximum(track.u1[piece] - track.u0[piece], 1e-12), 0.0, 1.0)
    on &= track.cutting[piece]
    if not logged_line:
        on &= aligned.distance < max_distance_mm
    if not on.any() or track.conditions.model is None:
        return Forces.none(len(tip))
    tip = _held_at_rest(tip, time)
    before, after = driven_directions(tip, time)
    programmed = path_tangents(track, piece, w)
    middle = before + after
    size = np.linalg.norm(middle, axis=1, keepdims=True)
    middle = np.where(size > 0.2, middle / np.maximum(size, 1e-12), after)
    as_told = (np.sum(middle * programmed, axis=1) > _AGREE) | (np.linalg.norm(middle, axis=1) == 0.0)
    still = np.full(len(tip), LEAST_FEED)
    feed, behind, ahead = driven_feeds(tip, time, track.conditions.feeds(track.path.feed[motion]))
    told, chord = track.force(piece, w, feed), track.force_along(piece, w, programmed, feed)
    force = np.where(as_told[:, None], told, track.force_along(piece, w, middle, feed))
    force[~on] = 0.0
    # on fine polygons the turn of the controller is somewhere between the corner alone and the whole of its lines
    turning = np.where((as_told & on)[:, None], np.abs(told - chord), 0.0)
    thicker = np.abs(track.force_along(piece, w, programmed, ahead) - track.force_along(piece, w, programmed, behind))
    turning = np.maximum(turning, np.where(on[:, None], thicker, 0.0))
    # the speed around a stop between rows is unknown
    most, least = (
        track.force_along(piece, w, programmed, each)
        for each in (track.conditions.feeds(track.path.feed[motion]), still)
    )
    stopped = (on & _beside_stops(motion, rests))[:, None]
    turning = np.maximum(turning, np.where(stopped, 0.5 * np.abs(most - least), 0.0))
    unsteady = _unsteady(before, after, as_told)[:, None] * np.linalg.norm(force, axis=1, keepdims=True) / np.sqrt(3.0)
    turning = np.maximum(turning, unsteady)
    # at standstill only the edge force remains, against the last direction of motion
    standing = (on & _standing(tip, time))[:, None] * np.linalg.norm(force, axis=1, keepdims=True)
    turning = np.maximum(turning, standing)
    # line numbers corrected for their lag are exact to one row
    slack = CLOCK_S + (float(np.median(np.diff(time))) if aligned.lag else 0.0)
    return Forces(
        force,
        np.maximum(_doubt(force, middle, time, on, slack), turning),
        on,
        _apart(track, motion) | _waited(tip, time, on),
    )


def _beside_stops(motion: Ints, rests: Bools) -> Bools:
    """Mask (n,) of rows on motions (n,) with a stop of the controller between them and a neighbour."""
    between = np.diff(np.concatenate([[0], np.cumsum(rests)])[motion]) > 0
    return np.asarray(np.append(between, False) | np.append(False, between))


def _unsteady(before: Floats, after: Floats, as_told: Bools) -> Floats:
    """Error bound (n,) rad of a direction between rows where the driven path deviates from the program.

    before, after (n, 3): directions before and after a row. A constant rate of turning is known exactly; where it changes,
    the bound is half of the change, because the side of the row is unknown.
    """
    change = np.linalg.norm(np.diff(after - before, axis=0), axis=1)
    most = 0.5 * np.maximum(np.append(change, 0.0), np.concatenate([[0.0], change]))
    near = ~as_told
    near[1:] |= ~as_told[:-1]
    near[:-1] |= ~as_told[1:]
    return np.where(near, most, 0.0)


def _apart(track: Track, motion: Ints) -> Bools:
    """Mask (n - 1,) of neighbouring rows on motions (n,) with a motion that does not cut between them."""
    cuts = np.zeros(len(track.path), bool)
    cuts[track.motion[track.cutting]] = True
    idle = np.concatenate([[0], np.cumsum(~cuts & (path_geometry.lengths(track.path) > 0.0))])
    return np.asarray(idle[motion[1:]] > idle[np.minimum(motion[:-1] + 1, len(idle) - 1)], bool)


def _waited(tip: Floats, time: Floats, on: Bools) -> Bools:
    """Mask (n - 1,) of gaps between cutting rows (n,) `on` in which the tool stood still for most of the time."""
    speed = np.linalg.norm(np.diff(tip, axis=0), axis=1) / np.maximum(np.diff(time), 1e-9)
    cutting = speed[on[1:] & on[:-1]]
    return np.asarray(missing_rows(time) & (speed < _CREEPS * float(np.median(cutting) if len(cutting) else 0.0)))


def path_tangents(track: Track, piece: Ints, w: Floats) -> Floats:
    """Programmed direction (n, 3) at fraction w (n,) of pieces (n,)."""
    return path_geometry.tangents(track.path, track.motion[piece], track.u(piece, w))


def driven_feeds(tip: Floats, time: Floats, programmed: Floats) -> tuple[Floats, Floats, Floats]:
    """Driven feeds (n,) mm/min of tips (n, 3) at times (n,) s: at the rows, before them, and after them.

    They determine the chip thickness. A feed that equals the programmed one (n,) on one side of a row is taken as
    programmed, because a corner or a rapid falsifies the other side. At standstill it is LEAST_FEED.
    """
    at = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(tip, axis=0), axis=1))])
    left, right = _beside(at)
    left, here, right = np.maximum(left, 0), np.arange(len(time)), np.minimum(right, len(time) - 1)

    def speed(a: Ints, b: Ints) -> Floats:
        found: Floats = np.maximum(60.0 * (at[b] - at[a]) / np.maximum(time[b] - time[a], 1e-9), LEAST_FEED)
        return np.where(np.abs(found - programmed) < _SAME_FEED * programmed, programmed, found)

    behind, ahead = speed(left, here), speed(here, right)
    told = (behind == programmed) | (ahead == programmed)
    return np.where(told, programmed, speed(left, right)), behind, ahead


def _beside(at: Floats) -> tuple[Ints, Ints]:
    """Rows at least _CHORD_MM of path length `at` (n,) before and after each row; neighbours if these are farther."""
    rows = np.arange(len(at))
    left = np.minimum(np.searchsorted(at, at - _CHORD_MM, side="right") - 1, rows - 1)
    right = np.maximum(np.searchsorted(at, at + _CHORD_MM, side="left"), rows + 1)
    return left, right


def driven_directions(tip: Floats, time: Floats) -> tuple[Floats, Floats]:
    """Unit directions (n, 3) before and after every row; at standstill those of the last movement, zero before the first."""
    step = np.diff(tip, axis=0)
    length = np.linalg.norm(step, axis=1)
    at = np.concatenate([[0.0], np.cumsum(length)])
    n = len(tip)
    left, right = _beside(at)
    before = _unit(tip - tip[np.clip(left, 0, n - 1)])
    after = _unit(tip[np.clip(right, 0, n - 1)] - tip)
    moving = ~_standing(tip, time)
    last = np.maximum.accumulate(np.where(moving, np.arange(n), -1))
    held = np.where(last[:, None] >= 0, after[np.maximum(last, 0)], 0.0)
    still = ~moving
    before[still], after[still] = held[still], held[still]
    first = moving & (np.linalg.norm(before, axis=1) == 0.0)
    before[first] = after[first]
    end = moving & (np.linalg.norm(after, axis=1) == 0.0)
    after[end] = before[end]
    return before, after


def _held_at_rest(tip: Floats, time: Floats) -> Floats:
    """Tips (n, 3) with the mean position in every standstill, so that noise and digits there have no direction."""
    rows = 2 * max(round(0.5 * _REST_S / max(float(np.median(np.diff(time))), 1e-9)), 2) + 1 if len(time) > 1 else 1
    if len(time) < rows:
        return tip
    spread = (maximum_filter1d(tip, rows, axis=0) - minimum_filter1d(tip, rows, axis=0)).max(axis=1)
    near = maximum_filter1d((spread < _CHORD_MM).astype(int), rows)
    edge = np.flatnonzero(np.diff(near, prepend=0, append=0))
    out = tip.copy()
    for a, b in zip(edge[::2], edge[1::2], strict=True):
        if (
            b - a >= rows
            and np.linalg.norm(tip[b - rows : b].mean(axis=0) - tip[a : a + rows].mean(axis=0)) < _CHORD_MM
        ):
            out[a:b] = np.median(tip[a:b], axis=0)
    return out


def _standing(tip: Floats, time: Floats) -> Bools:
    """Mask (n,) of rows without a movement before and after them."""
    speed = np.linalg.norm(np.diff(tip, axis=0), axis=1) / np.maximum(np.diff(time), 1e-9)
    slow = speed < _STILL_MM_PER_S
    return np.asarray(np.append(slow, True) & np.append(True, slow), bool)


def _unit(vectors: Floats) -> Floats:
    size = np.linalg.norm(vectors, axis=1, keepdims=True)
    out: Floats = np.divide(vectors, size, out=np.zeros_like(vectors), where=size > 1e-9)
    return out


def _executed(track: Track, aligned: Aligned, tip: Floats, time: Floats, logged: bool) -> tuple[Ints, Floats, Bools]:
    """Executed motion and share of it (n,) by the controller's line numbers, and mask (n,) of rows with one."""
    path = track.path
    motion, share = aligned.motion.copy(), aligned.share.copy()
    on = np.ones(len(motion), bool)
    if not logged:
        return motion, share, on
    line = aligned.line
    idle = np.isfinite(line) & ((line <= 0) | ~np.isin(np.where(np.isfinite(line), line, 0), path.line))
    on[idle] = False
    other = np.isfinite(line) & ~idle & (path.line[motion] != line)
    for i in np.flatnonzero(other):
        mine = np.flatnonzero(path.line == line[i])
        k = mine[np.argmin(np.abs(mine - motion[i]))]
        share[i], motion[i] = (0.0 if k > motion[i] else 1.0), k
    return motion, share, on


def _piece_of(track: Track, motion: Ints, share: Floats) -> Ints:
    key = motion + np.minimum(share, 1.0 - 1e-12)
    return np.clip(np.searchsorted(track.motion + track.u0, key, side="right") - 1, 0, len(track.motion) - 1)


def _doubt(force: Floats, direction: Floats, time: Floats, cutting: Bools, slack: float) -> Floats:
    """Error bound (n, 3) of the force at jumps between rows: half the jump, for rows within the clock offset.

    A force that reverses on a motion in one direction (n, 3) is that of a motion along the tool axis: the direction across it
    stays unknown for as long as the motion goes farther along that direction than across it.
    """
    change = np.diff(force, axis=0)
    size = np.linalg.norm(change, axis=1)
    out = np.zeros_like(force)
    for k in np.flatnonzero(_abrupt(size, force) | np.diff(cutting)):
        near = (time >= time[k] - slack) & (time <= time[k + 1] + slack)
        near[k : k + 2] = True
        if force[k] @ force[k + 1] < 0.0:
            near |= _stretch(direction @ direction[k] > np.sqrt(0.5), int(k))
        out[near] = np.maximum(out[near], np.abs(change[k]))
    return out


def _stretch(mask: Bools, k: int) -> Bools:
    """The rows (n,) of a mask that are next to each other and to row k."""
    part = np.cumsum(np.diff(mask, prepend=False))
    return np.asarray(mask & (part == part[k]))


def _abrupt(size: Floats, force: Floats) -> Bools:
    largest = float(np.linalg.norm(force, axis=1).max(initial=0.0))
    moving = size[size > 0.0]
    usual = float(np.median(moving)) if len(moving) else 0.0
    return size > max(_JUMP_SHARE * largest, min(_USUAL * usual, 0.5 * largest), 1e-9)


def _jumps(force: Floats, cutting: Bools) -> Ints:
    """Rows after which the force jumps."""
    size = np.linalg.norm(np.diff(force, axis=0), axis=1)
    return np.flatnonzero(_abrupt(size, force) | np.diff(cutting)) if len(force) > 1 else np.zeros(0, np.int64)


def _smooth(time: Floats, values: Floats) -> Callable[[Floats], Floats]:
    """Interpolant of values (n, c) between rows, smooth and without overshoot at ends of lines (Akima 1970).

    Across missing rows and at standstills it is monotone (Fritsch, Carlson 1980): a spurious reversal would put play and
    friction on the wrong side.
    """
    if len(time) < 3:
        return lambda at: np.column_stack([np.interp(at, time, v) for v in values.T])
    step, way = np.diff(time), np.abs(np.diff(values, axis=0))
    rest = np.pad(way <= _RESTS * way.max(axis=0), ((2, 2), (0, 0)))
    held = missing_rows(time)[:, None] | (rest[3:-1] & rest[4:]) | (rest[1:-3] & rest[:-4])
    lead = Akima1DInterpolator(time, values, axis=0)
    with np.errstate(over="ignore"):  # slopes of round-off size, whose harmonic mean is negligible
        over = PchipInterpolator(time, values, axis=0)

    def between(at: Floats) -> Floats:
        t = np.clip(at, time[0], time[-1])
        piece = np.clip(np.searchsorted(time, t, side="right") - 1, 0, len(step) - 1)
        return np.asarray(np.where(held[piece], over(t), lead(t)), float)

    return between
